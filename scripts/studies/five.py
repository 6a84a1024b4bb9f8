# SPDX-License-Identifier: GPL-3.0-or-later
"""The five characters measured: each against its analytic model, error maps, and Realtime against Cycles."""

import json
import math
from array import array
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.closures.quality import CHOSEN_LIGHTS
from true_diffuse.addon.material.closure_nodes import closures, remove_copy, trees
from true_diffuse.addon.measure import error, probes, render
from true_diffuse.addon.measure.record import Progress, Record, known
from true_diffuse.addon.models import Lambert, OrenNayar, Specular
from true_diffuse.addon.models.vector import Vector
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, chosen_lights
from true_diffuse.addon.nodes.graph import key_and_version
from true_diffuse.scenes.five_characters import Character, CharacterLook, FiveCharacters
from true_diffuse.scripts.studies import pictures

MEASUREMENT_WORK = 1.0  # a twelfth of a picture's
OSL_SAMPLES = 4  # only the pixel filter is random here


@dataclass(frozen=True)
class Reference:
    """The visible surface of one character, its `distance` [m] from the camera, and its radiance by its model and by Lambert."""

    character: Character
    region: render.Region
    surface: error.GBuffer
    distance: array[float]
    expected: error.Analytic
    lambert: error.Analytic
    probed: render.ProbedGBuffer | None = None
    """Of a character as it is, in Cycles."""


@dataclass(frozen=True)
class Measurement:
    """One character in one engine: `rgb` is its linear radiance [W/(m^2 sr)]; `osl` says whether Cycles used OSL."""

    reference: Reference
    engine: Engine
    samples: int
    seconds: float
    errors: error.Errors
    difference: dict[int, float]
    rgb: array[float]
    osl: bool
    albedo_difference: float | None
    """Of EEVEE's albedo, with which a character as it is was measured, from Cycles'."""


def references(stage: FiveCharacters, progress: Progress) -> list[Reference]:
    """Return, for each character, its visible surface and the analytic radiance of every pixel under the key light alone."""
    result = []
    for character in stage.characters:
        with (
            progress.step(f"Analytic  {character.look.label}", MEASUREMENT_WORK),
            render.measurement_scene(stage.scene, character.subject, stage.key) as scene,
        ):
            region, probed = render.region_of(stage.scene, character.subject), None
            if stage.plain:
                surface = render.g_buffer(scene, stage.plain)
            else:
                with _probes(stage, character) as show:
                    probed = render.probed_g_buffer(scene, show, isinstance(character.look.model, Specular))
                surface = probed.surface
            if len(surface.measurable) != region.width * region.height:
                raise RuntimeError(f"the render of {character.look.label} does not have the size of its region")
            result.append(_reference(stage, character, region, surface, probed))
    return result


def _reference(
    stage: FiveCharacters,
    character: Character,
    region: render.Region,
    surface: error.GBuffer,
    probed: render.ProbedGBuffer | None,
) -> Reference:
    """Return the reference of a character of which `surface` is visible."""
    camera = tuple(stage.scene.camera.matrix_world.translation)
    model = character.look.model
    own = error.ByPixel(partial(_highlighted, probed.highlight)) if probed and isinstance(model, Specular) else model
    expected, lambert = error.analytic(surface, (own, Lambert()), camera, render.light_of(stage.key))
    return Reference(character, region, surface, distances(surface, camera), expected, lambert, probed)


def _highlighted(highlight: array[float], pixel: int) -> Specular:
    """Return standard specular with the highlight of a pixel."""
    return Specular(highlight[3 * pixel], highlight[3 * pixel + 1])


@contextmanager
def _probes(stage: FiveCharacters, character: Character) -> Generator[Callable[[str], None]]:
    """Yield what has a character as it is emit a channel of its materials; it then wears what is measured of its look."""
    assert stage.converted and character.materials
    converted, measured = stage.converted, character.materials.measured
    created = []

    def show(channel: str) -> None:
        materials = measured if channel == probes.HIGHLIGHT else converted
        emitting = {source: probes.probe(material, channel) for source, material in materials.items()}
        created.extend(emitting.values())
        character.wear(emitting)

    try:
        yield show
    finally:
        character.wear(measured)
        for material in created:
            remove_copy(material)


