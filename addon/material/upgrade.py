# SPDX-License-Identifier: GPL-3.0-or-later
"""Upgrades files of an older True Diffuse: nodes get the groups of this version and keep links, values and animation.

Sockets and menu entries are matched by name; `SOCKETS` and `ENTRIES` map the names of older versions. A group that somebody has
edited, or that a newer True Diffuse made, stays as it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import bpy

from ..blender import fcurves
from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR
from ..closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from ..models import MODELS
from ..nodes import GROUPS, SUBSURFACE, Group, chosen_lights
from ..nodes.graph import fingerprint, key_and_version
from .materials import set_thickness

# Names of version 0.1.0, and what replaces them
SOCKETS = {"Mode": "Quality", "Mean Free Path": "Subsurface Radius"}
ENTRIES = {
    "Quality": {"Lobes": BALANCED, "Lobe": BALANCED, "Single": FAST, "Signed": PRECISE, "Lamps": CHOSEN_LIGHTS},
    "Model": {"Pits": MODELS["pitted"].label},
}
LIGHTS_KEYS = (chosen_lights.LIGHTS.key, "lamps")  # of the group of chosen lights, in this version and in 0.1.0


@dataclass
class Report:
    """The result of an upgrade: names of the owners of upgraded nodes, and notes on what could not be upgraded or was lost."""

    upgraded: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class OldNode:
    """A node whose group is of another version than this True Diffuse's `group`."""

    owner: bpy.types.ID
    tree: bpy.types.ShaderNodeTree
    node: bpy.types.Node
    group: Group

    @property
    def obstacle(self) -> str:
        """Why the node cannot be upgraded, empty where it can."""
        tree = self.node.node_tree
        if not self.owner.is_editable or not self.tree.is_editable or self.owner.override_library:
            return "is linked from another file"
        if int(key_and_version(self.node)[1]) > self.group.version:
            return "was made by a newer True Diffuse"
        if BUILT_FINGERPRINT in tree and tree[BUILT_FINGERPRINT] != fingerprint(tree):
            return f"holds {tree.name}, which somebody has edited"
        return ""


def current_name(socket: str) -> str:
    """Return the name in this version of a socket of any version."""
    return SOCKETS.get(socket, socket)


def current_value[Value](socket: str, value: Value) -> Value | str:
    """Return the value in this version of a socket, by its `current_name`: an entry of a menu may have a new name."""
    return ENTRIES.get(socket, {}).get(value, value) if isinstance(value, str) else value


def outdated() -> Iterator[OldNode]:
    """Yield the nodes of the file whose groups are of another version, or left out what one material did not need."""
    groups = {group.key: group for group in GROUPS}
    owners = [item for kind in (bpy.data.materials, bpy.data.worlds, bpy.data.lights) for item in kind if item.node_tree]
    trees = [(item, item.node_tree) for item in owners]
    trees += [(tree, tree) for tree in bpy.data.node_groups if tree.bl_idname == "ShaderNodeTree" and GROUP_ID not in tree]
    for owner, tree in trees:
        for node in tree.nodes:
            key, version = key_and_version(node)
            if key not in groups or not version.isdecimal():
                continue
            if int(version) != groups[key].version or SPECIALIZED_FOR in node.node_tree:
                yield OldNode(owner, tree, node, groups[key])


def is_outdated() -> bool:
    """Return whether the file has an `outdated` node; quick where it holds no group of another version."""
    versions = {group.key: str(group.version) for group in GROUPS}

    def is_old(tree: bpy.types.NodeTree) -> bool:
        key, _, version = str(tree.get(GROUP_ID, "")).partition("/")
        return key in versions and (version != versions[key] or SPECIALIZED_FOR in tree)

    return any(map(is_old, bpy.data.node_groups)) and any(outdated())


def upgrade() -> Report:
    """Give the `outdated` nodes the groups of this True Diffuse; returns what was done."""
    report = Report()
    for old in list(outdated()):
        name = f"{old.owner.name}: {old.node.label or old.node.name}"
        if old.obstacle:
            report.lines.append(f"{name} {old.obstacle} and is left alone")
            continue
        report.lines += [f"{name} {message}" for message in upgrade_node(old.tree, old.node, old.group)]
        if old.group is SUBSURFACE and isinstance(old.owner, bpy.types.Material):
            set_thickness(old.owner)
        if old.owner.name not in report.upgraded:
            report.upgraded.append(old.owner.name)
    return report


def upgrade_node(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, group: Group) -> list[str]:
    """Give a `node` of `tree` the `group` of this version; returns lines about what could not be kept."""
    _keep_chosen_lights()
    names = [current_name(socket.name) for socket in node.inputs]
    values = {
        name: current_value(name, _value(socket))
        for name, socket in zip(names, node.inputs, strict=True)
        if hasattr(socket, "default_value")
    }
    sources = [
        (link.from_socket, name, link.is_muted) for name, socket in zip(names, node.inputs, strict=True) for link in socket.links
    ]
    targets = [(link.from_socket.name, link.to_socket, link.is_muted) for socket in node.outputs for link in socket.links]
    animated = [(curve, curve.data_path, fcurves.input_of(curve)) for curve in fcurves.of_node(tree, node)]
    for curve, _, _ in animated:
        curve.data_path = "none"  # Blender deletes the curves of a socket along with it
    node.node_tree = None  # else Blender would match sockets by their numbers
    node.node_tree = group.ensure()
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
    for curve, path, index in animated:
        if index is not None and names[index] in node.inputs:
            path = path.replace(f"].inputs[{index}]", f"].inputs[{node.inputs.find(names[index])}]")
        curve.data_path = path
    return lines


def _value(socket: bpy.types.NodeSocket) -> float | str | tuple[float, ...]:
    value = socket.default_value
    return value if isinstance(value, (str, int, float)) else tuple(value)


def _keep_chosen_lights() -> None:
    """Choose the lights that an older version's group follows, unless lights have been chosen with this version."""
    if chosen_lights.chosen():
        return
    for tree in bpy.data.node_groups:
        is_lights = str(tree.get(GROUP_ID, "")).partition("/")[0] in LIGHTS_KEYS and tree.library is None
        if is_lights and (lights := chosen_lights.lights_of(tree)):
            chosen_lights.choose(lights)
            return
