# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures one material in an artist's own file: error against the model it claims, and time against plain Lambert.

Rough Diffuse and Standard Specular on a sphere under a sun, as in the accuracy report; Subsurface on a slab lit evenly, by the
color that it shows. All is made in scenes of its own, which are gone again afterwards; what the artist has is not touched.
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
from ..blender.id_properties import SPECIALIZED_FOR
from ..material import materials
from ..material.read import group_node
from ..material.summary import Claim, claim_of, engine_of
from ..measure import render
from ..measure.record import Progress
from ..models.quadrature import NORMAL
from ..models.vector import from_polar
from ..nodes import SPECULAR_GROUP, SUBSURFACE, chosen_lights
from ..optimize.materials import restore_node

LIGHT_DEGREES = (0.0, 30.0, 60.0, 90.0, 120.0)  # between light and viewer
SIZE = 96  # pixels across the sphere where the error is measured
VIEW_MUS = (1.0, 0.5)  # N.V of the slab
HALF_SPACE = 1000.0  # mean free paths across the slab
TIMED_SIZE, ROUNDS = 192, 3  # pixels across the sphere where the time is, and how often in turns
SAMPLES = {EEVEE: 4, CYCLES: 32, REALTIME: 1}  # of Realtime all are alike here
SLAB_SAMPLES = {EEVEE: 1, CYCLES: 512, REALTIME: 1}  # EEVEE's first is as good as many
TIMED_SAMPLES = {EEVEE: 4, CYCLES: 32, REALTIME: 16}
LEAST = 1e-4  # of a color that can be measured


class Refused(Exception):
    """The material cannot be measured; the message says why, in one line."""


class Setup(NamedTuple):
    """What a scene renders with: what a finding depends on beside the material."""

    engine: Engine
    osl: bool
    on_gpu: bool

    @classmethod
    def of(cls, scene: bpy.types.Scene) -> "Setup":
        """Return that of `scene`; raises Refused where its engine is none of ours to measure."""
        engine = engine_of(scene)
        if engine is None:
            raise Refused(f"The scene renders with {scene.render.engine.title()}: only EEVEE, Cycles and Realtime can be measured")
        return cls(engine, engine is CYCLES and uses_osl(scene), engine is CYCLES and scene.cycles.device == "GPU")

    @property
    def fitted(self) -> Engine:
        """The engine, on the device that the scene has chosen: measurements take the CPU else."""

        def apply(scene: bpy.types.Scene, samples: int) -> None:
            self.engine.apply(scene, samples)
            if self.on_gpu:
                scene.cycles.device = "GPU"

        return replace(self.engine, apply=apply)

    @property
    def device(self) -> str:
        """What it computes on."""
        return _gpu() if self.on_gpu else engines.device(self.engine)


class Finding(NamedTuple):
    """What was measured. Errors are shares of 1: RMS over all pixels of a view and channels, relative to the model's RMS.

    `mean` and `worst` are over the angles of the light, on a slab of the view.
    """

    claim: Claim
    setup: Setup
    device: str
    mean: float
    worst: float
    seconds: float
    lambert_seconds: float

    @property
    def ratio(self) -> float:
        """Time over that of plain Lambert."""
        return self.seconds / self.lambert_seconds

    @property
    def notes(self) -> tuple[str, ...]:
        """What was left out, in words."""
        fed = [name for name in self.claim.inputs if name in self.claim.fed and name not in ("Normal",)]
        left_out = [f"{', '.join(fed)} linked: measured at the socket's own value"] if fed else []
        if "Normal" in self.claim.fed:
            left_out.append("Normal linked: measured without")
        if self.claim.group == SUBSURFACE.key and self.claim.number("Specular") > 0.0:
            left_out.append("measured without the coat")
        return tuple(left_out)

    @property
    def way(self) -> str:
        """The engine, and how it makes the model."""
        way = self.claim.way(self.setup.engine, self.setup.osl)
        return f"{self.setup.engine.label}, {way}" if way else self.setup.engine.label

    @property
    def error(self) -> str:
        """The error in words."""
        of = "the color claimed" if self.claim.group == SUBSURFACE.key else self.claim.label
        return f"{percent(self.mean)} from {of} (worst {percent(self.worst)})"

    @property
    def cost(self) -> str:
        """The time in words."""
        return f"{self.ratio:.2f} times Lambert's time"

    def text(self) -> str:
        """Return all in one line."""
        return "; ".join((f"{self.way}: {self.error}, {self.cost}", *self.notes))

    def lines(self) -> tuple[str, ...]:
        """Return all in short lines."""
        return self.error, f"{self.cost} ({1e3 * self.seconds:.0f} ms)", self.way, self.device, *self.notes

    def is_of(self, claim: Claim | None, scene: bpy.types.Scene) -> bool:
        """Return whether it still tells what `scene` makes of `claim`."""
        try:
            return claim == self.claim and Setup.of(scene) == self.setup
        except Refused:
            return False


