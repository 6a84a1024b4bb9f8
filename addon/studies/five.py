# SPDX-License-Identifier: GPL-3.0-or-later
"""The five-character comparison as data and pictures: measurements of each, error maps, records, one engine against another."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...scenes.five_characters import Character, FiveCharacters
from ..engines import CYCLES, REALTIME, Engine
from ..measure import error, picture, render
from ..measure.record import Progress, Record, known
from ..models import Lambert, OrenNayar
from ..nodes import ROUGH_DIFFUSE
from .pictures import PICTURE_WORK, Captions, captions

MEASUREMENT_WORK = 1.0  # a twelfth of what a picture takes
OSL_SAMPLES = 4  # only what the pixel filter mixes is random here


@dataclass(frozen=True)
class Seen:
    """What the camera sees of one character, and what the models say of it."""

    character: Character
    region: render.Region
    surface: error.Surface
    distance: array[float]
    expected: error.Analytic
    lambert: error.Analytic


@dataclass(frozen=True)
class Measured:
    """One character in one engine: `rgb` is its linear radiance [W/(m^2 sr)]; `osl`, whether Cycles had it on."""

    seen: Seen
    engine: Engine
    samples: int
    seconds: float
    errors: error.Errors
    difference: dict[int, float]
    rgb: array[float]
    osl: bool


def work(stage: FiveCharacters, engine_count: int, osl: bool) -> float:
    """Return the work of a whole comparison, in the units that this module reports to `Progress`; `osl`: with `measure_osl`."""
    measured = (engine_count + 1) * len(stage.characters) + osl * sum(map(_has_osl, stage.characters))
    return engine_count * PICTURE_WORK + measured * MEASUREMENT_WORK


def _has_osl(character: Character) -> bool:
    return character.look.group is ROUGH_DIFFUSE


def surfaces(stage: FiveCharacters, progress: Progress) -> list[Seen]:
    """Return, for each character, its visible surface and the analytic radiance of every pixel under the key light alone."""
    light = render.light_of(stage.key)
    camera = tuple(stage.scene.camera.matrix_world.translation)
    seen = []
    for character in stage.characters:
        with (
            progress.step(f"Analytic  {character.look.label}", MEASUREMENT_WORK),
            render.measurement_scene(stage.scene, character.subject, stage.key) as scene,
        ):
            surface = render.surface(scene, stage.plain)
            region = render.region_of(stage.scene, character.subject)
            if len(surface.measurable) != region.width * region.height:
                raise RuntimeError(f"the render of {character.look.label} has not the size of its region")
            expected, lambert = error.analytic(surface, (character.look.model, Lambert()), camera, light)
            seen.append(Seen(character, region, surface, error.distances(surface, camera), expected, lambert))
    return seen


def measure(stage: FiveCharacters, seen: Sequence[Seen], engine: Engine, samples: int, progress: Progress) -> list[Measured]:
    """Return how `engine` renders each character under the key light alone, without fill, shadows and bounces."""
    light = render.light_of(stage.key)
    measured = []
    for one in seen:
        with (
            progress.step(f"Measuring  {engine.label}  {one.character.look.label}", MEASUREMENT_WORK),
            render.measurement_scene(stage.scene, one.character.subject, stage.key) as scene,
        ):
            seconds, rgb = render.radiance(scene, engine, samples)
            result = error.errors(rgb, one.expected, one.lambert)
            difference = error.signed_difference(rgb, one.expected, one.surface, light)
            osl = engine is CYCLES and stage.scene.cycles.shading_system
            measured.append(Measured(one, engine, samples, seconds, result, difference, rgb, osl))
    return measured


def measure_osl(stage: FiveCharacters, seen: Sequence[Seen], progress: Progress) -> list[Measured]:
    """Return the same of Cycles with OSL, for the characters whose group has a shader there; their groups must be whole."""
    chosen = [one for one in seen if _has_osl(one.character)]
    before, stage.scene.cycles.shading_system = stage.scene.cycles.shading_system, True
    try:
        return measure(stage, chosen, CYCLES, OSL_SAMPLES, progress)
    finally:
        stage.scene.cycles.shading_system = before


def five_captions(stage: FiveCharacters) -> Captions:
    """Return the captions of the five characters."""
    return captions(stage.scene, {character.look.label: character.subject for character in stage.characters})


def write_error_maps(stage: FiveCharacters, measured: Sequence[Measured], folder: Path) -> None:
    """Write error_ENGINE.png for each engine into `folder`; where characters overlap, the nearest one's error is shown."""
    resolution = stage.scene.render.resolution_x, stage.scene.render.resolution_y
    for engine in dict.fromkeys(one.engine for one in measured):
        ours = [one for one in measured if one.engine is engine]
        nearest: dict[tuple[int, int], tuple[float, float]] = {}
        for one in ours:
            region = one.seen.region
            for pixel, value in one.difference.items():
                row, column = divmod(pixel, region.width)
                place = (region.x + column, region.y + region.height - 1 - row)
                distance = one.seen.distance[pixel]
                if place not in nearest or distance < nearest[place][0]:
                    nearest[place] = (distance, value)
        picture.heat_map(
            folder / f"error_{engine.key}.png",
            resolution,
            {place: value for place, (_, value) in nearest.items()},
            [f"{one.seen.character.look.label}:  {_percent(one.errors.rms)}" for one in ours],
            five_captions(stage).centers,
            f"{engine.label} minus analytic value, as a share of a Lambert surface lit head on  (captions: RMS error)",
        )


