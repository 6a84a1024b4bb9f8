# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframed materials and lights: whether a frame of an animation equals the still of its values, and whether noise flickers.

A sphere under a sun and a point light; sigma, albedo, and the lights' strengths and positions go linearly from START to END.
"""

import math
import tempfile
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.scenes.elements import add
from true_diffuse.scenes.sphere import sphere_under_sun
from true_diffuse.scripts.studies.study import Step, Table, percent

LENGTH = 24  # frames from START to END
KEYED_FRAMES = (1, 8, LENGTH)  # compared with stills
SLOW, SLOW_FRAMES = 1000, (500, 501, 502)  # length of an animation, and frames of it that differ by less than any noise
LENS = 80.0  # mm: leaves room at the left for the pixels that shift EEVEE's noise pattern
SHIFT = 3  # pixels
# Realtime evaluates the model itself at every quality; Cycles has two
QUALITIES = {EEVEE: (FAST, BALANCED, PRECISE, CHOSEN_LIGHTS), CYCLES: (BALANCED, CHOSEN_LIGHTS), REALTIME: (BALANCED,)}


@dataclass(frozen=True)
class Values:
    """The animated values: `sigma` [radians], `albedo`; the sun's `irradiance` [W/m^2] and azimuth [radians]; the point light's
    `power` [W] and `height` [m].
    """

    sigma: float
    albedo: float
    irradiance: float
    azimuth: float
    power: float
    height: float


START, END = Values(0.0, 0.9, 1.0, -0.6, 50.0, -2.0), Values(0.5, 0.3, 3.0, 0.8, 400.0, 2.0)


def values_at(frame: int, length: int = LENGTH) -> Values:
    """Return the values at a frame of an animation of `length` frames."""
    t = (frame - 1) / (length - 1)
    return Values(*(a + (b - a) * t for a, b in zip(astuple(START), astuple(END), strict=True)))


class Animation:
    """The scene, alone in a new file. With `shadows`, a ball in front of the sphere casts soft ones, which are noisy."""

    def __init__(self, quality: str, size: int, shadows: bool) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        stage = sphere_under_sun(size)
        self.scene, self.sun, self.sphere = stage.scene, stage.sun, stage.sphere
        self.scene.camera.data.lens = LENS
        self.point = add(self.scene, "Point", bpy.data.lights.new("Point", "POINT"))
        self.sun.data.angle, self.point.data.shadow_soft_size = (0.3, 0.5) if shadows else (0.0, 0.0)
        for light in (self.sun, self.point):
            light.data.use_shadow = shadows
        if shadows:  # of a ball half-way to the point light
            ball = add(self.scene, "Ball", self.sphere.data.copy())
            ball.scale, ball.location = (0.3, 0.3, 0.3), (-1.3, -2.0, 0.0)
            ball.data.materials[0] = None
        self.scene.eevee.use_shadows = shadows
        self.scene.eevee.use_raytracing = False
        engines.leave_out_bounces(self.scene)
        render.crop(self.scene, render.region_of(self.scene, self.sphere))
        material = materials.create("Keyed", ROUGH_DIFFUSE, Quality=quality)
        self.node = material.node_tree.nodes[ROUGH_DIFFUSE.name]
        self.sphere.data.materials[0] = material
        chosen_lights.choose([self.sun, self.point])

    def show(self, values: Values) -> None:
        """Set the scene to `values`."""
        self.node.inputs["Roughness"].default_value = values.sigma
        self.node.inputs["Color"].default_value = (values.albedo, 0.5 * values.albedo, 0.25 * values.albedo, 1.0)
        self.sun.data.energy = values.irradiance
        self.sun.rotation_euler = (math.pi / 2.0, 0.0, values.azimuth)
        self.point.data.energy = values.power
        self.point.location = (-2.0, -3.0, values.height)
        self.scene.view_layers[0].update()

    def key(self, length: int) -> None:
        """Keyframe START and END over `length` frames, with linear interpolation."""
        animated = (
            (self.node.inputs["Roughness"], "default_value"),
            (self.node.inputs["Color"], "default_value"),
            (self.sun.data, "energy"),
            (self.sun, "rotation_euler"),
            (self.point.data, "energy"),
            (self.point, "location"),
        )
        for frame, values in ((1, START), (length, END)):
            self.show(values)
            for owner, path in animated:
                owner.keyframe_insert(path, frame=frame)
        for action in bpy.data.actions:
            for bag in (bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags):
                for point in (point for curve in bag.fcurves for point in curve.keyframe_points):
                    point.interpolation = "LINEAR"

    def render_frames(self, engine: Engine, samples: int, frames: Sequence[int]) -> list[array[float]]:
        """Return the linear RGB of `frames`, each rendered as Blender renders an animation."""
        engines.use(self.scene, engine, samples)
        with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
            image = self.scene.render.image_settings
            image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
            self.scene.render.filepath = str(Path(folder) / "frame_")
            pictures = []
            for frame in frames:
                self.scene.frame_start = self.scene.frame_end = frame
                render.render(self.scene, animation=True)
                pictures.append(render.interleaved(render.read_exr(Path(folder) / f"frame_{frame:04d}.exr")))
        return pictures


def keyed_difference(quality: str, engine: Engine, samples: int, size: int, frames: Sequence[int] = KEYED_FRAMES) -> float:
    """Return the largest difference of an animation's frames from stills of their values, which are not keyed.

    It is in linear RGB, relative to the stills' largest value.
    """
    animation, stills = Animation(quality, size, shadows=False), []
    for frame in frames:
        animation.show(values_at(frame))
        stills.append(render.radiance(animation.scene, engine, samples)[1])
    animation.key(LENGTH)
    keyed = animation.render_frames(engine, samples, frames)
    largest = max(map(max, stills))
    return max(abs(a - b) for got, still in zip(keyed, stills, strict=True) for a, b in zip(got, still, strict=True)) / largest


@dataclass(frozen=True)
class Flicker:
    """The `noise` of one frame and its change between frames: where nothing moves (`still`), and where everything moves so slowly
    that only noise differs (`moving`). RMS over the picture, relative to the picture's RMS.

    Both are scaled so that noise with new random numbers in every frame would give `noise`.
    """

    noise: float
    still: float
    moving: float


def flicker(quality: str, engine: Engine, samples: int, size: int) -> Flicker:
    """Return the noise of `engine` at `quality`, and its flicker."""
    animation = Animation(quality, size, shadows=True)
    animation.show(values_at(LENGTH // 2))
    repeats = [render.radiance(animation.scene, engine, samples, seed)[1] for seed in (0, SHIFT)]
    still = animation.render_frames(engine, samples, (1, 2))
    animation.key(SLOW)
    moving = animation.render_frames(engine, samples, SLOW_FRAMES)
    level = _rms(still[0])
    # a linear change has no second difference; that of independent noise is sqrt(1 + 4 + 1) times as large
    second = array("f", (a - 2.0 * b + c for a, b, c in zip(*moving, strict=True)))
    between = [_rms(array("f", (a - b for a, b in zip(*pair, strict=True)))) / math.sqrt(2.0) for pair in pairwise(still)]
    noise = _rms(array("f", (a - b for a, b in zip(*repeats, strict=True)))) / math.sqrt(2.0)
    return Flicker(noise / level, max(between) / level, _rms(second) / math.sqrt(6.0) / level)


def _rms(values: array[float]) -> float:
    return math.sqrt(math.fsum(value * value for value in values) / len(values))


def steps(used: Sequence[Engine], samples: int, size: int) -> list[Step]:
    """Return a step for each engine and quality: largest difference of keyed frames from stills, noise, flicker; as fractions."""

    def measure(engine: Engine, quality: str) -> Iterator[Record]:
        measured = flicker(quality, engine, samples, size)
        yield {
            "engine": engine.key,
            "quality": None if engine is REALTIME else quality,
            "samples": samples,
            "keyed_difference": keyed_difference(quality, engine, samples, size),
            "noise": measured.noise,
            "flicker_still": measured.still,
            "flicker_moving": measured.moving,
        }

    cases = [(engine, quality) for engine in used for quality in QUALITIES[engine]]
    return [Step(f"Keyed  {engine.label}  {quality}", partial(measure, engine, quality)) for engine, quality in cases]


def table(records: Sequence[Record]) -> Table:
    """Return a row for each engine and quality."""
    columns = ("Engine", "Quality", "Samples", "Keyed from still", "Noise", "Flicker, still", "Flicker, moving")
    figures = ("keyed_difference", "noise", "flicker_still", "flicker_moving")
    return columns, [
        (item["engine"], item["quality"] or "-", str(item["samples"]), *(f"{percent(item[figure], '.3g')} %" for figure in figures))
        for item in records
    ]
