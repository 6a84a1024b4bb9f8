# SPDX-License-Identifier: GPL-3.0-or-later
"""A thoroughly pitted surface: nothing but hemispherical pits with Lambertian walls, all interreflection in them included.

J. J. Koenderink, A. J. van Doorn, K. J. Dana, S. Nayar, "Bidirectional reflection distribution function of thoroughly pitted
surfaces" (IJCV 31, 1999). With rho the albedo of the wall, c = L.V, mu_i = N.L = cos(theta_i), mu_o = N.V = cos(theta_r):

    L_r = E0 mu_i (f_1 + f_ms),   f_ms = rho^2 / (pi (4 - 2 rho)),   f_1 = rho / (3 pi^2 mu_i mu_o) J
    J = c [Omega + sin(2 theta_i) + sin(2 theta_r) - sin(gamma)] + 2 mu_i mu_o [(1 - c^2) cot(gamma / 2) + c^2 tan(gamma / 2)]
    Omega = 2 pi - 2 theta_i - 2 theta_r - gamma
    cos(gamma) = 4 mu_i mu_o c - 2 mu_i^2 - 2 mu_o^2 + 1

f_1, once reflected: a ray towards L from the wall point with the normal m (towards the pit's center) leaves by the opening where
m.L' > 0, L' = 2 (N.L) L - N. So the points that see both light and viewer fill the spherical triangle m.N > 0, m.L' > 0, m.V' > 0
of the solid angle Omega, gamma is the angle between L' and V', and J / 3 is the integral of (m.L)(m.V) over it, by J. Arvo's
formula for double axial moments ("Applications of irradiance tensors to the simulation of non-Lambertian phenomena", SIGGRAPH
1995), simplified by hand. f_ms, reflected more often: in a sphere the light of any wall point falls evenly on all others, and half
of it on the opening.
"""

import math
from dataclasses import dataclass

from .geometry import Geometry, azimuth
from .protocol import Formula
from .registry import MaterialX, NearestEon, Osl, ReflectanceModel
from .terms import Expansion, LightFunction, Terms, relative_radiance
from .vector import Vector


def over(a: float, b: float) -> float:
    """Return a / b, or 0 where b is 0: the limit of the quotients below."""
    return a / b if b > 0.0 else 0.0


def once_reflected(g: Geometry) -> float:
    """Return J / mu_o, so that L_r = rho / (3 pi^2) J / mu_o for the light reflected once; finite up to the horizon.

    Near the horizon J is a small difference of large terms. With the elevations e_i, e_o above the horizon, x = e_i + e_o,
    d = e_i - e_o, y = gamma / 2 and q = sin(2 e_i) sin(2 e_o), the identities
        sin^2(x) - sin^2(y) = cos^2(y) - cos^2(x) = q cos^2(phi/2),   sin^2(y) - sin^2(d) = cos^2(d) - cos^2(y) = q sin^2(phi/2)
    take every difference apart into terms of one sign. Omega is 2 (x - y).
    """
    mu_i, mu_o = g.mu_i, g.mu_o
    sin_i, sin_o, cos_half, sin_half = azimuth(g)
    sin_x, cos_x = mu_i * sin_o + mu_o * sin_i, sin_i * sin_o - mu_i * mu_o
    sin_d, cos_d = mu_i * sin_o - mu_o * sin_i, sin_i * sin_o + mu_i * mu_o
    root_q = 2.0 * math.sqrt(mu_i) * math.sqrt(mu_o) * math.sqrt(sin_i * sin_o)
    sin_y, cos_y = math.hypot(sin_d, root_q * sin_half), math.hypot(cos_x, root_q * cos_half)
    cos2, sin2 = cos_half * cos_half, sin_half * sin_half
    q_over_mu_o = 4.0 * mu_i * sin_i * sin_o

    if cos_x < 0.0:
        omega = 2.0 * math.atan2(sin_x * cos_y - cos_x * sin_y, cos_x * cos_y + sin_x * sin_y) / mu_o
    else:
        slope = over(q_over_mu_o * cos2, sin_x * cos_y + cos_x * sin_y)
        omega = 2.0 * math.atan2(slope * mu_o, cos_x * cos_y + sin_x * sin_y) / mu_o
    # sin(2 e_i) + sin(2 e_o) - sin(gamma) = 2 [sin(x) (cos(d) - cos(y)) + cos(y) (sin(x) - sin(y))]
    sines = 2.0 * (q_over_mu_o * sin_x * sin2 / (cos_d + cos_y) + over(q_over_mu_o, sin_x + sin_y) * cos_y * cos2)
    c = 2.0 * sin_i * sin_o * cos2 - cos_x
    sin_psi2 = (sin_d * sin_d / (1.0 + cos_d) + 2.0 * sin_i * sin_o * sin2) * (1.0 + c)  # 1 - c^2
    cot = sin_psi2 * over(mu_i, sin_y) * cos_y  # sin(y) = 0: L = V
    tan = c * c * mu_i * over(sin_y, cos_y)  # cos(y) = 0: L' = -V'
    return max(0.0, c * (omega + sines) + 2.0 * (cot + tan))


@dataclass(frozen=True)
class Pitted(Formula):
    """Directional albedo: rho / (2 - rho) for light from everywhere, of which rho / 2 is reflected once. Reciprocal.

    Brightest towards the light. rho is the albedo of the wall, so the surface is darker than rho: a pit is a trap.
    """

    def reflected(self, g: Geometry, rho: float) -> float:
        return rho / (3.0 * math.pi**2) * once_reflected(g) + rho * rho / (math.pi * (4.0 - 2.0 * rho)) * g.mu_i

    def average_albedo(self, albedo: float) -> float:
        """Return rho / (2 - rho)."""
        return albedo / (2.0 - albedo)


def once(l: Vector, mu: float) -> float:
    """Return the light that the pits reflect once; at rho = 1 the rest is z / 2."""
    return relative_radiance(Pitted(), l, mu) - 0.5 * l[2]


ONCE = LightFunction("pitted", once)


class PittedTerms(Terms):
    """What is reflected once, and z for the rest. The formula is too much for nodes to evaluate for one light."""

    def expansion(self) -> Expansion:
        rho = self.view.color
        return Expansion(rho / (4.0 - rho * 2.0), {ONCE.name: 1.0})


MODEL = ReflectanceModel(
    id="pitted",
    number=7,
    label="Pitted (Koenderink)",
    description="A surface of nothing but round pits, after Koenderink: brightest towards the light",
    formula=Pitted,
    terms=PittedTerms,
    functions=(ONCE,),
    osl=Osl.FITTED,
    materialx=MaterialX("eon", roughness=1.0),
    eon=NearestEon((1.0,)),
)