def measure(
    stage: FiveCharacters, references: Sequence[Reference], engine: Engine, samples: int, progress: Progress
) -> list[Measurement]:
    """Return how `engine` renders each character under the key light alone, without fill, shadows and bounces."""
    light = render.light_of(stage.key)
    measurements = []
    for reference in references:
        with (
            progress.step(f"Measuring  {engine.label}  {reference.character.look.label}", MEASUREMENT_WORK),
            render.measurement_scene(stage.scene, reference.character.subject, stage.key) as scene,
        ):
            seconds, rgb = render.radiance(scene, engine, samples)
            filtered = None
            if engine is EEVEE and reference.probed:
                reference, filtered = _filtered(stage, reference, scene)
            errors = error.errors(rgb, reference.expected, reference.lambert)
            difference = signed_difference(rgb, reference.expected, reference.surface, light)
            osl = engine is CYCLES and stage.scene.cycles.shading_system
            measurements.append(Measurement(reference, engine, samples, seconds, errors, difference, rgb, osl, filtered))
    return measurements


def _filtered(stage: FiveCharacters, reference: Reference, scene: bpy.types.Scene) -> tuple[Reference, float]:
    """Return the reference of a character as it is with EEVEE's own albedo and normals, and how far that albedo is from Cycles'.

    EEVEE shows textures through its mipmaps, Cycles at the center of a pixel. `scene` is a measurement scene, which cannot be used
    afterwards. The difference is relative to the RMS of Cycles' albedo.
    """
    with _probes(stage, reference.character) as show:
        albedo, normal = render.probed_inputs(scene, EEVEE, show)
    surface = replace(reference.surface, albedo=albedo, normal=normal)
    difference = error.difference(albedo, reference.surface.albedo, reference.expected.pixels)
    return _reference(stage, reference.character, reference.region, surface, reference.probed), difference


def has_osl(look: CharacterLook) -> bool:
    """Return whether the group of `look` has a shader in Open Shading Language."""
    return look.group is ROUGH_DIFFUSE


def measure_osl(stage: FiveCharacters, references: Sequence[Reference], progress: Progress) -> list[Measurement]:
    """Return `measure` of Cycles with OSL for the characters that have a shader there."""
    chosen = [reference for reference in references if has_osl(reference.character.look)]
    before, stage.scene.cycles.shading_system = stage.scene.cycles.shading_system, True
    try:
        return measure(stage, chosen, CYCLES, OSL_SAMPLES, progress)
    finally:
        stage.scene.cycles.shading_system = before


def is_approximated(look: CharacterLook) -> bool:
    """Return whether closures only approximate the model of `look` in Cycles, unless its group follows chosen lights."""
    return look.group is SPECULAR_GROUP


def measure_chosen_lights(
    stage: FiveCharacters, references: Sequence[Reference], samples: int, progress: Progress
) -> list[Measurement]:
    """Return `measure` of Cycles at the quality Exact for Chosen Lights, which follows the key light, where that differs."""
    chosen = [reference for reference in references if is_approximated(reference.character.look)]
    sockets = [node.inputs["Quality"] for reference in chosen for node in group_nodes(reference.character)]
    before = [socket.default_value for socket in sockets]
    try:
        with chosen_lights.following([stage.key]):
            for socket in sockets:
                socket.default_value = CHOSEN_LIGHTS
            return measure(stage, chosen, CYCLES, samples, progress)
    finally:
        for socket, value in zip(sockets, before, strict=True):
            socket.default_value = value


def group_nodes(character: Character) -> Iterator[bpy.types.Node]:
    """Yield the nodes of our groups, with a menu Quality, in the materials that a character wears."""
    worn = {slot.material for part in character.parts for slot in part.material_slots}
    for material in sorted(worn, key=lambda material: material.name):
        for tree in trees(material):
            yield from (node for node in closures(tree) if key_and_version(node)[0] and "Quality" in node.inputs)


