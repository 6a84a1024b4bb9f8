# SPDX-License-Identifier: GPL-3.0-or-later
"""How a group node is used: what of its sockets can leave something out."""

import json
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass

import bpy

from .arithmetic import Plain

type Owner = bpy.types.Material | bpy.types.ShaderNodeTree  # where a group's node is: a material, or a group of the artist


@dataclass(frozen=True)
class Use:
    """The sockets of a group node that are constant and leave something out. Files keep it as JSON."""

    inputs: Mapping[str, Plain | str]
    """Entries of menus, what is 0 throughout, and weights that are 1, by name; colors without alpha."""

    def to_json(self) -> str:
        """Return it as JSON text, the same for equal uses."""
        return json.dumps(self.inputs, sort_keys=True)

    def holds(self, owner: Owner, node: bpy.types.Node) -> bool:
        """Return whether the sockets of `node` are still as this use has them."""
        current = use_of(owner, node).inputs
        return all(current.get(name) == value for name, value in self.inputs.items())


def from_json(text: str) -> Use | None:
    """Return the use that `Use.to_json` wrote as `text`, None where an earlier version wrote it."""
    values = json.loads(text)
    if "inputs" in values:
        return None
    return Use({name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})


def tree_of(owner: Owner) -> bpy.types.ShaderNodeTree | None:
    return owner.node_tree if isinstance(owner, bpy.types.Material) else owner


def owners_of(changed: Set[bpy.types.ID]) -> list[Owner]:
    """Return the materials and node trees that are in `changed`, or own a node tree or use an action that is."""
    owners: list[Owner] = [each for each in changed if isinstance(each, bpy.types.Material) or _is_group(each)]
    rest = changed - {*owners, *map(tree_of, owners)}
    if rest:
        found = (owner for owner in (*bpy.data.materials, *bpy.data.node_groups) if owner not in changed)
        owners += [owner for owner in found if tree_of(owner) in rest or not rest.isdisjoint(actions(owner))]
    return owners


def _is_group(item: bpy.types.ID) -> bool:
    return isinstance(item, bpy.types.NodeTree) and not item.is_embedded_data


def actions(owner: Owner) -> Iterator[bpy.types.Action]:
    """Yield the actions of `owner` and its node tree, and those of NLA strips."""
    for item in {owner, tree_of(owner)}:
        data = item.animation_data if item else None
        if data is not None:
            strips = (strip.action for track in data.nla_tracks for strip in track.strips)
            yield from (action for action in (data.action, *strips) if action)


def use_of(owner: Owner, node: bpy.types.Node) -> Use:
    """Return how `node` is used; a socket with a link, a driver or keyframes is not constant."""
    animated = animated_paths(owner)
    inputs: dict[str, Plain | str] = {}
    for socket in node.inputs:
        if not hasattr(socket, "default_value") or socket.is_linked:
            continue
        value = socket.default_value
        if not isinstance(value, str):
            value = float(value) if isinstance(value, (bool, int, float)) else tuple(value)[:3]
            components = value if isinstance(value, tuple) else (value,)
            is_weight = socket.bl_idname == "NodeSocketFloatFactor"
            if not (all(each == 0.0 for each in components) or (is_weight and all(each == 1.0 for each in components))):
                continue
        if animated and any(socket.path_from_id("default_value") in path for path in animated):
            continue
        inputs[socket.name] = value
    return Use(inputs)


def animated_paths(owner: Owner) -> set[str]:
    """Return the data paths of `owner` and its node tree that have drivers, keyframes or NLA strips."""
    paths: set[str] = set()
    for item in (owner, tree_of(owner)):
        data = item.animation_data if item else None
        paths.update(curve.data_path for curve in (data.drivers if data else ()))
    for layer in (layer for action in actions(owner) for layer in action.layers):
        for bag in (bag for strip in layer.strips for bag in strip.channelbags):
            paths.update(curve.data_path for curve in bag.fcurves)
    return paths
