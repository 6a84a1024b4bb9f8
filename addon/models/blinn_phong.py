# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard specular: a normalized Blinn-Phong highlight over a Lambert base, the paper's first character.

Game engines of the paper's time shaded this way. J. Blinn, "Models of Light Reflection for Computer Synthesized Pictures" (1977);
the factor (n + 8) / (8 pi) is the usual energy normalization of the half-vector lobe times N.L (T. Akenine-Moller, E. Haines,
N. Hoffman, "Real-Time Rendering", 3rd edition, section 7.6).
"""

import math
from dataclasses import dataclass

from .geometry import clamp, geometry
from .vector import Vector, add, dot, normalize

BELOW = 0.87, 0.42  # of the fraction of the highlight that is below the surface: scripts/fit/albedo.py


@dataclass(frozen=True)
class Specular:
    """L_r = E0 (N.L) [ rho / pi + k_s (n + 8) / (8 pi) (N.H)^n ], H halfway between L and V.

    `specular` is k_s, the weight of the highlight, without Fresnel, clamped to [0, 1]; `exponent` is n, clamped to [0, 10000]; NaN
    counts as 0. Neither the base nor the highlight knows of the other, as then usual: rho + k_s above about 1 reflects more than it
    receives.
    """

    specular: float = 0.06
    exponent: float = 30.0

    def __post_init__(self) -> None:
        """Clamp both parameters."""
        object.__setattr__(self, "specular", clamp(self.specular, 0.0, 1.0))
        object.__setattr__(self, "exponent", clamp(self.exponent, 0.0, 10000.0))

    @property
    def height(self) -> float:
        """k_s (n + 8) / 8, the highlight at its brightest over a white Lambert surface, in [0, 1251]."""
        return self.specular * (self.exponent + 8.0) / 8.0

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho of the base is clamped to [0, 1]."""
        g = geometry(n, l, v)
        if g is None:
            return 0.0
        n_dot_h = clamp(dot(g.n, normalize(add(g.l, g.v))), 0.0, 1.0)
        highlight = self.height * n_dot_h**self.exponent
        return (clamp(albedo, 0.0, 1.0) + highlight) / math.pi * g.mu_i
