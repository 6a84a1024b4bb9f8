# SPDX-License-Identifier: GPL-3.0-or-later
"""Follows links between nodes as Blender evaluates them: through reroutes, muted nodes and links, and into and out of groups."""

from collections.abc import Iterable, Iterator
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

    Groups of True Diffuse are nodes of their own. A muted node passes on the input that Blender shows for it; where there is none,
    links from it do not count. An output of a group that gives nothing is returned itself: see `is_nothing`.
    """
    return trail(place)[-1]


def is_nothing(output: Place) -> bool:
    """Return whether `source` returned an output of a group that has no inside, which is zero, or no closure."""
    node = output.node
    return node.type == "GROUP_INPUT" or (node.type == "GROUP" and not (node.node_tree and GROUP_ID in node.node_tree))


def trail(place: Place) -> list[Place]:
    """Return the inputs and outputs that the value of an input passes, from the input itself to what `source` returns."""
    passed = [place]
    while (output := _linked_output(passed[-1])) is not None:
        behind = _behind(output)
        if behind is None and output.node.mute:
            break
        passed.append(output)
        if behind is None:
            break
        passed.append(behind)
    return passed


def _behind(output: Place) -> Place | None:
    """Return the input whose value an output passes on; None where its node makes the value, or nothing."""
    node = output.node
    if node.mute:
        link = next((link for link in node.internal_links if link.to_socket == output.socket), None)
        return Place(link.from_socket, output.groups) if link else None
    if node.type == "REROUTE":
        return output.input(0)
    if node.type == "GROUP" and node.node_tree and GROUP_ID not in node.node_tree:
        return _group_output(output)
    if node.type == "GROUP_INPUT":
        return _group_input(output)
    if node.bl_idname == "GeometryNodeMenuSwitch" and output.socket == node.outputs[0]:
        return _switched(output)
    return None


def _switched(output: Place) -> Place | None:
    """Return the input of a Menu Switch that its menu chooses; None where that is not known, or has no such entry."""
    menu = source(output.input(0)).socket
    chosen = "" if menu.is_output else menu.default_value
    names = [item.name for item in output.node.enum_items]
    return output.input(1 + names.index(chosen)) if chosen in names else None


def is_used(output: bpy.types.NodeSocket) -> bool:
    """Return whether a value reaches an output of its tree."""
    seen: set[bpy.types.Node] = set()
    waiting = [output]
    while waiting:
        for link in waiting.pop().links:
            node = link.to_node
            if link.is_muted or not link.is_valid or node in seen:
                continue
            if node.type == "OUTPUT_AOV" or (node.type in ("OUTPUT_MATERIAL", "GROUP_OUTPUT") and node.is_active_output):
                return True
            seen.add(node)
            waiting += node.outputs
    return False


def _linked_output(place: Place) -> Place | None:
    """Return the output linked to an input; None where there is none. Muted and invalid links do not count."""
    socket = place.socket
    if not socket.is_linked:  # most are not, and `links` takes long: Blender looks through all of the tree
        return None
    for link in socket.id_data.links:
        if link.to_socket == socket and link.is_valid and not link.is_muted:
            return Place(link.from_socket, place.groups)
    return None


def _group_output(output: Place) -> Place | None:
    """Return the input inside a group node from which one of its outputs comes; None where the group has no output node."""
    nodes = [node for node in output.node.node_tree.nodes if node.type == "GROUP_OUTPUT"]
    node = next((node for node in nodes if node.is_active_output), None)
    if node is None:
        return None
    return _same(node.inputs, output, (*output.groups, output.node))


def _group_input(output: Place) -> Place | None:
    """Return the input of the group node that an output of the Group Input node inside stands for; None outside of any group."""
    if not output.groups:
        return None
    *outer, group = output.groups
    return _same(group.inputs, output, tuple(outer))


def _same(sockets: Iterable[bpy.types.NodeSocket], output: Place, groups: tuple[bpy.types.Node, ...]) -> Place | None:
    """Return the one of `sockets` that is the group's same socket as `output`."""
    return next((Place(socket, groups) for socket in sockets if socket.identifier == output.socket.identifier), None)


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
