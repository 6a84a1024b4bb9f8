# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps of suns and spots: each light's projection, fitted to what the camera sees, and its tile of one square texture."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from mathutils import Matrix, Vector

from .lights import Light
from .program import MAX_LIGHTS
from .scene_bounds import SceneBounds
from .view import View, matrix_to_bytes

MAP_SIZE = 4096  # texels
WIDEST = math.radians(80.0)  # half the angle of a spot's map; what a wider cone lights beyond has no shadow
NEAREST = 1e-3  # the near plane of a spot's map, as a fraction of its far plane
STEP = 2.0**0.25  # a sun's map grows in such steps, so that its texels stay where they are while the view turns


@dataclass(frozen=True)
class Tile:
    """A light's part of the shadow map.

    `light` is the light's index; `matrix` takes a point of the world to the light's clip space; `x`, `y`, `size` are in texels;
    `texel` is the width that a texel covers [m], for a spot at a distance of 1 m.
    """

    light: int
    matrix: Matrix
    x: int
    y: int
    size: int
    texel: float


def shadow_tiles(lights: Sequence[Light], bounds: SceneBounds, view: View) -> list[Tile]:
    """Return a tile for each light that casts shadows, all of one size, the largest at which they fit into MAP_SIZE."""
    casting = [index for index, light in enumerate(lights) if light.casts_shadow]
    casters = bounds.casters
    if not casting or not casters:
        return []
    columns = math.ceil(math.sqrt(len(casting)))
    size = MAP_SIZE // columns
    visible = bounds.visible(view)
    tiles = []
    for slot, index in enumerate(casting):
        light = lights[index]
        matrix, texel = _spot(light, casters, size) if light.kind == "SPOT" else _sun(light, casters, visible or casters, size)
        tiles.append(Tile(index, matrix, size * (slot % columns), size * (slot // columns), size, texel))
    return tiles


def tiles_to_bytes(tiles: Sequence[Tile]) -> bytes:
    """Return the struct Shadows of program.py; lights without a shadow map have a tile of size 0."""
    by_light = {tile.light: tile for tile in tiles}
    matrices, positions, texels = bytearray(), bytearray(), bytearray()
    for index in range(MAX_LIGHTS):
        tile = by_light.get(index)
        matrices += matrix_to_bytes(tile.matrix) if tile else bytes(64)
        positions += struct.pack("4f", tile.x, tile.y, tile.size, 0.0) if tile else bytes(16)
        texels += struct.pack("4f", tile.texel, 0.0, 0.0, 0.0) if tile else bytes(16)
    return bytes(matrices + positions + texels)


def _sun(light: Light, casters: Sequence[Vector], visible: Sequence[Vector], size: int) -> tuple[Matrix, float]:
    """Return a sun's projection and the width of a texel [m]: it holds `visible` and all `casters` that may stand before it."""
    rotation = Vector(light.axis).to_track_quat("Z", "Y").to_matrix().inverted()
    points = [rotation @ point for point in visible]
    low = Vector(min(point[axis] for point in points) for axis in range(2))
    high = Vector(max(point[axis] for point in points) for axis in range(2))
    width = max(*(high - low), 1e-6) * (1.0 + 4.0 / size)
    width = STEP ** math.ceil(math.log(width, STEP))
    texel = width / size
    center = [round((low[axis] + high[axis]) / (2.0 * texel)) * texel for axis in range(2)]
    depths = [(rotation @ point).z for point in (*casters, *visible)]
    near, far = max(depths), min(depths)
    depth = max(near - far, 1e-6) * 1.001
    middle = (near + far) / 2.0
    scale = Matrix.Diagonal((2.0 / width, 2.0 / width, -2.0 / depth, 1.0))
    return scale @ Matrix.Translation((-center[0], -center[1], -middle)) @ rotation.to_4x4(), texel


def _spot(light: Light, casters: Sequence[Vector], size: int) -> tuple[Matrix, float]:
    """Return a spot's projection, which holds its cone, and the width of a texel at a distance of 1 m [m]."""
    position = Vector(light.position)
    rotation = Vector(light.axis).to_track_quat("Z", "Y").to_matrix().inverted()
    far = max(1e-6, max((point - position).length for point in casters)) * 1.001
    near = far * NEAREST
    stretch = 1.0 / max(min(Vector(light.x_axis).length, Vector(light.y_axis).length), 1e-6)
    half = min(math.tan(min(math.acos(max(-1.0, min(light.edge, 1.0))), WIDEST)) * stretch, math.tan(WIDEST))
    slope, shift = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    projection = Matrix(((1.0 / half, 0, 0, 0), (0, 1.0 / half, 0, 0), (0, 0, slope, shift), (0, 0, -1.0, 0)))
    return projection @ rotation.to_4x4() @ Matrix.Translation(-position), 2.0 * half / size
