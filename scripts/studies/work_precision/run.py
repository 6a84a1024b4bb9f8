# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the study: every unit of work once, variants in turn, so that what slows the machine down slows all of them alike."""

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
from true_diffuse.scripts.studies.study import run as run_steps
from true_diffuse.scripts.studies.work_precision import stability
from true_diffuse.scripts.studies.work_precision.journal import Notes
from true_diffuse.scripts.studies.work_precision.test_scenes import (
    ANALYTIC,
    CONVERGED,
    REFERENCE_SEEDS,
    Five,
    Silent,
    Sphere,
    Takes,
    TestScene,
)
from true_diffuse.scripts.studies.work_precision.variants import SIGMA, Variant

# kinds of what a journal keeps
BUILD, UNIT, FIRST, STARTUP, REFERENCE, NOISE = "build", "unit", "first", "start-up", "reference", "noise"
GLSL, FORM, LUMINANCE, HARD_INPUTS = "glsl", "form", "luminance", "hard inputs"
TARGETS = {EEVEE.key: "GLSL", CYCLES.key: "OSL"}  # of the models whose hard inputs are measured, by the engine that has them
GLSL_WORK, HARD_WORK, RANDOM_INPUTS = 5.0, 15.0, 2000  # [s]; of each model
LUMINANCE_WORK, LUMINANCE_SAMPLES = 2.0, 4  # [s]
STARTUP_WORK = 8.0  # [s], of EEVEE's own shaders


@dataclass(frozen=True)
class Unit:
    """One render of a variant with a sample count; `repeat` counts those that are alike but for their random numbers."""

    variant: Variant
    samples: int
    repeat: int


def units(scene: TestScene) -> Iterator[Unit]:
    """Yield the units of a test scene interleaved: all variants once, then the next sample count, then the next repeat."""
    ladders = {variant: scene.ladder(variant) for variant in scene.variants}
    most = max(times for ladder in ladders.values() for times in ladder.values())
    every = sorted({samples for ladder in ladders.values() for samples in ladder})
    for repeat in range(most):
        for samples in every:
            for variant, ladder in ladders.items():
                if repeat < ladder.get(samples, 0):
                    yield Unit(variant, samples, repeat)


def beside(name: str, used: Sequence[Engine]) -> list[Engine]:
    """Return the engines in which something is measured beside the variants of the test scene `name`.

    Of the five characters it is the luminance over Lambert's; of the sphere, GLSL by EEVEE's driver.
    """
    return [engine for engine in used if name == Five.name or (name == Sphere.name and engine is EEVEE)]


@dataclass(frozen=True)
class Remaining:
    """What is left to do in a test scene: units, seeds of references, engines of what is measured beside them."""

    scene: TestScene
    units: Sequence[Unit] = ()
    references: Sequence[int] = ()
    beside: Sequence[Engine] = ()

    @property
    def variants(self) -> list[Variant]:
        """The variants of the units; each is rendered once before them, as its shaders are compiled then."""
        return list(dict.fromkeys(unit.variant for unit in self.units))

    @property
    def starts_eevee(self) -> bool:
        return any(variant.engine is EEVEE for variant in self.variants)

    @property
    def seconds(self) -> float:
        """How long it takes on two cores, roughly [s]: the work that `run` reports to a `Progress`."""
        total = sum(_seconds(self.scene, unit.variant, unit.samples) for unit in self.units)
        total += sum(_first_seconds(self.scene, variant) for variant in self.variants)
        total += len(self.references) * _reference_seconds(self.scene)
        return total + len(self.beside) * (LUMINANCE_WORK if isinstance(self.scene, Five) else GLSL_WORK)


def plan(scenes: Sequence[TestScene], used: Sequence[Engine], journal: Notes) -> list[Remaining]:
    """Return what is left, by test scene."""
    remaining = []
    for scene in scenes:
        left = [unit for unit in units(scene) if _key(scene, unit) not in journal.units]
        seeds = REFERENCE_SEEDS if scene.reference else ()
        references = [seed for seed in seeds if (REFERENCE, scene.name, seed) not in journal.units]
        kind = LUMINANCE if isinstance(scene, Five) else GLSL
        measured = [engine for engine in beside(scene.name, used) if (kind, engine.key) not in journal.units]
        remaining.append(Remaining(scene, left, references, measured))
    return remaining


def _key(scene: TestScene, unit: Unit) -> tuple[str | int, ...]:
    return (UNIT, scene.name, unit.variant.engine.key, unit.variant.label, unit.samples, unit.repeat)


def _seconds(scene: TestScene, variant: Variant, samples: int) -> float:
    return scene.costs[variant.engine.key].seconds(samples) * (variant.slowness if samples > 1 else 1.0)


def _first_seconds(scene: TestScene, variant: Variant) -> float:
    expected = scene.costs[variant.engine.key]
    return expected.first * variant.slowness + expected.seconds(1)


def _reference_seconds(scene: TestScene) -> float:
    return scene.costs[CYCLES.key].seconds(scene.reference_samples)


