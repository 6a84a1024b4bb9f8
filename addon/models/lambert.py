# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambert's ideal diffuse reflector: the paper's second character."""

import math
from dataclasses import dataclass

from .vector import Vector, dot


@dataclass(frozen=True)
class Lambert:
    """L_r = (rho / pi) E0 (N.L): the same from every view. Directional albedo: rho."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho in [0, 1]."""
        n_dot_l = dot(n, l)
        if n_dot_l <= 0.0 or dot(n, v) <= 0.0:
            return 0.0
        return albedo / math.pi * n_dot_l
