# SPDX-License-Identifier: GPL-3.0-or-later
"""A small benchmark of this machine: the curves that a scene's materials need to have settings picked, in about a minute.

It renders the scenes "sphere" and "five" of scripts/report.py, with monkeys, and makes curves in the form of its report. The sphere
says how far a quality is from the model's formula, as in the report. Noise is the difference from a picture of the most samples
with other random numbers, where the report has a converged picture: of some thousand pixels it is 10 % uncertain. Beyond the counts
that were measured it falls with the root of the samples, as independent ones do; what falls faster gets more than it needs.

Of Subsurface the noise alone counts: Method is the artist's choice. What was measured is kept in the user's folder.
"""

import hashlib
import json
import math
from array import array
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import NamedTuple

import bpy

from ...scenes.subject import monkey
from ..blender.engines import CYCLES, EEVEE, REALTIME
from ..blender.extension import user_folder
from ..closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from ..material.summary import MaterialSummary
from ..measure import error, render
from ..measure.record import Record, Step, Steps
from ..models import by_label
from ..models.registry import IOR
from ..nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, chosen_lights
from . import curves, fit
from .environment import environment
from .measurement import RenderSetup
from .scenes import FiveScene, SphereScene, StudyScene, paint, rough_material, translucent_material

VERSION = 1  # of the file
QUALITIES: Mapping[object, Sequence[str | None]] = {
    EEVEE: (FAST, BALANCED, PRECISE),
    CYCLES: (BALANCED,),
    REALTIME: (None,),  # it draws the model itself, whatever the quality
}
USUAL = {EEVEE: BALANCED, CYCLES: BALANCED, REALTIME: None}
ROUGHNESS_STEP = 0.05  # roughness is measured at multiples of this
SPHERE_SAMPLES = {EEVEE: (1, 1, 16), CYCLES: (1, 1, 16), REALTIME: (1, 1)}  # as in the report, of which the sphere has no noise
COUNTS, LEAST_COUNTS = (1, 4, 16, 64), 2  # samples of the five; as many as render within LONGEST, but at least the first two
LONGEST = 1.0  # s: the window does not hear the user while a picture renders
LAST_SAMPLES = 4096  # to which the noise is continued
NOISELESS = 1e-6
SPHERE_WORK, FIVE_WORK = 1.0, 3.0  # of a render, for the progress


class Variant(NamedTuple):
    """What is measured; as in a report's curves. `sigma`: the roughness, None of a model without and of Subsurface."""

    group: str
    model: str
    quality: str | None
    sigma: float | None
    osl: bool

    def make(self) -> bpy.types.Material:
        """Return a new material of it, in the paint of the scenes' meshes."""
        if self.group == SUBSURFACE.key:
            return translucent_material(self.quality or "Random Walk", paint)
        return rough_material(self.model, self.sigma or 0.0, self.quality, paint)

    @property
    def text(self) -> str:
        """Its name for people."""
        return ", ".join(filter(None, (self.model, "OSL" if self.osl else self.quality)))


def variants(summary: MaterialSummary, setup: RenderSetup) -> list[Variant]:
    """Return what settings for a material can be picked from in the scene's engine; nothing of Standard Specular."""
    if summary.group == SPECULAR_GROUP.key:
        return []
    if summary.group == SUBSURFACE.key:
        return [Variant(summary.group, summary.label, summary.mode if setup.engine is CYCLES else None, None, False)]
    model = summary.reflectance
    roughness = summary.number(summary.socket("Roughness"))
    sigma = None
    if model.is_rough and model.parameter:
        sigma = min(round(ROUGHNESS_STEP * math.ceil(roughness / ROUGHNESS_STEP - 1e-6), 3), model.parameter.high)
    qualities = QUALITIES[setup.engine] if model.functions else (USUAL[setup.engine],)
    followed = (CHOSEN_LIGHTS,) if summary.follows_lights and not setup.osl and setup.engine is not REALTIME else ()
    return [Variant(ROUGH_DIFFUSE.key, summary.label, quality, sigma, setup.osl) for quality in (*qualities, *followed)]


