# SPDX-License-Identifier: GPL-3.0-or-later
"""Normalized diffusion: two exponentials that fit what random walks give.

P. Christensen and B. Burley, "Approximate Reflectance Profiles for Efficient Subsurface Scattering" (Pixar 2015), equation (3):

    R(r) = (e^(-r / d) + e^(-r / (3 d))) / (8 pi d r),   d = l / s

R [mm^-2] integrates to 1 over the plane; multiply by the surface's albedo A. The length l and its s(A) come in three kinds,
equations (5), (6) and (8): for the same number in mm the third is up to 8 times narrower than the others. With l and light of its
own kind the fraction within r is that of index-matched random walks to 0.03, at single-scattering albedos from 0.5 to 0.99.
"""

import math
from dataclasses import dataclass

from .geometry import clamp
from .medium import LONGEST, SHORTEST

EDGE_WIDTH_25_75 = 1.633035806  # in d: between these fractions of the light across the edge of a lit half-plane
DIFFUSE_MAP = (1.9, 3.5, 0.8)  # s(A) = 1.9 - A + 3.5 (A - 0.8)^2
STEP = 0.125


def searchlight_mfp(albedo: float) -> float:
    """Return s for l = mean free path and a beam along the normal, equation (5); `albedo` A is clamped to [0, 1]."""
    a = clamp(albedo, 0.0, 1.0)
    return 1.85 - a + 7.0 * abs(a - 0.8) ** 3


def diffuse_mfp(albedo: float) -> float:
    """Return s for l = mean free path and light from everywhere, equation (6); `albedo` A is clamped to [0, 1]. EEVEE's."""
    a = clamp(albedo, 0.0, 1.0)
    return DIFFUSE_MAP[0] - a + DIFFUSE_MAP[1] * (a - DIFFUSE_MAP[2]) ** 2


@dataclass(frozen=True)
class Burley:
    """The normalized profile of the distance `d` [mm], clamped to [1e-6, 1e6], NaN to 1e-6."""

    d: float

    def __post_init__(self) -> None:
        """Clamp d."""
        object.__setattr__(self, "d", clamp(self.d, SHORTEST, LONGEST))

    def profile(self, r: float) -> float:
        """Return R(r) [mm^-2]. It grows as 1 / r without end: `r` [mm] below 1e-9 d, and NaN, count as that."""
        r = clamp(r, 1e-9 * self.d, math.inf)
        return self.ring(r) / (2.0 * math.pi * r)

    def ring(self, r: float) -> float:
        """Return 2 pi r R(r) [mm^-1], finite at r = 0; `r` [mm] below 0 and NaN count as 0."""
        x = clamp(r, 0.0, math.inf) / self.d
        return 0.25 * (math.exp(-x) + math.exp(-x / 3.0)) / self.d

    def cdf(self, r: float) -> float:
        """Return the fraction that comes out nearer than `r` [mm], 1 - e^(-x) / 4 - (3/4) e^(-x/3) with x = r / d."""
        x = clamp(r, 0.0, math.inf) / self.d
        return -0.25 * math.expm1(-x) - 0.75 * math.expm1(-x / 3.0)

    def radius(self, share: float) -> float:
        """Return the r [mm] at which `cdf` is `share`, clamped to [0, 1 - 1e-15]; exact.

        y = e^(-x/3) solves y^3 + 3 y = 4 (1 - share), so y = 2 sinh(asinh(2 (1 - share)) / 3); a step of Newton's method on 1 - y
        mends the digits lost where `share` is small.
        """
        u = clamp(share, 0.0, 1.0 - 1e-15)
        gap = 1.0 - 2.0 * math.sinh(math.asinh(2.0 * (1.0 - u)) / 3.0)
        gap -= (gap * (6.0 + gap * (gap - 3.0)) - 4.0 * u) / (6.0 + gap * (3.0 * gap - 6.0))
        return max(0.0, -3.0 * self.d * math.log1p(-gap))

    def edge(self, x: float) -> float:
        """Return the response at `x` [mm] to a half-plane lit where x > 0: 0.5 at the edge, in [0, 1].

        1 - [Ki1(x / d) + 3 Ki1(x / (3 d))] / (4 pi) for x >= 0, with Bickley's function Ki1. NaN counts as -infinity.
        """
        if not x >= 0.0:
            return 1.0 - self.edge(-x) if x < 0.0 else 0.0
        x /= self.d
        return 1.0 - (bickley(x) + 3.0 * bickley(x / 3.0)) / (4.0 * math.pi)


def bickley(z: float) -> float:
    """Return Ki1(z), the integral of e^(-z cosh t) / cosh t over t >= 0, for z >= 0; in [0, pi/2], to about 1e-15.

    The trapezoidal rule converges exponentially here.
    """
    total = 0.5 * math.exp(-z)
    for k in range(1, 320):
        hyperbolic = math.cosh(STEP * k)
        total += math.exp(-z * hyperbolic) / hyperbolic
    return STEP * total
