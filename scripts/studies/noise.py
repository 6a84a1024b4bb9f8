# SPDX-License-Identifier: GPL-3.0-or-later
"""The difference of noisy pictures with the noise taken out. No bpy."""

import math
from array import array
from collections.abc import Iterable, Sequence

type Pair = Sequence[array[float]]  # of two: the same picture twice, linear RGB, with independent noise


def difference(pictures: Pair, references: Pair, pixels: Iterable[int]) -> float:
    """Return sqrt(sum (a1 - b1)(a2 - b2) / sum b1 b2) of pictures a and references b; NaN where the references are black.

    This is the RMS difference relative to the references' RMS; noise cancels in the mean, as that of the two is independent.
    """
    (a1, a2), (b1, b2) = pictures, references
    indices = [i for pixel in pixels for i in range(3 * pixel, 3 * pixel + 3)]
    square = math.fsum((a1[i] - b1[i]) * (a2[i] - b2[i]) for i in indices)
    total = math.fsum(b1[i] * b2[i] for i in indices)
    return math.sqrt(max(0.0, square) / total) if total > 0.0 else math.nan
