# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own Diffuse BSDF as Cycles renders it, so that it can be matched and measured.

It is EON but for one factor: the node passes its color both as the closure's weight and as the albedo inside, so that the multiple
scattering carries rho^3 where EON has rho^2 (Blender 5.2.3, kernel/closure/bsdf_oren_nayar.h). At rho = 1 the two are the same.
"""

from dataclasses import dataclass, field

from .eon import Eon
from .geometry import clamp, geometry
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
