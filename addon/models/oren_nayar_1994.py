# SPDX-License-Identifier: GPL-3.0-or-later
"""The full Oren-Nayar model, of which equation (1) is the short form: all three terms, and the interreflection between facets.

M. Oren and S. Nayar, "Generalization of Lambert's Reflectance Model" (SIGGRAPH 1994), equations (27) to (29). With alpha and beta
the larger and smaller of the angles theta_i, theta_r from N, phi the azimuth between light and viewer and s2 = sigma^2:

    L_1 = (rho / pi) E0 cos(theta_i) [ C1 + C2 cos(phi) tan(beta) + C3 (1 - |cos(phi)|) tan((alpha + beta) / 2) ]
    L_2 = 0.17 (rho^2 / pi) E0 cos(theta_i) s2 / (s2 + 0.13) [ 1 - cos(phi) (2 beta / pi)^2 ]
    C1 = 1 - 0.5 s2 / (s2 + 0.33),   C3 = 0.125 s2 / (s2 + 0.09) (4 alpha beta / pi^2)^2
    C2 = 0.45 s2 / (s2 + 0.09) sin(alpha) where cos(phi) >= 0, else with sin(alpha) - (2 beta / pi)^3
"""

import functools
import math
from dataclasses import dataclass
from functools import cached_property

from .geometry import Geometry, azimuth
from .oren_nayar import OrenNayar, OrenNayarTerms
from .quadrature import average_albedo
from .registry import SIGMA, MaterialX, NearestEon, Osl, ReflectanceModel
from .terms import SMALLEST_DIVISOR, Expansion, Light, LightFunction, Number, relative_radiance
from .vector import Vector

ALBEDO_ORDER = 12  # of the quadrature: to 1e-4
FACETS_ALBEDO = 0.39632, -0.18953, -0.16266  # of f(mu), by scripts/fit/albedo.py, as in shaders/directional_albedo.glsl


@dataclass(frozen=True)
class OrenNayar1994(OrenNayar):
    """`sigma` in radians; below 0 and NaN count as 0, infinity is the limit; 0 is Lambert. Reciprocal.

    Gains energy at grazing view for small sigma: 3.6 % at N.V = 0.05 for sigma = 0.3. For sigma above about 0.66 the paper's fit
    falls below zero where light and viewer skim the surface from opposite sides; there it is cut off at 0.
    """

    @cached_property
    def interreflection(self) -> float:
        """The factor of the light that facets reflect twice, which depends on sigma alone."""
        variance = self.sigma * self.sigma
        return 0.17 / (1.0 + 0.13 / variance) if variance > 0.0 else 0.0

    def reflected(self, g: Geometry, rho: float) -> float:
        sin_i, sin_o, cos_half, sin_half = azimuth(g)
        cos_phi = (cos_half - sin_half) * (cos_half + sin_half)
        alpha, beta = math.acos(min(g.mu_i, g.mu_o)), math.acos(max(g.mu_i, g.mu_o))
        sin_alpha, sin_beta = max(sin_i, sin_o), min(sin_i, sin_o)
        forward = 0.0 if cos_phi >= 0.0 else (2.0 * beta / math.pi) ** 3
        c2 = self.b * (sin_alpha - forward)
        c3 = self.b / 3.6 * (4.0 * alpha * beta / math.pi**2) ** 2  # 0.125 = 0.45 / 3.6
        # cos(theta_i) times the tangents as quotients that stay finite when both angles near 90 degrees
        tan_beta = sin_beta * (g.mu_i / max(g.mu_i, g.mu_o))
        tan_half = (sin_alpha + sin_beta) * (g.mu_i / (g.mu_i + g.mu_o))
        once = self.a * g.mu_i + c2 * cos_phi * tan_beta + c3 * (1.0 - abs(cos_phi)) * tan_half
        twice = self.interreflection * g.mu_i * (1.0 - cos_phi * (2.0 * beta / math.pi) ** 2)
        return rho / math.pi * max(0.0, once + rho * twice)

    def average_albedo(self, albedo: float) -> float:
        """Return a rho + b rho^2, by quadrature."""
        once, twice = _average_albedo(self.sigma)
        return albedo * (once + twice * albedo)

    @property
    def constants(self) -> tuple[float, ...]:
        """A, B and the factor of the interreflection."""
        return self.a, self.b, self.interreflection


