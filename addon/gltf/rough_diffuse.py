# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of other programs with KHR_materials_diffuse_roughness: Rough Diffuse or Principled Rough Diffuse with the model EON.

The extension (https://github.com/KhronosGroup/glTF/pull/2481) gives the diffuse reflection of core glTF a roughness, a factor
in [0, 1], 0 by default, times the red channel of a texture.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from ..material.convert import convert_materials
from ..material.read import group_node
from ..models import MODELS
from .diffuse_roughness import NAME

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import Material, TextureInfo
    from io_scene_gltf2.io.imp.gltf2_io_gltf import glTFImporter

RED = 0
# Inputs of the Principled BSDF with the values at which it is a Diffuse BSDF
NEUTRAL = {
    "Metallic": 0.0,
    "Specular IOR Level": 0.0,
    "Subsurface Weight": 0.0,
    "Transmission Weight": 0.0,
    "Coat Weight": 0.0,
    "Sheen Weight": 0.0,
    "Thin Film Thickness": 0.0,
    "Alpha": 1.0,
}


def convert(
    gltf: "glTFImporter", gltf_material: "Material", vertex_color: str | None, material: bpy.types.Material
) -> Iterator[str]:
    """Make of Blender's nodes ours where the extension is there; yields what is wrong with it, in words for the user."""
    from io_scene_gltf2.blender.imp.material_utils import MaterialHelper, scalar_factor_and_texture

    extension = (gltf_material.extensions or {}).get(NAME)
    nodes = material.node_tree.nodes
    node = next((node for node in nodes if node.bl_idname == "ShaderNodeBsdfPrincipled"), None)
    if extension is None or node is None:
        return
    factor = extension.get("diffuseRoughnessFactor", 0.0)
    if not _is_number(factor):
        yield f"diffuseRoughnessFactor is {factor!r}, and no number: 0 is used"
        factor = 0.0
    elif not 0.0 <= factor <= 1.0:
        yield f"diffuseRoughnessFactor is {factor:g}, not in 0 to 1, and is clamped"
        factor = min(max(factor, 0.0), 1.0)
    texture = None
    if "diffuseRoughnessTexture" in extension:
        texture = _texture(gltf, extension["diffuseRoughnessTexture"])
        if texture is None:
            yield "diffuseRoughnessTexture is no valid texture of the file, and is left out"
    below = min(one.location.y for one in nodes) - 400.0
    helper = MaterialHelper(gltf, gltf_material, material, vertex_color)
    scalar_factor_and_texture(
        helper, (-200.0, below), "Diffuse Roughness", node.inputs["Diffuse Roughness"], float(factor), texture, RED
    )
    for image in {one.image for one in nodes if one.bl_idname == "ShaderNodeTexImage" and one.image}:
        if missing := missing_file(image):
            yield f"the image file {missing} is missing"
    if _is_diffuse(node):
        _as_diffuse(node)
    yield from convert_materials([material], bpy.context.scene.unit_settings.scale_length).lines
    found = group_node(material)
    if found:
        found[0].inputs["Model"].default_value = MODELS["eon"].label


def _texture(gltf: "glTFImporter", info: object) -> "TextureInfo | None":
    """Return what the extension says of its texture, None where that is no valid one of the file."""
    from io_scene_gltf2.io.com.gltf2_io import TextureInfo

    if not isinstance(info, dict) or not _is_index(info.get("index")) or info["index"] >= len(gltf.data.textures or []):
        return None
    extensions = info.get("extensions", {})
    transform = extensions.get("KHR_texture_transform", {}) if isinstance(extensions, dict) else None
    if not isinstance(transform, dict) or not all(map(_is_index, (info.get("texCoord", 0), transform.get("texCoord", 0)))):
        return None
    pairs = transform.get("offset", [0.0, 0.0]), transform.get("scale", [1.0, 1.0])
    if any(not isinstance(pair, list) or len(pair) != 2 for pair in pairs):
        return None
    if not all(map(_is_number, (*pairs[0], *pairs[1], transform.get("rotation", 0.0)))):
        return None
    transform.setdefault("animations", {})  # which the importer has added to those of core glTF
    return TextureInfo.from_dict(info)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_index(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def missing_file(image: bpy.types.Image) -> str:
    """Return the path of an image's file where that is not there, of which the importer says nothing; else an empty one."""
    path = Path(bpy.path.abspath(image.filepath))
    return "" if image.packed_file or path.is_file() else str(path)


def _is_diffuse(node: bpy.types.Node) -> bool:
    """Return whether a Principled BSDF has no layer but the diffuse one."""
    emits = node.inputs["Emission Color"].is_linked or any(node.inputs["Emission Color"].default_value[:3])
    if emits and (node.inputs["Emission Strength"].is_linked or node.inputs["Emission Strength"].default_value):
        return False
    return all(not node.inputs[name].is_linked and node.inputs[name].default_value == value for name, value in NEUTRAL.items())


def _as_diffuse(node: bpy.types.Node) -> None:
    """Put a Diffuse BSDF in the place of a Principled BSDF."""
    tree = node.id_data
    new = tree.nodes.new("ShaderNodeBsdfDiffuse")
    new.location = node.location
    for name, source in (("Color", "Base Color"), ("Roughness", "Diffuse Roughness"), ("Normal", "Normal")):
        new.inputs[name].default_value = node.inputs[source].default_value
        for link in node.inputs[source].links:
            tree.links.new(link.from_socket, new.inputs[name])
    for link in list(node.outputs[0].links):
        tree.links.new(new.outputs[0], link.to_socket)
    tree.nodes.remove(node)
