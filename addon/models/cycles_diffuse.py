# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own Diffuse BSDF as Cycles renders it, so that it can be matched and measured.

It is EON but for one factor: the node passes its color both as the closure's weight and as the albedo inside, so that the multiple
scattering carries rho^3 where EON has rho^2 (Blender 5.2.3, kernel/closure/bsdf_oren_nayar.h). At rho = 1 the two are the same.
"""

from dataclasses import dataclass
from functools import cached_property

from .eon import UNEVENNESS, Eon, EonTerms
from .fujii import SHAPE
from .geometry import Geometry
from .registry import OWN_ROUGHNESS, ROUGHNESS, CyclesClosures, MaterialX, Osl, ReflectanceModel
from .terms import Number


@dataclass(frozen=True)
class CyclesDiffuse(Eon):
    """`roughness` is the node's Roughness, clamped to [0, 1], NaN to 0; 0 is Lambert. Loses energy for 0 < rho < 1."""

    def multiple(self, g: Geometry, albedo: float) -> float:
        """Return EON's times rho."""
        return albedo * super().multiple(g, albedo)

    def average_albedo(self, albedo: float) -> float:
        """Return rho <E> (1 + rho^2 k / (1 - rho k)), k = 1 - <E>."""
        lost = 1.0 - self.average
        return albedo * self.average * (1.0 + albedo * albedo * lost / (1.0 - albedo * lost))


class CyclesDiffuseTerms(EonTerms):
    """EON's terms with rho^3."""

    @cached_property
    def multiple_scattering(self) -> Number:
        """rho_ms."""
        return super().multiple_scattering * self.view.color


MODEL = ReflectanceModel(
    id="cycles_diffuse",
    number=4,
    label="Cycles Diffuse",
    description="What Blender's Diffuse BSDF does in Cycles, for EEVEE to match",
    formula=CyclesDiffuse,
    terms=CyclesDiffuseTerms,
    parameter=ROUGHNESS,
    functions=(SHAPE, UNEVENNESS),
    osl=Osl.EXACT,
    cycles=CyclesClosures.DIFFUSE,
    materialx=MaterialX("eon"),
    eon=OWN_ROUGHNESS,
)
