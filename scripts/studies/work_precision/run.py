# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the study: every unit of work once, contestants in turn, so that what slows the machine down slows all of them alike."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.scripts.studies import cost, five
from true_diffuse.scripts.studies.glsl_values import evaluate
from true_diffuse.scripts.studies.work_precision import stability
from true_diffuse.scripts.studies.work_precision.journal import Key, Notes
from true_diffuse.scripts.studies.work_precision.test_scenes import (
    ANALYTIC,
    CONVERGED,
    REFERENCE_SEEDS,
    Five,
    Silent,
    Sphere,
    Stage,
    Takes,
)
from true_diffuse.scripts.studies.work_precision.variants import SIGMA, Contestant

# kinds of what a journal keeps
UNIT, COLD, STARTUP, REFERENCE, NOISE = "unit", "cold", "start-up", "reference", "noise"
GLSL, FORM, LUMINANCE = "glsl", "form", "luminance"
GLSL_WORK = 5.0  # [s]
LUMINANCE_WORK, LUMINANCE_SAMPLES = 2.0, 4  # [s]
RANDOM_INPUTS = 2000  # of each model
STARTUP_WORK = 8.0  # [s], of EEVEE's own shaders


@dataclass(frozen=True)
class Unit:
    """One render: of a contestant, with a sample count, for the so-manieth time."""

    contestant: Contestant
    samples: int
    repeat: int

    def key(self, stage: Stage) -> Key:
        """Return what names it in a journal."""
        return (UNIT, stage.name, self.contestant.engine.key, self.contestant.label, self.samples, self.repeat)


def units(stage: Stage) -> Iterator[Unit]:
    """Yield the units of a stage in turn: all contestants once, then the next sample count, then the next repeat."""
    ladders = {contestant: stage.ladder(contestant).repeats for contestant in stage.contestants}
    most = max(times for ladder in ladders.values() for times in ladder.values())
    every = sorted({samples for ladder in ladders.values() for samples in ladder})
    for repeat in range(most):
        for samples in every:
            for contestant, ladder in ladders.items():
                if repeat < ladder.get(samples, 0):
                    yield Unit(contestant, samples, repeat)


@dataclass
class Part:
    """What is left to do of a stage."""

    stage: Stage
    units: list[Unit]
    references: list[int]
    cold: list[Contestant]


def plan(stages: Sequence[Stage], journal: Notes) -> list[Part]:
    """Return what is left, stage by stage; every contestant of it is rendered once before, as its shaders are compiled then."""
    parts = []
    for stage in stages:
        left = [unit for unit in units(stage) if unit.key(stage) not in journal.units]
        seeds = REFERENCE_SEEDS if stage.reference else ()
        references = [seed for seed in seeds if (REFERENCE, stage.name, seed) not in journal.units]
        parts.append(Part(stage, left, references, list(dict.fromkeys(unit.contestant for unit in left))))
    return parts


def work(parts: Sequence[Part], used: Sequence[Engine], journal: Notes) -> float:
    """Return how long all of it takes on two cores, roughly [s]: the work of `run` to its `progress`."""
    total = STARTUP_WORK * _starts(parts) + GLSL_WORK * _has_glsl(parts, used, journal)
    for part in parts:
        if isinstance(part.stage, Five):
            total += LUMINANCE_WORK * sum((LUMINANCE, engine.key) not in journal.units for engine in used)
        total += sum(_seconds(part.stage, unit.contestant, unit.samples) for unit in part.units)
        total += sum(_cold_seconds(part.stage, contestant) for contestant in part.cold)
        total += sum(_reference_seconds(part.stage) for _ in part.references)
    return total


def _starts(parts: Sequence[Part]) -> bool:
    return any(contestant.engine is EEVEE for part in parts for contestant in part.cold)


def _has_glsl(parts: Sequence[Part], used: Sequence[Engine], journal: Notes) -> bool:
    return EEVEE in used and any(part.stage.name == Sphere.name for part in parts) and (GLSL, Sphere.name) not in journal.units


