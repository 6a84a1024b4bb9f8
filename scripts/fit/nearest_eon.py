# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the EON that stands for each reflectance model in glTF, the column `eon` of the registry, and says how near it comes.

uv run scripts/fit/nearest_eon.py      a minute: prints a table, and the numbers that the models' files have

Errors are RMS over a sphere and all lights from the viewer's side to 120 degrees away from it, relative to the model: a point
counts by its size in the picture, so a surface seen from the front counts more than one that is seen edge-on.
"""

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon.models import MODELS, Eon, Formula, ReflectanceModel, directional_albedo
from true_diffuse.addon.models.geometry import Geometry
from true_diffuse.addon.models.quadrature import gauss_legendre
from true_diffuse.addon.models.registry import IOR, ROUGHNESS, SIGMA, Parameter
from true_diffuse.scripts.cli.console import Parser, end, script_arguments
from true_diffuse.scripts.fit.least_squares import rational_fit

LIGHT_DEGREES = (0.0, 30.0, 60.0, 90.0, 120.0)  # between light and viewer
RHOS = (0.2, 0.5, 0.8)
SHOWN = {SIGMA: (0.2, 0.33, 1.0), ROUGHNESS: (0.2, 0.33, 1.0), IOR: (1.2, 1.5, 2.0)}
SIGMAS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.36, 0.43, 0.5, 0.6, 0.72, 0.86, 1.0, 1.2, 1.57, 2.5, 5.0, 20.0)  # that are fitted
TERMS = (2, 2)  # of the fitted fraction's polynomials, above and below
ORDER = 16  # points each way on a sphere; against 32 the errors change by less than 1 % of themselves
VIEWS, ALBEDO_ORDER = 8, 12
ROUNDS = 24  # of a search: to 1e-5
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class Sample(NamedTuple):
    """A point of a sphere: the directions there, and its share of the picture."""

    geometry: Geometry
    weight: float


@cache
def sphere(degrees: float) -> tuple[Sample, ...]:
    """Return points of a sphere that face both the viewer and a light, `degrees` apart from each other."""
    angle, viewer = math.radians(degrees), (0.0, 0.0, 1.0)
    light = (math.sin(angle), 0.0, math.cos(angle))
    low, high = angle - 0.5 * math.pi, 0.5 * math.pi
    samples = []
    for x, weight in gauss_legendre(ORDER):
        longitude = 0.5 * (low + high) + 0.5 * (high - low) * x
        for y, other in gauss_legendre(ORDER):
            latitude = 0.25 * math.pi * (1.0 + y)  # the other half is its mirror image
            across = math.cos(latitude)
            mu_i, mu_o = across * math.cos(longitude - angle), across * math.cos(longitude)
            n = (across * math.sin(longitude), math.sin(latitude), mu_o)
            samples.append(
                Sample(Geometry(n, light, viewer, mu_i, mu_o, math.cos(angle)), weight * other * (high - low) * across * mu_o)
            )
    return tuple(samples)


def sphere_error(shown: Formula, color: float, model: Formula, rho: float, lights: Sequence[float] = LIGHT_DEGREES) -> float:
    """Return the RMS error of `shown` of the albedo `color` for `model` of `rho`, over a sphere and all `lights`, as a fraction."""
    squares = reference = 0.0
    for degrees in lights:
        for geometry, weight in sphere(degrees):
            wanted = model.reflected(geometry, rho)
            squares += weight * (shown.reflected(geometry, color) - wanted) ** 2
            reference += weight * wanted * wanted
    return math.sqrt(squares / reference)


def eon_error(roughness: float, model: Formula, rhos: Sequence[float] = RHOS, lights: Sequence[float] = LIGHT_DEGREES) -> float:
    """Return the RMS over `rhos` of the `sphere_error` of EON with that roughness and the model's average albedo."""
    eon = Eon(roughness)
    errors = (sphere_error(eon, eon.color(model.average_albedo(rho)), model, rho, lights) for rho in rhos)
    return math.sqrt(sum(error * error for error in errors) / len(rhos))


def brightest_error(roughness: float, model: Formula, rho: float = 0.5) -> tuple[float, float]:
    """Return the least error of EON in any color, and how far that one's albedo is off, as fractions."""
    eon = Eon(roughness)
    color = least(lambda color: sphere_error(eon, color, model, rho), 0.0, 1.0)
    return sphere_error(eon, color, model, rho), eon.average_albedo(color) / model.average_albedo(rho) - 1.0


