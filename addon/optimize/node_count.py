# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the nodes and closures that reach an engine, as Blender makes them of a group: groups, menus and constants resolved."""

from typing import NamedTuple

import bpy

CLOSURES = {
    "ShaderNodeBsdfDiffuse",
    "ShaderNodeBsdfPrincipled",
    "ShaderNodeBsdfAnisotropic",
    "ShaderNodeBsdfTranslucent",
    "ShaderNodeSubsurfaceScattering",
    "ShaderNodeEmission",
    "ShaderNodeScript",
}
VARYING = {"VALUE": "Factor", "RGBA": "Color", "VECTOR": "Vector"}  # outputs of an Attribute node, by type of socket


class NodeCount(NamedTuple):
    """How many nodes there are, closures among them."""

    nodes: int
    closures: int


def node_count(node: bpy.types.Node) -> NodeCount:
    """Return how many nodes and closures the first output of a group node needs; nodes linked to its inputs do not count.

    They are those of the engine that the active scene was last evaluated for.
    """
    material = bpy.data.materials.new("Counted")
    tree = material.node_tree
    tree.nodes.clear()
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = node.node_tree
    attribute = tree.nodes.new("ShaderNodeAttribute")
    for socket, own in zip(node.inputs, group.inputs, strict=True):
        if socket.is_linked and socket.type in VARYING:
            tree.links.new(attribute.outputs[VARYING[socket.type]], own)
        elif hasattr(own, "default_value"):
            own.default_value = socket.default_value
    tree.links.new(group.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    kinds = [each.bl_idname for each in bpy.types.InlineShaderNodes.from_material(material).node_tree.nodes]
    bpy.data.materials.remove(material)
    return NodeCount(
        sum(kind not in ("ShaderNodeOutputMaterial", "ShaderNodeAttribute") for kind in kinds),
        sum(kind in CLOSURES for kind in kinds),
    )
