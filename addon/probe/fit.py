# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a model's error ends and noise begins: fits of measured errors and times, and the Pareto front. No bpy.

The error of n samples is that of the model and noise beside it, which are independent: error(n)^2 = floor^2 + (noise n^-slope)^2.
Monte Carlo integration has a slope of 1/2. Time is a fixed part, as the scene's synchronization, and one for each sample.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, stdev

FLAT = 0.03  # errors of all sample counts within this fraction of each other show no noise
SLOPES = (0.05, 2.0)  # that are looked for
INDEPENDENT = 0.5  # slope of independent samples
FEWEST = 3  # sample counts that a slope can be fitted to
STEPS = 80  # of the search, which makes its interval 2^-50 of what it was
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class Fit:
    """error(n)^2 = floor^2 + (noise n^-slope)^2, as fractions of 1; `slope` and `noise` are None where the errors show no noise."""

    floor: float
    noise: float | None
    slope: float | None

    def error(self, samples: float) -> float:
        """Return the error of so many samples."""
        if self.noise is None or self.slope is None:
            return self.floor
        return math.hypot(self.floor, self.noise * samples**-self.slope)

    def samples(self, tolerance: float) -> float | None:
        """Return how many samples, at least 1, have an error of `tolerance`; None where none are enough."""
        if self.floor >= tolerance:
            return None
        if self.noise is None or self.slope is None or self.error(1.0) <= tolerance:
            return 1.0
        return max(1.0, (self.noise / math.sqrt(tolerance**2 - self.floor**2)) ** (1.0 / self.slope))


@dataclass(frozen=True)
class Power:
    """error(n) = noise n^-slope: noise alone."""

    noise: float
    slope: float


@dataclass(frozen=True)
class Mean:
    """A mean and its standard error, which is None where there is but one value."""

    value: float
    uncertainty: float | None


@dataclass(frozen=True)
class Line:
    """seconds(n) = fixed + per_sample n, neither below 0."""

    fixed: float
    per_sample: float

    def seconds(self, samples: float) -> float:
        """Return the time of so many samples [s]."""
        return self.fixed + self.per_sample * samples


def mean(values: Sequence[float]) -> Mean:
    """Return the mean of one value or more, with the standard error of independent ones."""
    return Mean(fmean(values), stdev(values) / math.sqrt(len(values)) if len(values) > 1 else None)


def fit(samples: Sequence[float], errors: Sequence[float]) -> Fit:
    """Return the fit with the least sum of squared relative residuals of error^2.

    Where errors are alike within FLAT, or there are fewer than FEWEST, the floor is their mean (of fewer: the least of them). Both
    are of equal, positive length.
    """
    if max(errors) <= (1.0 + FLAT) * min(errors):
        return Fit(fmean(errors), None, None)
    if len(errors) < FEWEST:
        return Fit(min(errors), None, None)
    low, high = SLOPES
    for _ in range(STEPS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        if _parts(samples, errors, left)[2] < _parts(samples, errors, right)[2]:
            high = right
        else:
            low = left
    slope = 0.5 * (low + high)
    floor2, noise2, _ = _parts(samples, errors, slope)
    return Fit(math.sqrt(floor2), math.sqrt(noise2), slope) if noise2 > 0.0 else Fit(fmean(errors), None, None)


def _parts(samples: Sequence[float], errors: Sequence[float], slope: float) -> tuple[float, float, float]:
    """Return floor^2 and noise^2, neither negative, with the least residual for a given slope, and that residual."""
    rows = []  # of a floor^2 + b noise^2 = 1
    for n, e in zip(samples, errors, strict=True):
        weight = 1.0 / max(e * e, 1e-30)
        rows.append((weight, weight * n ** (-2.0 * slope)))
    aa, ab, bb = (sum(row[i] * row[j] for row in rows) for i, j in ((0, 0), (0, 1), (1, 1)))
    a, b = sum(row[0] for row in rows), sum(row[1] for row in rows)
    determinant = aa * bb - ab * ab
    both = ((a * bb - b * ab) / determinant, (b * aa - a * ab) / determinant) if determinant > 1e-12 * aa * bb else (-1.0, -1.0)
    candidates = [both] if min(both) >= 0.0 else [(a / aa, 0.0), (0.0, b / bb)]
    scored = [(x, y, sum((p * x + q * y - 1.0) ** 2 for p, q in rows)) for x, y in candidates]
    return min(scored, key=lambda one: one[2])


def power(samples: Sequence[float], errors: Sequence[float]) -> Power:
    """Return the power law with the least sum of squared residuals of the logarithm, its slope within SLOPES; no error is 0.

    Of one sample count it is the law of INDEPENDENT samples.
    """
    if len(samples) == 1:
        return Power(errors[0] * samples[0] ** INDEPENDENT, INDEPENDENT)
    x, y = [math.log(n) for n in samples], [math.log(e) for e in errors]
    middle, height = fmean(x), fmean(y)
    slope = -sum((a - middle) * (b - height) for a, b in zip(x, y, strict=True)) / sum((a - middle) ** 2 for a in x)
    slope = min(max(slope, SLOPES[0]), SLOPES[1])
    return Power(math.exp(height + slope * middle), slope)


def line(samples: Sequence[float], seconds: Sequence[float]) -> Line:
    """Return the line with the least sum of squared relative residuals; all time is fixed where there is but one sample count."""
    weights = [1.0 / max(t * t, 1e-30) for t in seconds]
    total = sum(weights)
    n = sum(w * x for w, x in zip(weights, samples, strict=True)) / total
    t = sum(w * y for w, y in zip(weights, seconds, strict=True)) / total
    spread = sum(w * (x - n) ** 2 for w, x in zip(weights, samples, strict=True))
    if spread == 0.0:
        return Line(t, 0.0)
    slope = sum(w * (x - n) * (y - t) for w, x, y in zip(weights, samples, seconds, strict=True)) / spread
    slope = max(0.0, slope)
    if slope * n > t:  # nothing is fixed: a line through 0
        through = sum(w * x * y for w, x, y in zip(weights, samples, seconds, strict=True))
        return Line(0.0, through / sum(w * x * x for w, x in zip(weights, samples, strict=True)))
    return Line(t - slope * n, slope)


def pareto(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Return for each (seconds, error) whether no other has both less or one less and the other equal."""
    front = []
    for seconds, error in points:
        front.append(not any(s <= seconds and e <= error and (s < seconds or e < error) for s, e in points))
    return front
