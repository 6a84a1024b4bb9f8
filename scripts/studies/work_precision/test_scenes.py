# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes, and what a picture of each is held against.

- sphere: under its sun 60 degrees beside the viewer, without bounces. Exact: the model's own radiance of every pixel.
- furnace: the same sphere in a world of radiance 1. Exact: the model's directional albedo at each pixel's N.V.
- five: the five characters as an artist renders them, with shadows, sky and bounces, all in one material.
- face: one head of skin against the light, without bounces.

The last two are held against Cycles with many samples, twice with other random numbers, which gives that reference's own error.
"""

import math
from array import array
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.models import directional_albedo
from true_diffuse.addon.models.vector import dot
from true_diffuse.addon.probe import scenes
from true_diffuse.addon.probe.scenes import FiveScene, SphereScene
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scenes.sphere import COLOR
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters import character as characters
from true_diffuse.scripts.characters import face
from true_diffuse.scripts.characters.human import REGIONS
from true_diffuse.scripts.studies import face as face_study
from true_diffuse.scripts.studies.rough import MeasuredModel
from true_diffuse.scripts.studies.work_precision.variants import SIGMA, Variant, rough, translucent

FACE = (240, 96)  # pixels
BSSRDF = 1  # which head: the one in the middle
NODES = 48  # cosines at which a furnace's albedo is worked out; it is linear between them, to 2e-4
REFERENCE_SEEDS = (1001, 1002)  # none of a variant's
ANALYTIC, CONVERGED = "analytic", "converged"
SLOW = {1: 3, 4: 3, 16: 2, 64: 1}  # sample counts of EEVEE and Realtime in the characters and the face, and their repeats
FULL = {1: 3, 4: 3, 16: 3, 64: 3, 256: 2, 1024: 1}  # Cycles' sample counts, and how often each is repeated

type Takes = Sequence[array[float]]  # of a reference
type Ladder = Mapping[int, int]
"""Sample counts, and how often each is repeated."""


@dataclass(frozen=True)
class Cost:
    """What a render takes on two cores, roughly [s], and the first of a material beyond it: for the time left."""

    fixed: float
    per_sample: float
    first: float

    def seconds(self, samples: int) -> float:
        """Return the time of so many samples."""
        return self.fixed + self.per_sample * samples


class TestScene:
    """A scene and all that is rendered in it, built when it is made. `reference_samples` is 0 where the reference is a formula."""

    name: str
    title: str
    reference_samples = 0
    reference_text: str
    variants: Sequence[Variant]
    ladders: Mapping[str, Ladder]
    extra_samples: Sequence[int] = ()
    costs: Mapping[str, Cost]

    @staticmethod
    def select(used: Sequence[Engine], quick: bool) -> list[Variant]:
        """Return the variants that take part."""
        raise NotImplementedError

    def ladder(self, variant: Variant) -> Ladder:
        """Return the sample counts of a variant."""
        ladder = self.ladders[variant.engine.key]
        return {samples: times for samples, times in ladder.items() if samples in self.extra_samples or not variant.is_extra}

    def prepare(self) -> None:
        """Choose the lights of this scene for materials that are exact for chosen lights."""

    def paint(self, material: bpy.types.Material, socket: bpy.types.NodeSocket) -> None:
        """Link the paint of this scene's meshes to a color socket."""
        scenes.paint(material, socket)

    def picture(
        self, material: bpy.types.Material, engine: Engine, osl: bool, samples: int, seed: int
    ) -> tuple[float, array[float]]:
        """Return the seconds of a render and its linear RGB."""
        raise NotImplementedError

    def error_of(self, variant: Variant, rgb: array[float], takes: Takes) -> float:
        """Return the RMS error of a picture, relative to the RMS of what it is held against: here the mean of `takes`."""
        return error.difference(rgb, mean(takes), self.pixels)

    def noise(self, takes: Takes) -> float:
        """Return the RMS noise that is left in the mean of a reference's takes, relative to them."""
        return error.difference(*takes, self.pixels) / 2.0

    @cached_property
    def pixels(self) -> Sequence[int]:
        """The pixels that count, where the reference is rendered."""
        raise NotImplementedError

    @property
    def reference(self) -> Variant | None:
        """The variant that renders the reference; None where that is a formula."""
        return None