def _seconds(stage: Stage, contestant: Contestant, samples: int) -> float:
    return stage.costs[contestant.engine.key].seconds(samples) * (contestant.slowness if samples > 1 else 1.0)


def _cold_seconds(stage: Stage, contestant: Contestant) -> float:
    expected = stage.costs[contestant.engine.key]
    return expected.first * contestant.slowness + expected.seconds(1)


def _reference_seconds(stage: Stage) -> float:
    return stage.costs[CYCLES.key].seconds(stage.reference_samples)


def run(parts: Sequence[Part], used: Sequence[Engine], journal: Notes, progress: Progress) -> None:
    """Do all that is left, and put it into `journal`."""
    if _starts(parts):
        with progress.step("Starting EEVEE", STARTUP_WORK):
            start_eevee(next(part.stage for part in parts if part.cold), journal)
    for part in parts:
        do(part, used, journal, progress)


def do(part: Part, used: Sequence[Engine], journal: Notes, progress: Progress) -> None:
    """Do what is left of a stage, EEVEE being started; `used` are the engines of what is measured beside the contestants."""
    stage = part.stage
    if part.units or part.references:
        stage.prepare()
    if isinstance(stage, Five):
        for engine in used:
            _luminance(stage, engine, journal, progress)
    for seed in part.references:
        _reference(stage, seed, journal, progress)
    takes = [journal.picture(reference_name(stage, seed)) for seed in REFERENCE_SEEDS] if stage.reference and part.units else []
    if takes and (NOISE, stage.name) not in journal.units:
        journal.add((NOISE, stage.name), {"scene": stage.name, "error": stage.noise(takes)})
    materials = _warm(part, journal, progress)
    for unit in part.units:
        _unit(stage, unit, materials[unit.contestant], takes, journal, progress)
    if isinstance(stage, Sphere) and _has_glsl([part], used, journal):
        with progress.step("GLSL", GLSL_WORK):
            _glsl(stage, journal)


def _luminance(stage: Five, engine: Engine, journal: Notes, progress: Progress) -> None:
    """Keep what the roughest character has over Lambert's luminance under the key light alone, before it gets other materials."""
    if (LUMINANCE, engine.key) in journal.units:
        return
    with progress.step(f"{stage.title}  {engine.label}  luminance over Lambert", LUMINANCE_WORK):
        rough = replace(stage.stage, characters=stage.stage.characters[-1:])
        seen = five.references(rough, Silent())
        (measured,) = five.measure(rough, seen, engine, LUMINANCE_SAMPLES, Silent())
        journal.add((LUMINANCE, engine.key), {"engine": engine.key, "ratio": measured.errors.luminance_over_lambert})


def reference_name(stage: Stage, seed: int) -> str:
    """Return the name of the picture of a reference."""
    return f"{stage.name}_{seed}"


def start_eevee(stage: Stage, journal: Notes) -> None:
    """Render plain Diffuse, for the first time and again: the difference is EEVEE's own shaders."""
    plain = bpy.data.materials.new("Start-Up")
    first, again = (stage.picture(plain, EEVEE, False, 1, 0)[0] for _ in range(2))
    if (STARTUP, EEVEE.key) not in journal.units:
        journal.add((STARTUP, EEVEE.key), {"engine": EEVEE.key, "seconds": max(0.0, first - again)})


def _reference(stage: Stage, seed: int, journal: Notes, progress: Progress) -> None:
    one = stage.reference
    assert one is not None
    with progress.step(f"{stage.title}  reference", _reference_seconds(stage)):
        seconds, rgb = stage.picture(one.make(stage.paint), one.engine, one.osl, stage.reference_samples, seed)
        journal.keep_picture(reference_name(stage, seed), rgb)
        key = (REFERENCE, stage.name, seed)
        journal.add(key, {"scene": stage.name, "samples": stage.reference_samples, "seconds": seconds})


