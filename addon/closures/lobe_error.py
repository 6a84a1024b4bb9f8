# SPDX-License-Identifier: GPL-3.0-or-later
"""How far one model is from another over all lights and views, from the formulas alone. No bpy."""

import math
from collections.abc import Callable

from ..models import Model
from ..models.quadrature import NORMAL, integrate
from ..models.vector import Vector, from_polar
from .lobe import CYCLES
from .lobes import Rendered, Shadowed

VIEWS = range(15, 90, 10)  # degrees from the normal
TILT = 30.0  # degrees, of `mapped_error`
ORDER = 16  # points in each of the four panels; against 32 the errors change by less than 1e-4


def lobe_error(approximate: Model, exact: Model, order: int = ORDER) -> float:
    """Return the mean over VIEWS of the relative RMS over the hemisphere of L (uniform in solid angle): a fraction of 1."""
    return sum(_relative_rms(approximate, exact, math.cos(math.radians(view)), order) for view in VIEWS) / len(VIEWS)


def mapped_error(model: Model, order: int = ORDER) -> float:
    """Return the `lobe_error` in Cycles where N is mapped, 30 degrees from the mesh's normal, towards or away from the viewer.

    That is beside the shadowing which Cycles gives Lambert's law with the same N.
    """
    meshes = (from_polar(math.cos(math.radians(TILT)), azimuth) for azimuth in (0.0, math.pi))
    return sum(lobe_error(Rendered(model, CYCLES, mesh_normal=mesh), Shadowed(model, mesh), order) for mesh in meshes) / 2.0


def _relative_rms(approximate: Model, exact: Model, mu_o: float, order: int) -> float:
    v = from_polar(mu_o, 0.0)

    def squared(value: Callable[[Vector], float]) -> float:
        def ring(mu: float) -> float:
            return integrate(lambda azimuth: value(from_polar(mu, azimuth)) ** 2, (0.0, math.pi / 2, math.pi), order)

        return integrate(ring, (0.0, mu_o, 1.0), order)

    def shown(l: Vector) -> float:
        return exact.radiance(NORMAL, l, v, 1.0)

    return math.sqrt(squared(lambda l: approximate.radiance(NORMAL, l, v, 1.0) - shown(l)) / squared(shown))
