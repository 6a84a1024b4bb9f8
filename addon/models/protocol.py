# SPDX-License-Identifier: GPL-3.0-or-later
"""What every reflectance model offers, so that quadrature and measurement need not know which one they have."""

from typing import Protocol

from .vector import Vector


class Model(Protocol):
    """A reflectance model with its shape parameters set; the package's docstring has the conventions."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the radiance towards `v` [W/(m^2 sr)] for E0 = 1 W/m^2 from `l`."""
        ...
