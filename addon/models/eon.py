# SPDX-License-Identifier: GPL-3.0-or-later
"""EON, the energy-preserving Oren-Nayar model of OpenPBR: Fujii's single scattering plus what is reflected more than once.

J. Portsmouth, P. Kutz, S. Hill, "EON: A Practical Energy-Preserving Rough Diffuse BRDF" (JCGT 14(1), 2025). With rho the albedo,
r the roughness, E Fujii's directional albedo at rho = 1 and <E> its average:

    L_r = L_Fujii + (rho_ms / pi) E0 (N.L) (1 - E(N.L)) (1 - E(N.V)) / (1 - <E>),   rho_ms = rho^2 <E> / (1 - rho (1 - <E>))
"""

import math
from dataclasses import dataclass
from functools import cached_property

from .fujii import K1, K2, SHAPE, Fujii, FujiiTerms, energy_deficit
from .geometry import Geometry
from .registry import OWN_ROUGHNESS, ROUGHNESS, CyclesClosures, MaterialX, Osl, ReflectanceModel
from .terms import FLOATS, Expansion, Light, LightFunction, Number
from .vector import Vector


@dataclass(frozen=True)
class Eon(Fujii):
    """`roughness` r is clamped to [0, 1], NaN to 0; 0 is Lambert. Reciprocal; at rho = 1 it reflects all light from everywhere."""

    def multiple(self, g: Geometry, albedo: float) -> float:
        """Return the radiance of what is reflected more than once [W/(m^2 sr)] for E0 = 1 W/m^2 and an `albedo` rho in [0, 1]."""
        a, r = super().constants
        rho_ms = albedo * albedo * self.average / (1.0 - albedo * (1.0 - self.average))
        deficit_i = max(0.0, energy_deficit(FLOATS, g.mu_i, math.sqrt(1.0 - g.mu_i * g.mu_i)))
        deficit_o = max(0.0, energy_deficit(FLOATS, g.mu_o, math.sqrt(1.0 - g.mu_o * g.mu_o)))
        # 1 - E is A r times the deficit, 1 - <E> is A r (K1 - K2)
        return rho_ms / math.pi * g.mu_i * (a * r * deficit_i * deficit_o / (K1 - K2))

    def reflected(self, g: Geometry, rho: float) -> float:
        return super().reflected(g, rho) + self.multiple(g, rho)

    def average_albedo(self, albedo: float) -> float:
        """Return rho <E> / (1 - rho (1 - <E>))."""
        return albedo * self.average / (1.0 - albedo * (1.0 - self.average))

    def color(self, average_albedo: float) -> float:
        """Return the rho of which `average_albedo`, in [0, 1], is the average albedo; in [0, 1]."""
        return average_albedo / (self.average + average_albedo * (1.0 - self.average))

    @property
    def constants(self) -> tuple[float, ...]:
        """A, r and 1 - <E>."""
        return *super().constants, 1.0 - self.average


def diluted(roughness: Number, share: float) -> Number:
    """Return the roughness of EON for a mix of `share` EON of `roughness` and the rest Lambert, of one average albedo.

    For light reflected once, Fujii's model, the mix is exactly that model again: A r is `share` times as much.
    """
    return roughness if share == 1.0 else roughness * share / (1.0 + roughness * (K1 * (1.0 - share)))


def unevenness(l: Vector, _mu: float) -> float:
    """Return z ((1 - E(z)) / (1 - <E>) - 1): how what is reflected more than once varies with the light, 0 in the mean."""
    return l[2] * (energy_deficit(FLOATS, l[2], math.sqrt(max(0.0, 1.0 - l[2] * l[2]))) / (K1 - K2) - 1.0)


UNEVENNESS = LightFunction("unevenness", unevenness, is_signed=True)


class EonTerms(FujiiTerms):
    """Fujii's terms, and what is reflected more than once."""

    @cached_property
    def multiple_scattering(self) -> Number:
        """rho_ms / rho."""
        rho, average = self.view.color, self.average
        return rho * average / (1.0 - rho * (1.0 - average))

    def expansion(self) -> Expansion:
        facing, functions = super().expansion()
        multiple = self.multiple_scattering * self.energy_deficit
        return Expansion(multiple + facing, {**functions, UNEVENNESS.name: multiple})

    def single_light(self, light: Light) -> Number:
        # (1 - E_i)(1 - E_o) / (1 - <E>); 1 - <E> is A r (K1 - K2)
        both = energy_deficit(self.ops, light.mu, light.sine) * (1.0 / (K1 - K2)) * self.energy_deficit
        return self.multiple_scattering * both + super().single_light(light)

    def directional_albedo(self) -> Number:
        return self.multiple_scattering * self.energy_deficit + super().directional_albedo()


MODEL = ReflectanceModel(
    id="eon",
    number=3,
    label="EON",
    description="Energy-preserving Oren-Nayar of OpenPBR: Fujii and all that is reflected again",
    formula=Eon,
    terms=EonTerms,
    parameter=ROUGHNESS,
    functions=(SHAPE, UNEVENNESS),
    osl=Osl.EXACT,
    cycles=CyclesClosures.DIFFUSE_PER_CHANNEL,
    materialx=MaterialX("eon"),
    eon=OWN_ROUGHNESS,
)
