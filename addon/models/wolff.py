# SPDX-License-Identifier: GPL-3.0-or-later
"""L. B. Wolff's diffuse reflection from a smooth dielectric: light that enters through the surface, is scattered and leaves again.

    L_r = (rho / pi) E0 cos(theta_i) [1 - F(theta_i, n)] [1 - F(asin(sin(theta_r) / n), 1/n)]

F is Fresnel's reflectance for unpolarized light, n the index of refraction. L. B. Wolff, "Diffuse-reflectance model for smooth
dielectric surfaces" (JOSA A 11(11), 1994). What leaves towards theta_r crosses the boundary along the path of light that enters
from there, so the second bracket is 1 - F(theta_r, n): the model is reciprocal.
"""

import math
from dataclasses import dataclass, field

from .fresnel import Boundary
from .geometry import clamp, geometry
from .vector import Vector


@dataclass(frozen=True)
class Wolff:
    """`ior` is the index of refraction n, clamped to [1, 3], NaN to 1; 1 is Lambert.

    rho here is the albedo of the body under the boundary, of all its multiple scattering; Wolff lets it vary slightly with the
    angle, this takes it as constant. The directional albedo is less than rho, since the boundary reflects a part both ways.
    """

    ior: float = 1.5
    boundary: Boundary = field(init=False)

    def __post_init__(self) -> None:
        """Clamp the index of refraction and fold what depends on it alone."""
        object.__setattr__(self, "ior", clamp(self.ior, 1.0, 3.0))
        object.__setattr__(self, "boundary", Boundary(self.ior))

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        if g is None:
            return 0.0
        through = self.boundary.transmittance(g.mu_i) * self.boundary.transmittance(g.mu_o)
        return clamp(albedo, 0.0, 1.0) / math.pi * g.mu_i * through
