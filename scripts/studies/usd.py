# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each rough diffuse model is to its formula once it has gone through USD: records for the accuracy report."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from mathutils import Vector

from true_diffuse.addon import usd
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.read import identifier
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Progress, Record, known
from true_diffuse.addon.models import Lambert
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.scenes.sphere import COLOR, SphereUnderSun
from true_diffuse.scripts.studies import storm
from true_diffuse.scripts.studies.rough import LAMBERT, OTHER_SIGMAS, OTHERS, PAPER, QUICK_SIGMAS, SIGMAS, Law

LIGHT_DEGREES = (0.0, 60.0, 120.0)  # between light and viewer; beyond 90 MaterialX's compensated formula has its fault
CONSUMERS = ("MaterialX in Storm", "UsdPreviewSurface in Storm")
GENERATED = "MaterialX's GLSL"

type Judge = Callable[[Path], list[Record]]
"""Returns what scripts/check_usd.py, in a process of its own, finds in a file."""


@dataclass(frozen=True)
class Case:
    """A model of some roughness."""

    law: Law
    sigma: float

    def material(self) -> bpy.types.Material:
        """Return a new material of it."""
        inputs = {"Model": self.law.name, "Color": COLOR, "Roughness": self.sigma}
        return materials.create(f"{self.law.name} {self.sigma:g}", ROUGH_DIFFUSE, **inputs)


def cases(quick: bool) -> list[Case]:
    """Return what to measure."""
    if quick:
        return [Case(PAPER, sigma) for sigma in QUICK_SIGMAS]
    first = [Case(LAMBERT, 0.0), *(Case(PAPER, sigma) for sigma in SIGMAS)]
    eon = next(law for law in OTHERS if law.name == "EON")
    others = [Case(law, sigma) for law in OTHERS if law is not eon for sigma in (OTHER_SIGMAS if law.rough else OTHER_SIGMAS[:1])]
    return first + [Case(eon, sigma) for sigma in SIGMAS] + others


def work(quick: bool) -> float:
    """Return how many units of work `records` has: one for each render, and one for what the judge does."""
    return len(cases(quick)) * len(LIGHT_DEGREES) * len(CONSUMERS) + 1.0


def records(sphere: SphereUnderSun, folder: Path, judge: Judge, quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield a record for each model, consumer and angle of the light; the files are made in `folder`, and stay there."""
    every = cases(quick)
    with progress.step(GENERATED, 1.0):
        found = _generated(sphere, every, folder / "all.usdc", judge)
    for case in every:
        yield {**_record(case, GENERATED), **found[case]}
        for degrees in LIGHT_DEGREES:
            for consumer in CONSUMERS:
                with progress.step(f"{consumer}  {case.law.name}  {case.sigma:g}  {degrees:g} degrees", 1.0):
                    rms = rendered(sphere, case, degrees, folder / "one.usdc", preview=consumer is CONSUMERS[1])
                yield {**_record(case, consumer), "light_degrees": degrees, "rms_error": known(rms)}


def _record(case: Case, consumer: str) -> Record:
    return {"consumer": consumer, "model": case.law.name, "sigma": case.sigma if case.law.rough else None}


def _generated(sphere: SphereUnderSun, every: Sequence[Case], file: Path, judge: Judge) -> dict[Case, Record]:
    """Return what the judge finds, case by case: the problems, and how far generated GLSL is from the formula."""
    shown = [sphere.sphere.copy() for _ in every]
    names = []
    for case, item in zip(every, shown, strict=True):
        material = case.material()
        sphere.scene.collection.objects.link(item)
        item.material_slots[0].link, item.material_slots[0].material = "OBJECT", material
        names.append(identifier(material.name))
    _export(file)
    for item in shown:
        bpy.data.objects.remove(item)
    found = {record["material"]: record for record in judge(file)}
    keys = {"rms": "rms_error", "worst": "worst_error", "worst_beside": "worst_error_light_beside", "problems": "problems"}
    return {
        case: {new: found[name][old] for old, new in keys.items() if old in found[name]}
        for case, name in zip(every, names, strict=True)
    }


def rendered(sphere: SphereUnderSun, case: Case, degrees: float, file: Path, preview: bool) -> float:
    """Return the RMS error of Storm's render of the exported sphere, relative to that of the formula."""
    from pxr import Usd, UsdGeom, UsdLux, UsdShade

    angle = math.radians(degrees)
    towards = Vector((math.sin(angle), -math.cos(angle), 0.0))
    sphere.sun.matrix_world = towards.to_track_quat("Z", "Y").to_matrix().to_4x4()
    sphere.sphere.data.materials[0] = case.material()
    _export(file)
    stage = Usd.Stage.Open(str(file))
    prims = list(stage.Traverse())
    camera = next(UsdGeom.Camera(prim) for prim in prims if prim.IsA(UsdGeom.Camera))
    lamp = next(UsdLux.DistantLight(prim) for prim in prims if prim.IsA(UsdLux.DistantLight))
    for prim in prims:
        if preview and prim.IsA(UsdShade.Material):
            prim.RemoveProperty("outputs:mtlx:surface")
    rgb = storm.radiance(stage, camera, sphere.scene.render.resolution_x)
    light = replace(render.light_of(sphere.sun), irradiance=lamp.GetIntensityAttr().Get())
    eye = tuple(sphere.scene.camera.matrix_world.translation)
    inside = _without_rim(sphere.surface(), sphere.scene.render.resolution_x)
    expected, lambert = error.analytic(inside, [case.law.make(case.sigma), Lambert()], eye, light)
    return error.errors(rgb, expected, lambert).rms


def _without_rim(surface: error.GBuffer, width: int) -> error.GBuffer:
    """Return `surface` without the pixels beside one that is not measurable: Storm smooths edges."""
    good = surface.measurable
    around = [row * width + column for row in (-1, 0, 1) for column in (-1, 0, 1)]
    inner = (i for i in range(width + 1, len(good) - width - 1) if all(good[i + step] for step in around))
    kept = bytearray(len(good))
    for pixel in inner:
        kept[pixel] = 1
    return replace(surface, measurable=kept)


def _export(file: Path) -> None:
    bpy.ops.wm.usd_export(filepath=str(file), convert_world_material=False)
    usd.report.take()


def table(found: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each model and consumer, errors in %."""
    groups: dict[tuple[str, float | None, str], list[Record]] = {}
    for record in found:
        groups.setdefault((record["model"], record["sigma"], record["consumer"]), []).append(record)
    rows = []
    for (model, sigma, consumer), group in groups.items():
        first = group[0]
        errors = (record.get("rms_error") for record in group)
        worst = first.get("worst_error_light_beside"), first.get("worst_error")
        cells = [*errors, *[None] * (len(LIGHT_DEGREES) - len(group)), *worst]
        rows.append((f"{model}{'' if sigma is None else f' {sigma:g}'}", consumer, *map(_percent, cells)))
    angles = (f"{angle:g}\u00b0" for angle in LIGHT_DEGREES)
    return ("Model", "Consumer", *angles, "Worst, L.V > 0", "Worst"), rows


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.2g}"
