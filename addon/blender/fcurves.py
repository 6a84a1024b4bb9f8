# SPDX-License-Identifier: GPL-3.0-or-later
"""The F-curves of nodes: drivers, and curves of actions."""

import re

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


def input_of(curve: bpy.types.FCurve) -> int | None:
    """Return the index of the node input that `curve` changes, None where it changes something else."""
    match = re.search(r"\]\.inputs\[(\d+)\]", curve.data_path)
    return int(match[1]) if match else None
