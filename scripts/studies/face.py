# SPDX-License-Identifier: GPL-3.0-or-later
"""The face's comparison as data: the engines' radiance of each region of skin against Cycles', under the lamps with shadows."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Progress, Record, known
from true_diffuse.addon.models.vector import dot
from true_diffuse.scripts.characters.face import Face, Look, region_albedo
from true_diffuse.scripts.characters.human import REGIONS
from true_diffuse.scripts.studies.five import MEASUREMENT_WORK
from true_diffuse.scripts.studies.pictures import Captions
from true_diffuse.scripts.studies.pictures import captions as captions_of

# Renders with random numbers of their own, so that their noise can be told and taken out; others are always the same.
TAKES = {EEVEE: 1, CYCLES: 2, REALTIME: 1}
HELD = (EEVEE, REALTIME)  # against Cycles
FRONT = ("forehead", "cheeks", "nose")  # where these face the key they are FRONT_LIT
FRONT_LIT, FACING = "front-lit", 0.3  # the least N.L
NEAR = 0.01  # of albedo, by which a region is told


@dataclass(frozen=True)
class Seen:
    """What the camera sees of one head: the pixels of each region of its skin."""

    look: Look
    pixels: dict[str, list[int]]


@dataclass(frozen=True)
class Measured:
    """One head in one engine: the linear RGB radiance [W/(m^2 sr)] of each take, of `samples` each."""

    look: Look
    engine: Engine
    samples: int
    seconds: float
    takes: tuple[array[float], ...]

    @property
    def mean(self) -> array[float]:
        return array("f", (sum(values) / len(values) for values in zip(*self.takes, strict=True)))


def captions(stage: Face) -> Captions:
    """Return the captions of the three heads."""
    return captions_of(stage.scene, {head.look.label: head.subject for head in stage.heads})


def surfaces(stage: Face, progress: Progress) -> list[Seen]:
    """Return, for each head, the pixels of each region that no edge and no border of a region runs through."""
    light = render.light_of(stage.lamps[0])
    seen = []
    for head in stage.heads:
        with (
            progress.step(f"Regions  {head.look.label}", MEASUREMENT_WORK),
            render.measurement_scene(stage.scene, head.subject) as scene,
        ):
            surface = render.surface(scene, stage.regions)
        seen.append(Seen(head.look, _regions(surface, light)))
    return seen


def _regions(surface: error.Surface, light: error.Light) -> dict[str, list[int]]:
    pixels: dict[str, list[int]] = {FRONT_LIT: []}
    for region in REGIONS[REGIONS.index("other skin") :]:
        pixels[region] = [
            pixel
            for pixel, measurable in enumerate(surface.measurable)
            if measurable and abs(surface.albedo[3 * pixel] - region_albedo(region)) < NEAR
        ]
    normal = surface.normal
    for region in FRONT:
        for pixel in pixels[region]:
            n = (normal[3 * pixel], normal[3 * pixel + 1], normal[3 * pixel + 2])
            if dot(n, light.direction) >= FACING:
                pixels[FRONT_LIT].append(pixel)
    return pixels


def measure(stage: Face, engine: Engine, samples: int, progress: Progress) -> list[Measured]:
    """Return how `engine` renders each head under the lamps and their shadows, without fill, bounces and denoising."""
    measured = []
    for head in stage.heads:
        with render.measurement_scene(stage.scene, head.subject, *stage.lamps, shadows=True) as scene:
            seconds, takes = 0.0, []
            for take in range(TAKES[engine]):
                with progress.step(f"Measuring  {engine.label}  {head.look.label}", MEASUREMENT_WORK):
                    spent, rgb = render.radiance(scene, engine, samples, take)
                seconds += spent
                takes.append(rgb)
        measured.append(Measured(head.look, engine, samples, seconds, tuple(takes)))
    return measured


def records(seen: Sequence[Seen], measured: Sequence[Measured]) -> list[Record]:
    """Return one record per head and region as compare.json keeps it.

    `rms_difference` is each engine's from Cycles; `noise`, which is not in it, is what is random in the mean of Cycles' takes: both
    RMS over all channels as shares of Cycles' RMS. Radiances are linear RGB [W/(m^2 sr)]; seconds and samples are those of all
    takes. What cannot be told, as an engine or the region is missing, is None.
    """
    result = []
    for one in seen:
        engines = {m.engine.key: m for m in measured if m.look is one.look}
        means = {key: m.mean for key, m in engines.items()}
        cycles = engines.get(CYCLES.key)
        held = {engine.key: means[engine.key] for engine in HELD if engine.key in means}
        for region, pixels in one.pixels.items():
            result.append(
                {
                    "scene": "face",
                    "look": one.look.name,
                    "region": region,
                    "pixels": len(pixels),
                    "engines": list(engines),
                    "rms_difference": {key: _difference(rgb, cycles.takes, pixels) for key, rgb in held.items()} if cycles else {},
                    "noise": None if cycles is None else known(error.difference(*cycles.takes, pixels) / 2.0),
                    "mean_radiance": {key: _mean(rgb, pixels) for key, rgb in means.items()},
                    "samples": {key: len(m.takes) * m.samples for key, m in engines.items()},
                    "render_seconds": {key: m.seconds for key, m in engines.items()},
                }
            )
    return result


def _difference(rgb: array[float], takes: tuple[array[float], ...], pixels: Sequence[int]) -> float | None:
    """Return sqrt(sum (L - a)(L - b) / sum a b) of L from two takes a, b, in which their noise cancels as it is independent."""
    places = [place for pixel in pixels for place in range(3 * pixel, 3 * pixel + 3)]
    first, second = takes
    square = math.fsum((rgb[i] - first[i]) * (rgb[i] - second[i]) for i in places)
    reference = math.fsum(first[i] * second[i] for i in places)
    return math.sqrt(max(0.0, square) / reference) if reference > 0.0 else None


def _mean(rgb: array[float], pixels: Sequence[int]) -> list[float] | None:
    """Return the mean of red, green and blue over `pixels`."""
    if not pixels:
        return None
    return [math.fsum(rgb[3 * pixel + channel] for pixel in pixels) / len(pixels) for channel in range(3)]


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows that sum up `records` for people."""

    def percent(share: float | None) -> str:
        return "-" if share is None else f"{100.0 * share:.2f} %"

    def color(record: Record, engine: Engine) -> str:
        rgb = record["mean_radiance"].get(engine.key)
        return "-" if rgb is None else " ".join(f"{value:.3f}" for value in rgb)

    columns = ("Look", "Region", "Pixels", *(engine.label for engine in HELD), "Noise")
    columns += tuple(f"{engine.label} RGB" for engine in (*HELD, CYCLES))
    return columns, [
        (
            r["look"],
            r["region"],
            str(r["pixels"]),
            *(percent(r["rms_difference"].get(engine.key)) for engine in HELD),
            percent(r["noise"]),
            *(color(r, engine) for engine in (*HELD, CYCLES)),
        )
        for r in records
    ]