def captions(stage: FiveCharacters) -> pictures.Captions:
    """Return the captions of the five characters."""
    return pictures.captions(stage.scene, {character.look.label: character.subject for character in stage.characters})


@dataclass(frozen=True)
class Patch:
    """One character in an error map: pixels as y * width + x from the frame's bottom left, each with its distance [m] from the
    camera and its error, as a fraction of a Lambert surface at normal incidence. `center` is the x of the caption [pixels].
    """

    label: str
    center: float
    rms: float | None
    pixels: array[int]
    distance: array[float]
    error: array[float]

    def to_bytes(self) -> bytes:
        """Return the patch as a line of JSON and arrays, little-endian as all machines that Blender runs on."""
        header = {"label": self.label, "center": self.center, "rms": self.rms, "pixels": len(self.pixels)}
        return json.dumps(header).encode() + b"\n" + b"".join(x.tobytes() for x in (self.pixels, self.distance, self.error))

    @staticmethod
    def from_bytes(content: bytes) -> "Patch":
        """Return the patch that `to_bytes` wrote."""
        line, _, rest = content.partition(b"\n")
        header = json.loads(line)
        columns = array("i"), array("f"), array("f")
        size = 4 * header["pixels"]
        for index, column in enumerate(columns):
            column.frombytes(rest[index * size : (index + 1) * size])
        return Patch(header["label"], header["center"], header["rms"], *columns)


def patch(stage: FiveCharacters, measurement: Measurement) -> Patch:
    """Return one character's part of the error map of its engine."""
    reference, difference = measurement.reference, measurement.difference
    region, width = reference.region, stage.scene.render.resolution_x
    pixels = array("i")
    for pixel in difference:
        row, column = divmod(pixel, region.width)
        pixels.append((region.y + region.height - 1 - row) * width + region.x + column)
    label = reference.character.look.label
    (center,) = pictures.captions(stage.scene, {label: reference.character.subject}).centers
    distance = array("f", (reference.distance[pixel] for pixel in difference))
    return Patch(label, center, known(measurement.errors.rms), pixels, distance, array("f", difference.values()))


