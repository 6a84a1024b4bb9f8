# SPDX-License-Identifier: GPL-3.0-or-later
"""The suns that an expression shows of its skies, apart from the rest. No bpy."""

import math
from dataclasses import replace

from .expression import Constant, Coordinate, Expression, ImageTexture, SkyTexture, as_kind, evaluate, rewritten, triple, walk
from .operations import Triple, Value
from .points import Unknown
from .sky import Sun

DIRECTION = Coordinate("position")
"""What stands for the direction in the radiance of a world."""
ROUNDING = 1e-9  # of the sums that a sun's radiance, of a million, is the difference of
BLACK, WHITE = Constant((0.0, 0.0, 0.0)), Constant((1.0, 1.0, 1.0))


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
            shown, other = (_shown(sun, radiance, texture, images) for images in (BLACK, WHITE))
        except LookupError:
            continue
        if math.dist(shown, other) > ROUNDING * math.hypot(*shown, *other):
            continue
        red, green, blue = (max(value, 0.0) for value in shown)
        if red or green or blue:
            suns.append(replace(sun, radiance=(red, green, blue)))
        sunless = replace(texture, sky=replace(texture.sky, disc=None))
        radiance = rewritten(radiance, lambda one, texture=texture, sunless=sunless: sunless if one == texture else None)
    return radiance, suns


def _shown(sun: Sun, radiance: Expression, texture: SkyTexture, images: Constant) -> Triple:
    """Return by how much a radiance is more with the sun of a sky than with that black, other skies being black, too."""

    def at_sun(color: Constant) -> Triple:
        def change(one: Expression) -> Expression | None:
            match one:
                case SkyTexture():
                    return color if one == texture else BLACK
                case ImageTexture():
                    return as_kind(images, one.kind)
            return None

        return triple(evaluate(rewritten(radiance, change), _Direction(sun.direction)))

    red, green, blue = (a - b for a, b in zip(at_sun(Constant(sun.radiance)), at_sun(BLACK), strict=True))
    return red, green, blue


def is_sky_alone(radiance: Expression) -> bool:
    """Return whether a world's radiance varies as skies without a sun alone, in which nothing is as small and bright as a sun."""
    rest = rewritten(radiance, lambda one: BLACK if isinstance(one, SkyTexture) and one.sky.sun() is None else None)
    return isinstance(rest, Constant)