def percent(share: float) -> str:
    """Return `share` in %, with two digits or to a hundredth."""
    return f"{100.0 * share:.2f} %" if share < 0.01 else f"{100.0 * share:.1f} %"


def work() -> float:
    """Return the work of a measurement, in the units that it reports."""
    return len(LIGHT_DEGREES) + 2.0 * (1 + ROUNDS)


def check(material: bpy.types.Material | None, scene: bpy.types.Scene) -> tuple[Claim, Setup]:
    """Return what `material` claims and what `scene` renders with; raises Refused where it cannot be measured."""
    setup, claim = Setup.of(scene), claim_of(material)
    if claim is None:
        raise Refused("No True Diffuse group makes this material's surface" if material else "There is no material")
    black = max(claim.rgb("Color")) < LEAST and not (claim.group == SPECULAR_GROUP.key and claim.number("Specular") >= LEAST)
    if black:
        raise Refused("The material is black: there is nothing to compare")
    if claim.follows_lamps and chosen_lights.LIGHTS.trees(linked=True):
        raise Refused("Mode Lamps of a material linked from another file follows the lamps chosen there: it cannot be measured")
    try:
        render.openimageio()
    except ImportError:
        raise Refused("This Blender lacks OpenImageIO, which reads the renders (Debian: python3-openimageio)") from None
    return claim, setup


def measure(material: bpy.types.Material, scene: bpy.types.Scene, progress: Progress) -> Finding:
    """Return how far `material` is from its claim in `scene`'s engine and what it costs; `work` is its work to `progress`.

    Raises Refused where it cannot be measured.
    """
    claim, setup = check(material, scene)
    is_slab = claim.group == SUBSURFACE.key
    with _workshop() as bench:
        bench.cycles.shading_system = setup.osl
        sphere = sphere_under_sun(SIZE, bench)
        with chosen_lights.following([sphere.sun]) if claim.follows_lamps else nullcontext():
            shown = _copy(material)
            if is_slab:
                errors = _slab_errors(shown, claim, setup, scene.unit_settings.scale_length, progress)
            else:
                errors = _sphere_errors(shown, claim, setup, sphere, progress)
            seconds, lambert_seconds = _seconds(shown, sphere, setup, progress)
    return Finding(claim, setup, setup.device, fmean(errors), max(errors), seconds, lambert_seconds)


def _sphere_errors(
    shown: bpy.types.Material, claim: Claim, setup: Setup, sphere: SphereUnderSun, progress: Progress
) -> list[float]:
    color = (*claim.rgb("Color"), 1.0)
    next(node for node in sphere.plain.node_tree.nodes if node.type == "BSDF_DIFFUSE").inputs["Color"].default_value = color
    errors = []
    for degrees in LIGHT_DEGREES:
        with progress.step(f"Light at {degrees:g} degrees", 1.0):
            errors.append(sphere.measure(shown, (claim.model,), setup.fitted, SAMPLES[setup.engine], degrees)[1][0].rms)
    return errors


