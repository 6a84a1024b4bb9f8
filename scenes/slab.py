# SPDX-License-Identifier: GPL-3.0-or-later
"""A slab under a sun and a mask: flat, so thick and wide that light takes it for a half-space, seen from above.

The sun shines straight down with an irradiance of pi, so a white Lambert surface would show 1. The mask hangs behind the camera and
lets light through on one side of an edge or in a ring around the middle. Lengths are in mm, whatever the scene's unit.

Light that is scattered below the surface leaves it as Lambert has it, in both engines, and paths may be reversed: what a narrow
beam sends to a ring around it is what a ring of light sends to the point in its middle. The second is measured: it has less noise.
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
    """Of pixels that show the same."""

    value: float
    noise: float
    """Standard error of `value`."""

    @classmethod
    def of(cls, values: Sequence[float]) -> "Mean":
        """Return the mean of `values`, two or more."""
        return cls(fmean(values), stdev(values) / math.sqrt(len(values)))


@dataclass(frozen=True)
class Slab:
    """The scene and what measures materials in it."""

    scene: bpy.types.Scene
    body: bpy.types.Object
    sun: bpy.types.Object
    cell: float
    """Width of a cell [mm]: the slab's top has `columns` times `rows` of them, each of its own material."""
    columns: int
    rows: int
    scale_length: float
    """Meters in a unit of the scene's coordinates."""

    def albedos(
        self,
        materials: Sequence[bpy.types.Material],
        engine: Engine,
        samples: int,
        mu: float = 1.0,
        world: bpy.types.World | None = None,
    ) -> list[tuple[Mean, ...]]:
        """Return the share of light that each cell shows at the cosine `mu`, by channel: of the sun's, or of `world`'s."""
        width, height = CELL * self.columns, CELL * self.rows
        picture = self.picture(materials, engine, samples, (width, height), self.cell * self.columns, mu=mu, world=world)
        inner = range(MARGIN, CELL - MARGIN)
        found = []
        for index in range(len(materials)):
            row, column = divmod(index, self.columns)
            pixels = [(row * CELL + y) * width + column * CELL + x for y in inner for x in inner]
            found.append(tuple(Mean.of([plane[pixel] for pixel in pixels]) for plane in picture))
        return found

    def edge(
        self, material: bpy.types.Material, engine: Engine, samples: int, size: tuple[int, int], view: float
    ) -> tuple[list[float], ...]:
        """Return the means of columns, from dark to lit, of a picture `view` mm wide with the edge in its middle, by channel."""
        columns = size[0]
        picture = self.picture([material], engine, samples, size, view, self.half_plane())
        return tuple([fmean(plane[x::columns]) for x in range(columns)] for plane in picture)

    def rings(self, material: bpy.types.Material, engine: Engine, samples: int, radii: Sequence[float]) -> tuple[list[float], ...]:
        """Return the shares of a narrow beam's light that leave between each two of `radii`, which rise, by channel.

        The camera sees the middle alone, so this is not for EEVEE, which scatters what it sees.
        """
        shares: tuple[list[float], ...] = [], [], []
        for inner, outer in pairwise(radii):
            size, mask = (SPOT_SIZE, SPOT_SIZE), self.ring(inner, outer)
            for channel, plane in zip(shares, self.picture([material], engine, samples, size, SPOT * radii[1], mask), strict=True):
                channel.append(fmean(plane))
        return shares

    def around_spot(
        self, material: bpy.types.Material, engine: Engine, samples: int, size: int, view: float, radii: Sequence[float]
    ) -> tuple[list[float], ...]:
        """Return the same as `rings`, from a picture `view` mm wide and `size` pixels across of a spot of light.

        The spot is five pixels wide, and so blurs what is nearer than some ten pixels.
        """
        step = view / size
        spot = math.sqrt(SPOT_PIXELS / math.pi) * step
        picture = self.picture([material], engine, samples, (size, size), view, self.ring(0.0, spot))
        middle = 0.5 * (size - 1)
        found: tuple[list[list[float]], ...] = tuple([[] for _ in pairwise(radii)] for _ in picture)
        for y in range(size):
            for x in range(size):
                index = bisect(radii, step * math.hypot(x - middle, y - middle)) - 1
                if 0 <= index < len(radii) - 1:
                    for channel, plane in zip(found, picture, strict=True):
                        channel[index].append(plane[y * size + x])
        areas = [(outer**2 - inner**2) / spot**2 for inner, outer in pairwise(radii)]
        return tuple([area * fmean(values) for area, values in zip(areas, channel, strict=True)] for channel in found)

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
        """Return what the camera sees from the cosine `mu`, `view` mm across, under the sun or in `world`.

        The slab is stretched against the foreshortening. `size` in pixels; a picture is at least as wide as it is high.
        """
        self.scene.render.resolution_x, self.scene.render.resolution_y = size
        camera, towards = self.scene.camera, Vector((math.sqrt(1.0 - mu * mu), 0.0, mu))
        camera.data.ortho_scale = self.units(view)
        place = Matrix.Translation(AWAY * self.units(0.5 * self.cell * self.columns) * towards)
        camera.matrix_world = place @ Matrix.Rotation(math.acos(mu), 4, "Y")
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
    """Return a slab with `columns` times `rows` cells that are `cell` mm wide, as thick as one, where a unit is `scale_length` m.

    A cell that is 100 mean free paths wide is a half-space, to scattered light. There are at least as many columns as rows.
    Camera and size of picture are `scene`'s, the current one's where none is given.
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
