# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures one material in an artist's file: its error relative to its reflectance model, and its render time relative to Lambert.

Rough Diffuse and Standard Specular are measured on a sphere under a sun, as in the accuracy report; Subsurface by the color of an
evenly lit slab. The measurement renders temporary scenes; the artist's data stay unchanged.
"""

import math
from collections.abc import Generator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from statistics import fmean, median
from typing import NamedTuple

import bpy

from ...scenes.slab import slab
from ...scenes.sphere import SphereUnderSun, sphere_under_sun
from ..blender import engines
from ..blender.engines import CYCLES, EEVEE, REALTIME, Engine, uses_osl
from ..closures.quality import CHOSEN_LIGHTS
from ..material import materials
from ..material.read import group_node
from ..material.summary import MaterialSummary, engine_of, material_summary
from ..measure import render
from ..measure.record import Progress
from ..models.quadrature import NORMAL
from ..models.vector import from_polar
from ..nodes import PRINCIPLED, SPECULAR_GROUP, SUBSURFACE, chosen_lights

LIGHT_DEGREES = (0.0, 30.0, 60.0, 90.0, 120.0)  # between light and viewer
SIZE = 96  # pixels across the sphere where the error is measured
VIEW_MUS = (1.0, 0.5)  # N.V of the slab
HALF_SPACE = 1000.0  # mean free paths across the slab
TIMED_SIZE, ROUNDS = 192, 3  # pixels across the sphere where the time is measured; interleaved renders of either material
SAMPLES = {EEVEE: 4, CYCLES: 32, REALTIME: 1}  # Realtime's samples are equal here
SLAB_SAMPLES = {EEVEE: 1, CYCLES: 512, REALTIME: 1}  # EEVEE's slab has no noise
TIMED_SAMPLES = {EEVEE: 4, CYCLES: 32, REALTIME: 16}
DARKEST = 1e-4  # color that can be measured


class MeasurementError(Exception):
    """The material cannot be measured; the message is one line for the user."""


class RenderSetup(NamedTuple):
    """The engine and options of a scene that a measurement depends on."""

    engine: Engine
    osl: bool
    on_gpu: bool

    @classmethod
    def of(cls, scene: bpy.types.Scene) -> "RenderSetup":
        """Return the setup of `scene`; raises MeasurementError where it renders with another engine."""
        engine = engine_of(scene)
        if engine is None:
            raise MeasurementError(
                f"The scene renders with {scene.render.engine.title()}: only EEVEE, Cycles and Realtime can be measured"
            )
        return cls(engine, engine is CYCLES and uses_osl(scene), engine is CYCLES and scene.cycles.device == "GPU")

    @property
    def engine_on_device(self) -> Engine:
        """The engine on the scene's device; by itself a measurement in Cycles uses the CPU."""

        def apply(scene: bpy.types.Scene, samples: int) -> None:
            self.engine.apply(scene, samples)
            if self.on_gpu:
                scene.cycles.device = "GPU"

        return replace(self.engine, apply=apply)

    @property
    def device(self) -> str:
        """The names of the processors that render."""
        return _gpu() if self.on_gpu else engines.device(self.engine)


