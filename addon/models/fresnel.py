# SPDX-License-Identifier: GPL-3.0-or-later
"""The smooth boundary between vacuum and a dielectric: Fresnel's transmittance, and how much of diffuse light inside passes it.

F is Fresnel's reflectance for unpolarized light, n the index of refraction, mu the cosine of the angle from the normal. Subsurface
models need two moments of F inside, E. d'Eon and G. Irving, "A quantized-diffusion model for rendering translucent materials"
(SIGGRAPH 2011): C1 = integral of F mu, C2 = integral of F mu^2 over mu in [0, 1]. 2 C1 is what others call F_dr. The polynomials in
use for them leave their range (F_dr of H. W. Jensen and others, SIGGRAPH 2001, is above 1 from n = 3.81 on; d'Eon's 2 C1 from about
2.5 on) and are not 0 at n = 1. Here both are integrals over the light that passes, as it fills the hemisphere outside:

    1 - 2 C1 = (2 / n^2) integral of T(mu) mu dmu,   1 - 3 C2 = (3 / n^3) integral of T(mu) mu sqrt(n^2 - 1 + mu^2) dmu,   T = 1 - F
"""

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

from .geometry import clamp
from .quadrature import integrate

HIGHEST_ETA = 4.0


class Passing(NamedTuple):
    """What passes the boundary from inside, of light that is alike in all directions, and of light in proportion to mu."""

    flux: float
    """1 - 2 C1 in (0, 1]."""
    gradient: float
    """1 - 3 C2 in (0, 1]."""


@dataclass(frozen=True)
class Boundary:
    """A smooth boundary from vacuum to a dielectric; `ior` n >= 1."""

    ior: float

    @functools.cached_property
    def bend(self) -> float:
        """sqrt(n^2 - 1)."""
        return math.sqrt((self.ior - 1.0) * (self.ior + 1.0))

    def transmittance(self, mu: float) -> float:
        """Return 1 - F of unpolarized light at the cosine `mu` > 0 of the angle outside; in [0, 1]."""
        n, n_cos_t = self.ior, math.hypot(self.bend, mu)  # n cos(theta_t) by Snell's law
        # 4 a b / (a + b)^2 for either polarization: 1 - F as a difference would lose its digits at grazing incidence.
        across, along = mu + n_cos_t, n * mu + n_cos_t / n
        return 2.0 * (mu / across * (n_cos_t / across) + n * mu / along * (n_cos_t / n / along))

    def transmittance_from_inside(self, mu: float) -> float:
        """Return 1 - F at the cosine `mu` > 0 of the angle inside; 0 where reflection is total."""
        n_mu = self.ior * mu
        return self.transmittance(math.sqrt((n_mu - self.bend) * (n_mu + self.bend))) if n_mu > self.bend else 0.0

    def refracted(self, mu: float) -> float:
        """Return the cosine inside of light at the cosine `mu` outside; in [sqrt(1 - 1/n^2), 1]."""
        return min(1.0, math.hypot(self.bend, mu) / self.ior)


@functools.cache
def boundary(eta: float) -> Boundary:
    """Return the boundary of index `eta`, clamped to [1, 4], NaN to 1."""
    return Boundary(clamp(eta, 1.0, HIGHEST_ETA))


@functools.cache
def passing(eta: float) -> Passing:
    """Return what passes the boundary of index `eta` from inside; clamped to [1, 4], NaN to 1. To about 1e-13."""
    edge = boundary(eta)
    n, bend = edge.ior, edge.bend
    if bend == 0.0:
        return Passing(1.0, 1.0)
    # mu = sqrt(n^2 - 1) sinh(x) spreads out the steep rise of T at grazing light, however narrow it is near n = 1.
    end = math.asinh(1.0 / bend)

    def moment(power: int) -> float:
        def passed(x: float) -> float:
            mu, n_cos_t = bend * math.sinh(x), bend * math.cosh(x)
            return edge.transmittance(mu) * mu * n_cos_t**power

        return integrate(passed, (0.0, 0.5 * end, end), 32)

    return Passing(2.0 / n**2 * moment(1), 3.0 / n**3 * moment(2))
