# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the fastest quality and sample count whose error, according to a report of this machine, is within a tolerance. No bpy.

The report is the report.json of scripts/report.py, or the benchmark of this machine (`benchmark.py`) in the same form: errors and
render times of every variant of a model, by sample count. The error
here is the error of the variant relative to the model, taken from the sphere, whose reference is the formula, combined with the
noise at the sample count, taken from the scene. Other differences between engines do not depend on the quality and do not count.
Error grows with roughness, so a model is looked up at the smallest measured roughness that is not below its own.
"""

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..closures.quality import CHOSEN_LIGHTS
from ..measure.record import LABELS, WorkError
from .fit import INDEPENDENT

VERSION = 2
SAME = ("machine", "blender")  # keys of the environment that must agree: times of another machine or Blender do not apply
EXACT = "sphere"  # the scene whose reference is the model's formula
VARIANT = ("kind", "engine", "osl", "group", "model", "quality", "sigma")  # keys that identify a variant
MAKE = "run scripts/report.py"

type Curve = Mapping[str, Any]


class ToleranceError(WorkError):
    """No choice is possible; the message is one line for the user."""


@dataclass(frozen=True)
class Choice:
    """A variant and its `samples` per pixel; `quality` is the entry of the group's menu, None where the engine has only one.

    `seconds` and `expected_error`, a fraction, are those of the report's own scene.
    """

    engine: str
    model: str
    quality: str | None
    samples: int
    osl: bool
    seconds: float
    expected_error: float

    @property
    def variant(self) -> str:
        """The quality, or OSL, or GLSL."""
        return "OSL" if self.osl and self.quality != CHOSEN_LIGHTS else self.quality or "GLSL"


def read_report(path: Path, here: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the report at `path`; raises ToleranceError where there is none, or where its environment is not `here`."""
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ToleranceError(f"There is no report at {path}: {MAKE}") from None
    except (OSError, ValueError) as error:
        raise ToleranceError(f"The report {path} cannot be read: {error}") from None
    if not isinstance(report, dict) or report.get("version") != VERSION or not report.get("curves"):
        raise ToleranceError(f"{path} is no report of this version: {MAKE}")
    there = report.get("environment", {})
    for key in SAME:
        if there.get(key) != here.get(key):
            what = f"Blender {there.get(key)}, this is {here.get(key)}" if key == "blender" else "another machine"
            raise ToleranceError(f"The report {path} is of {what}: {MAKE} here")
    return report


def choose(
    report: Mapping[str, Any],
    scene: str,
    engine: str,
    model: str,
    tolerance: float,
    roughness: float = 0.0,
    group: str = "rough_diffuse",
    osl: bool | None = None,
    excluded: Collection[str] = (),
) -> Choice:
    """Return the fastest choice for `model` in `engine` whose error, with its uncertainty, is at most `tolerance`, a fraction.

    `scene` is that of the report; `osl` whether OSL is used, None for either; `excluded` are qualities not to choose. No more
    samples are chosen than were measured. Raises ToleranceError where the report has no such model or nothing meets the tolerance.
    """
    ours = [c for c in report["curves"] if c["scene"] == scene and c["engine"] == engine and c["kind"] == "ours"]
    known = [curve for curve in ours if curve["group"] == group and curve["model"] == model]
    if not known:
        names = ", ".join(dict.fromkeys(str(curve["model"]) for curve in ours)) or "nothing"
        raise ToleranceError(f"The report has no {model} in {LABELS[engine]}, scene {scene}: it has {names}")
    measured = {curve["sigma"] for curve in known if curve["sigma"] is not None}
    if measured:
        above = [sigma for sigma in measured if sigma >= roughness - 1e-6]
        if not above:
            raise ToleranceError(f"The report has {model} up to a roughness of {max(measured):g}, not {roughness:.3g}")
        known = [curve for curve in known if curve["sigma"] in (None, min(above))]
    allowed = [curve for curve in known if curve["quality"] not in excluded and osl in (None, bool(curve["osl"]))]
    if not allowed:
        raise ToleranceError(f"The report has {model} in {LABELS[engine]} only with qualities that are excluded")
    variants = [_Variant(curve, _exact(report, curve)) for curve in allowed]
    choices = [choice for variant in variants if (choice := variant.fastest(tolerance))]
    if not choices:
        best = min((variant.most_accurate() for variant in variants), key=lambda choice: choice.expected_error)
        raise ToleranceError(
            f"{LABELS[engine]} reaches {percent(best.expected_error)} at best, with {best.variant} "
            f"and {best.samples} samples, not {percent(tolerance)}"
        )
    return min(choices, key=lambda choice: (choice.seconds, choice.expected_error))


