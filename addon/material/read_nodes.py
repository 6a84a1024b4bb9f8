# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what feeds an input of Blender's nodes into an expression, through groups, reroutes and muted nodes."""

import struct
from collections.abc import Sequence

import bpy

from .expression import Constant, Expression, as_kind
from .links import Place, source
from .operations import Value

NUMBERS = {"VALUE", "INT", "BOOLEAN"}


class UnsupportedInput(Exception):
    """A node that expressions do not have; `node` is its label, `what` describes it."""

    def __init__(self, node: str, what: str) -> None:
        super().__init__(f"{what} ({node})")
        self.node, self.what = node, what


class NodeReader:
    """Reads expressions, and collects the `images` that they name, by full name."""

    def __init__(self) -> None:
        self.images: dict[str, bpy.types.Image] = {}

    def expression(self, place: Place) -> Expression:
        """Return what feeds an input, of the input's kind, or its own value. Raises UnsupportedInput."""
        origin = source(place)
        kind = "number" if place.socket.type in NUMBERS else "triple"
        if not origin.socket.is_output:
            value = as_kind(Constant(plain(origin.socket.default_value)), kind, origin.socket.type == "RGBA")
        else:
            value = as_kind(self._output(origin), kind, origin.socket.type == "RGBA")
        return value

    def own(self, place: Place) -> Constant:
        """Return the own value of an input, linked or not."""
        return Constant(plain(place.socket.default_value))

    def _output(self, output: Place) -> Expression:
        raise UnsupportedInput(output.label, f"the node {output.node.bl_label}")


def plain(value: float | Sequence[float]) -> Value:
    """Return a socket's number, or first three components, with each 32-bit float as the shortest decimal that rounds to it."""
    if isinstance(value, (int, float)):
        return shortest(value)
    red, green, blue = (shortest(component) for component in value[:3])
    return red, green, blue


def shortest(value: float) -> float:
    """Return the shortest decimal number that rounds to the 32-bit float `value`."""
    single = struct.pack("f", value)
    for digits in range(6, 9):
        short = float(f"{value:.{digits}g}")
        if struct.pack("f", short) == single:
            return short
    return float(f"{value:.9g}")
