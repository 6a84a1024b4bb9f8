# SPDX-License-Identifier: GPL-3.0-or-later
"""Y. Fujii's improvement of the qualitative Oren-Nayar model, single scattering only: what Cycles' Diffuse BSDF starts from.

    L_r = (rho / pi) E0 (N.L) A (1 + r s / t),   s = L.V - (N.L)(N.V),   t = max(N.L, N.V) where s > 0, else 1
    A = 1 / (1 + (1/2 - 2/(3 pi)) r)

Y. Fujii, "A tiny improvement of Oren-Nayar reflectance model" (2015). The name of the constants is that of J. Portsmouth, P. Kutz
and S. Hill, "EON: A practical energy-preserving rough diffuse BRDF" (JCGT 14(1), 2025).
"""

import math
from dataclasses import dataclass

from .vector import Vector, dot

K1 = 0.5 - 2.0 / (3.0 * math.pi)


@dataclass(frozen=True)
class Fujii:
    """`roughness` r in [0, 1]; 0 is Lambert. Darkens as r grows, as nothing is reflected twice."""

    roughness: float

    def __post_init__(self) -> None:
        """Refuse a roughness outside [0, 1] with ValueError."""
        if not 0.0 <= self.roughness <= 1.0:
            raise ValueError(f"roughness must be in [0, 1], not {self.roughness}")

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho in [0, 1]."""
        mu_i, mu_o = dot(n, l), dot(n, v)
        if mu_i <= 0.0 or mu_o <= 0.0:
            return 0.0
        s = dot(l, v) - mu_i * mu_o
        t = max(mu_i, mu_o) if s > 0.0 else 1.0
        return albedo / math.pi * mu_i * (1.0 + self.roughness * s / t) / (1.0 + K1 * self.roughness)
