# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures of a material wherever they are in it, also in the artist's own groups, for those who change copies of materials."""

from collections.abc import Iterator

import bpy

from ..blender.id_properties import GROUP_ID
from ..nodes.graph import Graph, Number, Value
from .read import linked_output


class TreeGraph(Graph):
    """Adds nodes to a tree that has others: what it has of `Graph` but the inputs of a group."""

    def __init__(self, tree: bpy.types.ShaderNodeTree) -> None:
        self.tree = tree
        self._geometry = None

    def linked(self, socket: bpy.types.NodeSocket) -> Value | None:
        """Return the output linked to an input, None where there is none."""
        output = linked_output(socket)
        return Value(self, output) if output else None

    def number(self, socket: bpy.types.NodeSocket) -> Number:
        """Return what an input for a number gets: a number where nothing is linked to it."""
        value = self.linked(socket)
        if value is None:
            return float(socket.default_value)
        if value.socket.type == "VALUE":
            return value
        return self.node("ShaderNodeMath", {0: value, 1: 0.0}, operation="ADD")  # converts it as the input would

    def color(self, socket: bpy.types.NodeSocket) -> Value:
        """Return what an input for a color gets."""
        return self.linked(socket) or self.vector(*socket.default_value[:3])

    def less(self, factor: Number, weight: Number) -> Number:
        """Return `factor` (1 - `weight`), a number where it is known to be one."""
        return self.times(factor, 1.0 - weight)

    def times(self, a: Number, b: Number) -> Number:
        """Return a product, a number where it is known to be one."""
        return 0.0 if 0.0 in (a, b) else a * b

    def redirect(self, old: bpy.types.NodeSocket, new: Value) -> None:
        """Have all that the output `old` is linked to take `new` instead."""
        for link in list(old.links):
            if link.to_node != new.socket.node:
                self.tree.links.new(new.socket, link.to_socket).is_muted = link.is_muted


def own_copy(material: bpy.types.Material, name: str) -> bpy.types.Material:
    """Return a copy that shares none of the artist's node groups with closures, so that they can be changed."""
    copy = material.copy()
    copy.name = name
    for tree in trees(copy):
        for node in tree.nodes:
            if _has_closures(node):
                node.node_tree = node.node_tree.copy()
    return copy


def remove_copy(material: bpy.types.Material) -> None:
    """Remove a copy that `own_copy` made, with its groups; nothing may use it."""
    inner = list(trees(material))[1:]
    bpy.data.materials.remove(material)
    for tree in inner:
        bpy.data.node_groups.remove(tree)


def trees(material: bpy.types.Material) -> Iterator[bpy.types.ShaderNodeTree]:
    """Yield the node tree of a material and, the outer ones first, those of the artist's groups in it that output closures."""
    waiting = [material.node_tree]
    while waiting:
        tree = waiting.pop(0)
        yield tree
        waiting += [node.node_tree for node in tree.nodes if _has_closures(node)]


def closures(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.Node]:
    """Return the nodes of a tree that make a closure of anything but closures, and are not muted: Blender's and our groups."""
    return [
        node
        for node in tree.nodes
        if not node.mute
        and node.type != "GROUP_INPUT"
        and any(output.type == "SHADER" for output in node.outputs)
        and not any(socket.type == "SHADER" for socket in node.inputs)
        and not _has_closures(node)
    ]


def _has_closures(node: bpy.types.Node) -> bool:
    """Return whether `node` is a group of the artist that outputs closures."""
    inner = node.node_tree if node.type == "GROUP" else None
    return inner is not None and GROUP_ID not in inner and any(output.type == "SHADER" for output in node.outputs)
