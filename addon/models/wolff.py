# SPDX-License-Identifier: GPL-3.0-or-later
"""L. B. Wolff's diffuse reflection from a smooth dielectric: light that enters through the surface, is scattered and leaves again.

    L_r = (rho / pi) E0 cos(theta_i) [1 - F(theta_i, n)] [1 - F(asin(sin(theta_r) / n), 1/n)]

F is Fresnel's reflectance for unpolarized light, n the index of refraction. L. B. Wolff, "Diffuse-reflectance model for smooth
dielectric surfaces" (JOSA A 11(11), 1994). What leaves towards theta_r crosses the boundary along the path of light that enters
from there, so the second bracket is 1 - F(theta_r, n): the model is reciprocal.
"""

import functools
import math
from dataclasses import dataclass

from .fresnel import boundary
from .geometry import Geometry, clamp
from .protocol import Formula
from .quadrature import average_albedo
from .registry import IOR, SMOOTH, MaterialX, Osl, ReflectanceModel
from .terms import SMALLEST_DIVISOR, Arithmetic, Expansion, Light, Number, SingleLightTerms

ALBEDO_ORDER = 12  # of the quadrature: to 1e-4
AVERAGE_REFLECTANCE = 0.50647, -0.42269, 1.0386  # of f, f^2, f^3: scripts/fit/albedo.py


@dataclass(frozen=True)
class Wolff(Formula):
    """`ior` is the index of refraction n, clamped to [1, 3], NaN to 1; 1 is Lambert.

    rho here is the albedo of the body under the boundary, of all its multiple scattering; Wolff lets it vary slightly with the
    angle, this takes it as constant. The directional albedo is less than rho, since the boundary reflects a part both ways.
    """

    ior: float = 1.5

    def __post_init__(self) -> None:
        """Clamp the index of refraction."""
        object.__setattr__(self, "ior", clamp(self.ior, 1.0, 3.0))

    def reflected(self, g: Geometry, rho: float) -> float:
        surface = boundary(self.ior)
        return rho / math.pi * g.mu_i * (surface.transmittance(g.mu_i) * surface.transmittance(g.mu_o))

    def average_albedo(self, albedo: float) -> float:
        """Return rho (1 - <F>)^2, nearly, by quadrature."""
        return albedo * _average_albedo(self.ior)

    @property
    def constants(self) -> tuple[float, ...]:
        """n^2 and n^2 - 1."""
        return self.ior * self.ior, (self.ior - 1.0) * (self.ior + 1.0)


@functools.lru_cache(maxsize=256)
def _average_albedo(ior: float) -> float:
    return average_albedo(Wolff(ior), 1.0, ALBEDO_ORDER)


def transmittance(ops: Arithmetic, mu: Number, ior: Number) -> Number:
    """Return 1 - F(mu)."""
    refracted = ops.sqrt(ops.multiply_add(mu, mu, ior * ior - 1.0))  # n cos(theta_t)
    across, along = mu + refracted, ops.multiply_add(mu, ior, refracted / ior)
    product = ops.maximum(across * along, SMALLEST_DIVISOR)
    return 2.0 * (mu * refracted) * ops.multiply_add(across, across, along * along) / (product * product)


def average_transmittance(ior: Number) -> Number:
    """Return the mean of 1 - F over all light that falls on the surface, evenly from everywhere; within 0.2 % for n in [1, 3]."""
    f = (ior - 1.0) / (ior + 1.0)
    c_1, c_2, c_3 = AVERAGE_REFLECTANCE
    return 1.0 - f * (c_1 + f * (c_2 + f * c_3))


class WolffTerms(SingleLightTerms):
    """z times what passes the boundary both ways; `value` is n."""

    def expansion(self) -> Expansion:
        return Expansion(self.directional_albedo(), {})

    def single_light(self, light: Light) -> Number:
        return self._leaving * transmittance(self.ops, light.mu, self.value)

    def directional_albedo(self) -> Number:
        return self._both

    @functools.cached_property
    def _leaving(self) -> Number:
        return transmittance(self.ops, self.view.mu, self.value)

    @functools.cached_property
    def _both(self) -> Number:
        return self._leaving * average_transmittance(self.value)


MODEL = ReflectanceModel(
    id="wolff",
    number=6,
    label="Wolff",
    description="A smooth dielectric: light enters, is scattered inside and leaves. Uses IOR",
    formula=Wolff,
    terms=WolffTerms,
    parameter=IOR,
    osl=Osl.FITTED,
    materialx=MaterialX("lambert", roughness=0.0),
    eon=SMOOTH,
)
