# SPDX-License-Identifier: GPL-3.0-or-later
"""How wide an edge of light is that was scattered below a surface. No bpy."""

import math
from collections.abc import Sequence
from statistics import linear_regression

LEVEL, NEAR = 0.25, 1.4  # the level is looked for among the shares within this factor of it
FEWEST = 4  # of the nearest shares, where the steps are wide


def edge_width(values: Sequence[float], step: float) -> float:
    """Return the distance between 25 % and 75 % of the light across an edge; NaN where it does not show.

    `values` [any unit] rise from dark to lit at a distance of `step`, with the edge in the middle of them, an even number. Dark and
    lit sides are alike, as for every profile that is alike in all directions, so that full light is the sum of what both show.
    """
    half = len(values) // 2
    full = sum(values) / half
    logarithms = []  # of the share over LEVEL, with the distance from the edge
    for k in range(half):
        share = 0.5 + (values[half - 1 - k] - values[half + k]) / (2.0 * full) if full > 0.0 else 0.0
        if share > 0.0:
            logarithms.append((math.log(share / LEVEL), step * (k + 0.5)))
    near = sorted(logarithms, key=lambda point: abs(point[0]))
    points = near[: max(FEWEST, sum(abs(q) < math.log(NEAR) for q, _ in near))]
    if len(points) < FEWEST or not min(points)[0] < 0.0 < max(points)[0]:
        return math.nan
    # x = a + b q + c q^2 by least squares: x and q^2 without what is linear in q are proportional
    q, x = [point[0] for point in points], [point[1] for point in points]
    squares = [value * value for value in q]
    line, bend = linear_regression(q, x), linear_regression(q, squares)
    rest = [value - bend.intercept - bend.slope * at for at, value in zip(q, squares, strict=True)]
    c = sum(a * b for a, b in zip(rest, x, strict=True)) / sum(a * a for a in rest)
    return 2.0 * (line.intercept - c * bend.intercept)