def _percent(share: float | None) -> str:
    """Return `share` in %, to a hundredth, or where it is below that to a hundredth of it."""
    if share is None:
        return "-"
    return f"{100.0 * share:.{2 if share >= 1e-4 else 4}f} %"


def record(one: Measured, albedo: float) -> Record:
    """Return one character in one engine as compare.json keeps it: seconds, radiances in W/(m^2 sr), errors as shares of 1.

    A figure that cannot be told, as no pixel faces both light and camera or the albedo is 0, is None.
    """
    look = one.seen.character.look

    return {
        "name": look.name,
        "model": type(look.model).__name__,
        "sigma": look.model.sigma if isinstance(look.model, OrenNayar) else None,
        "albedo": albedo,
        "engine": one.engine.key,
        "samples": one.samples,
        "render_seconds": one.seconds,
        "pixels": one.errors.pixels,
        "rms_error": known(one.errors.rms),
        "p99_error": known(one.errors.p99),
        "mean_luminance": known(one.errors.mean_luminance),
        "luminance_over_lambert": known(one.errors.luminance_over_lambert),
    }


def between_engines(measured: Sequence[Measured]) -> list[Record]:
    """Return, for each character in Cycles and in Realtime, how far Realtime is from Cycles in the pixels that were measured.

    `rms_difference` is relative to the RMS of Cycles, None where that is black. Neither engine has bounces there.
    """
    drawn = {one.seen.character.look.name: one for one in measured if one.engine is REALTIME}
    found = []
    for one in measured:
        name = one.seen.character.look.name
        if one.engine is CYCLES and name in drawn:
            difference = error.difference(drawn[name].rgb, one.rgb, one.seen.expected.pixels)
            own: Record = {"name": name, "osl": one.osl, "samples": one.samples, "pixels": one.errors.pixels}
            found.append(own | {"rms_difference": known(difference)})
    return found


def between_engines_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows that sum up for people what `between_engines` found."""
    ways = {False: "Cycles", True: "Cycles with OSL"}
    by_name: dict[str, dict[bool, float | None]] = {}
    for one in records:
        by_name.setdefault(one["name"], {})[one["osl"]] = one["rms_difference"]
    used = sorted({one["osl"] for one in records})
    rows: list[tuple[str, ...]] = [(name, *(_percent(found.get(osl)) for osl in used)) for name, found in by_name.items()]
    return ("Character", *(f"RMS from {ways[osl]}" for osl in used)), rows


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows that sum up `records` for people."""

    def show(value: float | None, form: str) -> str:
        return "-" if value is None else form.format(value)

    columns = ("Engine", "Character", "Seconds", "Pixels", "RMS error", "99 % below", "Luminance", "L / Lambert")
    rows: list[tuple[str, ...]] = [
        (
            str(r["engine"]),
            str(r["name"]),
            show(r["render_seconds"], "{:.1f}"),
            str(r["pixels"]),
            _percent(r["rms_error"]),
            _percent(r["p99_error"]),
            show(r["mean_luminance"], "{:.4f}"),
            show(r["luminance_over_lambert"], "{:.4f}"),
        )
        for r in records
    ]
    return columns, rows