@functools.lru_cache(maxsize=256)
def _average_albedo(sigma: float) -> tuple[float, float]:
    """Return a and b of the average albedo a rho + b rho^2."""
    white, half = (average_albedo(OrenNayar1994(sigma), rho, ALBEDO_ORDER) for rho in (1.0, 0.5))
    return 4.0 * half - white, 2.0 * (white - 2.0 * half)


_ROUGH = OrenNayar1994(1.0)


def facets(l: Vector, mu: float) -> float:
    """Return what the model has beside C1 z and the interreflection, over B: the part in rho of rho (once + rho twice)."""
    once = 2.0 * relative_radiance(_ROUGH, l, mu, 0.5) - relative_radiance(_ROUGH, l, mu, 1.0)
    return (once - _ROUGH.a * l[2]) / _ROUGH.b


def interreflection(l: Vector, mu: float) -> float:
    """Return what the interreflection, over its factor, has beside z."""
    twice = 2.0 * (relative_radiance(_ROUGH, l, mu, 1.0) - relative_radiance(_ROUGH, l, mu, 0.5))
    return twice / _ROUGH.interreflection - l[2]


FACETS = LightFunction("oren_nayar_1994", facets, is_signed=True)
INTERREFLECTION = LightFunction("interreflection", interreflection, is_signed=True)


class OrenNayar1994Terms(OrenNayarTerms):
    """C1 z, the facets' other terms, and the interreflection; `value` is sigma."""

    @cached_property
    def interreflection(self) -> Number:
        """L_2 over (rho / pi) E0 z [ ... ], the factor that depends on rho and sigma."""
        return self.view.color * (0.17 * (self.variance / (self.variance + 0.13)))

    def expansion(self) -> Expansion:
        return Expansion(self.interreflection + self.a, {FACETS.name: self.b, INTERREFLECTION.name: self.interreflection})

    def single_light(self, light: Light) -> Number:
        ops, view = self.ops, self.view
        cos_phi = ops.clamp(light.s / ops.maximum(light.sine * view.sine, SMALLEST_DIVISOR), -1.0, 1.0)
        alpha, beta = ops.arccosine(ops.minimum(light.mu, view.mu)), ops.arccosine(ops.maximum(light.mu, view.mu))
        sin_alpha, sin_beta = ops.maximum(light.sine, view.sine), ops.minimum(light.sine, view.sine)
        share = beta * (2.0 / math.pi)
        opposite = ops.less_than(cos_phi, 0.0) * (share * share * share)
        c_2 = self.b * (sin_alpha - opposite)
        product = alpha * beta * (4.0 / math.pi**2)
        c_3 = self.b * (1.0 / 3.6) * (product * product)
        tan_half = (sin_alpha + sin_beta) / ops.maximum(light.mu + view.mu, SMALLEST_DIVISOR)
        once = self.a + c_2 * cos_phi * sin_beta * light.over_t + c_3 * (1.0 - ops.absolute(cos_phi)) * tan_half
        return ops.maximum(self.interreflection * (1.0 - cos_phi * (share * share)) + once, 0.0)

    def directional_albedo(self) -> Number:
        """Return A + B f(mu) + rho c, as shaders/directional_albedo.glsl has it: within 0.0011 for sigma up to 0.66."""
        c_0, c_1, c_2 = FACETS_ALBEDO
        f = (1.0 - self.view.mu) * (c_0 + c_1 * self.ops.sqrt(self.view.mu) + c_2 * self.view.mu)
        return self.interreflection + (self.a + self.b * f)


MODEL = ReflectanceModel(
    id="oren_nayar_1994",
    number=5,
    label="Oren-Nayar 1994",
    description="The full model with the interreflection of facets",
    formula=OrenNayar1994,
    terms=OrenNayar1994Terms,
    parameter=SIGMA,
    functions=(FACETS, INTERREFLECTION),
    osl=Osl.FITTED,
    materialx=MaterialX("oren_nayar"),
    eon=NearestEon((0.0, 4.9528, 14.455), (1.0, 12.746, 18.005), is_even=True),
)
