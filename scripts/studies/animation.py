# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyed materials and lamps: whether a frame of a film is the still of its values, and whether noise flickers between frames.

A sphere under a sun and a point lamp; sigma, albedo, the lamps' strengths and places go evenly from START to END.
"""

import math
import tempfile
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass
from itertools import pairwise
from pathlib import Path

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.addon.optimize.materials import optimize_materials
from true_diffuse.scenes.sphere import sphere_under_sun

LENGTH = 24  # frames from START to END
KEYED_FRAMES = (1, 8, LENGTH)  # that are held against stills
SLOW, SLOW_FRAMES = 1000, (500, 501, 502)  # a film that long, and frames of it: what they show differs by less than any noise
LENS = 80.0  # mm: leaves room at the left for the pixels that give EEVEE's noise another pattern
SHIFT = 3  # of those pixels
# Realtime draws the model itself in every mode; Cycles has two
MODES = {EEVEE: (FAST, BALANCED, PRECISE, CHOSEN_LIGHTS), CYCLES: (BALANCED, CHOSEN_LIGHTS), REALTIME: (BALANCED,)}
WORK = 12.0  # of an engine in a mode: renders


@dataclass(frozen=True)
class Moment:
    """What a frame shows: `sigma` [radians], `albedo`; the sun's `irradiance` [W/m^2] and its angle `turn` [radians] around the
    vertical; the point lamp's `power` [W] and height `rise` [m].
    """

    sigma: float
    albedo: float
    irradiance: float
    turn: float
    power: float
    rise: float


START, END = Moment(0.0, 0.9, 1.0, -0.6, 50.0, -2.0), Moment(0.5, 0.3, 3.0, 0.8, 400.0, 2.0)


def moment(frame: int, length: int = LENGTH) -> Moment:
    """Return what a frame of a film of so many frames shows."""
    share = (frame - 1) / (length - 1)
    return Moment(*(a + (b - a) * share for a, b in zip(astuple(START), astuple(END), strict=True)))


class Shot:
    """The scene, in a file with nothing else. `shadows`, of a ball before the sphere, are soft, which gives noise."""

    def __init__(self, mode: str, size: int, shadows: bool) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        stage = sphere_under_sun(size)
        self.scene, self.sun, self.sphere = stage.scene, stage.sun, stage.sphere
        self.scene.camera.data.lens = LENS
        self.point = bpy.data.objects.new("Point", bpy.data.lights.new("Point", "POINT"))
        self.scene.collection.objects.link(self.point)
        self.sun.data.angle, self.point.data.shadow_soft_size = (0.3, 0.5) if shadows else (0.0, 0.0)
        for lamp in (self.sun, self.point):
            lamp.data.use_shadow = shadows
        if shadows:  # of a ball half-way to the point lamp
            ball = bpy.data.objects.new("Ball", self.sphere.data.copy())
            ball.scale, ball.location = (0.3, 0.3, 0.3), (-1.3, -2.0, 0.0)
            ball.data.materials[0] = None
            self.scene.collection.objects.link(ball)
        self.scene.eevee.use_shadows = shadows
        self.scene.eevee.use_raytracing = False
        self.scene.cycles.max_bounces = 0
        render.crop(self.scene, render.region_of(self.scene, self.sphere))
        material = materials.create("Keyed", ROUGH_DIFFUSE, Quality=mode)
        self.node = material.node_tree.nodes[ROUGH_DIFFUSE.name]
        self.sphere.data.materials[0] = material
        chosen_lights.choose([self.sun, self.point])

    def show(self, now: Moment) -> None:
        """Set all to a moment."""
        self.node.inputs["Roughness"].default_value = now.sigma
        self.node.inputs["Color"].default_value = (now.albedo, 0.5 * now.albedo, 0.25 * now.albedo, 1.0)
        self.sun.data.energy = now.irradiance
        self.sun.rotation_euler = (math.pi / 2.0, 0.0, now.turn)
        self.point.data.energy = now.power
        self.point.location = (-2.0, -3.0, now.rise)
        self.scene.view_layers[0].update()

    def key(self, length: int) -> None:
        """Key START and END over so many frames, evenly between."""
        moved = (
            (self.node.inputs["Roughness"], "default_value"),
            (self.node.inputs["Color"], "default_value"),
            (self.sun.data, "energy"),
            (self.sun, "rotation_euler"),
            (self.point.data, "energy"),
            (self.point, "location"),
        )
        for frame, now in ((1, START), (length, END)):
            self.show(now)
            for owner, path in moved:
                owner.keyframe_insert(path, frame=frame)
        for action in bpy.data.actions:
            for bag in (bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags):
                for point in (point for curve in bag.fcurves for point in curve.keyframe_points):
                    point.interpolation = "LINEAR"

    def film(self, engine: Engine, samples: int, frames: Sequence[int]) -> list[array[float]]:
        """Return the linear RGB of `frames`, rendered as Blender renders an animation, from the first to the last by even steps."""
        engines.use(self.scene, engine, samples)
        optimize_materials()
        with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
            image = self.scene.render.image_settings
            image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
            self.scene.render.filepath = str(Path(folder) / "frame_")
            found = []
            for frame in frames:
                self.scene.frame_start = self.scene.frame_end = frame
                render.render(self.scene, animation=True)
                channels = render.read_exr(Path(folder) / f"frame_{frame:04d}.exr")
                found.append(render.interleaved(channels))
        return found


def keyed_difference(mode: str, engine: Engine, samples: int, size: int, frames: Sequence[int] = KEYED_FRAMES) -> float:
    """Return the largest difference of a film's frames from stills of their values, which nothing keys and nothing simplifies.

    As a share of the stills' largest value; of linear RGB.
    """
    shot, stills = Shot(mode, size, shadows=False), []
    for frame in frames:
        shot.show(moment(frame))
        stills.append(render.radiance(shot.scene, engine, samples)[1])
    shot.key(LENGTH)
    film = shot.film(engine, samples, frames)
    largest = max(map(max, stills))
    return max(abs(a - b) for got, still in zip(film, stills, strict=True) for a, b in zip(got, still, strict=True)) / largest


@dataclass(frozen=True)
class Flicker:
    """RMS over the picture, relative to the picture's RMS: the `noise` of one frame, and what flickers of it from frame to frame
    where nothing moves (`still`) and where all moves so slowly that what differs is noise (`moving`).

    Both are divided so that noise with new random numbers in every frame would flicker by just `noise`.
    """

    noise: float
    still: float
    moving: float


def flicker(mode: str, engine: Engine, samples: int, size: int) -> Flicker:
    """Return how noise flickers."""
    shot = Shot(mode, size, shadows=True)
    shot.show(moment(LENGTH // 2))
    takes = [render.radiance(shot.scene, engine, samples, seed)[1] for seed in (0, SHIFT)]
    still = shot.film(engine, samples, (1, 2))
    shot.key(SLOW)
    moving = shot.film(engine, samples, SLOW_FRAMES)
    level = _rms(still[0])
    # an even change has no second difference; of independent noise that is sqrt(1 + 4 + 1) times as large
    second = array("f", (a - 2.0 * b + c for a, b, c in zip(*moving, strict=True)))
    between = [_rms(array("f", (a - b for a, b in zip(*pair, strict=True)))) / math.sqrt(2.0) for pair in pairwise(still)]
    noise = _rms(array("f", (a - b for a, b in zip(*takes, strict=True)))) / math.sqrt(2.0)
    return Flicker(noise / level, max(between) / level, _rms(second) / math.sqrt(6.0) / level)


def _rms(values: array[float]) -> float:
    return math.sqrt(math.fsum(value * value for value in values) / len(values))


def work(used: Sequence[Engine]) -> float:
    """Return the work of `records`, in the units that it reports to its progress."""
    return WORK * sum(len(MODES[engine]) for engine in used)


def records(used: Sequence[Engine], samples: int, size: int, progress: Progress) -> Iterator[Record]:
    """Yield a record for each engine and mode: the largest difference of keyed frames from stills, noise, flicker; shares of 1."""
    for engine in used:
        for mode in MODES[engine]:
            with progress.step(f"Keyed  {engine.label}  {mode}", WORK):
                seen = flicker(mode, engine, samples, size)
                yield {
                    "engine": engine.key,
                    "mode": None if engine is REALTIME else mode,
                    "samples": samples,
                    "keyed_difference": keyed_difference(mode, engine, samples, size),
                    "noise": seen.noise,
                    "flicker_still": seen.still,
                    "flicker_moving": seen.moving,
                }


def table(found: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return the columns and rows that sum up records for people."""
    columns = ("Engine", "Quality", "Samples", "Keyed from still", "Noise", "Flicker, still", "Flicker, moving")
    shares = ("keyed_difference", "noise", "flicker_still", "flicker_moving")
    return columns, [
        (one["engine"], one["mode"] or "-", str(one["samples"]), *(f"{100.0 * one[share]:.3g} %" for share in shares))
        for one in found
    ]
