# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the nodes and closures that reach an engine: those that a group node's outputs need, with groups and menus resolved."""

from collections.abc import Iterator
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
# Nodes that Blender resolves before it compiles a shader
RESOLVED = {
    "NodeReroute",
    "ShaderNodeGroup",
    "GeometryNodeMenuSwitch",
    "NodeCombineBundle",
    "NodeSeparateBundle",
}

type Path = tuple[bpy.types.Node, ...]  # nested group nodes, outermost first


class NodeCount(NamedTuple):
    """How many nodes there are, closures among them."""

    nodes: int
    closures: int


class NodeOutput(NamedTuple):
    """An output of a node inside the groups of `path`; `item` is the needed item of a bundle."""

    path: Path
    node: bpy.types.Node
    identifier: str
    item: str = ""


def node_count(node: bpy.types.Node) -> NodeCount:
    """Return how many nodes and closures the outputs of a group node need; nodes linked to its inputs do not count."""
    pending = [NodeOutput((), node, output.identifier) for output in node.outputs]
    reached, nodes = set(pending), set()
    while pending:
        output = pending.pop()
        if output.node.bl_idname not in RESOLVED:
            nodes.add((output.path, output.node))
        for source in _needed(output):
            if source not in reached:
                reached.add(source)
                pending.append(source)
    return NodeCount(len(nodes), sum(inner.bl_idname in CLOSURES for _, inner in nodes))


def _needed(output: NodeOutput) -> Iterator[NodeOutput]:
    """Yield the outputs that `output` depends on directly."""
    path, node, identifier, item = output
    if node.bl_idname == "ShaderNodeGroup":
        inside = (*path, node)
        ends = [end for end in node.node_tree.nodes if end.bl_idname == "NodeGroupOutput" and end.is_active_output]
        sockets = [socket for end in ends for socket in end.inputs if socket.identifier == identifier]
    else:
        inside, sockets = path, node.inputs
    if node.bl_idname == "GeometryNodeMenuSwitch":
        entry = _entry(path, node.inputs[0])
        sockets = [socket for socket in node.inputs if entry in (None, socket.name)]
    elif node.bl_idname == "NodeSeparateBundle":
        item = next(output.name for output in node.outputs if output.identifier == identifier)
    elif node.bl_idname == "NodeCombineBundle":
        sockets, item = [socket for socket in node.inputs if socket.name == item], ""
    for socket in sockets:
        for source in _sources(inside, socket):
            yield source._replace(item=item)


def _sources(path: Path, socket: bpy.types.NodeSocket) -> Iterator[NodeOutput]:
    """Yield the outputs linked to `socket`; where that is a group's input, those linked to the group node."""
    for link in socket.links:
        if link.from_node.bl_idname != "NodeGroupInput":
            yield NodeOutput(path, link.from_node, link.from_socket.identifier)
        elif len(path) > 1:
            yield from _sources(path[:-1], _outside(path[-1], link))


def _outside(group: bpy.types.Node, link: bpy.types.NodeLink) -> bpy.types.NodeSocket:
    return next(socket for socket in group.inputs if socket.identifier == link.from_socket.identifier)


def _entry(path: Path, menu: bpy.types.NodeSocket) -> str | None:
    """Return the chosen entry of a menu, None where a node chooses it."""
    for link in menu.links:
        return _entry(path[:-1], _outside(path[-1], link)) if link.from_node.bl_idname == "NodeGroupInput" and path else None
    return menu.default_value
