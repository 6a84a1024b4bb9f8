# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of error and time against samples, from measured units: a record for each render with its samples, repeat, seconds, error.

No bpy.
"""

from collections.abc import Sequence
from statistics import fmean, median

from ..measure.record import Record
from . import fit


def points(units: Sequence[Record]) -> list[Record]:
    """Return the medians of the repeats for each sample count, with the least and the greatest."""
    by_samples: dict[int, list[Record]] = {}
    for unit in units:
        by_samples.setdefault(unit["samples"], []).append(unit)
    found = []
    for samples, repeats in sorted(by_samples.items()):
        point: Record = {"samples": samples, "repeats": len(repeats)}
        for name in ("seconds", "error"):
            values = [unit[name] for unit in repeats]
            point |= {name: median(values), f"{name}_low": min(values), f"{name}_high": max(values)}
        found.append(point)
    return found


def fitted(units: Sequence[Record]) -> Record:
    """Return the points of a curve, and floor, slope and noise as means over the repeats' own fits.

    `floor` is the model's error, `slope` that of the noise above it; each with the standard error of their means over the repeats.
    """
    repeats: dict[int, dict[int, float]] = {}
    for unit in units:
        repeats.setdefault(unit["repeat"], {})[unit["samples"]] = unit["error"]
    # the longest counts have fewer repeats: what the first one gave stands in for those that lack them
    fits = [fit.fit(list(errors), list(errors.values())) for errors in ({**repeats[0], **own} for own in repeats.values())]
    floor = fit.mean([one.floor for one in fits])
    slopes = [one.slope for one in fits if one.slope is not None]
    noises = [one.noise for one in fits if one.noise is not None]
    slope = fit.mean(slopes) if len(slopes) == len(fits) else None
    found = points(units)
    line = fit.line([point["samples"] for point in found], [point["seconds"] for point in found])
    return {
        "points": found,
        "floor": floor.value,
        "floor_uncertainty": floor.uncertainty,
        "slope": slope.value if slope else None,
        "slope_uncertainty": slope.uncertainty if slope else None,
        "noise": fmean(noises) if slope else None,
        "seconds_fixed": line.fixed,
        "seconds_per_sample": line.per_sample,
    }
