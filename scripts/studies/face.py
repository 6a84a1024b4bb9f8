# SPDX-License-Identifier: GPL-3.0-or-later
"""The face measured: the radiance of each region of skin in EEVEE and Realtime against Cycles, with lights and shadows."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Progress, Record, known
from true_diffuse.addon.models.vector import dot
from true_diffuse.scripts.characters.face import Face, Head, HeadLook, region_albedo
from true_diffuse.scripts.characters.human import REGIONS
from true_diffuse.scripts.studies import noise, pictures
from true_diffuse.scripts.studies.five import MEASUREMENT_WORK

REPEATS = {EEVEE: 1, CYCLES: 2, REALTIME: 1}  # renders with independent noise, so that it can be measured and taken out
COMPARED = (EEVEE, REALTIME)  # with Cycles
FRONT = ("forehead", "cheeks", "nose")  # where these face the key light they are FRONT_LIT
FRONT_LIT, FACING = "front-lit", 0.3  # the least N.L
TOLERANCE = 0.01  # of the albedo that stands for a region


@dataclass(frozen=True)
class VisibleRegions:
    """The pixels of each region of one head's skin."""

    look: HeadLook
    pixels: dict[str, list[int]]


@dataclass(frozen=True)
class Measurement:
    """One head in one engine: the linear RGB radiance [W/(m^2 sr)] of each repeated render, with `samples` each."""

    look: HeadLook
    engine: Engine
    samples: int
    seconds: float
    repeats: tuple[array[float], ...]

    @property
    def mean(self) -> array[float]:
        return array("f", (sum(values) / len(values) for values in zip(*self.repeats, strict=True)))


def captions(stage: Face) -> pictures.Captions:
    """Return the captions of the three heads."""
    return pictures.captions(stage.scene, {head.look.label: head.subject for head in stage.heads})


def visible_regions(stage: Face, progress: Progress) -> list[VisibleRegions]:
    """Return, for each head, the pixels of each region; no edge of the head or border of a region crosses them."""
    visible = []
    for head in stage.heads:
        with progress.step(f"Regions  {head.look.label}", MEASUREMENT_WORK):
            visible.append(VisibleRegions(head.look, regions_of(stage, head)))
    return visible


def regions_of(stage: Face, head: Head) -> dict[str, list[int]]:
    """Return the pixels of each region of one head; no edge of the head or border of a region crosses them."""
    with render.measurement_scene(stage.scene, head.subject) as scene:
        surface = render.g_buffer(scene, stage.regions)
    return _regions(surface, render.light_of(stage.lights[0]))


def _regions(surface: error.GBuffer, light: error.Light) -> dict[str, list[int]]:
    pixels: dict[str, list[int]] = {FRONT_LIT: []}
    for region in REGIONS[REGIONS.index("other skin") :]:
        pixels[region] = [
            pixel
            for pixel, measurable in enumerate(surface.measurable)
            if measurable and abs(surface.albedo[3 * pixel] - region_albedo(region)) < TOLERANCE
        ]
    normal = surface.normal
    for region in FRONT:
        for pixel in pixels[region]:
            n = (normal[3 * pixel], normal[3 * pixel + 1], normal[3 * pixel + 2])
            if dot(n, light.direction) >= FACING:
                pixels[FRONT_LIT].append(pixel)
    return pixels


def measure(stage: Face, engine: Engine, samples: int, progress: Progress) -> list[Measurement]:
    """Return how `engine` renders each head under the lights with shadows, without fill, bounces and denoising."""
    measurements = []
    for head in stage.heads:
        with render.measurement_scene(stage.scene, head.subject, *stage.lights, shadows=True) as scene:
            seconds, repeats = 0.0, []
            for seed in range(REPEATS[engine]):
                with progress.step(f"Measuring  {engine.label}  {head.look.label}", MEASUREMENT_WORK):
                    spent, rgb = render.radiance(scene, engine, samples, seed)
                seconds += spent
                repeats.append(rgb)
        measurements.append(Measurement(head.look, engine, samples, seconds, tuple(repeats)))
    return measurements


def records(visible: Sequence[VisibleRegions], measurements: Sequence[Measurement]) -> list[Record]:
    """Return one record for each head and region as compare.json keeps it.

    `rms_difference` is each engine's from Cycles; `noise`, which is not in it, is that of the mean of Cycles' renders: both are RMS
    over all channels relative to Cycles' RMS. Radiances are linear RGB [W/(m^2 sr)]; seconds and samples are those of all repeats.
    A figure is None where the engine or the region is missing.
    """
    result = []
    for head in visible:
        engines = {m.engine.key: m for m in measurements if m.look is head.look}
        means = {key: m.mean for key, m in engines.items()}
        cycles = engines.get(CYCLES.key)
        compared = [engine.key for engine in COMPARED if engine.key in means]
        for region, pixels in head.pixels.items():
            result.append(
                {
                    "scene": "face",
                    "look": head.look.name,
                    "region": region,
                    "pixels": len(pixels),
                    "engines": list(engines),
                    "rms_difference": {}
                    if cycles is None
                    else {key: known(noise.difference((means[key],) * 2, cycles.repeats, pixels)) for key in compared},
                    "noise": None if cycles is None else known(error.difference(*cycles.repeats, pixels) / 2.0),
                    "mean_radiance": {key: mean(rgb, pixels) for key, rgb in means.items()},
                    "samples": {key: len(m.repeats) * m.samples for key, m in engines.items()},
                    "render_seconds": {key: m.seconds for key, m in engines.items()},
                }
            )
    return result


def mean(rgb: array[float], pixels: Sequence[int]) -> list[float] | None:
    """Return the mean of red, green and blue over `pixels`, None where there are none."""
    if not pixels:
        return None
    return [math.fsum(rgb[3 * pixel + channel] for pixel in pixels) / len(pixels) for channel in range(3)]


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows of a table of `records`."""

    def color(record: Record, engine: Engine) -> str:
        rgb = record["mean_radiance"].get(engine.key)
        return "-" if rgb is None else " ".join(f"{value:.3f}" for value in rgb)

    columns = ("Look", "Region", "Pixels", *(engine.label for engine in COMPARED), "Noise")
    columns += tuple(f"{engine.label} RGB" for engine in (*COMPARED, CYCLES))
    return columns, [
        (
            r["look"],
            r["region"],
            str(r["pixels"]),
            *(_percent(r["rms_difference"].get(engine.key)) for engine in COMPARED),
            _percent(r["noise"]),
            *(color(r, engine) for engine in (*COMPARED, CYCLES)),
        )
        for r in records
    ]


def _percent(fraction: float | None) -> str:
    return "-" if fraction is None else f"{100.0 * fraction:.2f} %"