def total_work(measured: Sequence[Variant], setup: RenderSetup) -> float:
    """Return the work of `steps` in the units of its progress."""
    spheres = sum(variant.group != SUBSURFACE.key for variant in measured)
    fives = 1 + len(COUNTS) + (setup.engine is not REALTIME)
    return SPHERE_WORK * len(SPHERE_SAMPLES[setup.engine]) * spheres + FIVE_WORK * fives * len(measured)


def steps(measured: Sequence[Variant], setup: RenderSetup) -> Steps[list[Record]]:
    """Measure variants in the engine of `setup`, a render at a time; return their curves."""
    bench, found = _Bench(setup), list[Record]()
    for variant in measured:
        if variant.group != SUBSURFACE.key:
            units = yield from bench.sphere_units(variant)
            found.append(bench.record(variant, "sphere") | curves.fitted(units))
        units = yield from bench.five_units(variant)
        found.append(bench.record(variant, "five") | _noise(units))
    return found


@dataclass
class _Bench:
    """What renders variants; `surfaces` are those of the sphere, `pixels` those of the five that count."""

    setup: RenderSetup
    surfaces: dict[float, error.GBuffer] = field(default_factory=dict)
    pixels: Sequence[int] = ()

    def record(self, variant: Variant, scene: str) -> Record:
        """Return what names a curve."""
        named = {"scene": scene, "engine": self.setup.engine.key, "device": self.setup.device, "kind": "ours"}
        return named | variant._asdict()

    @contextmanager
    def shown[Scene: StudyScene](self, variant: Variant, build: Callable[[], Scene]) -> Generator[tuple[Scene, bpy.types.Material]]:
        """Yield a scene and the variant's material, which are removed again."""
        with render.temporary_data():
            scene = build()
            follows = variant.quality == CHOSEN_LIGHTS
            with chosen_lights.following(scene.suns) if follows else nullcontext():
                yield scene, variant.make()

    def sphere_units(self, variant: Variant) -> Steps[list[Record]]:
        """Render the sphere; return a unit for each picture, with its error against the model's formula."""
        formula = by_label(variant.model).reference({"Roughness": variant.sigma or 0.0, "IOR": IOR.usual})
        repeats: dict[int, int] = {}
        units = list[Record]()
        for samples in SPHERE_SAMPLES[self.setup.engine]:
            yield Step(f"{variant.text}, error", SPHERE_WORK)
            repeat = repeats[samples] = repeats.get(samples, -1) + 1
            with self.shown(variant, partial(SphereScene, "True Diffuse Benchmark")) as (scene, material):
                scene.built = replace(scene.built, surfaces=self.surfaces)
                seconds, rgb = scene.picture(material, self.setup.engine_on_device, variant.osl, samples, repeat)
                expected = scene.analytic(formula)
            rms = error.errors(rgb, expected, expected).rms
            units.append({"samples": samples, "repeat": repeat, "seconds": seconds, "error": rms})
        return units

    def five_units(self, variant: Variant) -> Steps[list[Record]]:
        """Render the five with each sample count; return a unit for each, with its noise as `error`.

        A picture is held against one of the most samples with other random numbers. Realtime has none, so its last picture stands
        for all samples.
        """
        units, pictures = list[Record](), list[array[float]]()
        yield from self.five(variant, COUNTS[0], 0, FIVE_WORK)  # compiles, and does not count
        for samples in COUNTS:
            if len(units) >= LEAST_COUNTS:
                line = fit.line([unit["samples"] for unit in units], [unit["seconds"] for unit in units])
                if line.seconds(samples) > LONGEST:
                    break
            seconds, rgb = yield from self.five(variant, samples, 0, FIVE_WORK)
            units.append({"samples": samples, "seconds": seconds})
            pictures.append(rgb)
        if self.setup.engine is REALTIME:
            last = pictures.pop()
            errors = [error.difference(rgb, last, self.pixels) for rgb in pictures]
            return [unit | {"error": value} for unit, value in zip(units, errors, strict=False)]
        left = 1 + len(COUNTS) - len(units)
        _, other = yield from self.five(variant, units[-1]["samples"], 1, FIVE_WORK * left)
        squares = [error.difference(rgb, other, self.pixels) ** 2 for rgb in pictures]
        least = squares[-1] / 2.0  # each of the two has its part in the difference
        squares = [max(square - least, least) for square in squares]
        return [unit | {"error": math.sqrt(square)} for unit, square in zip(units, squares, strict=True)]

    def five(self, variant: Variant, samples: int, seed: int, work: float) -> Steps[tuple[float, array[float]]]:
        """Render the five once."""
        yield Step(f"{variant.text}, noise of {samples} sample{'s' if samples > 1 else ''}", work)
        with self.shown(variant, lambda: FiveScene(monkey(), False)) as (scene, material):
            self.pixels = self.pixels or scene.pixels
            return scene.picture(material, self.setup.engine_on_device, variant.osl, samples, seed)