def run(left: Remaining, journal: Notes, progress: Progress) -> None:
    """Do what is left in a test scene, and put it into `journal`."""
    scene = left.scene
    if left.units or left.references:
        scene.prepare()
    for engine in left.beside:
        if isinstance(scene, Five):  # before the characters get other materials
            with progress.step(f"{scene.title}  {engine.label}  luminance over Lambert", LUMINANCE_WORK):
                _luminance(scene, engine, journal)
    for seed in left.references:
        with progress.step(f"{scene.title}  reference", _reference_seconds(scene)):
            _reference(scene, seed, journal)
    takes = [journal.picture(reference_name(scene, seed)) for seed in REFERENCE_SEEDS] if scene.reference and left.units else []
    if takes and (NOISE, scene.name) not in journal.units:
        journal.add((NOISE, scene.name), {"scene": scene.name, "error": scene.noise(takes)})
    materials = {}
    for variant in left.variants:
        with progress.step(_text(scene, variant, "first"), _first_seconds(scene, variant)):
            materials[variant] = _first(scene, variant, journal)
    for unit in left.units:
        with progress.step(_text(scene, unit.variant, str(unit.samples)), _seconds(scene, unit.variant, unit.samples)):
            _unit(scene, unit, materials[unit.variant], takes, journal)
    if left.beside and isinstance(scene, Sphere):
        with progress.step("GLSL", GLSL_WORK):
            _glsl(scene, journal)


def start_eevee(scene: TestScene, journal: Notes) -> None:
    """Render plain Diffuse, for the first time and again: the difference is EEVEE's own shaders."""
    plain = bpy.data.materials.new("Start-Up")
    first, again = (scene.picture(plain, EEVEE, False, 1, 0)[0] for _ in range(2))
    if (STARTUP, EEVEE.key) not in journal.units:
        journal.add((STARTUP, EEVEE.key), {"engine": EEVEE.key, "seconds": max(0.0, first - again)})


def reference_name(scene: TestScene, seed: int) -> str:
    """Return the name of the picture of a reference."""
    return f"{scene.name}_{seed}"


def _luminance(scene: Five, engine: Engine, journal: Notes) -> None:
    """Keep what the roughest character has over Lambert's luminance under the key light alone."""
    rough = replace(scene.built, characters=scene.built.characters[-1:])
    seen = five.references(rough, Silent())
    (measured,) = five.measure(rough, seen, engine, LUMINANCE_SAMPLES, Silent())
    journal.add((LUMINANCE, engine.key), {"engine": engine.key, "ratio": measured.errors.luminance_over_lambert})


def _reference(scene: TestScene, seed: int, journal: Notes) -> None:
    variant, samples = scene.reference, scene.reference_samples
    assert variant is not None
    seconds, rgb = scene.picture(variant.make(scene.paint), variant.engine, variant.osl, samples, seed)
    journal.keep_picture(reference_name(scene, seed), rgb)
    journal.add((REFERENCE, scene.name, seed), {"scene": scene.name, "samples": samples, "seconds": seconds})


def _first(scene: TestScene, variant: Variant, journal: Notes) -> bpy.types.Material:
    """Return the material of a variant, rendered once: that first time is kept apart."""
    samples, start = min(scene.ladder(variant)), time.perf_counter()
    material = variant.make(scene.paint)
    build = time.perf_counter() - start
    seconds, _ = scene.picture(material, variant.engine, variant.osl, samples, 0)
    key = (FIRST, scene.name, variant.engine.key, variant.label)
    if key not in journal.units:
        journal.add(key, {**_identity(scene, variant), "samples": samples, "seconds": seconds, "build_seconds": build})
    return material


def _unit(scene: TestScene, unit: Unit, material: bpy.types.Material, takes: Takes, journal: Notes) -> None:
    variant = unit.variant
    seconds, rgb = scene.picture(material, variant.engine, variant.osl, unit.samples, unit.repeat)
    found = {"samples": unit.samples, "repeat": unit.repeat, "seconds": seconds, "error": scene.error_of(variant, rgb, takes)}
    journal.add(_key(scene, unit), {**_identity(scene, variant), **found})


def _text(scene: TestScene, variant: Variant, what: str) -> str:
    return f"{scene.title}  {variant.engine.label}  {variant.label}  {what}"


def _identity(scene: TestScene, variant: Variant) -> Record:
    reference = CONVERGED if scene.reference else ANALYTIC
    model = variant.target.name if reference == ANALYTIC or scene.name == Five.name else "Subsurface, Random Walk"
    return {"scene": scene.name, **variant.record, "target": model, "reference": reference}


def _glsl(scene: Sphere, journal: Notes) -> None:
    """Keep the error of shaders/oren_nayar.glsl over the sphere's pixels, its time for them, and what its forms cost."""
    forms = list(cost.forms())
    surface, light = scene.built.surface(), render.light_of(scene.built.sun)
    camera = tuple(scene.built.scene.camera.matrix_world.translation)
    expected = scene.expected(scene.variants[0].target)
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
    seconds = 1e-9 * forms[-1]["nanoseconds"] * len(expected.pixels)  # the last is the shader itself
    journal.add((GLSL, EEVEE.key), {"scene": scene.name, "seconds": seconds, "error": (squares / total) ** 0.5})


def hard_inputs(target: str, journal: Notes) -> None:
    """Keep what a target of the models, GLSL or OSL, makes of random and of hard inputs, in 32-bit floats."""
    from true_diffuse.scripts.studies import reference_mpmath, stability_glsl, stability_osl  # need the package mpmath

    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    study = stability_glsl if target == "GLSL" else stability_osl
    found = list(run_steps(study.stability(reference_mpmath.radiance, quick, RANDOM_INPUTS), Silent()))
    journal.add((HARD_INPUTS, target), {"records": stability.shaders(found)})
