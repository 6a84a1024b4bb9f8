# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds ORDER of addon/realtime/ray_bundles.py: in which order the points of a spiral over the sphere are directions of rays.

uv run scripts/fit/bundle_directions.py        prints it, and the RMS error of the cosine's integral after so many

Simulated annealing (S. Kirkpatrick et al., 1983) exchanges two of them, so that each 4 directions that follow each other, which are
those of a sample, each 8, each 16 and each 32 integrate the cosine around any normal as well as can be.
"""

import math
import random
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import bpy  # noqa: F401 - whose gpu module comes with it

import checkout  # noqa: F401 - makes the checkout the package true_diffuse
from true_diffuse.addon.realtime.ray_bundles import ORDER, _fibonacci
from true_diffuse.scripts.cli.console import Parser, end, script_arguments

COUNT = len(ORDER)
NORMALS, CHECKED = 80, 500
WEIGHTS = {4: 2.0, 8: 2.5, 16: 4.0, 32: 6.0}  # of the errors of as many directions, which fall about as that
STEPS, START, END = 80_000, 0.01, 1e-4  # exchanges, and by how much worse one may be at first and at last


def cosines(count: int) -> list[list[float]]:
    """Return for each direction what it is taken for of the cosine's integral around `count` normals; the mean has to be 1."""
    normals = [_fibonacci(number, count) for number in range(count)]
    return [[4.0 * max(0.0, normal.dot(_fibonacci(k, COUNT))) for normal in normals] for k in range(COUNT)]


def rms_error(directions: Sequence[int], values: Sequence[Sequence[float]]) -> float:
    """Return the RMS error over all normals of the mean over `directions`."""
    columns = zip(*(values[k] for k in directions), strict=True)
    squares = [(math.fsum(column) / len(directions) - 1.0) ** 2 for column in columns]
    return math.sqrt(math.fsum(squares) / len(squares))


def annealed(values: Sequence[Sequence[float]]) -> list[int]:
    """Return the order that was found."""
    choice = random.Random(1)
    order = choice.sample(range(COUNT), COUNT)

    def error(size: int, block: int) -> float:
        return WEIGHTS[size] * rms_error(order[size * block : size * (block + 1)], values) * size / COUNT

    errors = {(size, block): error(size, block) for size in WEIGHTS for block in range(COUNT // size)}
    for step in range(STEPS):
        a, b = choice.sample(range(COUNT), 2)
        changed = {(size, place // size) for size in WEIGHTS for place in (a, b) if a // size != b // size}
        order[a], order[b] = order[b], order[a]
        now = {key: error(*key) for key in changed}
        worse = math.fsum(now.values()) - math.fsum(errors[key] for key in changed)
        if worse <= 0.0 or choice.random() < math.exp(-worse / (START * (END / START) ** (step / STEPS))):
            errors |= now
        else:
            order[a], order[b] = order[b], order[a]
    return best_first(order, values)


def best_first(order: list[int], values: Sequence[Sequence[float]]) -> list[int]:
    """Return `order` with the best 4 directions first, without a change of what stands together."""
    halves = order[: len(order) // 2], order[len(order) // 2 :]
    if len(order) == min(WEIGHTS):
        return order
    first, second = sorted((best_first(half, values) for half in halves), key=lambda half: rms_error(half[: min(WEIGHTS)], values))
    return first + second


def main() -> int:
    """Print the order, and how well it integrates beside that in use."""
    Parser(description=__doc__).parse_args(script_arguments())
    found, checked = annealed(cosines(NORMALS)), cosines(CHECKED)
    print("ORDER =", tuple(found))
    for name, order in (("found", found), ("in use", ORDER)):
        print(name, *(f"{count}: {rms_error(order[:count], checked):.2%}" for count in (4, 8, 16, 24, 32, 48, 64)), sep="  ")
    return 0


if __name__ == "__main__":
    end(main())
