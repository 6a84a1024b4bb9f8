# SPDX-License-Identifier: GPL-3.0-or-later
"""Realtime's shadows of lights with a size against Cycles, by the number of samples: five characters without sky and bounces."""

import math
from array import array
from collections.abc import Iterator, Sequence
from functools import cache, partial

import bpy

from mathutils import Matrix, Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Record
from true_diffuse.scenes import elements, five_characters
from true_diffuse.scripts.studies.study import Step, Table, pivot

RESOLUTION = (480, 180)
KEY_ANGLE = 0.1  # radians across: a sun behind thin clouds
FILL_PLACE, FILL_SIZE, FILL_POWER = Vector((3.0, -4.0, 2.0)), 2.0, 300.0  # m, m, W
CHESTS = Vector((0.0, 0.0, 1.2))  # what the fill faces [m]
FILTER = 1.5  # pixels, the width of Blackman and Harris's window in both engines
SAMPLES, NOISELESS = (1, 16, 64), 256
WORST = 0.01  # of the pixels, along edges, where engines filter different points
LIGHTS = {"key": ("key",), "fill": ("fill",), "key and fill": ("key", "fill")}


class Characters:
    """The five characters with plain Diffuse BSDFs, a wide sun as key light and an area light as fill."""

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        five = five_characters.build(mesh, 0.8, True, RESOLUTION)
        self.scene = five.scene
        self.figures = [character.subject for character in five.characters]
        for character in five.characters:
            character.subject.material_slots[0].material = five.plain
        fill = bpy.data.lights.new("Fill", "AREA")
        fill.energy, fill.size = FILL_POWER, FILL_SIZE
        placed = Matrix.Translation(FILL_PLACE) @ elements.towards(FILL_PLACE - CHESTS)
        five.key.data.angle = KEY_ANGLE
        self._lights = {"key": five.key, "fill": elements.add(self.scene, "Fill", fill, placed)}
        self.scene.world = None
        engines.leave_out_bounces(self.scene)
        self.scene.render.filter_size = FILTER
        self.scene.cycles.filter_width = FILTER / 2.0  # half the window
        self.cycles = cache(partial(self.radiance, engine=engines.CYCLES, samples=NOISELESS))

    def radiance(self, lights: Sequence[str], engine: engines.Engine, samples: int) -> array[float]:
        """Return the picture under some of the lights."""
        for name, light in self._lights.items():
            light.hide_render = name not in lights
        return render.radiance(self.scene, engine, samples)[1]


def steps(mesh: bpy.types.Mesh, quick: bool) -> list[Step]:
    """Return steps that yield Realtime's RMS difference from Cycles, of all pixels and without the WORST."""
    characters = Characters(mesh)

    def measure(name: str, samples: int) -> Iterator[Record]:
        expected = characters.cycles(LIGHTS[name])
        got = characters.radiance(LIGHTS[name], engines.REALTIME, samples)
        mean = sum(got) / sum(expected) - 1.0
        yield {"lights": name, "samples": samples, **differences(got, expected), "mean_difference": mean}

    names = ("key and fill",) if quick else LIGHTS
    return [Step(f"{name}  {count} samples", partial(measure, name, count), count + 20.0) for name in names for count in SAMPLES]


def differences(got: array[float], expected: array[float]) -> Record:
    """Return the RMS difference of two pictures, of all pixels and without the WORST."""
    pixels = range(len(got) // 3)

    def square(pixel: int) -> float:
        return sum((got[i] - expected[i]) ** 2 for i in range(3 * pixel, 3 * pixel + 3))

    best = sorted(pixels, key=square)[: math.ceil((1.0 - WORST) * len(pixels))]
    return {
        "rms_difference": error.difference(got, expected, pixels),
        "rms_difference_of_best": error.difference(got, expected, best),
    }


def table(records: Sequence[Record]) -> Table:
    """Return the differences, a row for each choice of lights and a column for each number of samples."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        whole, best, mean = (100.0 * one[key] for key in ("rms_difference", "rms_difference_of_best", "mean_difference"))
        return f"{whole:.1f} / {best:.1f} / {mean:+.2f} %"

    return pivot(records, ("Lights",), lambda one: (one["lights"],), lambda one: f"{one['samples']} samples", cell)
