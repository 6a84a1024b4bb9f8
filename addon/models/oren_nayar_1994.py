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

from .geometry import azimuth, clamp, geometry
from .oren_nayar import OrenNayar
from .vector import Vector


@dataclass(frozen=True)
class OrenNayar1994(OrenNayar):
    """`sigma` in radians; below 0 and NaN count as 0, infinity is the limit; 0 is Lambert. Reciprocal.

    Gains energy at grazing view for small sigma: 3.6 % at N.V = 0.05 for sigma = 0.3. For sigma above about 0.66 the paper's fit
    falls below zero where light and viewer skim the surface from opposite sides; there it is cut off at 0.
    """

    interreflection: float = field(init=False)

    def __post_init__(self) -> None:
        """Clamp sigma and fold what depends on it alone."""
        super().__post_init__()
        variance = self.sigma * self.sigma
        object.__setattr__(self, "interreflection", 0.17 / (1.0 + 0.13 / variance) if variance > 0.0 else 0.0)

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        if g is None:
            return 0.0
        rho = clamp(albedo, 0.0, 1.0)
        sin_i, sin_o, cos_half, sin_half = azimuth(g)
        cos_phi = (cos_half - sin_half) * (cos_half + sin_half)
        alpha, beta = math.acos(min(g.mu_i, g.mu_o)), math.acos(max(g.mu_i, g.mu_o))
        sin_alpha, sin_beta = max(sin_i, sin_o), min(sin_i, sin_o)
        forward = 0.0 if cos_phi >= 0.0 else (2.0 * beta / math.pi) ** 3
        c2 = self.b * (sin_alpha - forward)
        c3 = self.b / 3.6 * (4.0 * alpha * beta / math.pi**2) ** 2  # 0.125 = 0.45 / 3.6
        # cos(theta_i) times the tangents as quotients that stay finite when both angles near 90 degrees
        tan_beta = sin_beta * (g.mu_i / max(g.mu_i, g.mu_o))
        tan_half = (sin_alpha + sin_beta) * (g.mu_i / (g.mu_i + g.mu_o))
        once = self.a * g.mu_i + c2 * cos_phi * tan_beta + c3 * (1.0 - abs(cos_phi)) * tan_half
        twice = self.interreflection * g.mu_i * (1.0 - cos_phi * (2.0 * beta / math.pi) ** 2)
        return rho / math.pi * max(0.0, once + rho * twice)
