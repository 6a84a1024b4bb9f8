# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures one material in an artist's file: its error relative to its reflectance model, and its render time relative to Lambert.

Rough Diffuse and Standard Specular are measured on a sphere under a sun, as in the accuracy report; Subsurface by the color of an
evenly lit slab. The measurement renders temporary scenes; the artist's data stay unchanged.
"""

import math
from collections.abc import Generator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
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
from ..measure.error import GBuffer
from ..measure.record import Progress, Step, Steps, WorkError, run_steps
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
LACKS_OPENIMAGEIO = "This Blender lacks OpenImageIO, which reads the renders (Debian: python3-openimageio)"
DARKEST = 1e-4  # color that can be measured


class MeasurementError(WorkError):
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
            name = scene.render.engine.removeprefix("BLENDER_").title()
            raise MeasurementError(f"The scene renders with {name}: only EEVEE, Cycles and Realtime can be measured")
        return cls(engine, engine is CYCLES and uses_osl(scene), engine is CYCLES and scene.cycles.device == "GPU")

    @property
    def engine_on_device(self) -> Engine:
        """The engine on the scene's device; by itself a measurement in Cycles uses the CPU."""

        def apply(scene: bpy.types.Scene, samples: int) -> None:
            self.engine.apply(scene, samples)
            scene.cycles.device = "GPU"

        return replace(self.engine, apply=apply) if self.on_gpu else self.engine

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

    @property
    def meaning(self) -> str:
        """What was rendered and compared, in sentences."""
        if self.summary.group == SUBSURFACE.key:
            views = " and ".join(f"{math.degrees(math.acos(mu)):g}" for mu in VIEW_MUS)
            what = f"RMS difference of a thick slab's color from the node's Color, sun above it, seen from {views} degrees."
        else:
            lights = f"sun at {LIGHT_DEGREES[0]:g} to {LIGHT_DEGREES[-1]:g} degrees from the view, without shadows"
            what = f"RMS difference from the {self.summary.label} formula on a sphere, {lights}."
        return f"{what} Time: to render the sphere, over that with a Lambert material."

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
    if summary is None and material and (found := group_node(material)):
        raise MeasurementError(f"{found[0].node_tree.name} is of another version: Upgrade Groups makes it measurable")
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
        raise MeasurementError(LACKS_OPENIMAGEIO) from None
    return summary, setup


def measure(material: bpy.types.Material, scene: bpy.types.Scene, progress: Progress) -> Measurement:
    """Measure `material` in `scene`'s engine, in `total_work` units of `progress`. Raises MeasurementError as `check` does."""
    return run_steps(steps(material, scene), progress)


def steps(material: bpy.types.Material | None, scene: bpy.types.Scene) -> Steps[Measurement]:
    """Measure `material` as it is at the first step, in `scene`'s engine, a render at a time; `total_work` in all.

    Raises MeasurementError as `check` does, and where the material or its group is deleted meanwhile.
    """
    summary, setup = check(material, scene)
    assert material is not None  # else check raises
    probe = _Probe(material.session_uid, summary, setup, scene.unit_settings.scale_length)
    errors = yield from probe.slab_errors() if summary.group == SUBSURFACE.key else probe.sphere_errors()
    seconds, lambert_seconds = yield from probe.seconds()
    return Measurement(summary, setup, setup.device, fmean(errors), max(errors), seconds, lambert_seconds)


