# SPDX-License-Identifier: GPL-3.0-or-later
"""The full Oren-Nayar model, of which equation (1) is the short form: all three terms, and the interreflection between facets.

M. Oren and S. Nayar, "Generalization of Lambert's Reflectance Model" (SIGGRAPH 1994), equations (27) to (29). With alpha and beta
the larger and smaller of the angles theta_i, theta_r from N, phi the azimuth between light and viewer and s2 = sigma^2:

    L_1 = (rho / pi) E0 cos(theta_i) [ C1 + C2 cos(phi) tan(beta) + C3 (1 - |cos(phi)|) tan((alpha + beta) / 2) ]
    L_2 = 0.17 (rho^2 / pi) E0 cos(theta_i) s2 / (s2 + 0.13) [ 1 - cos(phi) (2 beta / pi)^2 ]
    C1 = 1 - 0.5 s2 / (s2 + 0.33),   C3 = 0.125 s2 / (s2 + 0.09) (4 alpha beta / pi^2)^2
    C2 = 0.45 s2 / (s2 + 0.09) sin(alpha) where cos(phi) >= 0, else with sin(alpha) - (2 beta / pi)^3
"""

import math
from dataclasses import dataclass, field

from .oren_nayar import OrenNayar
from .vector import Vector, dot


@dataclass(frozen=True)
class OrenNayar1994(OrenNayar):
    """`sigma` in radians, >= 0; 0 is Lambert. Reciprocal. Gains energy at grazing view for small sigma: 3.6 % at N.V = 0.05."""

    interreflection: float = field(init=False)

    def __post_init__(self) -> None:
        """Fold what depends on sigma alone; raises ValueError for a sigma out of range."""
        super().__post_init__()
        variance = self.sigma * self.sigma
        object.__setattr__(self, "interreflection", 0.17 / (1.0 + 0.13 / variance) if variance > 0.0 else 0.0)

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho in [0, 1]."""
        mu_i, mu_o = min(1.0, dot(n, l)), min(1.0, dot(n, v))
        if mu_i <= 0.0 or mu_o <= 0.0:
            return 0.0
        sin_i, sin_o = math.sqrt(1.0 - mu_i * mu_i), math.sqrt(1.0 - mu_o * mu_o)
        # cos(phi) is undefined where either vector is N; there all it multiplies is 0 but the C3 term, and alpha beta is 0 too.
        both = sin_i * sin_o
        cos_phi = max(-1.0, min(1.0, (dot(l, v) - mu_i * mu_o) / both)) if both > 0.0 else 0.0
        alpha, beta = math.acos(min(mu_i, mu_o)), math.acos(max(mu_i, mu_o))
        sin_alpha, sin_beta = max(sin_i, sin_o), min(sin_i, sin_o)
        forward = 0.0 if cos_phi >= 0.0 else (2.0 * beta / math.pi) ** 3
        c2 = self.b * (sin_alpha - forward)
        c3 = self.b / 3.6 * (4.0 * alpha * beta / math.pi**2) ** 2  # 0.125 = 0.45 / 3.6
        # tan((alpha + beta) / 2) as a quotient that stays finite, times cos(theta_i), when both angles near 90 degrees
        tan_half = (sin_alpha + sin_beta) / (mu_i + mu_o)
        once = self.a + c2 * cos_phi * sin_beta / max(mu_i, mu_o) + c3 * (1.0 - abs(cos_phi)) * tan_half
        twice = self.interreflection * (1.0 - cos_phi * (2.0 * beta / math.pi) ** 2)
        return albedo / math.pi * mu_i * (once + albedo * twice)
