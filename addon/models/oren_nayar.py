# SPDX-License-Identifier: GPL-3.0-or-later
"""Oren-Nayar rough diffuse reflection in the paper's form, equation (1): characters three to five.

    L_r = (rho / pi) E0 [ A (N.L) + B max(0, s) min(1, (N.L) / (N.E)) ],   s = E.L - (N.E)(N.L)
    A = 1 - 0.5 sigma^2 / (sigma^2 + 0.33),   B = 0.45 sigma^2 / (sigma^2 + 0.09)

This is the qualitative model of M. Oren and S. Nayar, "Generalization of Lambert's Reflectance Model" (SIGGRAPH 1994), equation
(30), with the angles replaced by cosines: sin(alpha) tan(beta) cos(phi) = s / max(N.L, N.E). The paper prints MAX(1, .) for the
minimum and two square roots that cancel; scripts/studies/as_printed.py keeps that form to show why it is not used.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property

from .fujii import K1, K2, energy_deficit
from .geometry import Geometry, clamp
from .protocol import Formula
from .registry import SIGMA, MaterialX, NearestEon, Osl, ReflectanceModel
from .terms import Expansion, Light, LightFunction, Number, SingleLightTerms
from .vector import Vector


def coefficients(sigma: float) -> tuple[float, float]:
    """Return (A, B) of equation (1), both without unit: A falls from 1 to 0.5, B rises from 0 to 0.45.

    `sigma` is the standard deviation of the facets' slope angle in radians; below 0 and NaN count as 0, infinity gives the limits.
    """
    sigma = clamp(sigma, 0.0, math.inf)
    # x / (x + c) as 1 / (1 + c / x) stays finite at both ends, where sigma^2 underflows or overflows.
    variance = sigma * sigma
    if variance == 0.0:
        return 1.0, 0.0
    return 1.0 - 0.5 / (1.0 + 0.33 / variance), 0.45 / (1.0 + 0.09 / variance)


@dataclass(frozen=True)
class OrenNayar(Formula):
    """Equation (1) with its right-hand minimum; sigma = 0 is Lambert exactly.

    `sigma` in radians (the paper shows 0, 0.2 and 0.33); below 0 and NaN count as 0, infinity is the limit. Reciprocal. It leaves
    out the interreflection between facets, and yet gains up to 1.4 % at grazing view for small sigma: `directional_albedo` tells
    both.
    """

    sigma: float
    a: float = field(init=False)
    b: float = field(init=False)

    def __post_init__(self) -> None:
        """Clamp sigma and fold A and B, which depend on it alone."""
        object.__setattr__(self, "sigma", clamp(self.sigma, 0.0, math.inf))
        a, b = coefficients(self.sigma)
        object.__setattr__(self, "a", a)
        object.__setattr__(self, "b", b)

    def reflected(self, g: Geometry, rho: float) -> float:
        s = g.l_dot_v - g.mu_o * g.mu_i
        ramp = g.mu_i / g.mu_o if g.mu_i < g.mu_o else 1.0
        return rho / math.pi * (self.a * g.mu_i + self.b * max(0.0, s) * ramp)

    def average_albedo(self, albedo: float) -> float:
        """Return rho (A + B (K2 + 4 / (9 pi))): Fujii's G without its part for s < 0."""
        return albedo * (self.a + self.b * (K2 + 4.0 / (9.0 * math.pi)))

    @property
    def constants(self) -> tuple[float, ...]:
        """A and B."""
        return self.a, self.b


def ramp(l: Vector, mu: float) -> float:
    """Return T = max(0, s) min(1, z / mu)."""
    return max(0.0, math.sqrt(1.0 - mu * mu) * l[0]) * min(1.0, l[2] / mu)


RAMP = LightFunction("oren_nayar", ramp)


class OrenNayarTerms(SingleLightTerms):
    """A z + B T; `value` is sigma."""

    @cached_property
    def variance(self) -> Number:
        return self.value * self.value

    @cached_property
    def a(self) -> Number:
        return 1.0 - 0.5 * (self.variance / (self.variance + 0.33))

    @cached_property
    def b(self) -> Number:
        return 0.45 * (self.variance / (self.variance + 0.09))

    def expansion(self) -> Expansion:
        return Expansion(self.a, {RAMP.name: self.b})

    def single_light(self, light: Light) -> Number:
        return self.a + self.b * self.ops.maximum(light.s, 0.0) * light.over_t

    def directional_albedo(self) -> Number:
        # E of Fujii's model is A (1 + r (K1 - energy_deficit)); T lacks its part for s < 0, which is 2/3 sin(v) / pi
        deficit = energy_deficit(self.ops, self.view.mu, self.view.sine)
        return self.a + self.b * (K1 - deficit + self.view.sine * (2.0 / (3.0 * math.pi)))


MODEL = ReflectanceModel(
    id="oren_nayar",
    number=1,
    label="Oren-Nayar",
    description="Classic matte look for chalk, clay, plaster: start here; equation (1) of Kim and Lee (2021)",
    formula=OrenNayar,
    terms=OrenNayarTerms,
    parameter=SIGMA,
    functions=(RAMP,),
    osl=Osl.EXACT_TOWARDS_VIEWER,
    materialx=MaterialX("oren_nayar"),
    eon=NearestEon((0.0, 4.0768, 12.605), (1.0, 12.999, 18.581), is_even=True),
)