class Sphere(SphereScene, TestScene):
    title = "Sphere under a sun"
    reference_text = "The model's own formula at every pixel: exact."
    extra_samples = (1, 16)

    @staticmethod
    def select(used: Sequence[Engine], quick: bool) -> list[Variant]:
        return rough(used, quick, sunlit=True)

    def __init__(self, used: Sequence[Engine], quick: bool) -> None:
        super().__init__(f"Work-Precision {self.title}")
        self.variants = self.select(used, quick)
        eevee = {1: 2, 16: 1} if quick else {1: 3, 4: 3, 16: 3, 64: 3, 256: 2}
        cycles = {1: 2, 4: 2, 16: 2, 64: 2} if quick else FULL
        # Realtime's samples are all at the pixel's center here, so that the first gives all
        self.ladders = {EEVEE.key: eevee, CYCLES.key: cycles, REALTIME.key: {1: 2 if quick else 3}}
        self.costs = {EEVEE.key: Cost(0.9, 0.015, 3.0), CYCLES.key: Cost(0.1, 0.003, 0.1), REALTIME.key: Cost(0.05, 0.001, 0.1)}
        self._expected: dict[str, error.Analytic] = {}

    def error_of(self, variant: Variant, rgb: array[float], takes: Takes) -> float:
        measured = variant.target
        if measured.name not in self._expected:
            self._expected[measured.name] = self.expected(measured)
        expected = self._expected[measured.name]
        return error.errors(rgb, expected, expected).rms

    def expected(self, measured: MeasuredModel) -> error.Analytic:
        """Return the radiance of a model at every pixel that faces the light."""
        return self.analytic(measured.formula(SIGMA))


class Furnace(Sphere):
    name = "furnace"
    title = "Sphere in a white furnace"
    reference_text = "The model's directional albedo at every pixel's N.V, by quadrature: exact to 2e-4."
    suns = ()

    @staticmethod
    def select(used: Sequence[Engine], quick: bool) -> list[Variant]:
        return [one for one in rough(used, quick, sunlit=False) if not one.is_duplicate]

    def __init__(self, used: Sequence[Engine], quick: bool) -> None:
        super().__init__(used, quick)
        self.suns, self.world = (), uniform_world()
        if quick:
            self.ladders = {**self.ladders, EEVEE.key: {1: 1, 16: 1}}
        self.costs = {**self.costs, EEVEE.key: Cost(0.9, 0.015, 0.5)}

    def prepare(self) -> None:
        """Nothing is chosen: the world is not a light."""

    def expected(self, measured: MeasuredModel) -> error.Analytic:
        """Return the fraction of the world's light that a model reflects, at every measurable pixel."""
        surface, camera, model = (
            self.built.surface(),
            tuple(self.built.scene.camera.matrix_world.translation),
            measured.formula(SIGMA),
        )
        tables = [[directional_albedo(model, (k + 0.5) / NODES, rho, order=12) for k in range(NODES)] for rho in COLOR[:3]]
        pixels, radiance = array("l"), array("f")
        for pixel, measurable in enumerate(surface.measurable):
            mu = dot(*error.directions(surface, pixel, camera)) if measurable else 0.0
            if mu > 0.0:
                pixels.append(pixel)
                radiance.extend(_between(table, mu) for table in tables)
        return error.Analytic(pixels, radiance)


def _between(table: Sequence[float], mu: float) -> float:
    """Return the value at `mu` of a table whose entries are at the middles of equal steps from 0 to 1; linear, also beyond."""
    at = mu * len(table) - 0.5
    k = min(max(0, math.floor(at)), len(table) - 2)
    return table[k] + (at - k) * (table[k + 1] - table[k])


