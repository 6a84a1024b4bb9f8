# SPDX-License-Identifier: GPL-3.0-or-later
"""A slab under a sun, seen from above: so thick and wide that scattered light meets no end of it.

The sun shines straight down with an irradiance of pi, so that a white Lambert surface has radiance 1. Lengths are in mm, whatever
the scene's unit.
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import NamedTuple

import bpy

from mathutils import Matrix, Vector

from ..addon.blender.engines import Engine
from ..addon.measure import render

type Picture = tuple[array[float], array[float], array[float]]  # red, green, blue; rows from the top

MM = 0.001  # m
CELL, MARGIN = 16, 2  # pixels across a cell, and around what is measured of it
AWAY = 6.0  # half widths from the camera to the slab: at N.V = 0.2 all of the slab is in front of it
SHADOW_STEPS = 4.0  # of EEVEE's shadow map across a pixel


class Mean(NamedTuple):
    """The mean `value` of pixels that show the same, and its standard error, `noise`."""

    value: float
    noise: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "Mean":
        """Return the mean of `values`, two or more."""
        return cls(fmean(values), stdev(values) / math.sqrt(len(values)))


@dataclass(frozen=True)
class Slab:
    """The scene. The slab's top has `columns` times `rows` cells, `cell` mm wide, each of its own material.

    `scale_length` is the scene's unit in meters.
    """

    scene: bpy.types.Scene
    body: bpy.types.Object
    sun: bpy.types.Object
    cell: float
    columns: int
    rows: int
    scale_length: float

    def albedos(
        self,
        materials: Sequence[bpy.types.Material],
        engine: Engine,
        samples: int,
        mu: float = 1.0,
        world: bpy.types.World | None = None,
    ) -> list[tuple[Mean, ...]]:
        """Return each cell's radiance at N.V = `mu`, by channel, as a fraction of white's: under the sun, or in `world` alone."""
        width, height = CELL * self.columns, CELL * self.rows
        picture = self.picture(materials, engine, samples, (width, height), self.cell * self.columns, mu=mu, world=world)
        inner = range(MARGIN, CELL - MARGIN)
        means = []
        for index in range(len(materials)):
            row, column = divmod(index, self.columns)
            pixels = [(row * CELL + y) * width + column * CELL + x for y in inner for x in inner]
            means.append(tuple(Mean.of([plane[pixel] for pixel in pixels]) for plane in picture))
        return means

    def picture(
        self,
        materials: Sequence[bpy.types.Material],
        engine: Engine,
        samples: int,
        size: tuple[int, int],
        view: float,
        mask: bpy.types.Object | None = None,
        mu: float = 1.0,
        world: bpy.types.World | None = None,
    ) -> Picture:
        """Return a picture `view` mm wide, seen at N.V = `mu` under the sun (through `mask`, then removed) or in `world` alone.

        The slab is stretched against foreshortening. `size` is in pixels, at least as wide as high.
        """
        self.scene.render.resolution_x, self.scene.render.resolution_y = size
        camera, direction = self.scene.camera, Vector((math.sqrt(1.0 - mu * mu), 0.0, mu))
        camera.data.ortho_scale = self.units(view)
        position = Matrix.Translation(AWAY * self.units(0.5 * self.cell * self.columns) * direction)
        camera.matrix_world = position @ Matrix.Rotation(math.acos(mu), 4, "Y")
        self.body.matrix_world = Matrix.Diagonal((1.0 / mu, 1.0, 1.0, 1.0))
        self.sun.data.shadow_maximum_resolution = self.units(view) / size[0] / SHADOW_STEPS
        for index in range(len(self.body.data.materials)):
            self.body.data.materials[index] = materials[min(index, len(materials) - 1)]
        with render.measurement_scene(self.scene, self.body, *(() if world else (self.sun,)), shadows=True) as scene:
            scene.unit_settings.scale_length = self.scale_length
            scene.world = world
            if mask:
                scene.collection.objects.link(mask)
            _, rgb = render.radiance(scene, engine, samples)
        if mask:
            bpy.data.meshes.remove(mask.data)
        return rgb[0::3], rgb[1::3], rgb[2::3]

    def units(self, length: float) -> float:
        """Return a `length` [mm] in the scene's coordinates."""
        return length * MM / self.scale_length


def slab(cell: float, columns: int = 1, rows: int = 1, scale_length: float = 1.0, scene: bpy.types.Scene | None = None) -> Slab:
    """Return a slab of `columns` times `rows` cells, `cell` mm wide and as thick; the scene's unit is `scale_length` meters.

    A cell 100 mean free paths wide is a half-space to scattered light. There are at least as many columns as rows. The camera
    becomes that of `scene`, by default the current one.
    """
    scene = scene or bpy.context.scene
    mesh = bpy.data.meshes.new("Slab")
    body = bpy.data.objects.new("Slab", mesh)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    result = Slab(scene, body, sun, cell, columns, rows, scale_length)
    side, line = result.units(cell), columns + 1
    # rows from the top, as in pictures
    top = [(side * (x - 0.5 * columns), side * (0.5 * rows - y), 0.0) for y in range(rows + 1) for x in range(line)]
    corners = (0, columns, rows * line + columns, rows * line)
    bottom = [(*top[corner][:2], -side) for corner in corners]
    cells = [(k + line, k + line + 1, k + 1, k) for y in range(rows) for k in range(y * line, y * line + columns)]
    first = len(top)
    sides = [(corners[k], corners[(k + 1) % 4], first + (k + 1) % 4, first + k) for k in range(4)]
    mesh.from_pydata(top + bottom, [], [*cells, *sides, tuple(range(first, first + 4))])
    for index in range(len(cells)):
        mesh.materials.append(None)
        mesh.polygons[index].material_index = index
    distance = AWAY * result.units(0.5 * cell * columns)
    camera.data.type, camera.data.clip_start, camera.data.clip_end = "ORTHO", 0.01 * distance, 2.0 * distance
    sun.data.energy = math.pi
    scene.camera = camera
    return result