def _warm(part: Part, journal: Notes, progress: Progress) -> dict[Contestant, bpy.types.Material]:
    """Return the materials of all contestants that have units left, each rendered once: that first time is kept apart."""
    stage, made = part.stage, {}
    for contestant in part.cold:
        least = min(stage.ladder(contestant).repeats)
        with progress.step(_text(stage, contestant, "first"), _cold_seconds(stage, contestant)):
            start = time.perf_counter()
            made[contestant] = contestant.make(stage.paint)
            build = time.perf_counter() - start
            seconds, _ = stage.picture(made[contestant], contestant.engine, contestant.osl, least, 0)
        key = (COLD, stage.name, contestant.engine.key, contestant.label)
        if key not in journal.units:
            journal.add(key, {**_identity(stage, contestant), "samples": least, "seconds": seconds, "build_seconds": build})
    return made


def _unit(stage: Stage, unit: Unit, material: bpy.types.Material, takes: Takes, journal: Notes, progress: Progress) -> None:
    contestant = unit.contestant
    with progress.step(_text(stage, contestant, str(unit.samples)), _seconds(stage, contestant, unit.samples)):
        seconds, rgb = stage.picture(material, contestant.engine, contestant.osl, unit.samples, unit.repeat)
        found = {
            "samples": unit.samples,
            "repeat": unit.repeat,
            "seconds": seconds,
            "error": stage.error_of(contestant, rgb, takes),
        }
        journal.add(unit.key(stage), {**_identity(stage, contestant), **found})


def _text(stage: Stage, contestant: Contestant, what: str) -> str:
    return f"{stage.title}  {contestant.engine.label}  {contestant.label}  {what}"


def _identity(stage: Stage, contestant: Contestant) -> Record:
    reference = CONVERGED if stage.reference else ANALYTIC
    target = contestant.target.name if reference == ANALYTIC or stage.name == "five" else "Subsurface, Random Walk"
    return {"scene": stage.name, **contestant.record, "target": target, "reference": reference}


def _glsl(stage: Sphere, journal: Notes) -> None:
    """Keep the error of shaders/oren_nayar.glsl over the sphere's pixels, its time for them, and what its forms cost."""
    forms = list(cost.forms(Silent()))
    safe = forms[-1]
    surface, light = stage.stage.surface(), render.light_of(stage.stage.sun)
    camera = tuple(stage.stage.scene.camera.matrix_world.translation)
    expected = stage.expected(stage.contestants[0].target)
    rows = []
    for pixel in expected.pixels:
        n, v = error.directions(surface, pixel, camera)
        rows.append(((*n, SIGMA), light.direction, v, surface.albedo[3 * pixel : 3 * pixel + 3]))
    call = "oren_nayar_radiance(oren_nayar_surface(a.xyz, c.xyz, d.xyz, oren_nayar_coefficients(a.w)), b.xyz)"
    squares = total = 0.0
    for k, got in enumerate(evaluate("oren_nayar", call, rows)):
        for channel in range(3):
            value = expected.radiance[3 * k + channel]
            squares += (light.irradiance * got[channel] - value) ** 2
            total += value * value
    for form in forms:
        journal.add((FORM, form["form"]), form)
    seconds = 1e-9 * safe["nanoseconds"] * len(expected.pixels)
    journal.add((GLSL, stage.name), {"scene": stage.name, "seconds": seconds, "error": (squares / total) ** 0.5})


def hard_inputs(home: str, journal: Notes) -> None:
    """Keep what a home of the models, GLSL or OSL, makes of random and of hard inputs, in 32-bit floats."""
    from true_diffuse.scripts.studies import reference_mpmath, stability_glsl, stability_osl  # need the package mpmath

    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    study = stability_glsl if home == "GLSL" else stability_osl
    found = list(study.stability(reference_mpmath.radiance, quick, RANDOM_INPUTS, Silent()))
    journal.add(("shaders", home), {"records": stability.shaders(found)})
