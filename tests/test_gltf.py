# SPDX-License-Identifier: GPL-3.0-or-later
"""glTF: our materials as Blender's exporter writes them."""

import json
import struct
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

import pytest

from true_diffuse.addon import glTF2ExportUserExtension, models
from true_diffuse.addon.blender import report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE

COLOR = (0.9, 0.5, 0.1, 1.0)


@pytest.fixture(autouse=True)
def hook() -> Iterator[None]:
    """A file with nothing in it, and the extension among the add-ons that the exporter asks."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon = bpy.context.preferences.addons.new()
    addon.module = "true_diffuse"
    assert sys.modules["true_diffuse"].glTF2ExportUserExtension is glTF2ExportUserExtension
    report.take()
    yield
    bpy.context.preferences.addons.remove(addon)


def show(*shown: bpy.types.Material) -> bpy.types.Object:
    """Return a new plane with one face for each of the materials."""
    mesh = bpy.data.meshes.new("Plane")
    corners = [(x, y, 0.0) for x in range(len(shown) + 1) for y in (0.0, 1.0)]
    mesh.from_pydata(corners, [], [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(shown))])
    mesh.uv_layers.new(name="UVMap")
    for material in shown:
        mesh.materials.append(material)
    for index, face in enumerate(mesh.polygons):
        face.material_index = index
    item = bpy.data.objects.new("Plane", mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def rough(model: str, **inputs: object) -> bpy.types.Material:
    return materials.create(model, ROUGH_DIFFUSE, **{"Model": model, "Roughness": 0.4, "Color": COLOR} | inputs)


def image_node(material: bpy.types.Material, name: str, color: tuple[float, ...] = (0.5, 0.5, 0.5, 1.0)) -> bpy.types.Node:
    """Return a new node in `material` with a new packed image of that name and color."""
    image = bpy.data.images.new(name, 4, 4)
    image.pixels.foreach_set(color * 16)
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def link_image(material: bpy.types.Material, socket: str, name: str) -> bpy.types.Node:
    """Link a new image to `socket` of our group; returns the image node."""
    node = image_node(material, name)
    material.node_tree.links.new(node.outputs["Color"], group_node(material)[0].inputs[socket])
    return node


def link_occlusion(material: bpy.types.Material) -> None:
    """Add an occlusion map as Blender's glTF importer does: in a group of its own, linked to nothing."""
    from io_scene_gltf2.blender.com.material_helpers import create_settings_group, get_gltf_node_name

    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = bpy.data.node_groups.get(get_gltf_node_name()) or create_settings_group(get_gltf_node_name())
    tree.links.new(image_node(material, "occlusion").outputs["Color"], node.inputs["Occlusion"])


def export(path: Path, **options: object) -> dict:
    """Return the JSON of a binary glTF file."""
    assert bpy.ops.export_scene.gltf(filepath=str(path), **options) == {"FINISHED"}
    data = path.read_bytes()
    return json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])


@pytest.mark.parametrize("has_occlusion", [False, True])
@pytest.mark.parametrize("unused", [False, True])
@pytest.mark.parametrize("quality", ["Balanced", "Precise"])
def test_what_is_inside_our_groups_is_no_emission(has_occlusion: bool, unused: bool, quality: str, tmp_path: Path) -> None:
    material = rough("EON", Quality=quality)
    link_image(material, "Color", "base")
    if has_occlusion:
        link_occlusion(material)
    show(material)
    written = export(tmp_path / "one.glb", export_unused_textures=unused)["materials"][0]
    assert "emissiveFactor" not in written and "emissiveTexture" not in written
    assert "KHR_materials_emissive_strength" not in written["extensions"]
    assert "baseColorTexture" in written["pbrMetallicRoughness"]
    assert ("occlusionTexture" in written) == has_occlusion


def test_reports_unsupported_links(tmp_path: Path) -> None:
    material = rough("EON")
    materials.paint(material, group_node(material)[0].inputs["Color"], "my color", 0.7)
    link_image(material, "Roughness", "sigma")
    show(material)
    export(tmp_path / "one.glb")
    assert sorted(report.take()) == [
        "True Diffuse: EON: Color: the color attribute my_color is not supported, the socket's own value is written",
        "True Diffuse: EON: Roughness: the image sigma is not supported, the socket's own value is written",
    ]


def test_has_color_and_roughness(tmp_path: Path) -> None:
    show(rough("Oren-Nayar"))
    show(materials.create("Coated", SUBSURFACE, Color=COLOR))
    show(materials.create("Shiny", SPECULAR_GROUP, Color=COLOR))
    painted = rough("EON")
    link_image(painted, "Color", "base")
    show(painted)
    bpy.data.materials.new("Other")
    document = export(tmp_path / "all.glb")
    seen = {material["name"]: material for material in document["materials"]}
    base = seen["Oren-Nayar"]["pbrMetallicRoughness"]
    expected = [models.average_albedo(models.OrenNayar(0.4), rho, order=16) for rho in COLOR[:3]]
    assert base["baseColorFactor"] == pytest.approx([*expected, 1.0], rel=1e-4)
    assert (base["metallicFactor"], base["roughnessFactor"]) == (0, 1)
    assert seen["Oren-Nayar"]["extensions"]["KHR_materials_specular"] == {"specularFactor": 0}
    assert seen["Coated"]["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(COLOR)
    assert seen["Coated"]["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.4)
    assert seen["Coated"]["extensions"]["KHR_materials_ior"]["ior"] == pytest.approx(1.4)
    assert seen["Shiny"]["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.5)
    assert "baseColorTexture" in seen["EON"]["pbrMetallicRoughness"] and len(document["images"]) == 1
