# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps of suns and spots: where each lamp looks from, fitted to what the camera sees, and its tile in one square texture."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from mathutils import Matrix, Vector

from .blocks import columns
from .extent import Extent
from .lights import Lamp
from .program import MOST_LAMPS
from .view import View

MAP_SIZE = 4096  # texels
WIDEST = math.radians(80.0)  # half of a spot's map; what a wider cone lights beyond has no shadow
NEAREST = 1e-3  # of a spot's reach
STEP = 2.0**0.25  # a sun's map grows in such steps, so that its texels stay where they are while the view turns


@dataclass(frozen=True)
class Tile:
    """A lamp's map: `matrix` takes a point of the world to its clip space; `x`, `y`, `size` in texels; `texel` what one covers [m],
    for a spot at a distance of 1 m.
    """

    lamp: int
    matrix: Matrix
    x: int
    y: int
    size: int
    texel: float


def tiles(lamps: Sequence[Lamp], extent: Extent, view: View) -> list[Tile]:
    """Return the maps of the lamps that cast shadows, as large as they all fit."""
    casting = [index for index, lamp in enumerate(lamps) if lamp.casts]
    casters = extent.casters
    if not casting or not casters:
        return []
    across = math.ceil(math.sqrt(len(casting)))
    size = MAP_SIZE // across
    seen = extent.seen(view)
    made = []
    for place, index in enumerate(casting):
        lamp = lamps[index]
        look = _spot(lamp, casters, size) if lamp.kind == "SPOT" else _sun(lamp, casters, seen or casters, size)
        made.append(Tile(index, look[0], size * (place % across), size * (place // across), size, look[1]))
    return made


def _sun(lamp: Lamp, casters: Sequence[Vector], seen: Sequence[Vector], size: int) -> tuple[Matrix, float]:
    """Return a sun's projection, which holds what is seen and all that may stand before it, and what a texel covers [m]."""
    turn = Vector(lamp.towards).to_track_quat("Z", "Y").to_matrix().inverted()
    points = [turn @ point for point in seen]
    low = Vector(min(point[axis] for point in points) for axis in range(2))
    high = Vector(max(point[axis] for point in points) for axis in range(2))
    width = max(*(high - low), 1e-6) * (1.0 + 4.0 / size)
    width = STEP ** math.ceil(math.log(width, STEP))
    texel = width / size
    center = [round((low[axis] + high[axis]) / (2.0 * texel)) * texel for axis in range(2)]
    depths = [(turn @ point).z for point in (*casters, *seen)]
    near, far = max(depths), min(depths)
    deep = max(near - far, 1e-6) * 1.001
    middle = (near + far) / 2.0
    scale = Matrix.Diagonal((2.0 / width, 2.0 / width, -2.0 / deep, 1.0))
    return scale @ Matrix.Translation((-center[0], -center[1], -middle)) @ turn.to_4x4(), texel


def _spot(lamp: Lamp, casters: Sequence[Vector], size: int) -> tuple[Matrix, float]:
    """Return a spot's projection, which holds its cone, and what a texel covers [m] at a distance of 1 m."""
    place = Vector(lamp.place)
    turn = Vector(lamp.towards).to_track_quat("Z", "Y").to_matrix().inverted()
    far = max(1e-6, max((point - place).length for point in casters)) * 1.001
    near = far * NEAREST
    stretch = 1.0 / max(min(Vector(lamp.across).length, Vector(lamp.up).length), 1e-6)
    half = min(math.tan(min(math.acos(max(-1.0, min(lamp.edge, 1.0))), WIDEST)) * stretch, math.tan(WIDEST))
    slope, shift = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    projection = Matrix(((1.0 / half, 0, 0, 0), (0, 1.0 / half, 0, 0), (0, 0, slope, shift), (0, 0, -1.0, 0)))
    return projection @ turn.to_4x4() @ Matrix.Translation(-place), 2.0 * half / size


def packed(made: Sequence[Tile]) -> bytes:
    """Return the struct Shadows of program.py; lamps without a map have a tile of no size."""
    by_lamp = {tile.lamp: tile for tile in made}
    matrices, places, texels = bytearray(), bytearray(), bytearray()
    for index in range(MOST_LAMPS):
        tile = by_lamp.get(index)
        matrices += columns(tile.matrix) if tile else bytes(64)
        places += struct.pack("4f", tile.x, tile.y, tile.size, 0.0) if tile else bytes(16)
        texels += struct.pack("4f", tile.texel, 0.0, 0.0, 0.0) if tile else bytes(16)
    return bytes(matrices + places + texels)
