# SPDX-License-Identifier: GPL-3.0-or-later
"""The character that is a .blend file: a skin behind one node group, as MakeHuman's add-on for Blender makes it, and image alpha.

The group holds the image and a Principled BSDF: the image mixed with a little red and brightened, its alpha, and values of the
group's inputs. MakeHuman's pores, bumps far smaller than a pixel, are left out. Its other materials link the image's alpha, too,
though that is 1 everywhere. Facts by github.com/makehumancommunity/mpfb2, src/mpfb/data/node_trees.
"""

from pathlib import Path

import bpy

from true_diffuse.scripts.characters.small.characters import BLUE, SKIN, WHITE, cloth
from true_diffuse.scripts.characters.small.figure import figure
from true_diffuse.scripts.characters.small.picture import png

FILE = "skin_behind_group.blend"


def write(path: Path) -> None:
    """Replace the open file by the character and save it to `path`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    parts = figure()
    skin, clothes = _skin(), _clothes()
    mesh = bpy.data.meshes.new("Skin")
    vertices, faces, uvs, materials = [], [], [], []
    for name, part in parts.items():
        first = len(vertices)
        vertices += [(x, -z, y) for x, y, z in part.positions]
        faces += [tuple(first + int(corner) for corner in triangle) for triangle in part.triangles]
        uvs += [(u, 1.0 - v) for u, v in part.uvs]
        materials += [int(name == "legs")] * len(part.triangles)
    mesh.from_pydata(vertices, (), faces)
    layer = mesh.uv_layers.new(name="UVMap")
    for corner, loop in enumerate(mesh.loops):
        layer.uv[corner].vector = uvs[loop.vertex_index]
    mesh.polygons.foreach_set("material_index", materials)
    mesh.shade_smooth()
    mesh.materials.append(skin)
    mesh.materials.append(clothes)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Skin", mesh))
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=True, relative_remap=False)


def _image(name: str, content: bytes) -> bpy.types.Image:
    """Return a PNG file as a packed image."""
    image = bpy.data.images.new(name, 1, 1, alpha=True)
    image.source, image.filepath_raw = "FILE", f"//{name}.png"
    image.pack(data=content, data_len=len(content))
    return image


def _skin() -> bpy.types.Material:
    group = bpy.data.node_groups.new("Skin", "ShaderNodeTree")
    sockets = {
        "colorMixIn": ("NodeSocketColor", (1.0, 0.2, 0.2, 1.0)),
        "colorMixInStrength": ("NodeSocketFloat", 0.05),
        "Roughness": ("NodeSocketFloat", 0.55),
        "Brightness": ("NodeSocketFloat", 0.02),
        "Contrast": ("NodeSocketFloat", 0.05),
        "Clearcoat": ("NodeSocketFloat", 0.1),
        "Clearcoat Roughness": ("NodeSocketFloat", 0.3),
        "SSS strength": ("NodeSocketFloat", 0.2),
        "SSS radius scale": ("NodeSocketFloat", 0.02),
    }
    for name, (kind, value) in sockets.items():
        group.interface.new_socket(name, in_out="INPUT", socket_type=kind).default_value = value
    group.interface.new_socket("shaderOutput", in_out="OUTPUT", socket_type="NodeSocketShader")
    nodes, link = group.nodes, group.links.new
    given, result = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    image, mix = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeMix")
    bright, closure = nodes.new("ShaderNodeBrightContrast"), nodes.new("ShaderNodeBsdfPrincipled")
    image.image = _image("skin", png(32, lambda u, v: (*cloth(SKIN, (0.8, 0.55, 0.45), 3, 4)(u, v), 1.0)))
    mix.data_type, mix.blend_type = "RGBA", "MIX"
    factor, a, b = (next(item for item in mix.inputs if item.identifier == key) for key in ("Factor_Float", "A_Color", "B_Color"))
    mixed = next(item for item in mix.outputs if item.identifier == "Result_Color")
    closure.inputs["Subsurface Radius"].default_value = (1.0, 0.2, 0.1)
    for source, target in (
        (given.outputs["colorMixInStrength"], factor),
        (image.outputs["Color"], a),
        (given.outputs["colorMixIn"], b),
        (mixed, bright.inputs["Color"]),
        (given.outputs["Brightness"], bright.inputs["Brightness"]),
        (given.outputs["Contrast"], bright.inputs["Contrast"]),
        (bright.outputs["Color"], closure.inputs["Base Color"]),
        (given.outputs["Roughness"], closure.inputs["Roughness"]),
        (given.outputs["Clearcoat"], closure.inputs["Coat Weight"]),
        (given.outputs["Clearcoat Roughness"], closure.inputs["Coat Roughness"]),
        (given.outputs["SSS strength"], closure.inputs["Subsurface Weight"]),
        (given.outputs["SSS radius scale"], closure.inputs["Subsurface Scale"]),
        (image.outputs["Alpha"], closure.inputs["Alpha"]),
        (closure.outputs["BSDF"], result.inputs["shaderOutput"]),
    ):
        link(source, target)
    material = _empty_material("Skin")
    node, output = material.node_tree.nodes.new("ShaderNodeGroup"), material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    node.node_tree = group
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _clothes() -> bpy.types.Material:
    material = _empty_material("Clothes")
    nodes, link = material.node_tree.nodes, material.node_tree.links.new
    image, closure = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeBsdfPrincipled")
    image.image = _image("clothes", png(32, lambda u, v: (*cloth(BLUE, WHITE)(u, v), 1.0)))
    closure.inputs["Roughness"].default_value = 0.7
    link(image.outputs["Color"], closure.inputs["Base Color"])
    link(image.outputs["Alpha"], closure.inputs["Alpha"])
    link(closure.outputs["BSDF"], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def _empty_material(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.node_tree.nodes.clear()
    return material
