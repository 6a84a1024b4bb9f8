# SPDX-License-Identifier: GPL-3.0-or-later
"""Lambert's ideal diffuse reflector: the paper's second character."""

import math
from dataclasses import dataclass

from .geometry import Geometry
from .protocol import Formula
from .registry import SMOOTH, CyclesClosures, Glsl, MaterialX, Osl, ReflectanceModel
from .terms import Expansion, Terms


@dataclass(frozen=True)
class Lambert(Formula):
    """L_r = (rho / pi) E0 (N.L): the same from every view. Directional albedo: rho."""

    def reflected(self, g: Geometry, rho: float) -> float:
        return rho / math.pi * g.mu_i

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
    glsl=Glsl(albedo_stem=""),
    osl=Osl.EXACT,
    cycles=CyclesClosures.DIFFUSE,
    materialx=MaterialX("lambert", roughness=0.0),
    eon=SMOOTH,
)
