# SPDX-License-Identifier: GPL-3.0-or-later
"""Recognizes coordinates that are a UV map moved, turned and scaled, as Mapping nodes and texture transforms make them."""

import math
from dataclasses import dataclass

from ..material.expression import Attribute, Bump, Coordinate, Expression, ImageTexture, NormalMap, UvMap, evaluate, triple, walk
from ..material.operations import Triple
from ..material.points import Unknown

# Where it is tried whether coordinates are affine, away from the steps of floor, sign and the like
PLACES = ((1.25, 1.5), (-2.375, 0.6875), (0.3125, 5.125), (-7.5625, -3.8125), (0.28125, 0.53125))
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Step:
    """A point of the plane scaled, turned counterclockwise by degrees, then moved, in this order; so UsdTransform2d does."""

    scale: tuple[float, float] = (1.0, 1.0)
    rotation: float = 0.0
    translation: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class _Uv(Unknown):
    """A shaded point of which only the UV maps are known."""

    u: float
    v: float

    def uv(self, name: str) -> Triple:
        return self.u, self.v, 0.0


def transformed(coordinates: Expression) -> tuple[str, list[Step]] | None:
    """Return the name of the UV map that x and y of `coordinates` are made of, and the steps to them: none, one or two.

    None where they are anything but one such map.
    """
    leaves = [one for one in walk(coordinates) if isinstance(one, (UvMap, ImageTexture, Attribute, Coordinate, NormalMap, Bump))]
    if len(leaves) != 1 or not isinstance(leaves[0], UvMap):
        return None

    def at(u: float, v: float) -> tuple[float, float]:
        x, y, _ = triple(evaluate(coordinates, _Uv(u, v)))
        return x, y

    try:
        origin, right, up = at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)
        columns = (right[0] - origin[0], right[1] - origin[1]), (up[0] - origin[0], up[1] - origin[1])
        for u, v in PLACES:
            expected = (u * columns[0][i] + v * columns[1][i] + origin[i] for i in range(2))
            if not all(math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=TOLERANCE) for a, b in zip(at(u, v), expected, strict=True)):
                return None
    except LookupError:
        return None
    return leaves[0].name, _steps(columns[0], columns[1], origin)


def _steps(first: tuple[float, float], second: tuple[float, float], origin: tuple[float, float]) -> list[Step]:
    """Return the steps to the matrix of the columns `first` and `second`, moved by `origin`.

    A scale before a turn is one step. Others need two, by the singular values of [[a, b], [c, d]], which is a turn after a scale
    after a turn.
    """
    (a, c), (b, d) = first, second
    if abs(a * b + c * d) < TOLERANCE:  # the columns are at right angles
        turn = math.atan2(c, a) if abs(a) + abs(c) > TOLERANCE else math.atan2(-b, d)
        if a < 0.0 and abs(c) < TOLERANCE:  # a mirrored or half turned map: prefer scales to turns
            turn = 0.0
        sine, cosine = math.sin(turn), math.cos(turn)
        one = Step((a * cosine + c * sine, d * cosine - b * sine), math.degrees(turn), origin)
        return [] if _is_identity(one) else [one]
    e, f, g, h = (a + d) / 2.0, (a - d) / 2.0, (c + b) / 2.0, (c - b) / 2.0
    total, difference = math.atan2(h, e), math.atan2(g, f)
    left, right = (total + difference) / 2.0, (total - difference) / 2.0
    scale = (math.hypot(e, h) + math.hypot(f, g), math.hypot(e, h) - math.hypot(f, g))
    return [Step(rotation=math.degrees(right)), Step(scale, math.degrees(left), origin)]


def _is_identity(step: Step) -> bool:
    values = (step.scale[0] - 1.0, step.scale[1] - 1.0, step.rotation, *step.translation)
    return all(abs(value) < TOLERANCE for value in values)
