# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambert's ideal diffuse reflector: the paper's second character."""

import math
from dataclasses import dataclass
from typing import ClassVar

from .geometry import clamp, geometry
from .registry import CyclesClosures, MaterialX, Osl, ReflectanceModel
from .terms import Expansion, Terms
from .vector import Vector


@dataclass(frozen=True)
class Lambert:
    """L_r = (rho / pi) E0 (N.L): the same from every view. Directional albedo: rho."""

    constants: ClassVar[tuple[float, ...]] = ()

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        return clamp(albedo, 0.0, 1.0) / math.pi * g.mu_i if g else 0.0

    def average_albedo(self, albedo: float) -> float:
        """Return rho."""
        return albedo


class LambertTerms(Terms):
    """z alone."""

    def expansion(self) -> Expansion:
        return Expansion(1.0, {})


MODEL = ReflectanceModel(
    id="lambert",
    number=0,
    label="Lambert",
    description="Ideal diffuse reflection: the same brightness from every view",
    formula=Lambert,
    terms=LambertTerms,
    osl=Osl.EXACT,
    cycles=CyclesClosures.DIFFUSE,
    materialx=MaterialX("lambert", roughness=0.0),
)
