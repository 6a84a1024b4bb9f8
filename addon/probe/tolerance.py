# SPDX-License-Identifier: GPL-3.0-or-later
"""Picks the cheapest mode and sample count that a report of this machine says will do. No bpy.

The report is the report.json of scripts/report.py: errors and seconds of every way to render a model, over sample counts. The error
here is that from the model, which is the mode's and known from the sphere, where the formula is the reference, and beside it the
noise of the scene, which is the samples'. What else one engine does differently from another no mode changes. Error grows with
roughness, so a rough model is looked up at the least roughness measured that is not below its own.
"""

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..closures.quality import CHOSEN_LIGHTS
from ..measure.record import LABELS

VERSION = 1
SAME = ("machine", "blender")  # of the environment: figures of another machine or Blender say nothing of this one
EXACT = "sphere"  # the scene whose reference is the model's formula
WAY = ("kind", "engine", "osl", "group", "model", "mode", "sigma")  # what tells a way to render from others
MAKE = "run scripts/report.py"

type Curve = Mapping[str, Any]


class Unmet(Exception):
    """No choice can be made; the message is one line for the user."""


@dataclass(frozen=True)
class Choice:
    """How to render: `mode` as the group's menu has it, None where there is but one way; `samples` per pixel.

    `seconds` and `expected_error`, a share of 1, are what the report expects of its own scene.
    """

    engine: str
    model: str
    mode: str | None
    samples: int
    osl: bool
    seconds: float
    expected_error: float

    @property
    def way(self) -> str:
        """The mode, or OSL, or that it is the model's GLSL, in words."""
        return "OSL" if self.osl and self.mode != CHOSEN_LIGHTS else self.mode or "GLSL"


