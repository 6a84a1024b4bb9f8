# SPDX-License-Identifier: GPL-3.0-or-later
"""The suns that an expression shows of its skies, apart from the rest. No bpy."""

from dataclasses import replace

from .expression import Constant, Coordinate, Expression, SkyTexture, evaluate, rewritten, triple, walk
from .operations import Triple, Value
from .points import Unknown
from .sky import Sun

DIRECTION = Coordinate("position")
"""What stands for the direction in the radiance of a world."""


class _Direction(Unknown):
    """A point of a world, at which the direction alone is known."""

    def __init__(self, direction: Triple) -> None:
        self.direction = direction

    def coordinate(self, coordinate: Coordinate) -> Value:
        return self.direction if coordinate == DIRECTION else super().coordinate(coordinate)


def without_suns(radiance: Expression) -> tuple[Expression, list[Sun]]:
    """Return a world's `radiance` by DIRECTION without the suns of its skies, and these as it shows them.

    The latter is exact where the radiance is a multiple of the sky, plus something. A sun stays where that multiple cannot be told,
    as that of an image.
    """
    suns = []
    for texture in [one for one in walk(radiance) if isinstance(one, SkyTexture) and one.direction == DIRECTION]:
        sun = texture.sky.sun()
        if sun is None:
            continue
        try:
            lit, unlit = (_radiance_at(sun.direction, radiance, texture, color) for color in (sun.radiance, (0.0, 0.0, 0.0)))
        except LookupError:
            continue
        red, green, blue = (max(a - b, 0.0) for a, b in zip(lit, unlit, strict=True))
        if red or green or blue:
            suns.append(replace(sun, radiance=(red, green, blue)))
        radiance = _replaced(radiance, texture, replace(texture, sky=replace(texture.sky, disc=None)))
    return radiance, suns


def _replaced(radiance: Expression, texture: SkyTexture, other: Expression) -> Expression:
    return rewritten(radiance, lambda one: other if one == texture else None)


def _radiance_at(direction: Triple, radiance: Expression, texture: SkyTexture, color: Triple) -> Triple:
    """Return a radiance in which one sky has a `color` and all others are black."""
    rest = _replaced(radiance, texture, Constant(color))
    shown = rewritten(rest, lambda one: Constant((0.0, 0.0, 0.0)) if isinstance(one, SkyTexture) else None)
    return triple(evaluate(shown, _Direction(direction)))
