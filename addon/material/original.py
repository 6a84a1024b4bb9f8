# SPDX-License-Identifier: GPL-3.0-or-later
"""What a converted node was before: kept as JSON in a custom property of the node, for `revert.py`."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass

import bpy

from ..blender.id_properties import CONVERTED_FROM
from .materials import Setting

TO_MILLIMETERS = "To Millimeters"  # label of the nodes that convert adds where a length is linked or animated


@dataclass(frozen=True)
class OriginalInput:
    """An input of the node as it was, and the group's `socket` that took it over: None where no socket did."""

    value: Setting | None
    """None for an input without one, as Normal."""
    socket: str | None = None
    made: Setting | None = None
    """What the socket got: the value that it still has tells that the artist has not changed it."""
    factor: float | tuple[float, ...] = 1.0
    """Of `made` over `value`, of each component."""


@dataclass(frozen=True)
class Original:
    """A node of Blender's: its bl_idname, properties and inputs by name."""

    kind: str
    properties: Mapping[str, str]
    inputs: Mapping[str, OriginalInput]

    def keep(self, node: bpy.types.Node) -> None:
        """Write this to the `node` that has taken the original's place."""
        node[CONVERTED_FROM] = json.dumps(asdict(self))


def original_of(node: bpy.types.Node) -> Original | None:
    """Return what `node` was made of, None where it was not converted."""
    text = node.get(CONVERTED_FROM)
    if text is None:
        return None
    data = json.loads(text)
    inputs = {
        name: OriginalInput(_plain(given["value"]), given["socket"], _plain(given["made"]), _plain(given["factor"]))
        for name, given in data["inputs"].items()
    }
    return Original(data["kind"], data["properties"], inputs)


def _plain[T](value: T) -> T | tuple[float, ...]:
    """Return a value as it was before JSON, which has no tuples."""
    return tuple(value) if isinstance(value, list) else value


def value_of(socket: bpy.types.NodeSocket) -> Setting | None:
    """Return the value of a socket as plain numbers, None where it has none to set: Shader sockets, Normal and the like."""
    if socket.hide_value or not hasattr(socket, "default_value"):
        return None
    value = socket.default_value
    return value if isinstance(value, (str, int, float)) else tuple(value)