def _noise(units: Sequence[Record]) -> Record:
    """Return the points of a curve that is nothing but noise, with its slope."""
    counts, errors = [unit["samples"] for unit in units], [unit["error"] for unit in units]
    line = fit.line(counts, [unit["seconds"] for unit in units])
    power = fit.power(counts, errors) if min(errors) > NOISELESS else None
    return {
        "points": [{name: unit[name] for name in ("samples", "seconds", "error")} for unit in units],
        "floor": 0.0,
        "floor_uncertainty": None,
        "slope": power.slope if power else None,
        "noise": power.noise if power else None,
        "seconds_fixed": line.fixed,
        "seconds_per_sample": line.per_sample,
        "last_samples": LAST_SAMPLES,
    }


def missing(wanted: Iterable[Variant], setup: RenderSetup, kept: Sequence[Record]) -> list[Variant]:
    """Return which variants have no curve among those `kept`."""
    return [variant for variant in dict.fromkeys(wanted) if not _curves_of(variant, setup, kept)]


def report(wanted: Sequence[Variant], setup: RenderSetup, kept: Sequence[Record]) -> Record:
    """Return the curves of variants in the form of a report."""
    return {"curves": [curve for variant in wanted for curve in _curves_of(variant, setup, kept)]}


def _curves_of(variant: Variant, setup: RenderSetup, kept: Sequence[Record]) -> list[Record]:
    key = {"engine": setup.engine.key, "device": setup.device, **variant._asdict()}
    return [curve for curve in kept if all(curve[name] == value for name, value in key.items())]


def path() -> Path:
    """Return where the curves of this machine, Blender and version of the extension are kept."""
    here = environment([])
    identity = json.dumps([here[key] for key in ("machine", "blender", "true_diffuse")])
    return user_folder() / f"benchmark_{hashlib.sha256(identity.encode()).hexdigest()[:16]}.json"


def source() -> str:
    """Return where numbers come from, in words: the day on which this machine was measured last, or that it was not."""
    try:
        day = datetime.fromtimestamp(path().stat().st_mtime).date()
    except FileNotFoundError:
        return "Measures this machine first"
    return f"Measured on this machine, {day}"


def read() -> list[Record]:
    """Return the curves that are kept; none where there is no file, it is damaged or of another version."""
    try:
        document = json.loads(path().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return document["curves"] if isinstance(document, dict) and document.get("version") == VERSION else []


def keep(found: Sequence[Record]) -> None:
    """Keep curves, and none but them. Raises OSError where the file cannot be written."""
    document = {"version": VERSION, "environment": environment([]), "curves": found}
    file = path()
    file.parent.mkdir(parents=True, exist_ok=True)
    whole = file.with_suffix(".new")
    whole.write_text(json.dumps(document, allow_nan=False) + "\n", encoding="utf-8")
    whole.replace(file)
