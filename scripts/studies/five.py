# SPDX-License-Identifier: GPL-3.0-or-later
"""The five-character comparison as data and pictures: measurements of each, error maps, records, one engine against another."""

import json
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy

from true_diffuse.addon.blender.engines import CYCLES, Engine
from true_diffuse.addon.closures.quality import CHOSEN_LIGHTS
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Progress, Record, known
from true_diffuse.addon.models import Lambert, OrenNayar
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, chosen_lights
from true_diffuse.scenes.five_characters import Character, CharacterLook, FiveCharacters
from true_diffuse.scripts.studies import picture
from true_diffuse.scripts.studies.pictures import Captions, captions

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


def has_osl(look: CharacterLook) -> bool:
    """Return whether a look's group has a shader in Open Shading Language."""
    return look.group is ROUGH_DIFFUSE


def measure_osl(stage: FiveCharacters, seen: Sequence[Seen], progress: Progress) -> list[Measured]:
    """Return the same of Cycles with OSL, for the characters whose group has a shader there; their groups must be whole."""
    chosen = [one for one in seen if has_osl(one.character.look)]
    before, stage.scene.cycles.shading_system = stage.scene.cycles.shading_system, True
    try:
        return measure(stage, chosen, CYCLES, OSL_SAMPLES, progress)
    finally:
        stage.scene.cycles.shading_system = before


def has_stand_in(look: CharacterLook) -> bool:
    """Return whether closures that stand in for a look's model by default can be exact, in the group's mode Lamps."""
    return look.group is SPECULAR_GROUP


def measure_lamps(stage: FiveCharacters, seen: Sequence[Seen], samples: int, progress: Progress) -> list[Measured]:
    """Return the same of Cycles in the mode Lamps, which follows the key light; the characters' groups must be whole."""
    chosen = [one for one in seen if has_stand_in(one.character.look)]
    modes = [_node(one.character).inputs["Quality"] for one in chosen]
    before = [mode.default_value for mode in modes]
    try:
        with chosen_lights.following([stage.key]):
            for mode in modes:
                mode.default_value = CHOSEN_LIGHTS
            return measure(stage, chosen, CYCLES, samples, progress)
    finally:
        for mode, value in zip(modes, before, strict=True):
            mode.default_value = value


def _node(character: Character) -> bpy.types.Node:
    """Return the node of a character's group."""
    return character.subject.material_slots[0].material.node_tree.nodes[character.look.group.name]


def five_captions(stage: FiveCharacters) -> Captions:
    """Return the captions of the five characters."""
    return captions(stage.scene, {character.look.label: character.subject for character in stage.characters})


@dataclass(frozen=True)
class Patch:
    """What an error map shows of one character: its pixels, as y * width + x from the frame's bottom left, and of each the distance
    from the camera [m] and the error, a share of a Lambert surface lit head on. `center` is the x of its caption [pixels].
    """

    label: str
    center: float
    rms: float | None
    pixels: array[int]
    distance: array[float]
    error: array[float]

    def packed(self) -> bytes:
        """Return all of it as bytes, little-endian as all machines that Blender runs on."""
        header = {"label": self.label, "center": self.center, "rms": self.rms, "pixels": len(self.pixels)}
        return json.dumps(header).encode() + b"\n" + b"".join(x.tobytes() for x in (self.pixels, self.distance, self.error))

    @staticmethod
    def unpacked(content: bytes) -> "Patch":
        """Return what `packed` made bytes of."""
        line, _, rest = content.partition(b"\n")
        header = json.loads(line)
        columns = array("i"), array("f"), array("f")
        for place, column in enumerate(columns):
            size = 4 * header["pixels"]
            column.frombytes(rest[place * size : (place + 1) * size])
        return Patch(header["label"], header["center"], header["rms"], *columns)


def patch(stage: FiveCharacters, one: Measured) -> Patch:
    """Return what the error map of `one`'s engine shows of it."""
    region, width = one.seen.region, stage.scene.render.resolution_x
    places = array("i")
    for pixel in one.difference:
        row, column = divmod(pixel, region.width)
        places.append((region.y + region.height - 1 - row) * width + region.x + column)
    label = one.seen.character.look.label
    (center,) = captions(stage.scene, {label: one.seen.character.subject}).centers
    distance = array("f", (one.seen.distance[pixel] for pixel in one.difference))
    return Patch(label, center, known(one.errors.rms), places, distance, array("f", one.difference.values()))


def write_error_map(path: Path, engine: str, resolution: tuple[int, int], patches: Sequence[Patch]) -> None:
    """Write the errors of an `engine`, by its label; where characters overlap, the nearest one's is shown."""
    nearest: dict[int, tuple[float, float]] = {}
    for one in patches:
        for pixel, distance, error_there in zip(one.pixels, one.distance, one.error, strict=True):
            if pixel not in nearest or distance < nearest[pixel][0]:
                nearest[pixel] = (distance, error_there)
    width = resolution[0]
    picture.heat_map(
        path,
        resolution,
        {(pixel % width, pixel // width): value for pixel, (_, value) in nearest.items()},
        [f"{one.label}:  {percent(one.rms)}" for one in patches],
        [one.center for one in patches],
        f"{engine} minus analytic value, as a share of a Lambert surface lit head on  (captions: RMS error)",
    )


def percent(share: float | None) -> str:
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


@dataclass(frozen=True)
class Held:
    """One character in Cycles, for Realtime to be held against: `osl`, `samples` and `rgb` as in `Measured`; `pixels` measured.

    `mode` is the group's where that is another than the picture's.
    """

    osl: bool
    mode: str | None
    samples: int
    pixels: Sequence[int]
    rgb: array[float]


def realtime_from_cycles(realtime: array[float], cycles: Held) -> Record:
    """Return how far a character's radiance in Realtime is from that in Cycles. Neither engine has bounces there.

    `rms_difference` is relative to the RMS of Cycles, None where that is black.
    """
    difference = error.difference(realtime, cycles.rgb, cycles.pixels)
    way = {"osl": cycles.osl, "mode": cycles.mode, "samples": cycles.samples}
    return {**way, "pixels": len(cycles.pixels), "rms_difference": known(difference)}


def realtime_from_cycles_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows that sum up for people how far Realtime is from Cycles, a row for each look as it is rendered."""
    found: dict[tuple[object, ...], dict[str, float | None]] = {}
    for one in records:
        found.setdefault((one["character"], one["frame"], one["name"]), {})[way_of(one)] = one["rms_difference"]
    used = sorted({way_of(one) for one in records})
    rows: list[tuple[str, ...]] = [(str(key[-1]), *(percent(each.get(way)) for way in used)) for key, each in found.items()]
    return ("Character", *(f"RMS from {way}" for way in used)), rows


def way_of(one: Record) -> str:
    """Return in words what a record of `realtime_from_cycles` holds Realtime against."""
    return f"Cycles{' with OSL' * one['osl']}{f' in mode {one["mode"]}' if one['mode'] else ''}"


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
            percent(r["rms_error"]),
            percent(r["p99_error"]),
            show(r["mean_luminance"], "{:.4f}"),
            show(r["luminance_over_lambert"], "{:.4f}"),
        )
        for r in records
    ]
    return columns, rows
