# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional and average albedo of any model by Gauss-Legendre quadrature over the hemisphere."""

import functools
import math
from collections.abc import Callable, Iterable
from itertools import pairwise

from .protocol import Model
from .vector import Vector, from_polar

NORMAL: Vector = (0.0, 0.0, 1.0)


@functools.cache
def gauss_legendre(order: int) -> tuple[tuple[float, float], ...]:
    """Return the (node, weight) pairs of the rule of `order` points on [-1, 1], nodes by Newton's method."""
    pairs = []
    for i in range(order):
        x = math.cos(math.pi * (i + 0.75) / (order + 0.5))
        for _ in range(8):  # doubles its digits each time: 4 suffice from this start
            p0, p1 = 1.0, x
            for k in range(2, order + 1):
                p0, p1 = p1, ((2 * k - 1) * x * p1 - (k - 1) * p0) / k
            slope = order * (x * p1 - p0) / (x * x - 1.0)
            x -= p1 / slope
        pairs.append((x, 2.0 / ((1.0 - x * x) * slope * slope)))
    return tuple(pairs)


def integrate(f: Callable[[float], float], breaks: Iterable[float], order: int) -> float:
    """Return the integral of `f` from the first to the last of the rising `breaks`, `order` points in each interval."""
    total = 0.0
    for low, high in pairwise(breaks):
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        total += half * sum(weight * f(middle + half * x) for x, weight in gauss_legendre(order))
    return total


def directional_albedo(model: Model, mu_o: float, albedo: float = 1.0, order: int = 32) -> float:
    """Return E(mu_o), the fraction of light reflected: the hemispherical integral of f_r (N.L) over L, for a view at N.V = mu_o.

    By reciprocity also the fraction of a beam from mu_o that is reflected anywhere. `mu_o` in (0, 1], else ValueError. The interval
    is split where equation (1) has its creases (N.L = N.V and s = 0), so `order` = 32 gives about 1e-9 for the diffuse models.
    """
    if not 0.0 < mu_o <= 1.0:
        raise ValueError(f"mu_o must be in (0, 1], not {mu_o}")
    v = from_polar(mu_o, 0.0)

    def over_azimuth(elevation: float) -> float:
        mu_i = math.cos(elevation)
        half_circle = integrate(
            lambda azimuth: model.radiance(NORMAL, from_polar(mu_i, azimuth), v, albedo), (0.0, math.pi / 2, math.pi), order
        )
        return 2.0 * half_circle * math.sin(elevation)

    return integrate(over_azimuth, (0.0, math.acos(mu_o), math.pi / 2), order)


def average_albedo(model: Model, albedo: float = 1.0, order: int = 32) -> float:
    """Return <E>, the share reflected under uniform light from everywhere: 2 times the integral of E(mu) mu over mu in [0, 1]."""

    def weighted(elevation: float) -> float:
        mu = math.cos(elevation)
        return 2.0 * directional_albedo(model, mu, albedo, order) * mu * math.sin(elevation)

    return integrate(weighted, (0.0, math.pi / 2), order)
