# SPDX-License-Identifier: GPL-3.0-or-later
"""The width of a shadow's edge that is blurred by subsurface scattering. No bpy."""

import math
from collections.abc import Sequence
from statistics import linear_regression

LEVEL, NEAR = 0.25, 1.4  # the fit takes the values within this factor of the level
FEWEST = 4  # values of a fit, where the steps are wide


def edge_width(values: Sequence[float], step: float) -> float:
    """Return the distance between 25 % and 75 % of the full light across an edge, in the unit of `step`, or NaN without an edge.

    `values` [any unit], an even number, are `step` apart and rise from dark to lit with the edge in the middle. Full light is the
    sum of values at equal distances on both sides, as for every isotropic profile.
    """
    half = len(values) // 2
    full = sum(values) / half
    logarithms = []  # of the fraction of full light over LEVEL, with the distance from the edge
    for k in range(half):
        fraction = 0.5 + (values[half - 1 - k] - values[half + k]) / (2.0 * full) if full > 0.0 else 0.0
        if fraction > 0.0:
            logarithms.append((math.log(fraction / LEVEL), step * (k + 0.5)))
    near = sorted(logarithms, key=lambda point: abs(point[0]))
    points = near[: max(FEWEST, sum(abs(q) < math.log(NEAR) for q, _ in near))]
    if len(points) < FEWEST or not min(points)[0] < 0.0 < max(points)[0]:
        return math.nan
    # x = a + b q + c q^2 by least squares: c relates the residuals of x and q^2 after their own fits linear in q
    q, x = [point[0] for point in points], [point[1] for point in points]
    squares = [value * value for value in q]
    line, bend = linear_regression(q, x), linear_regression(q, squares)
    rest = [value - bend.intercept - bend.slope * at for at, value in zip(q, squares, strict=True)]
    c = sum(a * b for a, b in zip(rest, x, strict=True)) / sum(a * a for a in rest)
    return 2.0 * (line.intercept - c * bend.intercept)
