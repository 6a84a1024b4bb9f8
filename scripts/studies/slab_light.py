# SPDX-License-Identifier: GPL-3.0-or-later
"""How far light spreads in a slab, by masks behind the camera: the edge of a shadow, and rings around a narrow beam.

In both engines light scattered below the surface leaves it by Lambert's law, so paths can be reversed: a narrow beam sends to a
ring around it what a ring of light sends to the point in its middle. The second is measured, as it has less noise.
"""

import math
from bisect import bisect
from collections.abc import Sequence
from itertools import pairwise
from statistics import fmean

import bpy

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.scenes.slab import AWAY, Slab

CORNERS = 256  # of a circle: its area is 1e-4 too small
SPOT = 0.1  # of the outer radius of the first ring: what Cycles' camera sees of the middle
SPOT_SIZE = 16  # pixels across it
SPOT_PIXELS = 21  # whose centers a circle of as much area holds


def edge(
    body: Slab, material: bpy.types.Material, engine: Engine, samples: int, size: tuple[int, int], view: float
) -> tuple[list[float], ...]:
    """Return, by channel, the mean of each column, from dark to lit, of a picture `view` mm wide with a centered edge."""
    columns = size[0]
    picture = body.picture([material], engine, samples, size, view, half_plane(body))
    return tuple([fmean(plane[x::columns]) for x in range(columns)] for plane in picture)


def rings(
    body: Slab, material: bpy.types.Material, engine: Engine, samples: int, radii: Sequence[float]
) -> tuple[list[float], ...]:
    """Return, by channel, the fractions of a narrow beam's light that leave between successive `radii` [mm].

    Not for EEVEE, which scatters only what the camera sees: here the middle alone.
    """
    fractions: tuple[list[float], ...] = [], [], []
    for inner, outer in pairwise(radii):
        size, mask = (SPOT_SIZE, SPOT_SIZE), _ring(body, inner, outer)
        for channel, plane in zip(fractions, body.picture([material], engine, samples, size, SPOT * radii[1], mask), strict=True):
            channel.append(fmean(plane))
    return fractions


def around_spot(
    body: Slab, material: bpy.types.Material, engine: Engine, samples: int, size: int, view: float, radii: Sequence[float]
) -> tuple[list[float], ...]:
    """Return the same as `rings` from a picture of a spot of light, `view` mm and `size` pixels wide.

    The spot is five pixels wide and blurs what is nearer than about ten pixels.
    """
    step = view / size
    spot = math.sqrt(SPOT_PIXELS / math.pi) * step
    picture = body.picture([material], engine, samples, (size, size), view, _ring(body, 0.0, spot))
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


def half_plane(body: Slab) -> bpy.types.Object:
    """Return a mask that lets light through where x > 0; in no scene."""
    far = body.cell
    return _mask(body, [(-far, -far), (0.0, -far), (0.0, far), (-far, far)], [(0, 1, 2, 3)])


def _ring(body: Slab, inner: float, outer: float) -> bpy.types.Object:
    """Return a mask that lets light through between two radii; in no scene."""
    turns = [2.0 * math.pi * k / CORNERS for k in range(CORNERS)]
    points = [(r * math.cos(turn), r * math.sin(turn)) for r in (inner, outer, body.cell) for turn in turns]
    around = [(k, (k + 1) % CORNERS) for k in range(CORNERS)]
    frame = [(CORNERS + k, 2 * CORNERS + k, 2 * CORNERS + after, CORNERS + after) for k, after in around]
    return _mask(body, points, [*frame, tuple(range(CORNERS))] if inner > 0.0 else frame)


def _mask(body: Slab, points: Sequence[tuple[float, float]], faces: Sequence[tuple[int, ...]]) -> bpy.types.Object:
    height = (AWAY + 1.0) * 0.5 * body.cell  # behind the camera
    mesh = bpy.data.meshes.new("Mask")
    mesh.from_pydata([(body.units(x), body.units(y), body.units(height)) for x, y in points], [], faces)
    return bpy.data.objects.new("Mask", mesh)
