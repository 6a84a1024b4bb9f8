# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps: each light's projections, fitted to what the camera sees, and their tiles of one square texture.

A light from which all that is seen lies in front has one projection, which holds it. Another has those sides of a cube that do.
"""

import math
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mathutils import Matrix, Vector

from .lights import Light
from .view import matrix_to_bytes

MAP_SIZE = 4096  # texels
WIDEST = math.radians(60.0)  # half the angle of the widest cone that has one projection; wider, a cube has finer texels
NEAREST = 1e-3  # the near plane of a projection from a point, as a fraction of its far plane
STEP = 2.0**0.25  # a sun's map grows in such steps, so that its texels stay where they are while the view turns
MARGIN = 4.0  # texels around what a map has to hold, for the filter
CUBE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""The unit vectors against which the sides of a cube look, in a light's axes; the last one looks to the back of an area light."""


@dataclass(frozen=True)
class Tile:
    """A part of the shadow map.

    `light` is the light's index; `matrix` takes a point of the world to the tile's clip space; `x`, `y`, `size` are in texels;
    `texel` is the width that a texel covers [m], for other lights than suns at a distance of 1 m.
    """

    light: int
    matrix: Matrix
    x: int
    y: int
    size: int
    texel: float

    BYTES = 80

    def to_bytes(self) -> bytes:
        """Return the tile's row of the texture `shadow_tiles`: the columns of its matrix, and x, y, size and texel."""
        return matrix_to_bytes(self.matrix) + struct.pack("4f", self.x, self.y, self.size, self.texel)


@dataclass(frozen=True)
class Frustum:
    """What a projection from a point holds: `axis` is the unit vector against which it looks, `center` and `half` are tangents."""

    axis: Vector
    half: float
    center: tuple[float, float] = (0.0, 0.0)


def shadow_tiles(lights: Sequence[Light], casters: Sequence[Vector], visible: Sequence[Vector]) -> list[Tile]:
    """Return the tiles of the lights that cast shadows, in their order, of one size, the largest at which all fit into MAP_SIZE.

    `casters` and `visible` are those of SceneBounds.
    """
    if not casters or not any(light.casts_shadow for light in lights):
        return []
    visible = visible or casters
    frusta = [(i, frustum) for i, light in enumerate(lights) if light.casts_shadow for frustum in _frusta(light, visible)]
    columns = max(1, math.ceil(math.sqrt(len(frusta))))
    size = MAP_SIZE // columns
    tiles = []
    for slot, (index, frustum) in enumerate(frusta):
        light = lights[index]
        matrix, texel = _from_point(light, frustum, visible, size) if frustum else _sun(light, casters, visible, size)
        tiles.append(Tile(index, matrix, size * (slot % columns), size * (slot // columns), size, texel))
    return tiles


def _frusta(light: Light, visible: Sequence[Vector]) -> Iterator[Frustum | None]:
    """Yield what the projections of a light hold: together all that is `visible`. None for a sun, whose rays are parallel."""
    if light.kind == "SUN":
        yield None
        return
    position, axis = Vector(light.position), Vector(light.axis)
    narrowest = _around([position - point for point in visible])
    if light.kind == "SPOT":
        stretch = 1.0 / max(min(Vector(light.x_axis).length, Vector(light.y_axis).length), 1e-6)
        half = math.tan(math.acos(max(1e-6, min(light.edge, 1.0)))) * stretch
        if half < (narrowest.half if narrowest else math.tan(WIDEST)):
            narrowest = Frustum(axis, half)
    if narrowest:
        yield narrowest
        return
    to_world = axis.to_track_quat("Z", "Y")
    for side in CUBE[:-1] if light.kind == "AREA" else CUBE:
        towards = to_world @ Vector(side)
        rotation = _axes(towards)
        points = [rotation @ (point - position) for point in visible]
        beyond = (
            [x > -z for x, _, z in points],
            [-x > -z for x, _, z in points],
            [y > -z for _, y, z in points],
            [-y > -z for _, y, z in points],
        )
        if not any(map(all, beyond)):  # nothing is seen there where all points are on the other side of one of its planes
            yield Frustum(towards, 1.0)


def _around(away: Sequence[Vector]) -> Frustum | None:
    """Return the frustum around points, given by the vectors from them to the light; None where it would be wider than WIDEST."""
    directions = [vector.normalized() for vector in away]
    axis = sum(directions, Vector()).normalized()
    if min(axis.dot(direction) for direction in directions) < math.cos(WIDEST):
        return None
    rotation = _axes(axis)
    tangents = [(rotation @ -vector) for vector in away]
    ranges = []
    for k in range(2):
        slopes = [point[k] / -point.z for point in tangents]
        ranges.append((min(slopes), max(slopes)))
    half = max((high - low) / 2.0 for low, high in ranges)
    (left, right), (bottom, top) = ranges
    return Frustum(axis, half, ((left + right) / 2.0, (bottom + top) / 2.0))


def _axes(axis: Vector) -> Matrix:
    """Return the rotation that turns `axis` to +Z."""
    return axis.to_track_quat("Z", "Y").to_matrix().inverted()


def _sun(light: Light, casters: Sequence[Vector], visible: Sequence[Vector], size: int) -> tuple[Matrix, float]:
    """Return a sun's projection and the width of a texel [m]: it holds `visible` and all `casters` that may stand before it."""
    rotation = _axes(Vector(light.axis))
    points = [rotation @ point for point in visible]
    low = Vector(min(point[axis] for point in points) for axis in range(2))
    high = Vector(max(point[axis] for point in points) for axis in range(2))
    width = max(*(high - low), 1e-6) * (1.0 + MARGIN / size)
    width = STEP ** math.ceil(math.log(width, STEP))
    texel = width / size
    center = [round((low[axis] + high[axis]) / (2.0 * texel)) * texel for axis in range(2)]
    depths = [(rotation @ point).z for point in (*casters, *visible)]
    near, far = max(depths), min(depths)
    depth = max(near - far, 1e-6) * 1.001
    middle = (near + far) / 2.0
    scale = Matrix.Diagonal((2.0 / width, 2.0 / width, -2.0 / depth, 1.0))
    return scale @ Matrix.Translation((-center[0], -center[1], -middle)) @ rotation.to_4x4(), texel


def _from_point(light: Light, frustum: Frustum, visible: Sequence[Vector], size: int) -> tuple[Matrix, float]:
    """Return the projection of a `frustum` from a light, and the width of a texel at a distance of 1 m [m]."""
    position, (x, y) = Vector(light.position), frustum.center
    far = max(1e-6, max((point - position).length for point in visible)) * 1.001
    near = far * NEAREST
    half = max(frustum.half, 1e-6) * (1.0 + MARGIN / size)
    slope, shift = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    rows = ((1.0 / half, 0.0, x / half, 0.0), (0.0, 1.0 / half, y / half, 0.0), (0.0, 0.0, slope, shift), (0.0, 0.0, -1.0, 0.0))
    return Matrix(rows) @ _axes(frustum.axis).to_4x4() @ Matrix.Translation(-position), 2.0 * half / size
