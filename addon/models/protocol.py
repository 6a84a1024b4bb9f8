# SPDX-License-Identifier: GPL-3.0-or-later
"""What formulas offer, so that quadrature, measurement and the registry need not know which one they have."""

from typing import Protocol

from .vector import Vector


class Model(Protocol):
    """A formula with its shape parameters set; the package's docstring has the conventions."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the radiance towards `v` [W/(m^2 sr)] for E0 = 1 W/m^2 from `l`."""
        ...


class Formula(Model, Protocol):
    """The formula of a registered reflectance model."""

    def average_albedo(self, albedo: float) -> float:
        """Return the share reflected under uniform light from everywhere, for an `albedo` rho in [0, 1]."""
        ...

    @property
    def constants(self) -> tuple[float, ...]:
        """The up to four numbers that depend on the shape parameter alone, as the GLSL function STEM_coefficients returns them."""
        ...