class Measurement(NamedTuple):
    """The result of a measurement. Errors are relative: the RMS over pixels and channels divided by that of the model.

    `mean` and `worst` are over the directions of the light, for a slab over those of the view. Times are in seconds.
    """

    summary: MaterialSummary
    setup: RenderSetup
    device: str
    mean: float
    worst: float
    seconds: float
    lambert_seconds: float

    @property
    def notes(self) -> tuple[str, ...]:
        """Messages about what the measurement ignored."""
        linked = [name for name in self.summary.inputs if name in self.summary.linked and name != "Normal"]
        notes = [f"{', '.join(linked)} linked: measured at the socket's own value"] if linked else []
        if "Normal" in self.summary.linked:
            notes.append("Normal linked: measured without")
        if self.summary.group == SUBSURFACE.key and self.summary.number("Specular") > 0.0:
            notes.append("measured without the coat")
        return tuple(notes)

    @property
    def variant(self) -> str:
        """The engine, with the quality or method, or OSL."""
        return ", ".join(filter(None, (self.setup.engine.label, self.summary.variant(self.setup.engine, self.setup.osl))))

    @property
    def error(self) -> str:
        """The error as text."""
        reference = "its Color" if self.summary.group == SUBSURFACE.key else self.summary.label
        return f"{percent(self.mean)} from {reference} (worst {percent(self.worst)})"

    @property
    def cost(self) -> str:
        """The relative time as text."""
        return f"{self.seconds / self.lambert_seconds:.2f} times Lambert's time"

    def text(self) -> str:
        """Return the measurement as one line."""
        return "; ".join((f"{self.variant}: {self.error}, {self.cost}", *self.notes))

    def lines(self) -> tuple[str, ...]:
        """Return the measurement as short lines."""
        return self.error, f"{self.cost} ({1e3 * self.seconds:.0f} ms)", self.variant, self.device, *self.notes

    def is_current(self, summary: MaterialSummary | None, scene: bpy.types.Scene) -> bool:
        """Return whether the material, as `summary` has it now, and `scene` are those that were measured."""
        try:
            return summary == self.summary and RenderSetup.of(scene) == self.setup
        except MeasurementError:
            return False


def percent(fraction: float) -> str:
    """Return `fraction` in %, with two decimals below 1 % and one above."""
    return f"{100.0 * fraction:.2f} %" if fraction < 0.01 else f"{100.0 * fraction:.1f} %"


def total_work() -> float:
    """Return the work of a whole measurement in the units of its progress."""
    return len(LIGHT_DEGREES) + 2.0 * (1 + ROUNDS)


def check(material: bpy.types.Material | None, scene: bpy.types.Scene) -> tuple[MaterialSummary, RenderSetup]:
    """Return the summary of `material` and the setup of `scene`; raises MeasurementError where they cannot be measured."""
    setup, summary = RenderSetup.of(scene), material_summary(material)
    if summary is None:
        raise MeasurementError("No True Diffuse group makes this material's surface" if material else "There is no material")
    if summary.group == PRINCIPLED.key:
        raise MeasurementError(f"{PRINCIPLED.label} has more layers than the formula: only its accuracy is stated")
    has_highlight = summary.group == SPECULAR_GROUP.key and summary.number("Specular") >= DARKEST
    if max(summary.rgb("Color")) < DARKEST and not has_highlight:
        raise MeasurementError("The material is black: there is nothing to compare")
    if summary.follows_lights and chosen_lights.LIGHTS.trees(linked=True):
        raise MeasurementError(f"{CHOSEN_LIGHTS} of a linked material follows the lights chosen in its file: it cannot be measured")
    try:
        render.openimageio()
    except ImportError:
        raise MeasurementError("This Blender lacks OpenImageIO, which reads the renders (Debian: python3-openimageio)") from None
    return summary, setup


def measure(material: bpy.types.Material, scene: bpy.types.Scene, progress: Progress) -> Measurement:
    """Measure `material` in `scene`'s engine, in `total_work` units of `progress`. Raises MeasurementError as `check` does."""
    summary, setup = check(material, scene)
    is_slab = summary.group == SUBSURFACE.key
    with _temporary_scene() as temporary:
        temporary.cycles.shading_system = setup.osl
        sphere = sphere_under_sun(SIZE, temporary)
        with chosen_lights.following([sphere.sun]) if summary.follows_lights else nullcontext():
            copy = _copy(material)
            if is_slab:
                errors = _slab_errors(copy, summary, setup, scene.unit_settings.scale_length, progress)
            else:
                errors = _sphere_errors(copy, summary, setup, sphere, progress)
            seconds, lambert_seconds = _seconds(copy, sphere, setup, progress)
    return Measurement(summary, setup, setup.device, fmean(errors), max(errors), seconds, lambert_seconds)


def _sphere_errors(
    material: bpy.types.Material, summary: MaterialSummary, setup: RenderSetup, sphere: SphereUnderSun, progress: Progress
) -> list[float]:
    color = (*summary.rgb("Color"), 1.0)
    next(node for node in sphere.plain.node_tree.nodes if node.type == "BSDF_DIFFUSE").inputs["Color"].default_value = color
    errors = []
    for degrees in LIGHT_DEGREES:
        with progress.step(f"Light at {degrees:g} degrees", 1.0):
            _, (error,) = sphere.measure(material, (summary.model,), setup.engine_on_device, SAMPLES[setup.engine], degrees)
        errors.append(error.rms)
    return errors


