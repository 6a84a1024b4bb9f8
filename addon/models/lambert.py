# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambert's ideal diffuse reflector: the paper's second character."""

import math
from dataclasses import dataclass

from .geometry import clamp, geometry
from .vector import Vector


@dataclass(frozen=True)
class Lambert:
    """L_r = (rho / pi) E0 (N.L): the same from every view. Directional albedo: rho."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        return clamp(albedo, 0.0, 1.0) / math.pi * g.mu_i if g else 0.0
