# SPDX-License-Identifier: GPL-3.0-or-later
"""Which part of the shadow casters' bounds can shade something that is seen: all that a shadow map has to hold."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import batched

from mathutils import Vector

from .lights import Light
from .scene_bounds import Enclosure

NEAR = 2e-6  # of the largest coordinate: so far behind a face is what counts as in its plane, as coordinates have 32 bits
MAX_TESTS = 20_000  # of points against faces, some 5 ms; the faces that are left are the smallest

type Polygon = Sequence[Vector]


class Face:
    """A flat face of the casters' bounds: its plane, and the points around what it can shade on either side of it."""

    def __init__(self, normal: Vector, corners: Sequence[Vector]) -> None:
        self.normal, self.offset = normal, normal.dot(corners[0])
        self.corners = corners
        self.extent = _extent(corners)
        self.in_front: Sequence[Vector] = ()
        self.behind: Sequence[Vector] = ()

    def is_lit_in_front(self, light: Light) -> bool:
        """Return whether a light is on the side to which the normal points."""
        side = self.normal.dot(Vector(light.axis)) if light.kind == "SUN" else self.distance(Vector(light.position))
        return side > 0.0

    def distance(self, point: Vector) -> float:
        """Return how far a point is in front of the plane [m]."""
        return self.normal.dot(point) - self.offset


@dataclass(frozen=True)
class Shade:
    """Points around all that is in some shadow of a light, and the faces that cast it."""

    points: list[Vector]
    faces: list[Face]


class ShadowBounds:
    """What of `casters`, the corners of triangles around all of them, can shade something within `polygons` [m].

    `points` are the polygons' corners, and `largest` the largest of their coordinates. A face shades only what is behind it, seen
    from the light: the floor below all else shades nothing, and a map need not hold it, however large it is. What a face shades is
    both in line with the face and within the polygons behind it, and the smaller of those counts. Where a light is within one of
    `boxes`, those among the casters' bounds, it may shade all.
    """

    def __init__(self, casters: Sequence[Vector], polygons: Sequence[Polygon], boxes: Sequence[Enclosure] = ()) -> None:
        self._boxes = boxes
        polygons = polygons or list(batched(casters, 3, strict=True))
        numbers: dict[tuple[float, ...], int] = {}
        indices = [frozenset(numbers.setdefault(tuple(point), len(numbers)) for point in polygon) for polygon in polygons]
        self.points = [Vector(point) for point in numbers]
        self._faces = sorted(_faces(casters), key=lambda face: face.extent, reverse=True)
        self._found: dict[tuple[bool, ...], Shade] = {}
        tests = 0
        self.largest = max((abs(x) for point in numbers for x in point), default=0.0)
        coordinates, whole = list(numbers), _extent(self.points)

        def smaller(face: Face, side: set[int]) -> Sequence[Vector]:
            """Return the corners of `face`, or the points of polygons on one `side` where those are within less space."""
            around = set().union(*(polygon for polygon in indices if not polygon.isdisjoint(side)))
            if around and face.extent <= (whole if len(around) == len(coordinates) else _extent([coordinates[k] for k in around])):
                return face.corners
            return [self.points[k] for k in around]

        for face in self._faces:
            tests += len(self.points)
            if tests > MAX_TESTS:
                face.in_front = face.behind = face.corners if face.extent < whole else self.points
                continue
            near = NEAR * max(self.largest, *(abs(x) for corner in face.corners for x in corner))
            low, high = face.offset - near, face.offset + near
            heights = list(enumerate(map(face.normal.dot, self.points)))
            face.in_front = smaller(face, {k for k, height in heights if height > high})
            face.behind = smaller(face, {k for k, height in heights if height < low})

    def shade(self, light: Light) -> "Shade":
        """Return what can be in the shadow of `light`."""
        if light.kind != "SUN" and any(box.holds(Vector(light.position)) for box in self._boxes):
            return Shade(self.points, self._faces)
        sides = tuple(face.is_lit_in_front(light) for face in self._faces)
        if sides not in self._found:
            shaded = [face.behind if is_lit else face.in_front for face, is_lit in zip(self._faces, sides, strict=True)]
            points = {tuple(point): point for points in shaded for point in points}
            faces = [face for face, points in zip(self._faces, shaded, strict=True) if points]
            self._found[sides] = Shade(list(points.values()), faces)
        return self._found[sides]


def _faces(corners: Sequence[Vector]) -> Iterator[Face]:
    """Yield the faces that triangles make, of two that follow each other in one plane one. A triangle without area has none."""
    last: Face | None = None
    for triangle in batched(corners, 3, strict=True):
        a, b, c = triangle
        normal = (b - a).cross(c - a)
        if normal.length_squared == 0.0:
            continue
        near = NEAR * max(abs(x) for corner in triangle for x in corner)
        if last and max(abs(last.distance(corner)) for corner in triangle) <= near:
            last = Face(last.normal, [*last.corners, *triangle])
            continue
        if last:
            yield last
        last = Face(normal.normalized(), triangle)
    if last:
        yield last


def _extent(points: Sequence[Sequence[float]]) -> float:
    """Return the diagonal of the box around points [m]."""
    axes = list(zip(*points, strict=True))
    return Vector([max(axis) - min(axis) for axis in axes]).length if axes else 0.0
