# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Voronoi Texture (Cycles' kernel/svm/voronoi.h).

S. Worley, "A cellular texture basis function", SIGGRAPH (1996); I. Quilez, "Voronoi edges" (2012) and "Smooth Voronoi" (2014).
Each cell of a grid has one point.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import product
from typing import NamedTuple

from ...models.vector import Vector
from .float32 import Coordinates, coordinates, f32, scaled
from .hashing import random, random_in_cell

FEATURES = ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS")
METRICS = ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI")


class Voronoi(NamedTuple):
    """The node's menus, coordinates and parameters, in its order."""

    dimensions: int
    feature: str
    metric: str
    normalize: bool
    vector: Vector
    w: float
    scale: float
    detail: float
    roughness: float
    lacunarity: float
    smoothness: float
    exponent: float
    randomness: float

    @property
    def place(self) -> Coordinates:
        """What the texture reads of the coordinates, scaled."""
        return coordinates(self.dimensions, self.vector, self.w, self.scale)


class Found(NamedTuple):
    """What the nearest points give: a distance, a color, and a position of as many coordinates as the texture has dimensions."""

    distance: float
    color: Sequence[float]
    position: Sequence[float]


def voronoi_distance(*given: object) -> float:
    """Return the output Distance; the arguments are those of `Voronoi`."""
    node = _in_range(given)
    return _edge_fractal(node) if node.feature == "DISTANCE_TO_EDGE" else _fractal(node).distance


def voronoi_color(*given: object) -> Vector:
    """Return the output Color: a random color for each point."""
    red, green, blue = _fractal(_in_range(given)).color
    return (red, green, blue)


def voronoi_position(*given: object) -> Vector:
    """Return the output Position of the point, 0 in directions that the texture does not have."""
    node = _in_range(given)
    x, y, z = (*_position(node), 0.0)[:3] if node.dimensions > 1 else (0.0, 0.0, 0.0)
    return (x, y, z)


def voronoi_w(*given: object) -> float:
    """Return the output W: the point's last coordinate in one or four dimensions."""
    node = _in_range(given)
    return _position(node)[-1] if node.dimensions in (1, 4) else 0.0


def voronoi_radius(*given: object) -> float:
    """Return the output Radius: half the distance from the nearest point to the point nearest to that."""
    node = _in_range(given)
    cell, local = _cell(node.place)
    offset, nearest = min(_points(node, cell, 1), key=lambda point: math.dist(point[1], local))
    around = [c + o for c, o in zip(cell, offset, strict=True)]
    origin = [p - o for p, o in zip(nearest, offset, strict=True)]
    return min(math.dist(point, origin) for o, point in _points(node, around, 1) if any(o)) / 2.0


def _in_range(given: Sequence[object]) -> Voronoi:
    node = Voronoi(*given)  # ty: ignore[invalid-argument-type]
    return node._replace(
        detail=min(max(node.detail, 0.0), 15.0),
        roughness=min(max(node.roughness, 0.0), 1.0),
        randomness=min(max(node.randomness, 0.0), 1.0),
        smoothness=min(max(node.smoothness / 2.0, 0.0), 0.5),
    )


def _position(node: Voronoi) -> list[float]:
    return [x / node.scale if node.scale else 0.0 for x in _fractal(node).position]


def _cell(p: Coordinates) -> tuple[list[int], list[float]]:
    """Return the cell and the place in it, 0 to 1."""
    cell = [math.floor(x) for x in p]
    return cell, [x - c for x, c in zip(p, cell, strict=True)]


def _points(node: Voronoi, cell: Sequence[int], reach: int) -> Iterator[tuple[tuple[int, ...], list[float]]]:
    """Yield for each cell up to `reach` from `cell` its offset and its point, seen from the corner of `cell`; x runs first."""
    for backwards in product(range(-reach, reach + 1), repeat=len(cell)):
        offset = backwards[::-1]
        there = tuple(c + o for c, o in zip(cell, offset, strict=True))
        shares = random_in_cell(there) if len(there) > 1 else (random(float(there[0])),)
        yield offset, [o + share * node.randomness for o, share in zip(offset, shares, strict=True)]


def _color(cell: Sequence[int], offset: Sequence[int]) -> Sequence[float]:
    there = tuple(c + o for c, o in zip(cell, offset, strict=True))
    if len(there) == 1:
        return (random(there[0]), random(there[0], 1.0), random(there[0], 2.0))
    return random_in_cell((*there, 0) if len(there) == 2 else there)[:3]


