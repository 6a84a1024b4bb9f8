# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF: our materials as Blender's importer brings them back, and rough diffuse materials of other programs."""

import json
import struct
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import bpy

import pytest

from support import show
from true_diffuse.addon.blender import properties, report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.node_record import Record
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.material.restore import kept
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.addon.nodes.principled import DISTRIBUTIONS, METHODS
from true_diffuse.addon.nodes.rough_diffuse import QUALITIES


@pytest.fixture(autouse=True)
def hook() -> Iterator[None]:
    """A file with nothing in it, and the extension among the add-ons that exporter and importer ask."""
    empty()
    properties.register()
    report.take()
    yield
    properties.unregister()


def empty() -> None:
    """Start from a file with nothing in it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.addons.new().module = "true_diffuse"


def load(path: Path) -> dict[str, Record]:
    """Import a file into an empty one; returns what it has of each material."""
    empty()
    assert bpy.ops.import_scene.gltf(filepath=str(path)) == {"FINISHED"}
    return {material.name: kept(material) for material in bpy.data.materials}


def save(path: Path, **options: object) -> dict[str, Record]:
    """Export the file; returns what it has of each material."""
    assert bpy.ops.export_scene.gltf(filepath=str(path), **options) == {"FINISHED"}
    return {material.name: kept(material) for material in bpy.data.materials}


def document(path: Path) -> dict[str, Any]:
    """Return the JSON of a .glb or .gltf file."""
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]] if path.suffix == ".glb" else data)


def image(name: str, color: tuple[float, ...] = (0.2, 0.6, 0.4, 1.0)) -> bpy.types.Image:
    """Return a new packed image."""
    made = bpy.data.images.new(name, 16, 16)
    made.pixels.foreach_set(color * 256)
    made.pack()
    return made


def link(material: bpy.types.Material, source: bpy.types.NodeSocket, socket: str) -> None:
    material.node_tree.links.new(source, group_node(material)[0].inputs[socket])


def test_every_entry_of_every_menu_and_every_preset_comes_back_as_it_was(tmp_path: Path) -> None:
    made = [materials.create(preset.name, preset.group, **preset.inputs) for preset in PRESETS.values()]
    for model, quality in product(MODELS.values(), QUALITIES):
        made.append(materials.create(f"{model.label} {quality}", ROUGH_DIFFUSE, Model=model.label, Quality=quality))
    for model, (label, _) in product(MODELS.values(), METHODS.values()):
        made.append(materials.create(f"{model.label} {label}", SUBSURFACE, Model=model.label, Method=label, Roughness=0.3))
        options = {"Model": model.label, "Subsurface Method": label, "Diffuse Roughness": 0.7, "Metallic": 0.25}
        made.append(materials.create(f"Principled {model.label} {label}", PRINCIPLED, **options))
    for label, _ in DISTRIBUTIONS.values():
        made.append(materials.create(f"Principled {label}", PRINCIPLED, Distribution=label, IOR=1.7))
    made.append(materials.create("Standard Specular", SPECULAR_GROUP))
    made[0].use_backface_culling, made[1].surface_render_method = True, "BLENDED"
    assert {group_node(material)[1] for material in made} == set(GROUPS)
    show(*made)
    before = save(tmp_path / "all.glb")
    assert load(tmp_path / "all.glb") == before
    assert len(before) == len(made) and all(not material.keys() for material in bpy.data.materials)


@pytest.mark.parametrize(
    "options", [{}, {"export_format": "GLTF_SEPARATE", "export_extras": False}, {"export_image_format": "WEBP"}]
)
def test_textured_materials_come_back_with_the_imported_mesh_s_names(options: dict[str, Any], tmp_path: Path) -> None:
    first = materials.create("Mapped", ROUGH_DIFFUSE, Model="EON", Roughness=0.4)
    nodes, links = first.node_tree.nodes, first.node_tree.links
    uv, mapping, texture, ramp = (nodes.new(f"ShaderNode{kind}") for kind in ("UVMap", "Mapping", "TexImage", "ValToRGB"))
    uv.uv_map, texture.image, texture.extension = "Second", image("wood"), "MIRROR"
    texture.image.colorspace_settings.name = "Linear Rec.709"
    mapping.inputs["Scale"].default_value, mapping.inputs["Rotation"].default_value = (2.0, 3.0, 1.0), (0.0, 0.0, 0.3)
    ramp.color_ramp.elements.new(0.3).color = (0.1, 0.8, 0.3, 1.0)
    for source, target in ((uv, mapping), (mapping, texture), (texture, ramp)):
        links.new(source.outputs[0], target.inputs[0])
    link(first, ramp.outputs["Color"], "Color")
    link(first, texture.outputs["Color"], "Roughness")
    second = materials.create("Painted", PRINCIPLED, Model="Oren-Nayar")
    nodes = second.node_tree.nodes
    paint, rough = nodes.new("ShaderNodeVertexColor"), nodes.new("ShaderNodeTexImage")
    paint.layer_name, rough.image = "Paint", image("rough")
    rough.image.colorspace_settings.name = "Non-Color"
    link(second, paint.outputs["Color"], "Base Color")
    link(second, rough.outputs["Color"], "Diffuse Roughness")
    mesh = show(first, second).data
    mesh.uv_layers.new(name="Second")
    mesh.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    path = tmp_path / ("two.gltf" if "export_format" in options else "two.glb")
    before = save(path, **options)
    file = document(path)
    assert sorted(one["name"] for one in file["images"]) == ["rough", "wood"]
    after = load(path)
    assert len(bpy.data.images) == 2
    (mesh,) = bpy.data.meshes
    expected = json.dumps(before).replace('"Second"', f'"{mesh.uv_layers[1].name}"')
    assert after == json.loads(expected.replace('"Paint"', f'"{mesh.color_attributes[0].name}"'))
    for name in ("wood", "rough"):
        assert bpy.data.images[name].pixels[:3] == pytest.approx((0.2, 0.6, 0.4), abs=0.02 if "WEBP" in str(options) else 0.5 / 255)