def read_report(path: Path, here: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the report at `path`; raises Unmet where there is none, or it is not of the environment `here`."""
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Unmet(f"There is no report at {path}: {MAKE}") from None
    except (OSError, ValueError) as error:
        raise Unmet(f"The report {path} cannot be read: {error}") from None
    if not isinstance(report, dict) or report.get("version") != VERSION or not report.get("curves"):
        raise Unmet(f"{path} is no report of this version: {MAKE}")
    there = report.get("environment", {})
    for key in SAME:
        if there.get(key) != here.get(key):
            what = f"Blender {there.get(key)}, this is {here.get(key)}" if key == "blender" else "another machine"
            raise Unmet(f"The report {path} is of {what}: {MAKE} here")
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
    leave_out: Collection[str] = (),
) -> Choice:
    """Return the fastest way to render `model` in `engine` whose error and noise in the report's `scene` are at most `tolerance`.

    `osl` is whether the scene has it on, None for either; `leave_out` are modes not to pick. The error counts with its uncertainty.
    No more samples are picked than were measured. Raises Unmet where the report does not know the model or nothing is near enough.
    """
    curves = _curves(report, scene, engine, model, roughness, group, osl, leave_out)
    ways = [_Way(curve, _exact(report, curve)) for curve in curves]
    choices = [choice for way in ways for choice in [way.cheapest(tolerance)] if choice]
    if not choices:
        best = min((way.nearest() for way in ways), key=lambda choice: choice.expected_error)
        raise Unmet(
            f"{LABELS[engine]} reaches {percent(best.expected_error)} at best, with {best.way} "
            f"and {best.samples} samples: {percent(tolerance)} is not to be had"
        )
    return min(choices, key=lambda choice: (choice.seconds, choice.expected_error))


def percent(share: float) -> str:
    """Return `share` in %, with two digits."""
    return f"{100.0 * share:.2g} %"


def parse_percent(text: str) -> float:
    """Return the share of 1 that "2%", "2 %" or "2" stand for; raises ValueError where that is none above 0 and up to 100 %."""
    value = float(text.strip().removesuffix("%"))
    if not 0.0 < value <= 100.0:
        raise ValueError(f"{text!r} is not above 0 and up to 100 %")
    return value / 100.0


def _curves(
    report: Mapping[str, Any],
    scene: str,
    engine: str,
    model: str,
    roughness: float,
    group: str,
    osl: bool | None,
    leave_out: Collection[str],
) -> list[Curve]:
    """Return the curves to choose from, one at least; raises Unmet where the report has none."""
    here = [curve for curve in report["curves"] if curve["scene"] == scene and curve["engine"] == engine]
    ours = [curve for curve in here if curve["kind"] == "ours"]
    known = [curve for curve in ours if curve["group"] == group and curve["model"] == model]
    if not known:
        names = ", ".join(dict.fromkeys(str(curve["model"]) for curve in ours)) or "nothing"
        raise Unmet(f"The report knows no {model} in {LABELS[engine]}, scene {scene}: it has {names}")
    measured = {curve["sigma"] for curve in known if curve["sigma"] is not None}
    if measured:
        above = [sigma for sigma in measured if sigma >= roughness - 1e-6]
        if not above:
            raise Unmet(f"The report knows {model} up to a roughness of {max(measured):g}, not {roughness:.3g}")
        known = [curve for curve in known if curve["sigma"] in (None, min(above))]
    allowed = [curve for curve in known if curve["mode"] not in leave_out and osl in (None, bool(curve["osl"]))]
    if not allowed:
        raise Unmet(f"The report knows {model} in {LABELS[engine]} only in modes that are left out here")
    return allowed


def _exact(report: Mapping[str, Any], curve: Curve) -> Curve:
    """Return the curve of the same way to render where the reference is exact; `curve` itself where there is none."""
    same = (other for other in report["curves"] if all(other[key] == curve[key] for key in WAY))
    return next((other for other in same if other["scene"] == EXACT), curve)


@dataclass(frozen=True)
class _Way:
    """A way to render: its curve in the scene, and the one that its error from the model is taken from."""

    curve: Curve
    exact: Curve

    def cheapest(self, tolerance: float) -> Choice | None:
        """Return the fewest samples that meet `tolerance`; None where none do."""
        counts = sorted(point["samples"] for point in self.curve["points"])
        if self.curve["slope"] is not None and self.highest(counts[-1]) <= tolerance:
            room = math.sqrt(tolerance**2 - self.floor_high**2)
            wanted = (self.curve["noise"] / room) ** (1.0 / self.curve["slope"])
            counts = [min(counts[-1], max(counts[0], math.ceil(wanted)))]
        return next((self.choice(samples) for samples in counts if self.highest(samples) <= tolerance), None)

    def nearest(self) -> Choice:
        """Return the choice with the least error."""
        return min((self.choice(point["samples"]) for point in self.curve["points"]), key=lambda choice: choice.expected_error)

    def choice(self, samples: int) -> Choice:
        curve = self.curve
        seconds = curve["seconds_fixed"] + curve["seconds_per_sample"] * samples
        error = math.hypot(self.exact["floor"], self.noise(samples))
        return Choice(curve["engine"], curve["model"], curve["mode"], samples, bool(curve["osl"]), seconds, error)

    @property
    def floor_high(self) -> float:
        """The error without noise, at the upper end of what is known of it."""
        return self.exact["floor"] + (self.exact["floor_uncertainty"] or 0.0)

    def highest(self, samples: int) -> float:
        """Return the error of `samples`, at the upper end of what is known of it."""
        return math.hypot(self.floor_high, self.noise(samples))

    def noise(self, samples: int) -> float:
        """Return the noise of `samples`: as fitted, or what a measured error has over the least where no noise was to be told."""
        if self.curve["slope"] is not None:
            return self.curve["noise"] * samples ** -self.curve["slope"]
        errors = {point["samples"]: point["error"] for point in self.curve["points"]}
        return math.sqrt(errors[samples] ** 2 - min(errors.values()) ** 2)


def told(choice: Choice) -> str:
    """Return a choice in words."""
    return (
        f"{LABELS[choice.engine]}: {choice.way} with {choice.samples} samples, "
        f"{percent(choice.expected_error)} expected in {choice.seconds:.2g} s"
    )
