# SPDX-License-Identifier: GPL-3.0-or-later
"""A random walk in a half-space that scatters isotropically: slow, noisy, and without any assumption of diffusion theory.

The referee where formulas disagree. Lengths are in mean free paths 1 / sigma_t.
"""

import math
import random
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from .fresnel import boundary
from .geometry import clamp

WHITEST = 0.9999  # a walk that loses less takes too long


class Walk(NamedTuple):
    """Shares of the light that falls on the surface; what the surface itself mirrors counts as lost."""

    reflectance: float
    error: float
    """Standard error of `reflectance`."""
    single: float
    """The part of `reflectance` that was scattered exactly once."""
    rings: tuple[float, ...]
    """The part that left within radii[0] of where it entered, between radii[0] and radii[1], ..., beyond the last."""


def walk(
    albedo: float, eta: float = 1.0, mu_i: float | None = None, radii: Sequence[float] = (), paths: int = 20_000, seed: int = 1
) -> Walk:
    """Return what `paths` random walks find.

    `albedo` alpha of a single scattering is clamped to [0, 0.9999], the boundary's index `eta` to [1, 4], NaN to the lower end.
    `mu_i` in (0, 1] is the cosine of the incoming beam, None for light from everywhere. `radii` rise [mean free paths]. Light that
    meets the boundary from inside is split; what weighs less than 0.1 is ended by Russian roulette, without bias.
    """
    albedo, edge, roll = clamp(albedo, 0.0, WHITEST), boundary(eta), random.Random(seed).random
    total = squares = single = 0.0
    rings = [0.0] * (len(radii) + 1)
    for _ in range(paths):
        mu = mu_i or math.sqrt(1.0 - roll())
        weight, left = edge.transmittance(mu), 0.0
        dz, dy, order = edge.refracted(mu), 0.0, 0
        dx = math.sqrt(max(0.0, 1.0 - dz * dz))
        x = y = z = 0.0
        while weight > 0.0:
            step = -math.log(1.0 - roll())
            if z + dz * step < 0.0:
                reach = -z / dz
                x, y, z, step = x + dx * reach, y + dy * reach, 0.0, step - reach
                leaving = weight * edge.transmittance_from_inside(-dz)
                weight, left, dz = weight - leaving, left + leaving, -dz
                single += leaving if order == 1 else 0.0
                rings[bisect_right(radii, math.hypot(x, y))] += leaving
            x, y, z = x + dx * step, y + dy * step, z + dz * step
            weight, order = weight * albedo, order + 1
            if weight < 0.1:
                weight = 2.0 * weight if roll() < 0.5 else 0.0
            dz, turn = 2.0 * roll() - 1.0, 2.0 * math.pi * roll()
            sine = math.sqrt(1.0 - dz * dz)
            dx, dy = sine * math.cos(turn), sine * math.sin(turn)
        total += left
        squares += left * left
    mean = total / paths
    error = math.sqrt(max(0.0, squares / paths - mean * mean) / paths)
    return Walk(mean, error, single / paths, tuple(share / paths for share in rings))
