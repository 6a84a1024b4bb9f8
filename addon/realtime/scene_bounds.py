# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds of a scene's meshes: triangles and boxes that enclose all of them, few enough to be clipped for each view."""

import math
from array import array
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import batched

from mathutils import Vector

from .meshes import Geometry, Point, box
from .objects import MATRIX_BYTES, Part, matrix
from .view import View

MAX_TRIANGLES = 384  # objects with more than that in all share boxes with their neighbors
BOX_TRIANGLES = 12
WIDE = 0.5  # of the scene's size: an object of that size, as a floor, shares no box, which would have no end

type Polygon = list[Vector]
type Clipped = list[tuple[Vector, Vector]]
"""A polygon whose corners are each given in clip space and in the world."""
type Range = tuple[Point, Point]
"""The lowest and the highest coordinates [m]."""
type Placed = tuple[Geometry, bytes]
"""A mesh and the matrix of an object that shows it."""


@dataclass(frozen=True)
class Enclosure:
    """The corners of triangles that enclose objects [m], and whether they are a box, anywhere within which surfaces may be."""

    corners: list[Vector]
    is_box: bool

    def polygons(self) -> list[Polygon]:
        """Return a box's six sides, or the triangles."""
        if not self.is_box:
            return [list(triangle) for triangle in batched(self.corners, 3, strict=True)]
        return [[a, b, c, d] for a, b, c, _, _, d in batched(self.corners, 6, strict=True)]

    def holds(self, point: Vector) -> bool:
        """Return whether a point is within a box. Nothing is within one that is flat."""
        if not self.is_box:
            return False
        middle = sum(self.corners, Vector()) / len(self.corners)
        for a, b, _, d in self.polygons():
            normal = (b - a).cross(d - a)
            if normal.dot(point - a) * normal.dot(middle - a) <= 0.0:
                return False
        return True


class SceneBounds:
    """The bounds of all objects in the world [m].

    `casters` are the corners of triangles that enclose all shadow casters, `everything` of those that enclose all objects;
    `caster_boxes` the boxes among what encloses the casters.
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
        casting = self._visible if self.casting == visible else self._enclosing(self.casting)
        self._before = {}
        self.casters = [corner for enclosure in casting for corner in enclosure.corners]
        self.caster_boxes = [enclosure for enclosure in casting if enclosure.is_box]
        enclosing = casting if self.casting == everything else self._enclosing(everything)
        self.everything = [corner for enclosure in enclosing for corner in enclosure.corners]

    def visible(self, view: View) -> list[Polygon]:
        """Return the polygons that enclose what is in the picture [m]: the bounds, clipped to `view`.

        Of a box that goes on before the picture or beside it they include where it is cut, as something may be right there.
        """
        return list(_in_picture(self._visible, view))

    def visible_detail(self, view: View) -> list[Polygon]:
        """Return the polygons that enclose what is in the picture of the objects that are not WIDE [m], as `visible` does."""
        return list(_in_picture(self._detail, view))

    @cached_property
    def _detail(self) -> list[Enclosure]:
        """What encloses the visible objects that are not WIDE."""
        ranges = self._ranges_of(self._shown)
        least = _least_wide(ranges)
        return self._enclosing([placed for placed, ends in ranges.items() if _longest(ends) < least])

    def _ranges_of(self, all_placed: Collection[Placed]) -> dict[Placed, Range]:
        """Return the ranges of those that have a hull; each is found once."""
        ranges = {}
        for placed in all_placed:
            if placed[0].hull:
                if placed not in self.ranges:
                    self.ranges[placed] = self._before.get(placed) or _range(*placed)
                ranges[placed] = self.ranges[placed]
        return ranges

    def _enclosing(self, all_placed: Collection[Placed]) -> list[Enclosure]:
        """Return what encloses them: the meshes' hulls or, where those have too many triangles, boxes around groups."""
        if sum(len(mesh.hull) for mesh, _ in all_placed) <= 3 * MAX_TRIANGLES:
            return [_hull(*placed) for placed in all_placed]
        ranges = self._ranges_of(all_placed)
        wide = _wide(ranges)
        found = [_hull(*placed) for placed in wide]
        shared = [ends for placed, ends in ranges.items() if placed not in wide]
        left = MAX_TRIANGLES - sum(len(enclosure.corners) // 3 for enclosure in found)
        boxes = _grouped(shared, left // BOX_TRIANGLES) if shared else ()
        return [*found, *(Enclosure([Vector(corner) for corner in box(low, high)], True) for low, high in boxes)]


def _hull(mesh: Geometry, place: bytes) -> Enclosure:
    """Return the hull of a mesh in the world."""
    to_world = matrix(place)
    return Enclosure([to_world @ Vector(point) for point in mesh.hull], mesh.is_hull_a_box)


def _in_picture(enclosures: Sequence[Enclosure], view: View) -> Iterator[Polygon]:
    """Yield the polygons of `enclosures` clipped to `view` [m]."""
    for projection in (part.projection for part in view.holding()):
        for enclosure in enclosures:
            sides = [[(projection @ corner.to_4d(), corner) for corner in side] for side in enclosure.polygons()]
            for part in [sides] if enclosure.is_box else ([side] for side in sides):
                yield from ([world for _, world in polygon] for polygon in _clipped(part, enclosure.is_box))


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
    least, left, wide = _least_wide(ranges), MAX_TRIANGLES // 2, set()
    for placed, size in sorted(sizes.items(), key=lambda item: -item[1]):
        left -= len(placed[0].hull) // 3
        if size < least or left < 0:
            break
        wide.add(placed)
    return wide


def _least_wide(ranges: Mapping[Placed, Range]) -> float:
    """Return the side from which on an object of `ranges` is WIDE [m]; 0 where there is none."""
    return WIDE * _longest(_union(ranges.values())) if ranges else 0.0


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


def _clipped(polygons: list[Clipped], is_solid: bool) -> list[Clipped]:
    """Return polygons clipped at the six planes of clip space; if they are the sides of a convex solid, with those of the cuts."""
    for axis in range(3):
        for sign in (1.0, -1.0):
            if all(clip.w + sign * clip[axis] >= 0.0 for polygon in polygons for clip, _ in polygon):
                continue
            left, rim = [], []
            for polygon in polygons:
                part = []
                for k, (clip, world) in enumerate(polygon):
                    next_clip, next_world = polygon[(k + 1) % len(polygon)]
                    here, there = clip.w + sign * clip[axis], next_clip.w + sign * next_clip[axis]
                    if here >= 0.0:
                        part.append((clip, world))
                    if (here >= 0.0) != (there >= 0.0):
                        t = here / (here - there)
                        rim.append((clip.lerp(next_clip, t), world.lerp(next_world, t)))
                        part.append(rim[-1])
                left += [part] if part else []
            polygons = [*left, _around(rim)] if is_solid and rim else left
    return polygons


def _around(rim: Clipped) -> Clipped:
    """Return the corners of a convex polygon in the order in which they are around it."""
    middle = sum((world for _, world in rim), Vector()) / len(rim)
    right = max((world - middle for _, world in rim), key=lambda away: away.length_squared).normalized()
    aside = [world - middle - right * right.dot(world - middle) for _, world in rim]
    up = max(aside, key=lambda away: away.length_squared).normalized()
    return sorted(rim, key=lambda corner: math.atan2(up.dot(corner[1] - middle), right.dot(corner[1] - middle)))
