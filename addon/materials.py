# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials made of True Diffuse groups."""

import bpy

from .nodes import Group


def create(name: str, group: Group, **inputs: float | tuple[float, ...]) -> bpy.types.Material:
    """Return a new material whose surface is `group`, its sockets set to `inputs` (by socket name; the rest at their defaults)."""
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group.ensure()
    node.name = group.name
    node.width = 220.0
    for socket, value in inputs.items():
        node.inputs[socket].default_value = value
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (300.0, 0.0)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return material


def paint(material: bpy.types.Material, socket: bpy.types.NodeSocket, attribute: str, albedo: float) -> None:
    """Feed the color `socket` of `material` with the mesh's color `attribute` (linear, in [0, 1]) times `albedo`."""
    tree = material.node_tree
    source = tree.nodes.new("ShaderNodeAttribute")
    source.attribute_name = attribute
    source.location = (-500.0, 0.0)
    factor = tree.nodes.new("ShaderNodeVectorMath")
    factor.operation = "SCALE"
    factor.inputs["Scale"].default_value = albedo
    factor.location = (-250.0, 0.0)
    tree.links.new(source.outputs["Color"], factor.inputs["Vector"])
    tree.links.new(factor.outputs["Vector"], socket)