def _length(node: Voronoi, vector: Sequence[float]) -> float:
    sides = [abs(x) for x in vector]
    if node.metric == "EUCLIDEAN" or len(sides) == 1:
        return math.hypot(*sides)
    if node.metric == "MANHATTAN":
        return sum(sides)
    if node.metric == "CHEBYCHEV":
        return max(sides)
    return sum(x**node.exponent for x in sides) ** (1.0 / node.exponent)


def _octave(node: Voronoi, p: Coordinates) -> Found:
    cell, local = _cell(p)
    smooth = node.feature == "SMOOTH_F1" and node.smoothness > 0.0
    points = [
        (_length(node, [a - b for a, b in zip(point, local, strict=True)]), offset, point)
        for offset, point in _points(node, cell, 2 if smooth else 1)
    ]
    if not smooth:
        distance, offset, point = sorted(points, key=lambda found: found[0])[node.feature == "F2"]
        return Found(distance, _color(cell, offset), [c + x for c, x in zip(cell, point, strict=True)])
    distance, color, place = points[0][0], _color(cell, points[0][1]), points[0][2]
    for other, offset, point in points[1:]:
        t = min(max(0.5 + 0.5 * (distance - other) / node.smoothness, 0.0), 1.0)
        h = t * t * (3.0 - 2.0 * t)
        correction = node.smoothness * h * (1.0 - h)
        distance = _mix(distance, other, h) - correction
        correction /= 1.0 + 3.0 * node.smoothness
        color = [_mix(a, b, h) - correction for a, b in zip(color, _color(cell, offset), strict=True)]
        place = [_mix(a, b, h) - correction for a, b in zip(place, point, strict=True)]
    return Found(distance, color, [c + x for c, x in zip(cell, place, strict=True)])


def _edge_distance(node: Voronoi, p: Coordinates) -> float:
    """Return the Euclidean distance to the plane halfway between the nearest point and another, of those around `p`."""
    cell, local = _cell(p)
    points = [[a - b for a, b in zip(point, local, strict=True)] for _, point in _points(node, cell, 1)]
    if len(cell) == 1:  # the planes on both sides of the cell's own point
        return min(abs(points[1][0] + points[side][0]) / 2.0 for side in (0, 2))
    nearest = min(points, key=lambda point: math.hypot(*point))
    distances = []
    for point in points:
        across = [a - b for a, b in zip(point, nearest, strict=True)]
        length = math.hypot(*across)
        if length * length > 0.0001:
            distances.append(sum((a + b) / 2.0 * c for a, b, c in zip(point, nearest, across, strict=True)) / length)
    return min(distances)


def _octaves(node: Voronoi) -> Iterator[tuple[Coordinates, float, float, float]]:
    """Yield the place, scale, height and share of each octave; one alone where further ones would not count."""
    scale, height = 1.0, 1.0
    for octave in range(math.ceil(node.detail) + 1 if node.roughness else 1):
        yield scaled(node.place, scale), scale, height, min(node.detail + 1.0 - octave, 1.0)
        scale, height = f32(scale * node.lacunarity), height * node.roughness


def _fractal(node: Voronoi) -> Found:
    total = 0.0
    distance, color, position = 0.0, [0.0] * 3, [0.0] * node.dimensions
    for p, scale, height, share in _octaves(node):
        octave = _octave(node, p)
        total += height * share
        distance += octave.distance * height * share
        color = [a + b * height * share for a, b in zip(color, octave.color, strict=True)]
        position = [_mix(a, _ratio(b, scale), height * share) for a, b in zip(position, octave.position, strict=True)]
    if node.normalize:
        farthest = _length(node, [0.5 + 0.5 * node.randomness] * node.dimensions) * (2.0 if node.feature == "F2" else 1.0)
        distance, color = _ratio(distance, total * farthest), [x / total for x in color]
    return Found(distance, color, position)


def _edge_fractal(node: Voronoi) -> float:
    farthest = 0.5 + 0.5 * node.randomness
    distance, total = 8.0, farthest
    for p, scale, height, share in _octaves(node):
        nearer = _edge_distance(node, p)
        if node.detail == 0.0 or node.roughness == 0.0:
            distance = nearer
            break
        total = _mix(total, _ratio(farthest, scale), height * share)
        mixed = _mix(distance, min(distance, _ratio(nearer, scale)), height)
        distance = _mix(distance, min(distance, mixed), share)
    return distance / total if node.normalize else distance


def _mix(a: float, b: float, t: float) -> float:
    return a + (b - a) * t


def _ratio(a: float, b: float) -> float:
    """Return a / b as floats of the processor have it: infinite or not a number where b is 0."""
    return a / b if b else a * math.inf
