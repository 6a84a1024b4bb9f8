# SPDX-License-Identifier: GPL-3.0-or-later
"""The F-curves of nodes: drivers, and curves of actions; and what drivers read of nodes."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import bpy


def curves(tree: bpy.types.NodeTree) -> list[bpy.types.FCurve]:
    """Return all curves that change values of `tree`: its drivers', its action's and its NLA strips'."""
    data = tree.animation_data
    if data is None:
        return []
    users = (data, *(strip for track in data.nla_tracks for strip in track.strips))
    played = {(user.action, user.action_slot) for user in users if user.action and user.action_slot}
    # other slots of an action are other data-blocks'
    bags = [strip.channelbag(slot) for action, slot in played for layer in action.layers for strip in layer.strips]
    return [*data.drivers, *(curve for bag in bags if bag for curve in bag.fcurves)]


def of_node(tree: bpy.types.NodeTree, node: bpy.types.Node) -> list[bpy.types.FCurve]:
    """Return those of the `curves` that change values of `node`."""
    start = f'nodes["{bpy.utils.escape_identifier(node.name)}"]'
    return [curve for curve in curves(tree) if curve.data_path.startswith(start)]


def input_of(curve: "bpy.types.FCurve | Reader") -> int | None:
    """Return the index of the node input that `curve` changes or reads, None where that is something else."""
    match = re.search(r"\]\.inputs\[(\d+)\]", curve.data_path)
    return int(match[1]) if match else None


@dataclass(frozen=True)
class Reader:
    """A driver's variable that reads a value of a node, by way of the node tree or of its owner."""

    target: bpy.types.DriverTarget
    data_path: str

    def follow(self, socket: bpy.types.NodeSocket) -> None:
        """Make the variable read `socket` instead, the same component of it."""
        before, _, after = self.data_path.partition("nodes[")
        component = re.search(r"\.default_value(\[\d+\])?$", after)
        self.target.data_path = before + socket.path_from_id("default_value") + ((component and component[1]) or "")


def readers_of(tree: bpy.types.NodeTree, node: bpy.types.Node) -> list[Reader]:
    """Return the drivers' variables in the file that read an input of `node`."""
    start = f'nodes["{bpy.utils.escape_identifier(node.name)}"].inputs['
    return [
        Reader(target, target.data_path)
        for target in _targets(tree)
        if target.data_path.removeprefix("node_tree.").startswith(start)
    ]


def _targets(tree: bpy.types.NodeTree) -> Iterator[bpy.types.DriverTarget]:
    """Yield what drivers of the file read of `tree`."""
    for item in _animated():
        for curve in item.animation_data.drivers:
            for variable in curve.driver.variables:
                yield from (target for target in variable.targets if target.id and tree in (target.id, _tree_of(target.id)))


def _animated() -> Iterator[bpy.types.ID]:
    """Yield the data-blocks of the file that have animation data, and so the node trees in them."""
    collections: Iterable[Iterable[bpy.types.ID]] = (
        getattr(bpy.data, each.identifier) for each in bpy.data.bl_rna.properties if each.type == "COLLECTION"
    )
    for collection in collections:
        for item in collection:
            for owner in (item, _tree_of(item)):
                if getattr(owner, "animation_data", None):
                    yield owner


def _tree_of(item: bpy.types.ID) -> bpy.types.NodeTree | None:
    return getattr(item, "node_tree", None)