def percent(fraction: float) -> str:
    """Return `fraction` in %, with two digits."""
    return f"{100.0 * fraction:.2g} %"


def _exact(report: Mapping[str, Any], curve: Curve) -> Curve:
    """Return the curve of the same variant in the scene EXACT; `curve` itself where there is none."""
    same = (other for other in report["curves"] if all(other[key] == curve[key] for key in VARIANT))
    return next((other for other in same if other["scene"] == EXACT), curve)


@dataclass(frozen=True)
class _Variant:
    """The curve of a variant in the scene, for time and noise, and its curve in the scene EXACT, for its error."""

    curve: Curve
    exact: Curve

    def fastest(self, tolerance: float) -> Choice | None:
        """Return the choice with the fewest samples within `tolerance`; None where there is none."""
        counts, slope = self.counts, self.curve["slope"]
        if slope is not None and self.highest(self.last) <= tolerance:
            room = math.sqrt(tolerance**2 - self.floor_high**2)
            wanted = (self.curve["noise"] / room) ** (1.0 / slope)
            if wanted > counts[-1]:
                wanted = counts[-1] * (self.noise(counts[-1]) / room) ** (1.0 / min(slope, INDEPENDENT))
            counts = [min(self.last, max(counts[0], math.ceil(wanted)))]
        return next((self.choice(samples) for samples in counts if self.highest(samples) <= tolerance), None)

    def most_accurate(self) -> Choice:
        """Return the choice with the smallest error among the sample counts measured."""
        return min(map(self.choice, [*self.counts, self.last]), key=lambda choice: choice.expected_error)

    def choice(self, samples: int) -> Choice:
        curve = self.curve
        seconds = curve["seconds_fixed"] + curve["seconds_per_sample"] * samples
        error = math.hypot(self.exact["floor"], self.noise(samples))
        return Choice(curve["engine"], curve["model"], curve["quality"], samples, bool(curve["osl"]), seconds, error)

    @property
    def counts(self) -> list[int]:
        """The sample counts that were measured."""
        return sorted(point["samples"] for point in self.curve["points"])

    @property
    def last(self) -> int:
        """The most samples that can be chosen: a benchmark of this machine continues the noise beyond those measured."""
        return self.counts[-1] if self.curve["slope"] is None else self.curve.get("last_samples", self.counts[-1])

    @property
    def floor_high(self) -> float:
        """The error without noise, at the upper end of its uncertainty."""
        return self.exact["floor"] + (self.exact["floor_uncertainty"] or 0.0)

    def highest(self, samples: int) -> float:
        """Return the error with `samples`, at the upper end of its uncertainty."""
        return math.hypot(self.floor_high, self.noise(samples))

    def noise(self, samples: int) -> float:
        """Return the noise with `samples`: from the fit, or else from the measured error beyond the smallest one."""
        slope = self.curve["slope"]
        if slope is not None:
            measured = min(samples, self.counts[-1])
            return self.curve["noise"] * measured**-slope * (measured / samples) ** min(slope, INDEPENDENT)
        errors = {point["samples"]: point["error"] for point in self.curve["points"]}
        return math.sqrt(errors[samples] ** 2 - min(errors.values()) ** 2)


def describe(choice: Choice) -> str:
    """Return a choice as one line."""
    return (
        f"{LABELS[choice.engine]}: {choice.variant} with {choice.samples} samples, "
        f"{percent(choice.expected_error)} expected in {choice.seconds:.2g} s"
    )
