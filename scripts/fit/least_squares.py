# SPDX-License-Identifier: GPL-3.0-or-later
"""Least squares."""

import math
from collections.abc import Sequence
from operator import mul


def solve(matrix: list[list[float]], right: list[float]) -> list[float]:
    """Return x of matrix x = right for a symmetric positive definite matrix, by Cholesky's decomposition."""
    size = len(right)
    lower = [[0.0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            rest = matrix[i][j] - sum(lower[i][k] * lower[j][k] for k in range(j))
            lower[i][j] = math.sqrt(rest) if i == j else rest / lower[j][j]
    y: list[float] = []
    for i in range(size):
        y.append((right[i] - sum(lower[i][k] * y[k] for k in range(i))) / lower[i][i])
    x = [0.0] * size
    for i in reversed(range(size)):
        x[i] = (y[i] - sum(lower[k][i] * x[k] for k in range(i + 1, size))) / lower[i][i]
    return x


def least_squares(
    rows: Sequence[Sequence[float]], wanted: Sequence[float], weights: Sequence[float] | None = None, ridge: float = 0.0
) -> list[float]:
    """Return x with the least sum of squares of row.x - `wanted` over the rows, each times its weight (1 where none are given).

    A `ridge` above 0 keeps numbers small that the rows hardly tell apart: it is a fraction of each one's own sum of squares.
    """
    pairs = list(zip(rows, wanted, weights or [1.0] * len(rows), strict=True))
    size = range(len(rows[0]))
    gram = [[sum(weight * row[i] * row[j] for row, _, weight in pairs) for j in size] for i in size]
    for i in size:
        gram[i][i] *= 1.0 + ridge
    return solve(gram, [sum(weight * row[i] * value for row, value, weight in pairs) for i in size])


def rational_fit(points: Sequence[tuple[float, float]], above: int, below: int) -> tuple[float, ...]:
    """Return (n_0, n_1, ..., d_1, d_2, ...) of (n_0 + n_1 x + ...) / (1 + d_1 x + ...) with the least relative squares.

    `above` and `below` count them. C. Sanathanan and J. Koerner (1963): linear least squares, weighted by the last denominator.
    """
    found = [0.0] * (above + below)
    for _ in range(20):
        weights = [(y * (1.0 + sum(found[above + k] * x ** (k + 1) for k in range(below)))) ** -2 for x, y in points]
        rows = [[x**k for k in range(above)] + [-y * x ** (k + 1) for k in range(below)] for x, y in points]
        found = least_squares(rows, [y for _, y in points], weights)
    return tuple(found)


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the sum of a[i] b[i]."""
    return sum(map(mul, a, b))