def write_error_map(path: Path, engine: str, resolution: tuple[int, int], patches: Sequence[Patch]) -> None:
    """Write the error map of an `engine`, by its label; where characters overlap, the nearest one's error is shown."""
    nearest: dict[int, tuple[float, float]] = {}
    for shown in patches:
        for pixel, *hit in zip(shown.pixels, shown.distance, shown.error, strict=True):
            nearest[pixel] = min(nearest.get(pixel, (math.inf, 0.0)), (hit[0], hit[1]))
    width = resolution[0]
    pictures.heat_map(
        path,
        resolution,
        {(pixel % width, pixel // width): value for pixel, (_, value) in nearest.items()},
        [f"{shown.label}:  {percent(shown.rms)}" for shown in patches],
        [shown.center for shown in patches],
        f"{engine} minus analytic value, as a fraction of a Lambert surface at normal incidence  (captions: RMS error)",
    )


def percent(fraction: float | None) -> str:
    """Return `fraction` in percent with two decimals, below 0.01 % with four; "-" for None."""
    if fraction is None:
        return "-"
    return f"{100.0 * fraction:.{2 if fraction >= 1e-4 else 4}f} %"


def record(measurement: Measurement, albedo: float) -> Record:
    """Return one character in one engine as compare.json keeps it: seconds, radiances in W/(m^2 sr), errors as fractions.

    A figure is None where no pixel faces both light and camera, or the albedo is 0. Of a character as it is, the albedo is None,
    and `diffuse_fraction` is the fraction of its pixels that reflect diffusely alone: those are measured, without their specular
    layers. EEVEE is measured with its own albedo, whose RMS difference from Cycles' is `albedo_difference`.
    """
    probed = measurement.reference.probed
    own: Record = {}
    if probed:
        own["diffuse_fraction"] = probed.coverage.diffuse / max(probed.coverage.visible, 1)
    if measurement.albedo_difference is not None:
        own["albedo_difference"] = known(measurement.albedo_difference)
    look, errors = measurement.reference.character.look, measurement.errors
    return {
        "name": look.name,
        "model": type(look.model).__name__,
        "sigma": look.model.sigma if isinstance(look.model, OrenNayar) else None,
        "albedo": None if probed else albedo,
        "engine": measurement.engine.key,
        "samples": measurement.samples,
        "render_seconds": measurement.seconds,
        "pixels": errors.pixels,
        "rms_error": known(errors.rms),
        "p99_error": known(errors.p99),
        "mean_luminance": known(errors.mean_luminance),
        "luminance_over_lambert": known(errors.luminance_over_lambert),
        **own,
    }


@dataclass(frozen=True)
class CyclesReference:
    """One character in Cycles: `osl`, `samples` and `rgb` as in `Measurement`; `pixels` are the measured ones.

    `quality` is the group's where it is not the picture's.
    """

    osl: bool
    quality: str | None
    samples: int
    pixels: Sequence[int]
    rgb: array[float]


def realtime_difference(realtime: array[float], cycles: CyclesReference) -> Record:
    """Return the RMS difference of a character's radiance in Realtime from Cycles, neither with bounces.

    `rms_difference` is relative to the RMS of Cycles, None where that is black.
    """
    difference = error.difference(realtime, cycles.rgb, cycles.pixels)
    reference = {"osl": cycles.osl, "quality": cycles.quality, "samples": cycles.samples}
    return {**reference, "pixels": len(cycles.pixels), "rms_difference": known(difference)}


def realtime_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows of a table of `realtime_difference`, a row for each character and a column for each reference."""
    differences: dict[tuple[object, ...], dict[str, float | None]] = {}
    for item in records:
        differences.setdefault((item["character"], item["frame"], item["name"]), {})[reference_name(item)] = item["rms_difference"]
    names = sorted({reference_name(item) for item in records})
    rows: list[tuple[str, ...]] = [
        (str(key[-1]), *(percent(by_reference.get(name)) for name in names)) for key, by_reference in differences.items()
    ]
    return ("Character", *(f"RMS from {name}" for name in names)), rows


def reference_name(item: Record) -> str:
    """Return the name of the reference of a record of `realtime_difference`."""
    return f"Cycles{' with OSL' * item['osl']}{f', {item["quality"]}' if item['quality'] else ''}"


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows of a table of `record`."""

    def number(value: float | None, form: str) -> str:
        return "-" if value is None else format(value, form)

    columns = ["Engine", "Character", "Seconds", "Pixels", "RMS error", "99 % below", "Luminance", "L / Lambert"]
    is_partly = any("diffuse_fraction" in item for item in records)
    columns += ["Of its pixels diffuse"] * is_partly
    return tuple(columns), [
        (
            item["engine"],
            item["name"],
            number(item["render_seconds"], ".1f"),
            str(item["pixels"]),
            percent(item["rms_error"]),
            percent(item["p99_error"]),
            number(item["mean_luminance"], ".4f"),
            number(item["luminance_over_lambert"], ".4f"),
            *([number(item.get("diffuse_fraction"), ".0%")] * is_partly),
        )
        for item in records
    ]


def distances(surface: error.GBuffer, camera: Vector) -> array[float]:
    """Return the distance [m] of every pixel's surface from the point `camera`; undefined where there is no surface."""
    p = surface.position
    return array("f", (math.dist(camera, p[i : i + 3]) for i in range(0, len(p), 3)))


def signed_difference(
    rendered: array[float], expected: error.Analytic, surface: error.GBuffer, light: error.Light
) -> dict[int, float]:
    """Return, by pixel, the error of luminance divided by the luminance of Lambert with the pixel's albedo at normal incidence."""
    white = Lambert().radiance((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1.0) * light.irradiance
    difference = {}
    for k, pixel in enumerate(expected.pixels):
        excess = error.luminance(rendered, 3 * pixel) - error.luminance(expected.radiance, 3 * k)
        difference[pixel] = excess / (white * max(error.luminance(surface.albedo, 3 * pixel), 1e-6))
    return difference
