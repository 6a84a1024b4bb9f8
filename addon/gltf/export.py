# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills in our materials in Blender's own File > Export > glTF, which by itself writes nothing for a material made of a group.

glTF has Lambert and one GGX lobe, as UsdPreviewSurface does, so it gets the same: the model's average albedo as base color, and the
coat as the lobe. Without a coat KHR_materials_specular switches the lobe off.
"""

from typing import TYPE_CHECKING

import bpy

from ..blender import report
from ..material.read import Names, group_node, identifier, read
from ..material.surface import Image, texture_factor
from ..models.geometry import clamp
from ..usd import preview

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import Material

FAILURES = (RuntimeError, TypeError, ValueError, LookupError, AttributeError, ImportError, ArithmeticError, OSError)


def gather_material(gltf_material: "Material", material: bpy.types.Material, settings: dict) -> None:
    """Fill in the glTF material of one of our materials by the exporter's `settings`; reports a failure instead of raising."""
    try:
        _fill(gltf_material, material, settings)
    except FAILURES as error:
        report.add(material.name, f"is left as Blender has it: {error or type(error).__name__}")


def _fill(gltf_material: "Material", material: bpy.types.Material, settings: dict) -> None:
    found = group_node(material)
    if found is None:
        return
    from io_scene_gltf2.io.com.gltf2_io import MaterialPBRMetallicRoughness
    from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

    node = found[0]
    surface, unsupported = read(*found, Names(lambda image: image.name, identifier)).supported(("Color",), ())
    albedo, source = preview.albedo(surface), surface.linked.get("Color")
    texture = None
    red, green, blue = map(albedo, surface.rgb("Color"))
    if isinstance(source, Image):
        texture = _texture(material, node.inputs["Color"], settings)
        if texture:
            red = green = blue = clamp(source.factor * texture_factor(albedo), 0.0, 1.0)
        else:
            unsupported.append(f"Color: the image {source.file} has no file, the socket's own value is written")
    gloss = preview.gloss(surface)
    gltf_material.pbr_metallic_roughness = MaterialPBRMetallicRoughness(
        base_color_factor=[red, green, blue, 1.0],
        base_color_texture=texture,
        extensions=None,
        extras=None,
        metallic_factor=0.0,
        metallic_roughness_texture=None,
        roughness_factor=gloss.roughness,
    )
    # The exporter follows links into groups, where it takes the closure of chosen lights for an emission of the artist's.
    gltf_material.emissive_factor = gltf_material.emissive_texture = None
    gltf_material.extensions = dict(gltf_material.extensions or {})
    gltf_material.extensions.pop("KHR_materials_emissive_strength", None)
    extensions = {"KHR_materials_specular": {"specularFactor": gloss.weight}}
    if gloss.weight > 0.0:
        extensions["KHR_materials_ior"] = {"ior": gloss.ior}
    for name, values in extensions.items():
        gltf_material.extensions[name] = Extension(name, values, False)
    for message in unsupported:
        report.add(material.name, message)


def _texture(material: bpy.types.Material, socket: bpy.types.NodeSocket, settings: dict) -> object | None:
    """Return the exporter's texture for the image linked to `socket`, None where that has no file."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import NodeSocket
    from io_scene_gltf2.blender.exp.material.texture_info import gather_texture_info

    wrapped = NodeSocket(socket, [material.node_tree])
    return gather_texture_info(wrapped, (wrapped,), settings)[0]
