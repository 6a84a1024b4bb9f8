# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of error against seconds, with fits, Pareto fronts and recommendations, from what a journal keeps. No bpy."""

import math
from collections.abc import Iterable, Mapping, Sequence

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.probe import fit
from true_diffuse.addon.probe.curves import fitted

TOLERANCES = (0.05, 0.02, 0.01, 0.005)
# What makes two measured figures of one kind of curve
IDENTITY = ("scene", "engine", "osl", "label", "kind", "group", "model", "quality", "sigma", "target", "reference")


def curves(units: Iterable[Record], first: Iterable[Record], noise: Mapping[str, float]) -> list[Record]:
    """Return a curve for each scene and variant, in the order of the units; `noise` is that of the references, by scene.

    `floor` is the model's error, `slope` that of the noise above it; each with the standard error of their means over the repeats.
    `seconds_to` says what an error costs [s], None where no number of samples is enough, `samples_to` how many samples that is;
    `beyond` lists the tolerances that need more than were measured, or are below the reference's noise. `build_seconds` is what
    its material took to build, `first_seconds` what the first render took beyond a later one; None where they were not measured.
    """
    groups: dict[tuple[object, ...], list[Record]] = {}
    for unit in units:
        groups.setdefault(tuple(unit[name] for name in IDENTITY), []).append(unit)
    firsts = {(one["scene"], one["engine"], one["label"]): one for one in first}
    found = []
    for identity, group in groups.items():
        curve: Record = dict(zip(IDENTITY, identity, strict=True))
        curve["reference_error"] = noise.get(curve["scene"], 0.0)
        curve |= fitted(group)
        curve |= _costs(curve)
        hidden = [f"{tolerance:g}" for tolerance in TOLERANCES if tolerance < curve["reference_error"]]
        curve["beyond"] += [key for key in hidden if key not in curve["beyond"] and curve["seconds_to"][key] is not None]
        own = firsts.get((curve["scene"], curve["engine"], curve["label"]))
        curve["build_seconds"] = None if own is None else own["build_seconds"]
        curve["first_seconds"] = None if own is None else _beyond_later(own, curve["points"])
        found.append(curve)
    for curve in found:
        rivals = [one for one in found if one["scene"] == curve["scene"] and one["engine"] == curve["engine"]]
        _mark(curve, [point for one in rivals if one["target"] == curve["target"] for point in one["points"]])
    return found


def _costs(curve: Record) -> Record:
    """Return what each tolerance costs by the fits of a curve."""
    whole = fit.Fit(curve["floor"], curve["noise"], curve["slope"])
    line = fit.Line(curve["seconds_fixed"], curve["seconds_per_sample"])
    result: Record = {"seconds_to": {}, "samples_to": {}, "beyond": []}
    last = max(point["samples"] for point in curve["points"])
    for tolerance in TOLERANCES:
        samples, key = whole.samples(tolerance), f"{tolerance:g}"
        result["samples_to"][key] = samples
        result["seconds_to"][key] = None if samples is None else line.seconds(samples)
        if samples is not None and samples > last:
            result["beyond"].append(key)
    return result


def _beyond_later(first: Record, points: Sequence[Record]) -> float:
    """Return what a first render took beyond the median of later ones with as many samples [s]."""
    later = next(point["seconds"] for point in points if point["samples"] == first["samples"])
    return max(0.0, first["seconds"] - later)


def _mark(curve: Record, rivals: Sequence[Record]) -> None:
    """Mark the points that no other of the same scene, engine and target beats in both error and seconds."""
    front = fit.pareto([(point["seconds"], point["error"]) for point in rivals])
    best = [point for point, is_best in zip(rivals, front, strict=True) if is_best]
    for point in curve["points"]:
        point["pareto"] = any(point is one for one in best)


def glsl(record: Record, model: str, sigma: float) -> Record:
    """Return the curve, of one point, of the model's shader on the graphics driver."""
    seconds, error = record["seconds"], record["error"]
    point: Record = {"samples": 1, "repeats": 1, "pareto": True}
    point |= dict.fromkeys(("seconds", "seconds_low", "seconds_high"), seconds)
    point |= dict.fromkeys(("error", "error_low", "error_high"), error)
    to = {f"{tolerance:g}": seconds if error < tolerance else None for tolerance in TOLERANCES}
    return {
        **{"scene": record["scene"], "engine": "glsl", "osl": False, "label": "GLSL", "kind": "ours", "group": "rough_diffuse"},
        **{"model": model, "quality": None, "sigma": sigma, "target": model, "reference": "analytic", "reference_error": 0.0},
        "points": [point],
        **{"floor": error, "floor_uncertainty": None, "slope": None, "slope_uncertainty": None, "noise": None},
        **{"seconds_fixed": seconds, "seconds_per_sample": 0.0, "seconds_to": to, "build_seconds": None, "first_seconds": None},
        **{"samples_to": {key: None if value is None else 1.0 for key, value in to.items()}, "beyond": []},
    }


def recommendations(found: Sequence[Record]) -> list[Record]:
    """Return, for each scene, engine and tolerance, the choice that gets there soonest; `label` is None where none does.

    Choices with another target than the first's are models of their own and left out, as is what needs more samples than were
    measured. `text` says it in a sentence.
    """
    result = []
    for scene, engine in dict.fromkeys((curve["scene"], curve["engine"]) for curve in found if curve["engine"] != "glsl"):
        rivals = [curve for curve in found if (curve["scene"], curve["engine"]) == (scene, engine)]
        rivals = [curve for curve in rivals if curve["target"] == rivals[0]["target"]]
        for tolerance in TOLERANCES:
            key = f"{tolerance:g}"
            able = [curve for curve in rivals if curve["seconds_to"][key] is not None and key not in curve["beyond"]]
            best = min(able, key=lambda curve: curve["seconds_to"][key], default=None)
            one = {"scene": scene, "engine": engine, "tolerance": tolerance, "target": rivals[0]["target"]}
            one |= {"label": best["label"] if best else None, "osl": best["osl"] if best else None}
            one |= {"seconds": best["seconds_to"][key] if best else None, "samples": best["samples_to"][key] if best else None}
            result.append(one | {"text": _sentence(one, rivals)})
    return result


def _sentence(one: Record, rivals: Sequence[Record]) -> str:
    percent, key = f"{100.0 * one['tolerance']:g} %", f"{one['tolerance']:g}"
    if one["label"] is not None:
        return f"For {percent} take {one['label']}: {_count(one['samples'])}, {seconds(one['seconds'])}."
    nearest = min(rivals, key=lambda curve: min(point["error"] for point in curve["points"]))
    least = min(point["error"] for point in nearest["points"])
    text = f"Nothing measured comes within {percent}: nearest is {nearest['label']} at {100.0 * least:.2g} %"
    more = [curve for curve in rivals if curve["seconds_to"][key] is not None]
    if not more:
        return f"{text}."
    soonest = min(more, key=lambda curve: curve["seconds_to"][key])
    return f"{text}; {soonest['label']} would take some {_count(soonest['samples_to'][key])}."


def _count(samples: float) -> str:
    """Return a number of samples in words, rounded up and, where it is great, to two digits."""
    count = math.ceil(samples - 0.05)
    if count >= 100:
        count = round(float(f"{samples:.2g}"))
    return f"{count} sample{'' if count == 1 else 's'}"


def seconds(value: float) -> str:
    """Return a time in words, to two digits."""
    if value <= 0.0:
        return "0 s"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size:
            return f"{value / size:.2g} {unit}" if value / size < 9.95 else f"{value / size:.0f} {unit}"
    return f"{value / 1e-9:.2g} ns"
