# SPDX-License-Identifier: GPL-3.0-or-later
"""What formulas offer, so that quadrature, measurement and the registry need not know which one they have."""

from typing import Protocol

from .geometry import Geometry, clamp, geometry
from .vector import Vector


class Model(Protocol):
    """A formula with its shape parameters set; the package's docstring has the conventions."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the radiance towards `v` [W/(m^2 sr)] for E0 = 1 W/m^2 from `l`."""
        ...


class Formula:
    """The formula of a registered reflectance model."""

    @property
    def constants(self) -> tuple[float, ...]:
        """The up to four numbers that depend on the shape parameter alone, as the GLSL function STEM_coefficients returns them."""
        return ()

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; `albedo` rho is clamped to [0, 1]."""
        g = geometry(n, l, v)
        return self.reflected(g, clamp(albedo, 0.0, 1.0)) if g else 0.0

    def reflected(self, g: Geometry, rho: float) -> float:
        """Return `radiance` for light and viewer above the surface and an albedo rho in [0, 1]."""
        raise NotImplementedError

    def average_albedo(self, albedo: float) -> float:
        """Return the fraction reflected under uniform light from everywhere, for an `albedo` rho in [0, 1]."""
        raise NotImplementedError
