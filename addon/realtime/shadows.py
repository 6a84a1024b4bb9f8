# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadow maps: each light's projections, fitted to what it shades of what the camera sees, and their tiles of one texture.

A light in front of which all of that lies has one projection, which holds it. Another has those sides of a cube that do.
"""

import math
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from mathutils import Matrix, Vector

from .lights import Light
from .shadow_bounds import Face, Shade, ShadowBounds
from .view import matrix_to_bytes

MAP_SIZE = 4096  # the square of it is how many texels there are
MOST_IN_A_ROW = 3  # tiles of which a row wastes nothing; more are in a square
WIDEST = math.radians(60.0)  # half the angle of the widest cone that has one projection; wider, a cube has finer texels
NEAREST = 1e-3  # the near plane of a projection from a point, as a fraction of its far plane
STEP = 2.0**0.25  # a sun's map grows in such steps, so that its texels stay where they are while the view turns
MARGIN = 4.0  # texels around what a map has to hold, for the filter
NOISE = 5e-7  # of coordinates and depths in 32 bits
CUBE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""The unit vectors against which the sides of a cube look, in a light's axes; the last one looks to the back of an area light."""


@dataclass(frozen=True)
class Tile:
    """A part of the shadow map.

    `light` is the light's index; `matrix` takes a point of the world to the tile's clip space; `x`, `y`, `size` are in texels;
    `texel` is the width that a texel covers [m], for other lights than suns at a distance of 1 m. `noise`: how far depths are off
    for 32 bits [m]. `is_filtered`: whether a sample is to smooth the shadows, as the map is not another one for each.
    """

    light: int
    matrix: Matrix
    x: int
    y: int
    size: int
    texel: float
    noise: float
    is_filtered: bool

    TEXELS = 6  # of the texture `shadow_tiles`

    def to_bytes(self) -> bytes:
        """Return the tile's row of `shadow_tiles`: the columns of its matrix; x, y, size, texel; whether it is filtered, noise."""
        place = struct.pack("8f", self.x, self.y, self.size, self.texel, self.is_filtered, self.noise, 0.0, 0.0)
        return matrix_to_bytes(self.matrix) + place


@dataclass(frozen=True)
class Frustum:
    """What a projection from a point holds: `rotation` turns the unit vector against which it looks to +Z, `center` and `half` are
    tangents."""

    rotation: Matrix
    half: float
    center: tuple[float, float] = (0.0, 0.0)