def _slab_errors(
    material: bpy.types.Material, summary: MaterialSummary, setup: RenderSetup, scale_length: float, progress: Progress
) -> list[float]:
    """Return the errors of the slab's color at VIEW_MUS under a sun from above, without the coat, which would reflect the sun."""
    node = _node(material)
    coat, node.inputs["Specular"].default_value = node.inputs["Specular"].default_value, 0.0
    longest_path = max(max(summary.rgb("Subsurface Radius")) * summary.number("Scale"), 1e-3)
    scene = bpy.data.scenes.new("True Diffuse Slab")
    scene.cycles.shading_system = setup.osl
    body = slab(HALF_SPACE * longest_path, scale_length=scale_length, scene=scene)
    weight, color = summary.number("Subsurface"), summary.rgb("Color")
    errors = []
    for mu in VIEW_MUS:
        view = from_polar(mu, 0.0)
        reflected = [math.pi * summary.model.radiance(NORMAL, NORMAL, view, channel) for channel in color]
        expected = [weight * channel + (1.0 - weight) * rough for channel, rough in zip(color, reflected, strict=True)]
        with progress.step(f"View at {math.degrees(math.acos(mu)):g} degrees", len(LIGHT_DEGREES) / len(VIEW_MUS)):
            (rendered,) = body.albedos([material], setup.engine_on_device, SLAB_SAMPLES[setup.engine], mu)
        square = sum((mean.value - value) ** 2 for mean, value in zip(rendered, expected, strict=True))
        errors.append(math.sqrt(square / sum(value * value for value in expected)))
    node.inputs["Specular"].default_value = coat
    return errors


def _seconds(measured: bpy.types.Material, sphere: SphereUnderSun, setup: RenderSetup, progress: Progress) -> tuple[float, float]:
    """Return the median render times [s] of `measured` and of Lambert, interleaved; the first renders compile and do not count."""
    sphere.scene.render.resolution_x = sphere.scene.render.resolution_y = TIMED_SIZE
    rounds: list[tuple[float, float]] = []
    for _ in range(1 + ROUNDS):
        pair = []
        for material in (measured, sphere.plain):
            with progress.step("Timing", 1.0):
                samples = TIMED_SAMPLES[setup.engine]
                pair.append(sphere.radiance(material, [sphere.sun], None, setup.engine_on_device, samples, shadows=False)[0])
        rounds.append((pair[0], pair[1]))
    return median(seconds for seconds, _ in rounds[1:]), median(seconds for _, seconds in rounds[1:])


def _copy(material: bpy.types.Material) -> bpy.types.Material:
    """Return a copy of `material` whose surface is its group with no links to its inputs."""
    copy = material.copy()
    node = _node(copy)
    tree = copy.node_tree
    tree.animation_data_clear()
    for other in [other for other in tree.nodes if other != node]:
        tree.nodes.remove(other)
    materials.show(copy, node)
    materials.set_thickness(copy)
    return copy


def _node(material: bpy.types.Material) -> bpy.types.Node:
    """Return the group node that makes the surface of `material`; raises MeasurementError where none of ours does."""
    found = group_node(material)
    if found is None:
        raise MeasurementError(f"No True Diffuse group makes the surface of {material.name}")
    return found[0]


@contextmanager
def _temporary_scene() -> Generator[bpy.types.Scene]:
    """Yield an empty scene; removes all data-blocks created in the context at its end."""
    before = set(bpy.data.user_map())
    try:
        yield bpy.data.scenes.new("True Diffuse Probe")
    finally:
        kept = {image for image in bpy.data.images if image.type == "RENDER_RESULT"}  # where Blender keeps renders
        bpy.data.batch_remove(set(bpy.data.user_map()) - before - kept)


def _gpu() -> str:
    """Return the names of the devices that Cycles may use as GPUs."""
    cycles = bpy.context.preferences.addons["cycles"].preferences
    names = [device.name for device in cycles.devices if device.use and device.type == cycles.compute_device_type]
    return ", ".join(names) or "CPU"  # Cycles' fallback
