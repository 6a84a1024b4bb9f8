# SPDX-License-Identifier: GPL-3.0-or-later
"""Standard specular: a normalized Blinn-Phong highlight over a Lambert base, the paper's first character.

Game engines of the paper's time shaded this way. J. Blinn, "Models of Light Reflection for Computer Synthesized Pictures" (1977);
the factor (n + 8) / (8 pi) is the usual energy normalization of the half-vector lobe times N.L (T. Akenine-Moller, E. Haines,
N. Hoffman, "Real-Time Rendering", 3rd edition, section 7.6).
"""

import math
from dataclasses import dataclass

from .vector import Vector, add, dot, normalize


@dataclass(frozen=True)
class Specular:
    """L_r = E0 (N.L) [ rho / pi + k_s (n + 8) / (8 pi) (N.H)^n ], H halfway between L and V.

    `specular` is k_s in [0, 1], the weight of the highlight, without Fresnel; `exponent` is n >= 0. Neither the base nor the
    highlight knows of the other, as then usual: rho + k_s above about 1 reflects more than it receives.
    """

    specular: float = 0.06
    exponent: float = 30.0

    def __post_init__(self) -> None:
        """Refuse values outside the model's range with ValueError."""
        if not 0.0 <= self.specular <= 1.0:
            raise ValueError(f"specular must be in [0, 1], not {self.specular}")
        if not 0.0 <= self.exponent < math.inf:
            raise ValueError(f"exponent must be finite and not negative, not {self.exponent}")

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho of the base in [0, 1]."""
        n_dot_l = dot(n, l)
        if n_dot_l <= 0.0 or dot(n, v) <= 0.0:
            return 0.0
        n_dot_h = min(1.0, max(0.0, dot(n, normalize(add(l, v)))))
        highlight = self.specular * (self.exponent + 8.0) / (8.0 * math.pi) * n_dot_h**self.exponent
        return (albedo / math.pi + highlight) * n_dot_l