def shadow_tiles(lights: Sequence[Light], regions: Sequence[ShadowBounds], map_size: int, of_all: bool = False) -> list[Tile]:
    """Return the tiles of the lights that cast shadows, in their order, of one size, the largest at which all have room.

    With `of_all` there are those of the others, too, for what their light comes through. They hold what is within `regions`, the
    first of them in a light's first tiles, in as many texels as a square of `map_size` has.
    """
    frusta = []
    for index, light in enumerate(lights):
        for bounds in regions if light.casts_shadow or of_all else ():
            if (shade := bounds.shade(light)).points:
                frusta += [(index, bounds, shade, frustum) for frustum in _frusta(light, shade.points)]
    count = max(1, len(frusta))
    columns = count if count <= MOST_IN_A_ROW else math.ceil(math.sqrt(count))
    size = int(map_size / math.sqrt(columns * math.ceil(count / columns)))
    tiles = []
    for slot, (index, bounds, shade, frustum) in enumerate(frusta):
        light = lights[index]
        matrix, texel, reach = _from_point(light, frustum, bounds, size) if frustum else _sun(light, shade, bounds, size)
        if light.shift is not None:
            matrix = Matrix.Translation([2.0 * part / size for part in (*light.shift, 0.0)]) @ matrix
        noise = NOISE * max(reach, bounds.largest)
        place = size * (slot % columns), size * (slot // columns), size
        tiles.append(Tile(index, matrix, *place, texel, noise, is_filtered=light.shift is None))
    return tiles


def _frusta(light: Light, shaded: Sequence[Vector]) -> Iterator[Frustum | None]:
    """Yield what the projections of a light hold: together all that is `shaded`. None for a sun, whose rays are parallel."""
    if light.kind == "SUN":
        yield None
        return
    position, axis = Vector(light.position), Vector(light.axis)
    narrowest = _around([position - point for point in shaded])
    if light.kind == "SPOT":
        stretch = 1.0 / max(min(Vector(light.x_axis).length, Vector(light.y_axis).length), 1e-6)
        half = math.tan(math.acos(max(1e-6, min(light.edge, 1.0)))) * stretch
        if half < (narrowest.half if narrowest else math.tan(WIDEST)):
            narrowest = Frustum(_axes(axis), half)
    if narrowest:
        yield narrowest
        return
    to_axes = _axes(axis)
    for side in CUBE[:-1] if light.kind == "AREA" else CUBE:
        rotation = _axes(Vector(side)) @ to_axes  # so that the sides meet
        points = [rotation @ (point - position) for point in shaded]
        beyond = (
            [x > -z for x, _, z in points],
            [-x > -z for x, _, z in points],
            [y > -z for _, y, z in points],
            [-y > -z for _, y, z in points],
        )
        if not any(map(all, beyond)):  # nothing is there where all points are on the other side of one of its planes
            yield Frustum(rotation, 1.0)


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
    return Frustum(rotation, half, ((left + right) / 2.0, (bottom + top) / 2.0))


def _axes(axis: Vector) -> Matrix:
    """Return the rotation that turns `axis` to +Z."""
    return axis.to_track_quat("Z", "Y").to_matrix().inverted()


def _sun(light: Light, shade: Shade, bounds: ShadowBounds, size: int) -> tuple[Matrix, float, float]:
    """Return a sun's projection, the width of a texel and how deep it is [m]: it holds what is seen of `shade`, and what may stand
    before it."""
    rotation = _axes(Vector(light.axis))
    points, seen = ([rotation @ point for point in some] for some in (shade.points, bounds.points))
    low, high = (
        Vector(inner(outer(point[axis] for point in some) for some in (points, seen)) for axis in range(2))
        for inner, outer in ((max, min), (min, max))
    )
    width = max(*(high - low), 1e-6) * (1.0 + MARGIN / size)
    if light.shift is None:
        width = STEP ** math.ceil(math.log(width, STEP))
    texel = width / size
    center = [round((low[axis] + high[axis]) / (2.0 * texel)) * texel for axis in range(2)]
    depths = [point.z for point in (*points, *seen)]
    far, near = (
        min(depths),
        max(*depths, *(_nearest(face, rotation, (low + high) / 2.0, (high - low) / 2.0) for face in shade.faces)),
    )
    depth = max(near - far, 1e-6) * 1.001
    middle = (near + far) / 2.0
    scale = Matrix.Diagonal((2.0 / width, 2.0 / width, -2.0 / depth, 1.0))
    return scale @ Matrix.Translation((-center[0], -center[1], -middle)) @ rotation.to_4x4(), texel, depth


def _nearest(face: Face, rotation: Matrix, middle: Vector, half: Vector) -> float:
    """Return the largest z of a face turned by `rotation` within a rectangle around `middle`, or a little more [m]."""
    normal = rotation @ face.normal
    highest = max((rotation @ corner).z for corner in face.corners)
    if normal.z == 0.0:
        return highest
    rise = abs(normal.x * half.x) + abs(normal.y * half.y)
    return min(highest, (face.offset - normal.x * middle.x - normal.y * middle.y) / normal.z + rise / abs(normal.z))


def _from_point(light: Light, frustum: Frustum, bounds: ShadowBounds, size: int) -> tuple[Matrix, float, float]:
    """Return the projection of a `frustum` from a light, the width of a texel at a distance of 1 m, and how far it reaches [m]."""
    position, (x, y) = Vector(light.position), frustum.center
    far = max(1e-6, max((point - position).length for point in bounds.points)) * 1.001
    near = far * NEAREST
    half = max(frustum.half, 1e-6) * (1.0 + MARGIN / size)
    slope, shift = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    rows = ((1.0 / half, 0.0, x / half, 0.0), (0.0, 1.0 / half, y / half, 0.0), (0.0, 0.0, slope, shift), (0.0, 0.0, -1.0, 0.0))
    return Matrix(rows) @ frustum.rotation.to_4x4() @ Matrix.Translation(-position), 2.0 * half / size, far
