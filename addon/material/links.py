# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows links between nodes as Blender evaluates them: through reroutes, muted nodes and links, and into and out of groups."""

from collections.abc import Iterator
from typing import NamedTuple

import bpy

from ..blender.id_properties import GROUP_ID


class Place(NamedTuple):
    """A socket, and the group nodes, from the outside in, that hold its tree; none in the material's own tree."""

    socket: bpy.types.NodeSocket
    groups: tuple[bpy.types.Node, ...] = ()

    @property
    def node(self) -> bpy.types.Node:
        """The socket's node."""
        return self.socket.node

    def input(self, name: str | int) -> "Place":
        """Return an input of the node by name or index; KeyError or IndexError where there is none."""
        return Place(self.node.inputs[name], self.groups)

    def inputs(self) -> list["Place"]:
        """Return the inputs that the node shows for its settings."""
        return [Place(socket, self.groups) for socket in self.node.inputs if socket.enabled]

    @property
    def label(self) -> str:
        """What the interface calls the node."""
        return self.node.label or self.node.name


def source(place: Place) -> Place:
    """Return where the value of an input comes from: an output of a node that makes it, or an unlinked input.

    Groups of True Diffuse are nodes of their own. A muted node passes on the input that Blender shows for it; an output without
    one gives the output itself, whose node is muted.
    """
    while True:
        output = _linked_output(place)
        if output is None:
            return place
        node = output.node
        if node.mute:
            link = next((link for link in node.internal_links if link.to_socket == output.socket), None)
            if link is None:
                return output
            place = Place(link.from_socket, output.groups)
        elif node.type == "REROUTE":
            place = output.input(0)
        elif node.type == "GROUP" and node.node_tree and GROUP_ID not in node.node_tree:
            inside = _group_output(output)
            if inside is None:
                return output
            place = inside
        elif node.type == "GROUP_INPUT":
            place = _group_input(output)
        else:
            return output


def _linked_output(place: Place) -> Place | None:
    """Return the output linked to an input; None where there is none. Muted and invalid links do not count."""
    for link in place.socket.links:
        if link.is_valid and not link.is_muted:
            return Place(link.from_socket, place.groups)
    return None


def _group_output(output: Place) -> Place | None:
    """Return the input inside a group node from which one of its outputs comes; None where the group has no output node."""
    nodes = [node for node in output.node.node_tree.nodes if node.type == "GROUP_OUTPUT"]
    node = next((node for node in nodes if node.is_active_output), None)
    if node is None:
        return None
    inside = next(socket for socket in node.inputs if socket.identifier == output.socket.identifier)
    return Place(inside, (*output.groups, output.node))


def _group_input(output: Place) -> Place:
    """Return the input of the group node that an output of the Group Input node inside stands for."""
    *outer, group = output.groups
    return Place(next(socket for socket in group.inputs if socket.identifier == output.socket.identifier), tuple(outer))


def upstream(place: Place) -> Iterator[Place]:
    """Yield one output of each node that the value of an input comes from, through groups, the nearest first."""
    seen: set[tuple[bpy.types.Node, tuple[bpy.types.Node, ...]]] = set()
    waiting = [place]
    while waiting:
        output = source(waiting.pop())
        if output.socket.is_output and (output.node, output.groups) not in seen:
            seen.add((output.node, output.groups))
            yield output
            waiting += output.inputs()
