# SPDX-License-Identifier: GPL-3.0-or-later
"""How much an engine is given: the nodes and closures that a group node's outputs need, with groups opened and menus chosen."""

from collections.abc import Iterator
from typing import NamedTuple

import bpy

CLOSURES = {
    "ShaderNodeBsdfDiffuse",
    "ShaderNodeBsdfAnisotropic",
    "ShaderNodeBsdfTranslucent",
    "ShaderNodeSubsurfaceScattering",
    "ShaderNodeEmission",
    "ShaderNodeScript",
}
# What selects or passes on before anything is compiled
FREE = {
    "NodeReroute",
    "ShaderNodeGroup",
    "GeometryNodeMenuSwitch",
    "NodeCombineBundle",
    "NodeSeparateBundle",
}

type Path = tuple[bpy.types.Node, ...]  # the group nodes that were opened, outermost first


class Count(NamedTuple):
    """Nodes that compute something, and those of them that are closures."""

    nodes: int
    closures: int


class Place(NamedTuple):
    """An output of a node inside the groups of `path`; `item` is what is wanted of it where it is a bundle."""

    path: Path
    node: bpy.types.Node
    identifier: str
    item: str = ""


def count(node: bpy.types.Node) -> Count:
    """Return what the outputs of a group node need; what feeds the node itself does not count."""
    waiting = [Place((), node, output.identifier) for output in node.outputs]
    seen, nodes = set(waiting), set()
    while waiting:
        place = waiting.pop()
        if place.node.bl_idname not in FREE:
            nodes.add((place.path, place.node))
        for before in _before(place):
            if before not in seen:
                seen.add(before)
                waiting.append(before)
    return Count(len(nodes), sum(each.bl_idname in CLOSURES for _, each in nodes))


def _before(place: Place) -> Iterator[Place]:
    """Yield the outputs that `place` needs."""
    path, node, identifier, item = place
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


def _sources(path: Path, socket: bpy.types.NodeSocket) -> Iterator[Place]:
    """Yield the outputs that feed `socket`, out of the opened groups where it is a group's input."""
    for link in socket.links:
        if link.from_node.bl_idname != "NodeGroupInput":
            yield Place(path, link.from_node, link.from_socket.identifier)
        elif len(path) > 1:
            yield from _sources(path[:-1], _outside(path[-1], link))


def _outside(group: bpy.types.Node, link: bpy.types.NodeLink) -> bpy.types.NodeSocket:
    return next(socket for socket in group.inputs if socket.identifier == link.from_socket.identifier)


def _entry(path: Path, menu: bpy.types.NodeSocket) -> str | None:
    """Return what is chosen in a menu, None where a node chooses."""
    for link in menu.links:
        return _entry(path[:-1], _outside(path[-1], link)) if link.from_node.bl_idname == "NodeGroupInput" and path else None
    return menu.default_value
