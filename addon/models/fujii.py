# SPDX-License-Identifier: GPL-3.0-or-later
"""Y. Fujii's improvement of the qualitative Oren-Nayar model, single scattering only: what Cycles' Diffuse BSDF starts from.

    L_r = (rho / pi) E0 (N.L) A (1 + r s / t),   s = L.V - (N.L)(N.V),   t = max(N.L, N.V) where s > 0, else 1
    A = 1 / (1 + (1/2 - 2/(3 pi)) r)

Y. Fujii, "A tiny improvement of Oren-Nayar reflectance model" (2015). The name of the constants is that of J. Portsmouth, P. Kutz
and S. Hill, "EON: A practical energy-preserving rough diffuse BRDF" (JCGT 14(1), 2025).
"""

import math
from dataclasses import dataclass
from functools import cached_property

from .geometry import Geometry, clamp
from .protocol import Formula
from .registry import OWN_ROUGHNESS, ROUGHNESS, CyclesClosures, MaterialX, Osl, ReflectanceModel
from .terms import Arithmetic, Expansion, Light, LightFunction, Number, SingleLightTerms
from .vector import Vector

K1 = 0.5 - 2.0 / (3.0 * math.pi)
K2 = 2.0 / 3.0 - 28.0 / (15.0 * math.pi)


@dataclass(frozen=True)
class Fujii(Formula):
    """`roughness` r is clamped to [0, 1], NaN to 0; 0 is Lambert. Darkens as r grows, as nothing is reflected twice."""

    roughness: float

    def __post_init__(self) -> None:
        """Clamp the roughness."""
        object.__setattr__(self, "roughness", clamp(self.roughness, 0.0, 1.0))

    def reflected(self, g: Geometry, rho: float) -> float:
        s = g.l_dot_v - g.mu_i * g.mu_o
        # (N.L) / t at once, as s / t overflows near the horizon
        over_t = g.mu_i / max(g.mu_i, g.mu_o) if s > 0.0 else g.mu_i
        # rounding may leave s a little below -1
        return rho / math.pi * max(0.0, g.mu_i + self.roughness * s * over_t) / (1.0 + K1 * self.roughness)

    @cached_property
    def average(self) -> float:
        """<E> = A (1 + K2 r), the average albedo at rho = 1."""
        return (1.0 + K2 * self.roughness) / (1.0 + K1 * self.roughness)

    def average_albedo(self, albedo: float) -> float:
        """Return rho <E>."""
        return albedo * self.average

    @property
    def constants(self) -> tuple[float, ...]:
        """A and r."""
        return 1.0 / (1.0 + K1 * self.roughness), self.roughness


def shape(l: Vector, mu: float) -> float:
    """Return F = z s / t."""
    s = math.sqrt(1.0 - mu * mu) * l[0]
    return s * l[2] / max(l[2], mu) if s > 0.0 else s * l[2]


def energy_deficit(ops: Arithmetic, mu: Number, sine: Number) -> Number:
    """Return (1 - E(mu)) / (A r) = K1 - G(mu) / pi, which Fujii's model reflects too little of light from the angle of `mu`."""
    # The paper's (sin / mu)(1 - sin^3) without its 0 / 0 at mu = 0: 1 - sin = mu^2 / (1 + sin).
    cubic = mu * (1.0 + sine + sine * sine) / (1.0 + sine)
    g = sine * (ops.arccosine(mu) - sine * mu + 2.0 / 3.0 * (cubic - 1.0))
    return K1 - g * (1.0 / math.pi)


SHAPE = LightFunction("fujii", shape, is_signed=True)


class FujiiTerms(SingleLightTerms):
    """A (z + r F); `value` is r."""

    @cached_property
    def a(self) -> Number:
        return 1.0 / (1.0 + K1 * self.value)

    @cached_property
    def ar(self) -> Number:
        return self.a * self.value

    @cached_property
    def average(self) -> Number:
        """<E> at rho = 1."""
        return (1.0 + K2 * self.value) * self.a

    @cached_property
    def energy_deficit(self) -> Number:
        """1 - E(mu) at rho = 1."""
        return self.ar * energy_deficit(self.ops, self.view.mu, self.view.sine)

    def expansion(self) -> Expansion:
        return Expansion(self.a, {SHAPE.name: self.ar})

    def single_light(self, light: Light) -> Number:
        over_t = self.ops.maximum(light.s, 0.0) * light.over_t + self.ops.minimum(light.s, 0.0)
        return self.a * (1.0 + self.value * over_t)

    def directional_albedo(self) -> Number:
        return 1.0 - self.energy_deficit


MODEL = ReflectanceModel(
    id="fujii",
    number=2,
    label="Fujii",
    description="Fujii's improvement of Oren-Nayar, light reflected once: darkens as it gets rougher",
    formula=Fujii,
    terms=FujiiTerms,
    parameter=ROUGHNESS,
    functions=(SHAPE,),
    osl=Osl.EXACT,
    cycles=CyclesClosures.SINGLE_SCATTERING,
    materialx=MaterialX("eon"),
    eon=OWN_ROUGHNESS,
)
