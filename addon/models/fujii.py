# SPDX-License-Identifier: GPL-3.0-or-later
"""Y. Fujii's improvement of the qualitative Oren-Nayar model, single scattering only: what Cycles' Diffuse BSDF starts from.

    L_r = (rho / pi) E0 (N.L) A (1 + r s / t),   s = L.V - (N.L)(N.V),   t = max(N.L, N.V) where s > 0, else 1
    A = 1 / (1 + (1/2 - 2/(3 pi)) r)

Y. Fujii, "A tiny improvement of Oren-Nayar reflectance model" (2015). The name of the constants is that of J. Portsmouth, P. Kutz
and S. Hill, "EON: A practical energy-preserving rough diffuse BRDF" (JCGT 14(1), 2025).
"""

import math
from dataclasses import dataclass

from .geometry import Geometry, clamp, geometry
from .vector import Vector

K1 = 0.5 - 2.0 / (3.0 * math.pi)


@dataclass(frozen=True)
class Fujii:
    """`roughness` r is clamped to [0, 1], NaN to 0; 0 is Lambert. Darkens as r grows, as nothing is reflected twice."""

    roughness: float

    def __post_init__(self) -> None:
        """Clamp the roughness."""
        object.__setattr__(self, "roughness", clamp(self.roughness, 0.0, 1.0))

    def single(self, g: Geometry, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2 and an `albedo` rho in [0, 1]."""
        s = g.l_dot_v - g.mu_i * g.mu_o
        # (N.L) / t at once, as s / t overflows near the horizon
        over_t = g.mu_i / max(g.mu_i, g.mu_o) if s > 0.0 else g.mu_i
        # rounding may leave s a little below -1
        return albedo / math.pi * max(0.0, g.mu_i + self.roughness * s * over_t) / (1.0 + K1 * self.roughness)

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        return self.single(g, clamp(albedo, 0.0, 1.0)) if g else 0.0
