# SPDX-License-Identifier: GPL-3.0-or-later
"""The least RMS error of equation (1) in Cycles, where N is not the mesh's normal, that any sum of its closures can have.

The sums are of Diffuse closures of roughness 0 and 1 around N and around directions everywhere, with positive weights, chosen anew
for each view and mesh; the error is that in relation to the formula, beside Cycles' shadowing of Lambert's law, over lights spread
evenly above both horizons.

uv run scripts/fit/mapped.py
"""

import math
import sys
from collections.abc import Sequence
from itertools import product
from operator import mul
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon.closures.lobe import cycles_lobe
from true_diffuse.addon.models import OrenNayar
from true_diffuse.addon.models.quadrature import NORMAL
from true_diffuse.addon.models.terms import relative_radiance
from true_diffuse.addon.models.vector import Vector, dot, from_polar
from true_diffuse.scripts.cli.console import Parser, end, script_arguments
from true_diffuse.scripts.fit.lobes import LOWEST
from true_diffuse.scripts.fit.ramps import nonnegative

VIEWS, AZIMUTHS, TILTS = (30.0, 60.0), (0.0, 90.0, 180.0), (15.0, 30.0, 45.0)  # degrees from N, of the mesh, and from N
SIGMAS = (0.33, 1.0)
LIGHTS, DIRECTIONS = 150, 120


def sphere(count: int) -> list[Vector]:
    """Return N and `count` directions evenly spread over the half of the sphere around it: Fibonacci's lattice."""
    return [NORMAL, *(from_polar((k + 0.5) / count, math.pi * (3.0 - math.sqrt(5.0)) * k) for k in range(count))]


def closure(m: Vector, roughness: float, lights: Sequence[Vector], v: Vector, mesh: Vector) -> list[float]:
    """Return what a Diffuse closure without multiple scattering, around `m`, reflects of each of `lights`, but for a factor."""
    n_dot_v = max(0.0, dot(m, v))
    values = []
    for l in lights:
        n_dot_l = max(0.0, dot(m, l))
        s = dot(l, v) - n_dot_l * n_dot_v
        values.append(cycles_lobe(m, l, mesh) * (1.0 + roughness * (s / max(n_dot_l, n_dot_v, 1e-9) if s > 0.0 else s)))
    return values


def least_error(sigma: float, view: float, mesh: Vector) -> float:
    """Return the least RMS error, a fraction, at `view` [degrees from N]; `mesh` is the normal in the frame (V_t, N x V_t, N)."""
    mu = math.cos(math.radians(view))
    lights = [l for l in sphere(LIGHTS) if min(l[2], dot(mesh, l)) > LOWEST]
    shown = [relative_radiance(OrenNayar(sigma), l, mu) * cycles_lobe(NORMAL, l, mesh) / l[2] for l in lights]
    closures = [closure(m, r, lights, from_polar(mu, 0.0), mesh) for m, r in product(sphere(DIRECTIONS), (0.0, 1.0))]
    columns = [[value / whole for value, whole in zip(values, shown, strict=True)] for values in closures if any(values)]
    gram = [[sum(map(mul, a, b)) for b in columns] for a in columns]
    weights = nonnegative(gram, [sum(column) for column in columns], ())
    used = [(weight, column) for weight, column in zip(weights, columns, strict=True) if weight > 0.0]
    off = [sum(weight * column[k] for weight, column in used) - 1.0 for k in range(len(lights))]
    return math.sqrt(sum(x * x for x in off) / len(off))


def main() -> int:
    """Run the script; returns the exit status."""
    Parser(prog="fit/mapped.py", description=(__doc__ or "").splitlines()[0]).parse_args(script_arguments())
    for sigma, tilt in product(SIGMAS, TILTS):
        meshes = [from_polar(math.cos(math.radians(tilt)), math.radians(azimuth)) for azimuth in AZIMUTHS]
        errors = [least_error(sigma, view, mesh) for view, mesh in product(VIEWS, meshes)]
        print(f"sigma {sigma:g}, {tilt:g} degrees: {100.0 * sum(errors) / len(errors):.1f} %")
    return 0


if __name__ == "__main__":
    end(main())
