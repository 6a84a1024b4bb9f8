# SPDX-License-Identifier: GPL-3.0-or-later
"""What comes from other files uses the groups and the chosen lights that the file already has."""

from pathlib import Path

import bpy

import pytest

from support import specialize
from true_diffuse.addon.blender.id_properties import GROUP_ID
from true_diffuse.addon.material import materials
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE, chosen_lights

pytestmark = pytest.mark.usefixtures("registered")


def new_light(name: str) -> bpy.types.Object:
    """Return a new sun in the scene, the file's chosen light."""
    light = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
    bpy.context.scene.collection.objects.link(light)
    chosen_lights.choose([light])
    return light


def saved(folder: Path, name: str) -> Path:
    """Save a file that has chosen a light, and empty it again.

    It has two whole materials, one that an earlier version optimized, and a collection with all.
    """
    light = new_light(f"Light of {name}")
    made = [
        materials.create(f"Rough {name}", ROUGH_DIFFUSE, Quality="Exact for Chosen Lights"),
        materials.create(f"Skin {name}", SUBSURFACE),
        materials.create(f"Smooth {name}", ROUGH_DIFFUSE, Roughness=0.0),
    ]
    mesh = bpy.data.meshes.new(f"Mesh {name}")
    for material in made:
        mesh.materials.append(material)
    collection = bpy.data.collections.new(f"All {name}")
    bpy.context.scene.collection.children.link(collection)
    for item in (bpy.data.objects.new(f"Object {name}", mesh), light):
        collection.objects.link(item)
    specialize(made[2].node_tree.nodes[ROUGH_DIFFUSE.name])
    path = folder / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.data.batch_remove([*bpy.data.objects, *bpy.data.collections, *bpy.data.materials, *bpy.data.node_groups])
    return path


def append(path: Path, kind: str, name: str) -> None:
    assert bpy.ops.wm.append(directory=str(path / kind), filename=name) == {"FINISHED"}


def groups() -> list[str]:
    return sorted(tree[GROUP_ID] for tree in bpy.data.node_groups if "true_diffuse_least_for" not in tree)


def test_materials_of_three_files_share_the_file_s_groups_and_lights(tmp_path: Path) -> None:
    files = [saved(tmp_path, name) for name in "ABC"]
    own = new_light("Own")
    materials.create("Rough", ROUGH_DIFFUSE)
    materials.create("Skin", SUBSURFACE)
    before = groups()
    for path in files:
        for kind in ("Rough", "Skin", "Smooth"):
            append(path, "Material", f"{kind} {path.stem}")
        assert groups() == before
    with bpy.data.libraries.load(str(files[0])) as (_, target):
        target.materials = ["Rough A"]
    assert groups() == before
    assert chosen_lights.chosen() == [own] and list(bpy.data.objects) == [own]
    optimized = {bpy.data.materials[f"Smooth {name}"].node_tree.nodes[ROUGH_DIFFUSE.name].node_tree for name in "ABC"}
    assert len(optimized) == 1


def test_material_does_not_bring_the_lights_of_its_file(tmp_path: Path) -> None:
    path = saved(tmp_path, "A")
    append(path, "Material", "Rough A")
    assert not bpy.data.objects and not chosen_lights.chosen()


def test_collection_brings_its_light_and_the_choice_of_it(tmp_path: Path) -> None:
    path = saved(tmp_path, "A")
    append(path, "Collection", "All A")
    assert [light.name for light in chosen_lights.chosen()] == ["Light of A"]
    assert bpy.data.objects["Light of A"].users_scene


def test_collection_leaves_the_file_s_own_choice(tmp_path: Path) -> None:
    path = saved(tmp_path, "A")
    own = new_light("Own")
    append(path, "Collection", "All A")
    assert chosen_lights.chosen() == [own] and bpy.data.objects["Light of A"].users_scene


def test_node_of_an_appended_group_gets_the_file_s_own(tmp_path: Path) -> None:
    path = saved(tmp_path, "A")
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(materials.create("Own", ROUGH_DIFFUSE))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Object", mesh))
    own, before = ROUGH_DIFFUSE.ensure(), groups()
    with bpy.data.libraries.load(str(path)) as (_, target):
        target.node_groups = [ROUGH_DIFFUSE.name]
    node = bpy.data.materials["Own"].node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = target.node_groups[0]
    assert node.node_tree != own
    bpy.context.view_layer.update()
    assert node.node_tree == own and groups() == before
