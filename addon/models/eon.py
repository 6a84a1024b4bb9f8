# SPDX-License-Identifier: GPL-3.0-or-later
"""EON, the energy-preserving Oren-Nayar model of OpenPBR: Fujii's single scattering plus what is reflected more than once.

J. Portsmouth, P. Kutz, S. Hill, "EON: A Practical Energy-Preserving Rough Diffuse BRDF" (JCGT 14(1), 2025). With rho the albedo,
r the roughness, E Fujii's directional albedo at rho = 1 and <E> its average:

    L_r = L_Fujii + (rho_ms / pi) E0 (N.L) (1 - E(N.L)) (1 - E(N.V)) / (1 - <E>),   rho_ms = rho^2 <E> / (1 - rho (1 - <E>))
"""

import math
from dataclasses import dataclass, field

from .fujii import K1, Fujii
from .geometry import Geometry, clamp, geometry
from .vector import Vector

K2 = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


def fujii_directional_albedo(roughness: float, mu: float) -> float:
    """Return E(mu) = A (1 + r G(mu) / pi) of Fujii's model at rho = 1; `roughness` r in [0, 1], `mu` a cosine in [0, 1]."""
    sine = math.sqrt(max(0.0, 1.0 - mu * mu))
    # The paper's (sin / mu)(1 - sin^3) without its 0 / 0 at mu = 0: 1 - sin = mu^2 / (1 + sin).
    g = sine * (math.acos(min(1.0, mu)) - sine * mu)
    g += 2.0 / 3.0 * sine * (mu * (1.0 + sine + sine * sine) / (1.0 + sine) - 1.0)
    return (1.0 + roughness * g / math.pi) / (1.0 + K1 * roughness)


def fujii_average_albedo(roughness: float) -> float:
    """Return <E> = A (1 + K2 r) of Fujii's model at rho = 1; `roughness` r in [0, 1]."""
    return (1.0 + K2 * roughness) / (1.0 + K1 * roughness)


@dataclass(frozen=True)
class Eon:
    """`roughness` r is clamped to [0, 1], NaN to 0; 0 is Lambert. Reciprocal; at rho = 1 it reflects all light from everywhere."""

    roughness: float
    base: Fujii = field(init=False)
    average: float = field(init=False)

    def __post_init__(self) -> None:
        """Clamp the roughness and fold what depends on it alone."""
        object.__setattr__(self, "roughness", clamp(self.roughness, 0.0, 1.0))
        object.__setattr__(self, "base", Fujii(self.roughness))
        object.__setattr__(self, "average", fujii_average_albedo(self.roughness))

    def multiple(self, g: Geometry, albedo: float) -> float:
        """Return the radiance of what is reflected more than once [W/(m^2 sr)] for E0 = 1 W/m^2 and an `albedo` rho in [0, 1]."""
        lost = 1.0 - self.average
        if lost <= 0.0:  # Lambert: nothing is left to reflect again
            return 0.0
        rho_ms = albedo * albedo * self.average / (1.0 - albedo * lost)
        missing_i = max(0.0, 1.0 - fujii_directional_albedo(self.roughness, g.mu_i))
        missing_o = max(0.0, 1.0 - fujii_directional_albedo(self.roughness, g.mu_o))
        return rho_ms / math.pi * g.mu_i * missing_i * missing_o / lost

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        if g is None:
            return 0.0
        rho = clamp(albedo, 0.0, 1.0)
        return self.base.single(g, rho) + self.multiple(g, rho)
