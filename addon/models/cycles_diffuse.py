# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own Diffuse BSDF as Cycles renders it, so that it can be matched and measured.

It is EON but for one factor: the node passes its color both as the closure's weight and as the albedo inside, so that the multiple
scattering carries rho^3 where EON has rho^2 (Blender 5.2.3, kernel/closure/bsdf_oren_nayar.h). At rho = 1 the two are the same.
"""

from dataclasses import dataclass, field
from functools import cached_property

from .eon import Eon, EonTerms
from .fujii import SHAPE
from .geometry import clamp, geometry
from .registry import ROUGHNESS, CyclesClosures, Glsl, MaterialX, Osl, ReflectanceModel
from .terms import Number
from .vector import Vector


@dataclass(frozen=True)
class CyclesDiffuse:
    """`roughness` is the node's Roughness, clamped to [0, 1], NaN to 0; 0 is Lambert. Loses energy for 0 < rho < 1."""

    roughness: float
    eon: Eon = field(init=False)

    def __post_init__(self) -> None:
        """Clamp the roughness and fold what depends on it alone."""
        object.__setattr__(self, "roughness", clamp(self.roughness, 0.0, 1.0))
        object.__setattr__(self, "eon", Eon(self.roughness))

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        if g is None:
            return 0.0
        rho = clamp(albedo, 0.0, 1.0)
        return self.eon.base.single(g, rho) + rho * self.eon.multiple(g, rho)

    def average_albedo(self, albedo: float) -> float:
        """Return rho <E> (1 + rho^2 k / (1 - rho k)), k = 1 - <E>."""
        lost = 1.0 - self.eon.average
        return albedo * self.eon.average * (1.0 + albedo * albedo * lost / (1.0 - albedo * lost))

    @property
    def constants(self) -> tuple[float, ...]:
        """EON's."""
        return self.eon.constants


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
    functions=(SHAPE,),
    glsl=Glsl(albedo_stem="directional_albedo"),
    osl=Osl.EXACT,
    cycles=CyclesClosures.DIFFUSE,
    materialx=MaterialX("eon"),
)