class Five(FiveScene, TestScene):
    title = "Five characters"

    @staticmethod
    def select(used: Sequence[Engine], quick: bool) -> list[Variant]:
        slow = (PRECISE, CHOSEN_LIGHTS) if quick else ()
        everyone = rough(used, True, sunlit=True)
        return [one for one in everyone if not (one.is_duplicate or (one.engine is EEVEE and one.quality in slow))]

    def __init__(self, used: Sequence[Engine], quick: bool, mesh: bpy.types.Mesh, bust: bool = True) -> None:
        super().__init__(mesh, bust)
        self.variants = self.select(used, quick)
        eevee, realtime = ({1: 1, 4: 1}, {1: 1, 16: 1}) if quick else (SLOW, SLOW)
        cycles = {1: 2, 4: 2, 16: 2, 64: 1} if quick else FULL
        self.ladders = {EEVEE.key: eevee, CYCLES.key: cycles, REALTIME.key: realtime}
        self.costs = {EEVEE.key: Cost(1.6, 0.5, 4.0), CYCLES.key: Cost(0.25, 0.02, 0.2), REALTIME.key: Cost(0.8, 0.2, 0.3)}
        self.reference_samples = 256 if quick else 2048
        found = [one for one in rough((CYCLES,), True, sunlit=False) if one.quality == BALANCED]
        self.chosen = found[-1]  # OSL, where there is any
        osl, lobes = "with the model's OSL shader, within 0.1 % of equation (1)", "by lobes, 0.6 % from equation (1)"
        self.reference_text = f"Cycles, {osl if self.chosen.osl else lobes}."

    @property
    def reference(self) -> Variant:
        return self.chosen


class Face(TestScene):
    name = "face"
    title = "Face against the light"
    reference_text = "Cycles, the group Subsurface by Random Walk."
    select = staticmethod(translucent)

    def __init__(self, used: Sequence[Engine], quick: bool, mesh: bpy.types.Mesh) -> None:
        self.built = face.build(mesh, True, FACE)
        self.head = self.built.heads[BSSRDF]
        self.variants = self.select(used, quick)
        eevee, realtime = ({1: 1, 4: 1}, {1: 1, 16: 1}) if quick else (SLOW, SLOW)
        cycles = {1: 2, 4: 2, 16: 2} if quick else FULL
        self.ladders = {EEVEE.key: eevee, CYCLES.key: cycles, REALTIME.key: realtime}
        self.costs = {EEVEE.key: Cost(1.6, 0.5, 2.5), CYCLES.key: Cost(0.06, 0.016, 0.1), REALTIME.key: Cost(0.8, 0.1, 0.3)}
        self.reference_samples = 128 if quick else 4096

    @property
    def reference(self) -> Variant:
        return translucent((CYCLES,), True)[0]

    def paint(self, material: bpy.types.Material, socket: bpy.types.NodeSocket) -> None:
        materials.paint(material, socket, ALBEDO_ATTRIBUTE, 1.0)

    def picture(
        self, material: bpy.types.Material, engine: Engine, osl: bool, samples: int, seed: int
    ) -> tuple[float, array[float]]:
        self.built.scene.cycles.shading_system = osl
        self.head.subject.material_slots[-1].material = material
        with render.measurement_scene(self.built.scene, self.head.subject, *self.built.lights, shadows=True) as scene:
            return render.radiance(scene, engine, samples, seed)

    @cached_property
    def pixels(self) -> Sequence[int]:
        """The pixels of skin that no edge runs through."""
        (seen,) = face_study.visible_regions(replace(self.built, heads=(self.head,)), Silent())
        return sorted({pixel for region in REGIONS for pixel in seen.pixels.get(region, ())})


class Silent:
    """A `Progress` that nobody sees."""

    def step(self, text: str, work: float) -> AbstractContextManager[None]:
        return nullcontext()

    def within(self, work: float) -> None:
        """Show nothing."""


def mean(takes: Takes) -> array[float]:
    """Return the mean of two pictures."""
    return array("f", (0.5 * (a + b) for a, b in zip(*takes, strict=True)))


TEST_SCENES: Mapping[str, type[TestScene]] = {one.name: one for one in (Sphere, Furnace, Five, Face)}


def build(name: str, used: Sequence[Engine], quick: bool, who: str) -> TestScene:
    """Build and return the test scene `name`; `who` are the five characters. Raises CharacterError where they cannot be had."""
    if name == Five.name:
        return Five(used, quick, characters.load(who), bust=who == "human")
    if name == Face.name:
        return Face(used, quick, characters.load("human"))
    return {Sphere.name: Sphere, Furnace.name: Furnace}[name](used, quick)
