# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds of a scene's meshes: triangles that enclose all of them, few enough to be clipped to the picture for each view."""

from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import batched

from mathutils import Vector

from .meshes import Geometry, Point, box
from .objects import MATRIX_BYTES, Part, matrix
from .view import View

MAX_TRIANGLES = 384  # objects with more than that in all share boxes with their neighbors
BOX_TRIANGLES = 12
WIDE = 0.5  # of the scene's size: an object of that size, as a floor, shares no box, which would have no end

type Triangle = tuple[Vector, Vector, Vector]
type Range = tuple[Point, Point]
"""The lowest and the highest coordinates [m]."""
type Placed = tuple[Geometry, bytes]
"""A mesh and the matrix of an object that shows it."""


class SceneBounds:
    """The bounds of all objects in the world [m].

    `casters` are the corners of triangles that enclose all shadow casters, `everything` of those that enclose all objects.
    """

    def __init__(self, groups: Mapping[Part, Sequence[int]], matrices: array[float], before: "SceneBounds | None" = None) -> None:
        """Find the bounds of the objects in `groups`, and look at no mesh again that is where `before` has it."""
        self._before: Mapping[Placed, Range] = before.ranges if before else {}
        self.ranges: dict[Placed, Range] = {}
        places = matrices.tobytes()
        self.casting: dict[Placed, None] = {}  # all that casts shadows
        visible: dict[Placed, None] = {}
        everything: dict[Placed, None] = {}
        for part, group in groups.items():
            placed = [(part.mesh, places[MATRIX_BYTES * index : MATRIX_BYTES * (index + 1)]) for index in group]
            self.casting |= dict.fromkeys(placed if part.casts_shadow else ())
            visible |= dict.fromkeys(placed if part.is_visible else ())
            everything |= dict.fromkeys(placed)
        self._shown = visible
        self._visible = self._enclosing(visible)
        triangles = self._visible if self.casting == visible else self._enclosing(self.casting)
        self._before = {}
        self.casters = [corner for triangle in triangles for corner in triangle]
        enclosing = triangles if self.casting == everything else self._enclosing(everything)
        self.everything = [corner for triangle in enclosing for corner in triangle]

    def visible(self, view: View) -> list[list[Vector]]:
        """Return the polygons that enclose what is in the picture [m]: the bounds, clipped to `view`."""
        return list(_in_picture(self._visible, view))

    def visible_detail(self, view: View) -> list[list[Vector]]:
        """Return the polygons that enclose what is in the picture of the objects that are not WIDE [m]."""
        return list(_in_picture(self._detail, view))

    @cached_property
    def _detail(self) -> list[Triangle]:
        """The triangles that enclose visible objects that are not WIDE."""
        shown = [placed for placed in self._shown if placed[0].hull]
        self.ranges |= {placed: _range(*placed) for placed in shown if placed not in self.ranges}
        if not shown:
            return []
        least = WIDE * _longest(_union([self.ranges[placed] for placed in shown]))
        return self._enclosing([placed for placed in shown if _longest(self.ranges[placed]) < least])

    def _enclosing(self, all_placed: Collection[Placed]) -> list[Triangle]:
        """Return triangles that enclose them: those of the meshes' hulls or, where they are too many, of boxes around groups."""
        if sum(len(mesh.hull) for mesh, _ in all_placed) <= 3 * MAX_TRIANGLES:
            points = [(matrix(place), mesh.hull) for mesh, place in all_placed]
            corners = [to_world @ Vector(point) for to_world, hull in points for point in hull]
        else:
            for placed in all_placed:
                if placed not in self.ranges and placed[0].hull:
                    self.ranges[placed] = self._before.get(placed) or _range(*placed)
            ranges = {placed: self.ranges[placed] for placed in all_placed if placed[0].hull}
            wide = _wide(ranges)
            corners = [matrix(place) @ Vector(point) for mesh, place in wide for point in mesh.hull]
            shared = [ends for placed, ends in ranges.items() if placed not in wide]
            boxes = _grouped(shared, (MAX_TRIANGLES - len(corners) // 3) // BOX_TRIANGLES) if shared else ()
            corners += [Vector(corner) for low, high in boxes for corner in box(low, high)]
        return list(batched(corners, 3, strict=True))


def _in_picture(triangles: Sequence[Triangle], view: View) -> Iterator[list[Vector]]:
    """Yield `triangles` clipped to `view` [m]."""
    for projection in (part.projection for part in view.holding()):
        for triangle in triangles:
            polygon = [(projection @ Vector((*corner, 1.0)), corner) for corner in triangle]
            if clipped := [world for _, world in _clipped(polygon)]:
                yield clipped


def _range(mesh: Geometry, place: bytes) -> Range:
    """Return the range of a mesh's box in the world."""
    m = memoryview(place).cast("f")
    low, high = mesh.bounds
    x, y, z = ((a + b) / 2.0 for a, b in zip(low, high, strict=True))
    dx, dy, dz = ((b - a) / 2.0 for a, b in zip(low, high, strict=True))
    middle = [m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row] for row in range(3)]
    half = [abs(m[row]) * dx + abs(m[4 + row]) * dy + abs(m[8 + row]) * dz for row in range(3)]
    (x, y, z), (dx, dy, dz) = middle, half
    return (x - dx, y - dy, z - dz), (x + dx, y + dy, z + dz)


def _wide(ranges: Mapping[Placed, Range]) -> set[Placed]:
    """Return the widest of the objects that have `ranges`, with at most half of MAX_TRIANGLES."""
    sizes = {placed: _longest(ends) for placed, ends in ranges.items()}
    least, left, wide = WIDE * _longest(_union(ranges.values())), MAX_TRIANGLES // 2, set()
    for placed, size in sorted(sizes.items(), key=lambda item: -item[1]):
        left -= len(placed[0].hull) // 3
        if size < least or left < 0:
            break
        wide.add(placed)
    return wide


def _longest(ends: Range) -> float:
    """Return the longest side of a range."""
    return max(high - low for low, high in zip(*ends, strict=True))


def _union(ranges: Collection[Range]) -> Range:
    """Return the range around all `ranges`."""
    lows, highs = zip(*ranges, strict=True)
    (x0, y0, z0), (x1, y1, z1) = map(min, zip(*lows, strict=True)), map(max, zip(*highs, strict=True))
    return (x0, y0, z0), (x1, y1, z1)


def _grouped(ranges: Sequence[Range], count: int) -> Iterator[Range]:
    """Yield the ranges of at most `count` groups of neighboring `ranges`, which are halved along their longest axis."""
    union = _union(ranges)
    if count == 1 or len(ranges) == 1:
        yield union
        return
    size = [high - low for low, high in zip(*union, strict=True)]
    axis = size.index(max(size))
    ranges = sorted(ranges, key=lambda ends: ends[0][axis] + ends[1][axis])
    for half in (ranges[: len(ranges) // 2], ranges[len(ranges) // 2 :]):
        yield from _grouped(half, count // 2)


def _clipped(polygon: list[tuple[Vector, Vector]]) -> list[tuple[Vector, Vector]]:
    """Return a polygon clipped at the six planes of clip space; each corner is given in clip space and in the world."""
    if all(abs(coordinate) <= clip.w for clip, _ in polygon for coordinate in clip[:3]):
        return polygon
    for axis in range(3):
        for sign in (1.0, -1.0):
            clipped = []
            for k, (clip, world) in enumerate(polygon):
                next_clip, next_world = polygon[(k + 1) % len(polygon)]
                here, there = clip.w + sign * clip[axis], next_clip.w + sign * next_clip[axis]
                if here >= 0.0:
                    clipped.append((clip, world))
                if (here >= 0.0) != (there >= 0.0):
                    t = here / (here - there)
                    clipped.append((clip.lerp(next_clip, t), world.lerp(next_world, t)))
            polygon = clipped
            if not polygon:
                return []
    return polygon
