# SPDX-License-Identifier: GPL-3.0-or-later
"""A random walk in a half-space that scatters isotropically: slow, noisy, and without any assumption of diffusion theory.

The referee where formulas disagree. Lengths are in mean free paths 1 / sigma_t.
"""

import math
import random
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from true_diffuse.addon.models.fresnel import boundary
from true_diffuse.addon.models.geometry import clamp

WHITEST = 0.9999  # a walk that loses less takes too long


class Exit(NamedTuple):
    """Where a share `weight` of a walk leaves: `x`, `y` from where it entered [mean free paths], after `order` scatterings."""

    weight: float
    x: float
    y: float
    order: int


class Walk(NamedTuple):
    """Shares of the light that falls on the surface; what the surface itself mirrors counts as lost."""

    reflectance: float
    error: float
    """Standard error of `reflectance`."""
    single: float
    """The part of `reflectance` that was scattered exactly once."""
    rings: tuple[float, ...]
    """The part that left within radii[0] of where it entered, between radii[0] and radii[1], ..., beyond the last."""


def exits(albedo: float, eta: float = 1.0, mu_i: float | None = None, paths: int = 20_000, seed: int = 1) -> Iterator[list[Exit]]:
    """Yield, for each of `paths` random walks of weight 1, where it leaves; light that meets the boundary from inside is split.

    `albedo` alpha of a single scattering is clamped to [0, 0.9999], the boundary's index `eta` to [1, 4], NaN to the lower end.
    `mu_i` in (0, 1] is the cosine of the incoming beam, None for light from everywhere. What weighs less than 0.1 is ended by
    Russian roulette, without bias.
    """
    albedo, edge, roll = clamp(albedo, 0.0, WHITEST), boundary(eta), random.Random(seed).random
    for _ in range(paths):
        mu = mu_i or math.sqrt(1.0 - roll())
        weight, dz, dy, order = edge.transmittance(mu), edge.refracted(mu), 0.0, 0
        dx = math.sqrt(max(0.0, 1.0 - dz * dz))
        x = y = z = 0.0
        found = []
        while weight > 0.0:
            step = -math.log(1.0 - roll())
            if z + dz * step < 0.0:
                reach = -z / dz
                x, y, z, step = x + dx * reach, y + dy * reach, 0.0, step - reach
                leaving = weight * edge.transmittance_from_inside(-dz)
                weight, dz = weight - leaving, -dz
                found.append(Exit(leaving, x, y, order))
            x, y, z = x + dx * step, y + dy * step, z + dz * step
            weight, order = weight * albedo, order + 1
            if weight < 0.1:
                weight = 2.0 * weight if roll() < 0.5 else 0.0
            dz, turn = 2.0 * roll() - 1.0, 2.0 * math.pi * roll()
            sine = math.sqrt(1.0 - dz * dz)
            dx, dy = sine * math.cos(turn), sine * math.sin(turn)
        yield found


def walk(
    albedo: float, eta: float = 1.0, mu_i: float | None = None, radii: Sequence[float] = (), paths: int = 20_000, seed: int = 1
) -> Walk:
    """Return what `paths` random walks find; arguments as for `exits`. `radii` rise [mean free paths]."""
    total = squares = single = 0.0
    rings = [0.0] * (len(radii) + 1)
    for found in exits(albedo, eta, mu_i, paths, seed):
        left = sum(one.weight for one in found)
        single += sum(one.weight for one in found if one.order == 1)
        for one in found:
            rings[bisect_right(radii, math.hypot(one.x, one.y))] += one.weight
        total += left
        squares += left * left
    mean = total / paths
    error = math.sqrt(max(0.0, squares / paths - mean * mean) / paths)
    return Walk(mean, error, single / paths, tuple(share / paths for share in rings))
