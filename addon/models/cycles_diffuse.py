# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own Diffuse BSDF as Cycles renders it, so that it can be matched and measured.

It is EON but for one factor: the node passes its color both as the closure's weight and as the albedo inside, so that the multiple
scattering carries rho^3 where EON has rho^2 (Blender 5.2.3, kernel/closure/bsdf_oren_nayar.h). At rho = 1 the two are the same.
"""

from dataclasses import dataclass, field

from .eon import Eon
from .vector import Vector, dot


@dataclass(frozen=True)
class CyclesDiffuse:
    """`roughness` is the node's Roughness in [0, 1]; 0 is Lambert. Loses energy for 0 < rho < 1."""

    roughness: float
    eon: Eon = field(init=False)

    def __post_init__(self) -> None:
        """Fold what depends on the roughness alone; raises ValueError for one outside [0, 1]."""
        object.__setattr__(self, "eon", Eon(self.roughness))

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho in [0, 1]."""
        mu_i, mu_o = dot(n, l), dot(n, v)
        if mu_i <= 0.0 or mu_o <= 0.0:
            return 0.0
        return self.eon.single.radiance(n, l, v, albedo) + albedo * self.eon.multiple(min(1.0, mu_i), min(1.0, mu_o), albedo)
