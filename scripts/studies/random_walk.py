# SPDX-License-Identifier: GPL-3.0-or-later
"""A random walk in a half-space that scatters isotropically: slow, noisy, and without any assumption of diffusion theory.

The referee where formulas disagree. Lengths are in mean free paths 1 / sigma_t.
"""

import math
import random
from collections.abc import Iterator
from typing import NamedTuple

from true_diffuse.addon.models.fresnel import boundary
from true_diffuse.addon.models.geometry import clamp

WHITEST = 0.9999  # a walk that loses less takes too long


class Exit(NamedTuple):
    """Where a fraction `weight` of a walk leaves: `x`, `y` from where it entered [mean free paths], after `order` scatterings."""

    weight: float
    x: float
    y: float
    order: int


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
