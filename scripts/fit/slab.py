# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the numbers of shaders/realtime/slab_profile.glsl: what slabs let through, as two exponentials.

uv run scripts/fit/slab.py        two minutes: prints them, and how far they are off
"""

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes the checkout the package true_diffuse
from true_diffuse.addon.closures.subsurface_fit import BEAM, MU, darkened
from true_diffuse.addon.models.terms import FLOATS, polynomial
from true_diffuse.scripts.cli.console import Parser, end, script_arguments
from true_diffuse.scripts.studies.slab_transmittance import solved, transmittance

COLORS = (0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 0.98)
THICKNESSES = (0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0)  # mean free paths
LEAST = 4e-3  # of what less is let through, the error is absolute
START = (  # w, r and q as polynomials of the color
    (1.35, 0.8, -8.0, 14.5, -13.7, 5.3),
    (1.04, -0.57, -4.3, 9.5, -8.7, 3.1),
    (1.15, 2.2, -6.2, 3.4),
)
STEPS = 60
DIFFERENCE = 1e-6
CELLS = 128


def fitted(numbers: Sequence[float], color: float, thickness: float) -> float:
    """Return T of the fit that has all the polynomials' `numbers`, one after the other."""
    values, first = [], 0
    for start in START:
        values.append(polynomial(FLOATS, tuple(numbers[first : first + len(start)]), color))
        first += len(start)
    share, slow, fast = values
    return share * math.exp(-slow * thickness) + (1.0 - share) * math.exp(-fast * thickness)


def least_squares(errors: Callable[[list[float]], list[float]], numbers: list[float]) -> list[float]:
    """Return the numbers near `numbers` at which the sum of squared errors is least: K. Levenberg (1944), D. Marquardt (1963)."""
    damping, current = 1e-2, errors(numbers)
    for _ in range(STEPS):
        columns = []
        for k in range(len(numbers)):
            moved = errors([x + DIFFERENCE * (j == k) for j, x in enumerate(numbers)])
            columns.append([(a - b) / DIFFERENCE for a, b in zip(moved, current, strict=True)])
        rows = []
        for k, column in enumerate(columns):
            row = [math.fsum(a * b for a, b in zip(column, other, strict=True)) for other in columns]
            row[k] *= 1.0 + damping
            rows.append([*row, -math.fsum(a * b for a, b in zip(column, current, strict=True))])
        trial = [x + step for x, step in zip(numbers, solved(rows), strict=True)]
        found = errors(trial)
        if math.fsum(x * x for x in found) < math.fsum(x * x for x in current):
            numbers, current, damping = trial, found, damping / 3.0
        else:
            damping *= 4.0
    return numbers


def main() -> int:
    Parser(description=__doc__).parse_args(script_arguments())
    albedos = {color: 1.0 - BEAM.s(darkened(color)) ** 2 for color in COLORS}
    exact = {(color, h): transmittance(albedos[color], h, MU, CELLS) for color in COLORS for h in THICKNESSES}

    def errors(numbers: list[float]) -> list[float]:
        return [(fitted(numbers, color, h) - value) / max(value, LEAST) for (color, h), value in exact.items()]

    numbers = least_squares(errors, [number for start in START for number in start])
    first = 0
    for name, start in zip(("w", "r", "q"), START, strict=True):
        print(name, ", ".join(f"{number:.5f}" for number in numbers[first : first + len(start)]))
        first += len(start)
    for color in COLORS:
        off = [abs(fitted(numbers, color, h) / exact[color, h] - 1.0) for h in THICKNESSES if exact[color, h] > 0.01]
        print(f"color {color:g}: off by at most {100.0 * max(off):.1f} % where more than 1 % comes through")
    return 0


if __name__ == "__main__":
    end(main())
