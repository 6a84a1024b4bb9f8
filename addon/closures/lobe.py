# SPDX-License-Identifier: GPL-3.0-or-later
"""What the lobes of `lobes.py` are made of: directions and weights that move with N.V, and the engines' own shading of them."""

import math
from collections.abc import Mapping
from typing import NamedTuple, Self

from ..models.fujii import SHAPE
from ..models.quadrature import NORMAL
from ..models.vector import Vector, add, dot, normalize, scale

GRAZING = 0.05  # the least mu that steep directions follow
SINGLE, PAIR, SIGNED, CYCLES = "single", "pair", "signed", "cycles"


class Weight(NamedTuple):
    """c(mu) = constant + sin(v) (s_0 + s_1 mu + s_2 mu^2)."""

    constant: float
    s_0: float
    s_1: float
    s_2: float

    def at(self, mu: float) -> float:
        return self.constant + math.sqrt(1.0 - mu * mu) * (self.s_0 + mu * (self.s_1 + mu * self.s_2))


class Lobe(NamedTuple):
    """max(0, d.L) around d = along V_t +- side (N x V_t) + (up_0 + up_1 mu + steep / max(mu, GRAZING)) N.

    With a side, half of it to each.
    """

    along: float
    side: float
    up_0: float
    up_1: float
    steep: float

    def up(self, mu: float) -> float:
        return self.up_0 + self.up_1 * mu + self.steep / max(mu, GRAZING)

    def value(self, x: float, y: float, z: float, mu: float) -> float:
        """Return the lobe for light from (x, y, z)."""
        middle, side = self.along * x + self.up(mu) * z, self.side * y
        return 0.5 * (max(0.0, middle + side) + max(0.0, middle - side))

    @property
    def under(self) -> Self:
        """The lobe around -N or N that is as far up as this one: `along` and `side` left out."""
        return self._replace(along=0.0, side=0.0)

    def length(self, mu: float) -> float:
        """Return the length of d: what a uniform world of radiance 1 gives the lobe in EEVEE, over pi."""
        return math.hypot(self.along, self.side, self.up(mu))


class Fit(NamedTuple):
    """The lobes of a set for one function or two, and for each function the weight of every lobe.

    Of SIGNED the lobes are the creases, and the weights those of the lobe around N and, for each crease, the two of `capped`.
    """

    lobes: tuple[Lobe, ...]
    weights: Mapping[str, tuple[Weight, ...]]


CYCLES_AWAY = math.radians(85.6)  # never 90 degrees: there Cycles' test of the light's side falls either way by chance

# Where N is not the mesh's normal, for what `mapped_share` takes from the lobe away from the viewer: the part of its weight that
# the base around N gets, and the part, times mu, of its own weight that Fujii's function loses. Both by scripts/fit/lobes.py; with
# a MAPPED_FADE of 20 or 60 the error is much the same.
MAPPED_FADE = 40.0
MAPPED_BASE, MAPPED_FUJII = 0.2569, 0.4144


def eevee_horizon(n_dot_l: float) -> float:
    """Return the factor by which EEVEE fades all closures of a pixel near the horizon of its first one; N.L may be negative."""
    return min(1.0, max(0.0, 10.0 * n_dot_l + 1.0))


def cycles_bump_shadowing(n_dot_l: float, n_dot_m: float, m_dot_l: float) -> float:
    """Return the factor by which Cycles shadows a diffuse closure with the bent normal M, for unit vectors; in [0, 1]."""
    if n_dot_l <= 0.0 or n_dot_m <= 0.0 or m_dot_l <= 0.0:
        return 0.0
    alpha2 = min(1.0, 0.125 * (1.0 / (n_dot_m * n_dot_m) - 1.0))
    tangent2 = 1.0 / (n_dot_l * n_dot_l) - 1.0
    return 2.0 / (1.0 + math.sqrt(1.0 + max(0.0, alpha2 * tangent2)))


def mapped_share(n_dot_mesh: float) -> float:
    """Return the share of its weight that the lobe away from the viewer keeps where N is mapped: 1 where it is the mesh's normal.

    Cycles shadows the lobe by the mesh's normal and cuts it off there, so it no longer corrects what Fujii's function lacks.
    """
    return 1.0 / (1.0 + MAPPED_FADE * (1.0 - n_dot_mesh))


def away(mesh: Vector, up: float) -> Vector:
    """Return the unit vector of -V_t, lifted where that is below a surface of the normal `mesh` to `up` over it, a slope."""
    return normalize(add(scale(mesh, max(0.0, mesh[0]) + up), (-1.0, 0.0, 0.0)))


def cycles_lobe(m: Vector, l: Vector, mesh: Vector) -> float:
    """Return max(0, m.l) as Cycles shades it on a surface of the normal `mesh`; all unit vectors."""
    return max(0.0, dot(m, l)) * (1.0 if m == mesh else cycles_bump_shadowing(dot(mesh, l), dot(mesh, m), dot(m, l)))


def lobe_values(lobe_set: str, lobes: tuple[Lobe, ...], l: Vector, mu: float, mesh: Vector = NORMAL) -> tuple[float, ...]:
    """Return what each lobe of a set gives for light from `l`, above the surface; of SIGNED the one around N, and +-`capped`.

    `l` and, for the lobes of CYCLES, the normal `mesh` of the surface are in the frame (V_t, N x V_t, N).
    """
    if lobe_set == SINGLE:
        return (l[2], l[0])
    if lobe_set == CYCLES:
        shadow = cycles_lobe(NORMAL, l, mesh) / l[2]
        return (l[2] * shadow, SHAPE.value(l, mu) * shadow, cycles_lobe(away(mesh, 1.0 / math.tan(CYCLES_AWAY)), l, mesh))
    if lobe_set == SIGNED:
        return (l[2], *(crease.along * capped(crease, l, mu, 1.0, 0.0) for crease in lobes))
    return tuple(lobe.value(*l, mu) for lobe in lobes)


def capped(crease: Lobe, l: Vector, mu: float, weight: float, under: float) -> float:
    """Return `weight` max(0, +-x) without what of it is beyond the crease, for light from `l`, which may be below the surface.

    The lobe around the crease looks far below the surface: `under` is the weight of one around -N, which takes from it what light
    from there gives, and which no light from above reaches. So a uniform world is reflected as it should be. Both maxima keep a
    light that is partly below from leaving anything but what its visible part does.
    """
    beyond = max(0.0, weight * crease.value(*l, mu) - under * crease.under.value(*l, mu))
    return max(0.0, weight * max(0.0, crease.along * l[0]) - beyond)


def capped_albedo(crease: Lobe, mu: float, weight: float, under: float) -> float:
    """Return what `capped` reflects of a uniform world in EEVEE, which cuts nothing of a world off at the horizon."""
    beyond = max(0.0, weight * crease.length(mu) - under * crease.under.length(mu))
    return max(0.0, weight - beyond)
