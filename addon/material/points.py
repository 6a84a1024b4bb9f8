# SPDX-License-Identifier: GPL-3.0-or-later
"""A shaded point at which nothing is known, for trying what expressions make of what is."""

from collections.abc import Callable

from .expression import Attribute, Bump, Coordinate, ImageTexture, NormalMap, Point
from .operations import Triple, Value


class Unknown(Point):
    """A point that lacks everything; its methods raise LookupError."""

    def uv(self, name: str) -> Triple:
        raise LookupError(name)

    def attribute(self, attribute: Attribute) -> Value:
        raise LookupError(attribute.name)

    def coordinate(self, coordinate: Coordinate) -> Value:
        raise LookupError(coordinate.name)

    def image(self, texture: ImageTexture, coordinates: Triple) -> Value:
        raise LookupError(texture.image.name)

    def normal_map(self, normal_map: NormalMap, color: Triple, strength: float) -> Triple:
        raise LookupError("normal map")

    def bump(self, bump: Bump, height: Callable[[Point], float], strength: float, distance: float, normal: Triple | None) -> Triple:
        raise LookupError("bump")
