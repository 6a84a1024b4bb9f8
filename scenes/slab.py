# SPDX-License-Identifier: GPL-3.0-or-later
"""A slab under a sun, seen from above: so thick and wide that scattered light meets no end of it.

The sun shines straight down with an irradiance of pi, so that a white Lambert surface has radiance 1. A mask behind the camera lets
its light through on one side of an edge, or in a ring around the middle. Lengths are in mm, whatever the scene's unit.

In both engines light scattered below the surface leaves it by Lambert's law, so paths can be reversed: a narrow beam sends to a
ring around it what a ring of light sends to the point in its middle. The second is measured, as it has less noise.
"""

import math
from array import array
from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, stdev
from typing import NamedTuple

import bpy

from mathutils import Matrix, Vector

from ..addon.blender.engines import Engine
from ..addon.measure import render

type Picture = tuple[array[float], array[float], array[float]]  # red, green, blue; rows from the top

MM = 0.001  # m
CORNERS = 256  # of a circle: its area is 1e-4 too small
SPOT = 0.1  # of the outer radius of the first ring: what Cycles' camera sees of the middle
SPOT_SIZE = 16  # pixels across it
SPOT_PIXELS = 21  # whose centers a circle of as much area holds
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

    def edge(
        self, material: bpy.types.Material, engine: Engine, samples: int, size: tuple[int, int], view: float
    ) -> tuple[list[float], ...]:
        """Return, by channel, the mean of each column, from dark to lit, of a picture `view` mm wide with a centered edge."""
        columns = size[0]
        picture = self.picture([material], engine, samples, size, view, self.half_plane())
        return tuple([fmean(plane[x::columns]) for x in range(columns)] for plane in picture)

    def rings(self, material: bpy.types.Material, engine: Engine, samples: int, radii: Sequence[float]) -> tuple[list[float], ...]:
        """Return, by channel, the fractions of a narrow beam's light that leave between successive `radii` [mm].

        Not for EEVEE, which scatters only what the camera sees: here the middle alone.
        """
        fractions: tuple[list[float], ...] = [], [], []
        for inner, outer in pairwise(radii):
            size, mask = (SPOT_SIZE, SPOT_SIZE), self.ring(inner, outer)
            for channel, plane in zip(
                fractions, self.picture([material], engine, samples, size, SPOT * radii[1], mask), strict=True
            ):
                channel.append(fmean(plane))
        return fractions

    def around_spot(
        self, material: bpy.types.Material, engine: Engine, samples: int, size: int, view: float, radii: Sequence[float]
    ) -> tuple[list[float], ...]:
        """Return the same as `rings` from a picture of a spot of light, `view` mm and `size` pixels wide.

        The spot is five pixels wide and blurs what is nearer than about ten pixels.
        """
        step = view / size
        spot = math.sqrt(SPOT_PIXELS / math.pi) * step
        picture = self.picture([material], engine, samples, (size, size), view, self.ring(0.0, spot))
        middle = 0.5 * (size - 1)
        values: tuple[list[list[float]], ...] = tuple([[] for _ in pairwise(radii)] for _ in picture)
        for y in range(size):
            for x in range(size):
                index = bisect(radii, step * math.hypot(x - middle, y - middle)) - 1
                if 0 <= index < len(radii) - 1:
                    for channel, plane in zip(values, picture, strict=True):
                        channel[index].append(plane[y * size + x])
        areas = [(outer**2 - inner**2) / spot**2 for inner, outer in pairwise(radii)]
        return tuple([area * fmean(ring) for area, ring in zip(areas, channel, strict=True)] for channel in values)

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

    def half_plane(self) -> bpy.types.Object:
        """Return a mask that lets light through where x > 0; in no scene."""
        far = self.cell
        return self._mask([(-far, -far), (0.0, -far), (0.0, far), (-far, far)], [(0, 1, 2, 3)])

    def ring(self, inner: float, outer: float) -> bpy.types.Object:
        """Return a mask that lets light through between two radii; in no scene."""
        turns = [2.0 * math.pi * k / CORNERS for k in range(CORNERS)]
        points = [(r * math.cos(turn), r * math.sin(turn)) for r in (inner, outer, self.cell) for turn in turns]
        around = [(k, (k + 1) % CORNERS) for k in range(CORNERS)]
        frame = [(CORNERS + k, 2 * CORNERS + k, 2 * CORNERS + after, CORNERS + after) for k, after in around]
        return self._mask(points, [*frame, tuple(range(CORNERS))] if inner > 0.0 else frame)

    def _mask(self, points: Sequence[tuple[float, float]], faces: Sequence[tuple[int, ...]]) -> bpy.types.Object:
        height = (AWAY + 1.0) * 0.5 * self.cell  # behind the camera
        mesh = bpy.data.meshes.new("Mask")
        mesh.from_pydata([(self.units(x), self.units(y), self.units(height)) for x, y in points], [], faces)
        return bpy.data.objects.new("Mask", mesh)

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