def _slab_errors(shown: bpy.types.Material, claim: Claim, setup: Setup, scale_length: float, progress: Progress) -> list[float]:
    """Return the errors of the color shown at VIEW_MUS, under a sun from above, without the coat, which would mirror the sun."""
    node = _node(shown)
    coat, node.inputs["Specular"].default_value = node.inputs["Specular"].default_value, 0.0
    longest = max(max(claim.rgb("Subsurface Radius")) * claim.number("Scale"), 1e-3)
    scene = bpy.data.scenes.new("True Diffuse Slab")
    scene.cycles.shading_system = setup.osl
    body = slab(HALF_SPACE * longest, scale_length=scale_length, scene=scene)
    enters, color = claim.number("Subsurface"), claim.rgb("Color")
    errors = []
    for mu in VIEW_MUS:
        view = from_polar(mu, 0.0)
        reflected = [math.pi * claim.model.radiance(NORMAL, NORMAL, view, channel) for channel in color]
        expected = [enters * channel + (1.0 - enters) * rough for channel, rough in zip(color, reflected, strict=True)]
        with progress.step(f"View at {math.degrees(math.acos(mu)):g} degrees", len(LIGHT_DEGREES) / len(VIEW_MUS)):
            ((found),) = body.albedos([shown], setup.fitted, SLAB_SAMPLES[setup.engine], mu)
        square = sum((got.value - want) ** 2 for got, want in zip(found, expected, strict=True))
        errors.append(math.sqrt(square / sum(want * want for want in expected)))
    node.inputs["Specular"].default_value = coat
    return errors


def _seconds(shown: bpy.types.Material, sphere: SphereUnderSun, setup: Setup, progress: Progress) -> tuple[float, float]:
    """Return the median render times of `shown` and of plain Lambert, in turns; the first, in which shaders compile, is no turn."""
    sphere.scene.render.resolution_x = sphere.scene.render.resolution_y = TIMED_SIZE
    turns: list[tuple[float, float]] = []
    for _ in range(1 + ROUNDS):
        pair = []
        for material in (shown, sphere.plain):
            with progress.step("Timing", 1.0):
                samples = TIMED_SAMPLES[setup.engine]
                pair.append(sphere.radiance(material, [sphere.sun], None, setup.fitted, samples, shadows=False)[0])
        turns.append((pair[0], pair[1]))
    return median(turn[0] for turn in turns[1:]), median(turn[1] for turn in turns[1:])


def _copy(material: bpy.types.Material) -> bpy.types.Material:
    """Return a copy of `material` whose surface is its group, whole, with nothing that feeds it."""
    copy = material.copy()
    node = _node(copy)
    if SPECIALIZED_FOR in node.node_tree:
        restore_node(node)  # what was left out may be needed here
    tree = copy.node_tree
    tree.animation_data_clear()
    for other in [other for other in tree.nodes if other != node]:
        tree.nodes.remove(other)
    materials.show(copy, node)
    materials.set_thickness(copy)
    return copy


def _node(material: bpy.types.Material) -> bpy.types.Node:
    """Return the node of our group that makes the surface of `material`, which has one."""
    found = group_node(material)
    if found is None:
        raise Refused(f"No True Diffuse group makes the surface of {material.name}")
    return found[0]


@contextmanager
def _workshop() -> Generator[bpy.types.Scene]:
    """Yield an empty scene; all data-blocks that are made until the end are removed there."""
    before = set(bpy.data.user_map())
    try:
        yield bpy.data.scenes.new("True Diffuse Probe")
    finally:
        bpy.data.batch_remove([item for item in bpy.data.user_map() if item not in before and not _is_blenders(item)])


def _is_blenders(item: bpy.types.ID) -> bool:
    """Return whether `item` is the image that Blender keeps its renders in."""
    return isinstance(item, bpy.types.Image) and item.type == "RENDER_RESULT"


def _gpu() -> str:
    """Return the names of the devices that Cycles may use as GPUs."""
    cycles = bpy.context.preferences.addons["cycles"].preferences
    names = [device.name for device in cycles.devices if device.use and device.type == cycles.compute_device_type]
    return ", ".join(names) or "CPU"  # what Cycles falls back to
