# SPDX-License-Identifier: GPL-3.0-or-later
"""What every model begins with: parameters inside their range, and the angles between normal, light and viewer."""

import math
from typing import NamedTuple

from .vector import Vector, add, dot, normalize, scale


def clamp(value: float, low: float, high: float) -> float:
    """Return `value` inside [low, high]; NaN counts as `low`."""
    return min(value, high) if value > low else low


class Geometry(NamedTuple):
    """The three directions at unit length and the cosines between them, for light and viewer above the surface."""

    n: Vector
    l: Vector
    v: Vector
    mu_i: float
    """N.L in (0, 1]."""
    mu_o: float
    """N.V in (0, 1]."""
    l_dot_v: float
    """L.V in [-1, 1]."""


def geometry(n: Vector, l: Vector, v: Vector) -> Geometry | None:
    """Return the geometry of vectors of any length; None where light or viewer is not above the surface.

    A vector without a direction (no length, NaN, infinity) is above no surface.
    """
    n, l, v = normalize(n), normalize(l), normalize(v)
    mu_i, mu_o = dot(n, l), dot(n, v)
    if mu_i <= 0.0 or mu_o <= 0.0:
        return None
    return Geometry(n, l, v, min(1.0, mu_i), min(1.0, mu_o), clamp(dot(l, v), -1.0, 1.0))


class Azimuth(NamedTuple):
    """The sines of theta_i and theta_r, and cosine and sine of half the azimuth phi between light and viewer, all in [0, 1]."""

    sin_i: float
    sin_o: float
    cos_half: float
    sin_half: float


def azimuth(g: Geometry) -> Azimuth:
    """Return the azimuth between light and viewer, with all digits near phi = 0 and near phi = pi.

    Where L or V is N there is none; phi counts as 0 then.
    """
    side_i, side_o = add(g.l, scale(g.n, -g.mu_i)), add(g.v, scale(g.n, -g.mu_o))
    sin_i, sin_o = min(1.0, math.hypot(*side_i)), min(1.0, math.hypot(*side_o))
    if sin_i == 0.0 or sin_o == 0.0:
        return Azimuth(sin_i, sin_o, 1.0, 0.0)
    side_i, side_o = normalize(side_i), normalize(side_o)
    cos_half, sin_half = 0.5 * math.hypot(*add(side_i, side_o)), 0.5 * math.hypot(*add(side_i, scale(side_o, -1.0)))
    return Azimuth(sin_i, sin_o, min(1.0, cos_half), min(1.0, sin_half))
