# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of other programs with KHR_materials_diffuse_roughness: Rough Diffuse or Principled Rough Diffuse with the model EON.

The extension (https://github.com/KhronosGroup/glTF/pull/2481) gives the diffuse reflection of core glTF a roughness, a factor
in [0, 1], 0 by default, times the red channel of a texture.
"""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import bpy

from ..material.convert import convert_materials
from ..material.read import group_node
from ..models import MODELS
from .extras import DIFFUSE_ROUGHNESS

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

    extension = (gltf_material.extensions or {}).get(DIFFUSE_ROUGHNESS)
    nodes = material.node_tree.nodes
    node = next((node for node in nodes if node.bl_idname == "ShaderNodeBsdfPrincipled"), None)
    if extension is None or node is None:
        return
    factor = extension.get("diffuseRoughnessFactor", 0.0)
    if isinstance(factor, bool) or not isinstance(factor, (int, float)):
        yield f"diffuseRoughnessFactor is {factor!r}, and no number: 0 is used"
        factor = 0.0
    elif not 0.0 <= factor <= 1.0:
        yield f"diffuseRoughnessFactor is {factor:g}, not in 0 to 1, and is clamped"
        factor = min(max(factor, 0.0), 1.0)
    texture = None
    if "diffuseRoughnessTexture" in extension:
        texture = _texture(gltf, extension["diffuseRoughnessTexture"])
        if texture is None:
            yield "diffuseRoughnessTexture names no texture of the file, and is left out"
    below = min(one.location.y for one in nodes) - 400.0
    helper = MaterialHelper(gltf, gltf_material, material, vertex_color)
    scalar_factor_and_texture(
        helper, (-200.0, below), "Diffuse Roughness", node.inputs["Diffuse Roughness"], float(factor), texture, RED
    )
    if _is_diffuse(node):
        _as_diffuse(node)
    yield from convert_materials([material], bpy.context.scene.unit_settings.scale_length).lines
    found = group_node(material)
    if found:
        found[0].inputs["Model"].default_value = MODELS["eon"].label


def _texture(gltf: "glTFImporter", info: object) -> "TextureInfo | None":
    """Return what the extension says of its texture, None where that names none of the file."""
    from io_scene_gltf2.io.com.gltf2_io import TextureInfo

    textures, index = gltf.data.textures or [], info.get("index") if isinstance(info, Mapping) else None
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(textures):
        return None
    found = TextureInfo.from_dict(info)
    transform = (found.extensions or {}).get("KHR_texture_transform")
    if transform is not None:
        transform.setdefault("animations", {})  # which the importer has added to those of core glTF
    return found


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
