# SPDX-License-Identifier: GPL-3.0-or-later
"""Files made with an older True Diffuse: their nodes get the groups of this one, with their links, values and animation.

Sockets are matched by name. A group that somebody has changed, or that a newer True Diffuse made, stays as it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import bpy

from ..blender import fcurves
from ..blender.id_properties import AS_BUILT, STAMP
from ..nodes import GROUPS, Group, chosen_lights
from ..nodes.graph import fingerprint, stamp_of


@dataclass
class Report:
    """What an upgrade did: the owners of the nodes that were upgraded by name, and lines about what stayed or was lost."""

    upgraded: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Old:
    """A node whose group is of another version than this True Diffuse's `group`."""

    owner: bpy.types.ID
    tree: bpy.types.ShaderNodeTree
    node: bpy.types.Node
    group: Group

    @property
    def reason(self) -> str:
        """Why the node stays as it is, empty where it need not."""
        held = self.node.node_tree
        if not self.owner.is_editable or not self.tree.is_editable or self.owner.override_library:
            return "is linked from another file"
        if int(stamp_of(self.node)[1]) > self.group.version:
            return "was made by a newer True Diffuse"
        if AS_BUILT in held and held[AS_BUILT] != fingerprint(held):
            return f"holds {held.name}, which somebody has changed"
        return ""


def outdated() -> Iterator[Old]:
    """Yield the nodes of the file whose groups are of another version."""
    groups = {group.key: group for group in GROUPS}
    owners = [item for kind in (bpy.data.materials, bpy.data.worlds, bpy.data.lights) for item in kind if item.node_tree]
    trees = [(item, item.node_tree) for item in owners]
    trees += [(tree, tree) for tree in bpy.data.node_groups if tree.bl_idname == "ShaderNodeTree" and STAMP not in tree]
    for owner, tree in trees:
        for node in tree.nodes:
            key, version = stamp_of(node)
            if key in groups and version.isdecimal() and int(version) != groups[key].version:
                yield Old(owner, tree, node, groups[key])


def upgrade() -> Report:
    """Give the `outdated` nodes the groups of this True Diffuse; returns what was done.

    A group made the least for one use becomes the whole one again.
    """
    report = Report()
    lights = _chosen_lamps()
    for old in list(outdated()):
        name = f"{old.owner.name}: {old.node.label or old.node.name}"
        if old.reason:
            report.lines.append(f"{name} {old.reason} and is left alone")
            continue
        report.lines += [f"{name} {words}" for words in _upgrade(old)]
        if old.owner.name not in report.upgraded:
            report.upgraded.append(old.owner.name)
    if lights and report.upgraded and lights != _chosen_lamps(chosen_lights.LAMPS.stamp):
        chosen_lights.choose(lights)
    return report


def _upgrade(old: Old) -> list[str]:
    """Give a node the group of this version; returns lines about what that has no place for."""
    tree, node = old.tree, old.node
    names = [socket.name for socket in node.inputs]
    values = {socket.name: _value(socket) for socket in node.inputs if hasattr(socket, "default_value")}
    sources = [(link.from_socket, link.to_socket.name, link.is_muted) for socket in node.inputs for link in socket.links]
    targets = [(link.from_socket.name, link.to_socket, link.is_muted) for socket in node.outputs for link in socket.links]
    animated = [(curve, curve.data_path, fcurves.input_of(curve)) for curve in fcurves.of_node(tree, node)]
    for curve, _, _ in animated:
        curve.data_path = "none"  # Blender deletes the curves of a socket along with it
    node.node_tree = None  # else Blender would match sockets by their numbers
    node.node_tree = old.group.ensure()
    lines = []
    for name, value in values.items():
        try:
            if name in node.inputs and value is not None:
                node.inputs[name].default_value = value
        except (TypeError, ValueError):  # an entry that the menu no longer has, or another type of socket
            lines.append(f"has no {name} {value} any more")
    for source, name, is_muted in sources:
        if name in node.inputs:
            tree.links.new(source, node.inputs[name]).is_muted = is_muted
        else:
            lines.append(f"has no {name} any more, which was linked")
    for name, socket, is_muted in targets:
        output = node.outputs.get(name)
        if output:
            tree.links.new(output, socket).is_muted = is_muted
        else:
            lines.append(f"has no output {name} any more, which was linked")
    for curve, path, place in animated:
        if place is not None and names[place] in node.inputs:
            path = path.replace(f"].inputs[{place}]", f"].inputs[{node.inputs.find(names[place])}]")
        curve.data_path = path
    return lines


def _value(socket: bpy.types.NodeSocket) -> float | str | tuple[float, ...]:
    value = socket.default_value
    return value if isinstance(value, (str, int, float)) else tuple(value)


def _chosen_lamps(stamp: str = "") -> list[bpy.types.Object]:
    """Return the lights that the mode Lamps follows in the file, in its groups of one `stamp` or in those of any version."""
    for tree in bpy.data.node_groups:
        own = str(tree.get(STAMP, ""))
        if own.startswith(stamp or f"{chosen_lights.LAMPS.key}/") and tree.library is None and tree.animation_data:
            drivers = [curve.driver for curve in tree.animation_data.drivers]
            found = {target.id: None for driver in drivers for variable in driver.variables for target in variable.targets}
            return [item for item in found if isinstance(item, bpy.types.Object)]
    return []