@dataclass(frozen=True)
class _Probe:
    """What is measured: the material with the number `uid`, with the values in `summary`. `surfaces` are those of the sphere."""

    uid: int
    summary: MaterialSummary
    setup: RenderSetup
    scale_length: float
    surfaces: dict[float, GBuffer] = field(default_factory=dict)

    @contextmanager
    def shown(self) -> Generator[tuple[SphereUnderSun, bpy.types.Material]]:
        """Yield the sphere under a sun, plain in the material's color, and a copy of the material; both are removed again."""
        material = next((each for each in bpy.data.materials if each.session_uid == self.uid), None)
        if material is None:
            raise MeasurementError("The material has been deleted")
        with render.temporary_data():
            scene = bpy.data.scenes.new("True Diffuse Probe")
            scene.cycles.shading_system = self.setup.osl
            sphere = replace(sphere_under_sun(SIZE, scene), surfaces=self.surfaces)
            plain = next(node for node in sphere.plain.node_tree.nodes if node.type == "BSDF_DIFFUSE")
            plain.inputs["Color"].default_value = (*self.summary.rgb("Color"), 1.0)
            with chosen_lights.following([sphere.sun]) if self.summary.follows_lights else nullcontext():
                yield sphere, self.copy(material)

    def copy(self, material: bpy.types.Material) -> bpy.types.Material:
        """Return a copy of `material` whose surface is its group with the values of the summary and no links."""
        copy = material.copy()
        node = _node(copy)
        tree = copy.node_tree
        tree.animation_data_clear()
        for other in [other for other in tree.nodes if other != node]:
            tree.nodes.remove(other)
        materials.set_inputs(node, self.summary.inputs)
        materials.show(copy, node)
        materials.set_thickness(copy)
        return copy

    def sphere_errors(self) -> Steps[list[float]]:
        """Measure the error of the sphere under the sun of LIGHT_DEGREES."""
        errors = []
        for degrees in LIGHT_DEGREES:
            yield Step(f"light at {degrees:g}°", 1.0)
            with self.shown() as (sphere, material):
                engine, samples = self.setup.engine_on_device, SAMPLES[self.setup.engine]
                _, (error,) = sphere.measure(material, (self.summary.model,), engine, samples, degrees)
            errors.append(error.rms)
        return errors

    def slab_errors(self) -> Steps[list[float]]:
        """Measure the error of the slab's color at VIEW_MUS, sun from above, without the coat, which would reflect the sun."""
        summary, errors = self.summary, []
        longest_path = max(max(summary.rgb("Subsurface Radius")) * summary.number("Scale"), 1e-3)
        weight, color = summary.number("Subsurface"), summary.rgb("Color")
        for mu in VIEW_MUS:
            yield Step(f"view at {math.degrees(math.acos(mu)):g}°", len(LIGHT_DEGREES) / len(VIEW_MUS))
            view = from_polar(mu, 0.0)
            reflected = [math.pi * summary.model.radiance(NORMAL, NORMAL, view, channel) for channel in color]
            expected = [weight * channel + (1.0 - weight) * rough for channel, rough in zip(color, reflected, strict=True)]
            with self.shown() as (_, material):
                _node(material).inputs["Specular"].default_value = 0.0
                scene = bpy.data.scenes.new("True Diffuse Slab")
                scene.cycles.shading_system = self.setup.osl
                body = slab(HALF_SPACE * longest_path, scale_length=self.scale_length, scene=scene)
                (rendered,) = body.albedos([material], self.setup.engine_on_device, SLAB_SAMPLES[self.setup.engine], mu)
            square = sum((mean.value - value) ** 2 for mean, value in zip(rendered, expected, strict=True))
            errors.append(math.sqrt(square / sum(value * value for value in expected)))
        return errors

    def seconds(self) -> Steps[tuple[float, float]]:
        """Measure the median render times [s] of the material and of Lambert, interleaved.

        The first renders compile and do not count.
        """
        rounds: list[tuple[float, float]] = []
        for _ in range(1 + ROUNDS):
            pair = []
            for is_lambert in (False, True):
                yield Step("time", 1.0)
                with self.shown() as (sphere, material):
                    sphere.scene.render.resolution_x = sphere.scene.render.resolution_y = TIMED_SIZE
                    shown, samples = sphere.plain if is_lambert else material, TIMED_SAMPLES[self.setup.engine]
                    pair.append(sphere.radiance(shown, [sphere.sun], None, self.setup.engine_on_device, samples, shadows=False)[0])
            rounds.append((pair[0], pair[1]))
        return median(seconds for seconds, _ in rounds[1:]), median(seconds for _, seconds in rounds[1:])


def _node(material: bpy.types.Material) -> bpy.types.Node:
    """Return the group node that makes the surface of `material`; raises MeasurementError where none of ours does."""
    found = group_node(material)
    if found is None:
        raise MeasurementError(f"No True Diffuse group makes the surface of {material.name}")
    return found[0]


def _gpu() -> str:
    """Return the names of the devices that Cycles may use as GPUs."""
    cycles = bpy.context.preferences.addons["cycles"].preferences
    names = [device.name for device in cycles.devices if device.use and device.type == cycles.compute_device_type]
    return ", ".join(names) or "CPU"  # Cycles' fallback
