# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a Blender material into a `Surface`, and finds the groups of True Diffuse that make it."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import bpy

from ..nodes import GROUPS, Group
from ..nodes.graph import key_and_version
from .links import Place, upstream
from .read_closures import TARGETS, ClosureReader, material_surface
from .read_nodes import shortest
from .surface import Loss, Setting, Surface


def group_nodes(material: bpy.types.Material) -> Iterator[tuple[bpy.types.Node, Group, int]]:
    """Yield the nodes of our groups that the surface of `material` comes from in any engine, each with its group and version.

    The nearest to the output is first; those behind mixes, sums and the artist's own groups follow.
    """
    groups = {group.key: group for group in GROUPS}
    tree = material.node_tree
    outputs = [tree.get_output_node(target) for target in TARGETS] if tree else []
    for output in dict.fromkeys(filter(None, outputs)):
        for place in upstream(Place(output.inputs["Surface"])):
            key, version = key_and_version(place.node)
            if key in groups and not place.node.mute:
                yield place.node, groups[key], int(version) if version.isdecimal() else groups[key].version


def group_node(material: bpy.types.Material) -> tuple[bpy.types.Node, Group, int] | None:
    """Return the first of `group_nodes`; None where there is none."""
    return next(group_nodes(material), None)


def shown(material: bpy.types.Material) -> str | None:
    """Return the target at whose output a group of True Diffuse is, directly or behind other nodes; None where there is none."""
    tree, keys = material.node_tree, {group.key for group in GROUPS}
    for target in TARGETS if tree else ():
        output = tree.get_output_node(target)
        places = upstream(Place(output.inputs["Surface"])) if output else ()
        if any(key_and_version(place.node)[0] in keys and not place.node.mute for place in places):
            return target
    return None


def linked_output(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output linked to `socket`, None where there is none; muted and invalid links do not count."""
    return next((link.from_socket for link in socket.links if link.is_valid and not link.is_muted), None)


def plain(value: Setting | Sequence[float]) -> Setting:
    """Return a socket's value with each 32-bit float as the shortest decimal number that rounds to it."""
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float)):
        return shortest(value)
    return tuple(shortest(component) for component in value)


def identifier(name: str) -> str:
    """Return `name` as Blender's USD exporter writes it: an identifier of letters, digits and underscores."""
    name = re.sub(r"\W", "_", name)
    return f"_{name}" if not name or name[0].isdigit() else name


@dataclass
class Reading:
    """A material read into a surface."""

    surface: Surface
    losses: list[Loss] = field(default_factory=list)
    """What the surface does not hold."""
    notes: list[str] = field(default_factory=list)
    """What a file that is written once cannot follow: animated values."""
    images: dict[str, bpy.types.Image] = field(default_factory=dict)
    """The images that expressions name."""
    places: dict[str, Place] = field(default_factory=dict)
    """For each parameter that one input alone gives, that input."""


def read_surface(material: bpy.types.Material, unit: float = 1.0, target: str = "EEVEE") -> Reading:
    """Return the surface that `material` has at its output for `target`, EEVEE or CYCLES, or else at another.

    `unit` is the scene's unit in meters (unit_settings.scale_length). What cannot be read is in the losses, with what takes its
    place; nothing is left out unsaid.
    """
    reader = ClosureReader(unit)
    surface = material_surface(material, target, reader)
    losses = list(dict.fromkeys(reader.losses))
    notes = [f"{what} ({node})" for node, what in reader.nodes.notes]
    return Reading(surface, losses, notes, reader.nodes.images, reader.places)
