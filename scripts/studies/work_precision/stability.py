# SPDX-License-Identifier: GPL-3.0-or-later
"""What the formulas as the paper prints them make of hard inputs, beside ours: case, plain formula, ours. No bpy."""

import math
from collections.abc import Callable, Iterator, Sequence

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import OrenNayar, directional_albedo
from true_diffuse.addon.models.vector import Vector, dot
from true_diffuse.scripts.studies import stability_subsurface
from true_diffuse.scripts.studies.as_printed import as_printed
from true_diffuse.scripts.studies.study import number_or_name

UP: Vector = (0.0, 0.0, 1.0)
SIGMA = 0.3  # of the paper's text


def at(degrees: float, azimuth: float = 0.0) -> Vector:
    """Return a direction so far from UP, about it by `azimuth` degrees."""
    polar, turn = math.radians(degrees), math.radians(azimuth)
    return (math.sin(polar) * math.cos(turn), math.sin(polar) * math.sin(turn), math.cos(polar))


def plain(n: Vector, l: Vector, v: Vector, rho: float, sigma: float) -> float:
    """Return equation (1) word for word, with its square roots and its MAX. Raises ZeroDivisionError and ValueError."""
    n_dot_l, n_dot_e = dot(n, l), dot(n, v)
    a = 1.0 - 0.5 * sigma * sigma / (sigma * sigma + 0.33)
    b = 0.45 * sigma * sigma / (sigma * sigma + 0.09)
    roots = math.sqrt((1.0 - n_dot_l * n_dot_l) * (1.0 - n_dot_e * n_dot_e))
    cosine = (dot(v, l) - n_dot_e * n_dot_l) / roots
    return rho / math.pi * (a * n_dot_l + b * roots * max(0.0, cosine) * max(1.0, n_dot_l / n_dot_e))


CASES: tuple[tuple[str, tuple[Vector, Vector, Vector, float, float]], ...] = (
    ("N = L = E", (UP, UP, UP, 1.0, SIGMA)),
    ("L = E, 60 degrees", (UP, at(60.0), at(60.0), 1.0, SIGMA)),
    ("E at 89.9 degrees, L at 0", (UP, UP, at(89.9), 1.0, SIGMA)),
    ("E at 89.9 degrees, L at 60 beside it", (UP, at(60.0), at(89.9), 1.0, SIGMA)),
    ("E at 90 degrees", (UP, at(60.0), (1.0, 0.0, 0.0), 1.0, SIGMA)),
    ("L at 90 degrees, E at 45 beside it", (UP, (1.0, 0.0, 0.0), at(45.0), 1.0, SIGMA)),
    ("L opposite E, both at 89.9 degrees", (UP, at(89.9, 180.0), at(89.9), 1.0, SIGMA)),
    ("L below the surface", (UP, at(120.0), at(30.0), 1.0, SIGMA)),
    ("N of length 2", ((0.0, 0.0, 2.0), at(30.0), at(60.0), 1.0, SIGMA)),
    ("N of length 0", ((0.0, 0.0, 0.0), at(30.0), at(60.0), 1.0, SIGMA)),
    ("sigma 0", (UP, at(30.0), at(60.0), 1.0, 0.0)),
    ("sigma 1e3", (UP, at(30.0), at(60.0), 1.0, 1e3)),
    ("sigma 1e200", (UP, at(30.0), at(60.0), 1.0, 1e200)),
    ("sigma NaN", (UP, at(30.0), at(60.0), 1.0, math.nan)),
    ("albedo NaN", (UP, at(30.0), at(60.0), math.nan, SIGMA)),
    ("albedo 1.5", (UP, at(30.0), at(60.0), 1.5, SIGMA)),
)
GRAZING = 0.05  # N.E


class Printed:
    """Equation (1) with its MAX, as a model; without the square roots, which would divide by zero."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the radiance for E0 = 1 W/m^2."""
        return as_printed(n, l, v, albedo, SIGMA)


def records() -> Iterator[Record]:
    """Yield what, case, plain and ours, for the rough model and the subsurface formulas; `expected` where it is known.

    `plain` and `ours` are numbers, or words where JSON has no number for it.
    """
    for case, arguments in CASES:
        *directions, rho, sigma = arguments
        ours = OrenNayar(sigma).radiance(*directions, rho)
        yield _record("Equation (1), radiance", case, _tried(plain, *arguments), ours)
    shares = [directional_albedo(model, GRAZING) for model in (Printed(), OrenNayar(SIGMA))]
    yield _record(f"Equation (1), share of light reflected, sigma {SIGMA:g}", f"N.E {GRAZING:g}", *shares)
    for one in stability_subsurface.records():
        yield {
            "what": one["model"],
            "case": one["case"],
            "plain": one["plain"],
            "ours": one["got"],
            "expected": one["expected"],
        }


def _tried(formula: Callable[..., float], *arguments: object) -> float | str:
    try:
        return formula(*arguments)
    except ZeroDivisionError:
        return "0 / 0"
    except (ArithmeticError, ValueError) as error:
        return str(error)


def _record(what: str, case: str, printed: float | str, ours: float) -> Record:
    plain = printed if isinstance(printed, str) else number_or_name(printed)
    return {"what": what, "case": case, "plain": plain, "ours": number_or_name(ours), "expected": None}


def shaders(found: Sequence[Record]) -> list[Record]:
    """Return the findings of the GLSL and OSL studies as they stand in a report: the largest error of each model and case."""
    names = ("target", "model", "case", "count", "relative_error", "absolute_error", "share_within", "finite")
    return [{name: one[name] for name in names} for one in found]