def scaled_error(roughness: float, model: Formula) -> float:
    """Return how far off, as a fraction, the color of RHOS is where an image can only be scaled, by the factor of rho = 0.5."""
    scales = [Eon(roughness).color(model.average_albedo(rho)) / rho for rho in (0.5, *RHOS)]
    return max(abs(scales[0] / scale - 1.0) for scale in scales)


def albedo_error(roughness: float, model: Formula, rho: float = 0.5) -> float:
    """Return the RMS error of the directional albedo, over views in proportion to N.V, as a fraction."""
    eon = Eon(roughness)
    color = eon.color(model.average_albedo(rho))
    squares = reference = 0.0
    for x, weight in gauss_legendre(VIEWS):
        mu = 0.5 * (1.0 + x)
        wanted = directional_albedo(model, mu, rho, ALBEDO_ORDER)
        squares += weight * mu * (directional_albedo(eon, mu, color, ALBEDO_ORDER) - wanted) ** 2
        reference += weight * mu * wanted * wanted
    return math.sqrt(squares / reference)


def least(f: Callable[[float], float], low: float, high: float) -> float:
    """Return where `f`, which falls and then rises, is least in an interval: by golden sections."""
    for _ in range(ROUNDS):
        first, second = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        low, high = (low, second) if f(first) < f(second) else (first, high)
    return min((low, 0.5 * (low + high), high), key=f)


def nearest(model: Formula) -> float:
    """Return EON's roughness that comes nearest to `model`."""
    return least(lambda roughness: eon_error(roughness, model), 0.0, 1.0)


def fitted(model: ReflectanceModel) -> str:
    """Return the entry `eon` of a model whose parameter is sigma: a fraction of polynomials in its square, 0 at 0."""
    points = [(sigma * sigma, nearest(model.formula(sigma)) / (sigma * sigma)) for sigma in SIGMAS]
    found = rational_fit(points, *TERMS)
    above, below = (", ".join(f"{number:.5g}" for number in part) for part in (found[: TERMS[0]], found[TERMS[0] :]))
    return f"eon=NearestEon((0.0, {above}), (1.0, {below}), is_even=True)"


def values(parameter: Parameter | None) -> Sequence[float]:
    return SHOWN[parameter] if parameter else (0.0,)


def lines() -> Iterator[str]:
    """Yield the table, errors in %.

    It has EON's roughness as registered and the nearest; the errors of these two and of Lambert; those of the registered one and of
    Lambert in directional albedo; that of a color whose image is scaled; for rho = 0.5 how far off the albedo is where a reader
    lacks the extension, and the least error in any color, with how far off that is in albedo; and the first error by degrees
    between light and viewer.
    """
    yield (
        f"{'Model':20}{'Value':>6}{'EON':>7}{'Nearest':>8} {'Error':>7} {'Nearest':>7} {'Lambert':>7} {'Albedo':>7} {'Lambert':>7}"
        f"{'Scaled':>7}{'Without':>8} {'In any color':>13}   0 / 60 / 120"
    )
    for model in MODELS.values():
        for value in values(model.parameter):
            formula = model.formula(*([value] if model.parameter else []))
            used, best = model.eon.roughness(value), nearest(formula)
            by_light = " / ".join(f"{100.0 * eon_error(used, formula, lights=(light,)):.1f}" for light in LIGHT_DEGREES[::2])
            errors = " ".join(f"{100.0 * eon_error(roughness, formula):7.2f}" for roughness in (used, best, 0.0))
            albedos = " ".join(f"{100.0 * albedo_error(roughness, formula):7.2f}" for roughness in (used, 0.0))
            albedo = formula.average_albedo(0.5)
            without = 100.0 * (Eon(used).color(albedo) / albedo - 1.0)
            least_error, off = (100.0 * each for each in brightest_error(used, formula))
            shown = f"{value:g}" if model.parameter else ""
            color = f"{100.0 * scaled_error(used, formula):7.1f}{without:+8.1f} {least_error:7.2f}{off:+6.1f}"
            yield f"{model.label:20}{shown:>6}{used:7.3f}{best:8.3f} {errors} {albedos}{color}   {by_light}"


def main() -> int:
    """Run the script; returns the exit status."""
    Parser(prog="fit/nearest_eon.py", description=(__doc__ or "").splitlines()[0]).parse_args(script_arguments())
    for line in lines():
        print(line, flush=True)
    for model in MODELS.values():
        if model.parameter is SIGMA:
            print(f"{model.id}.py: {fitted(model)}", flush=True)
    return 0


if __name__ == "__main__":
    end(main())
