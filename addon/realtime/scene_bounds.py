# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounds of a scene's meshes: triangles that enclose all of them, few enough to be clipped to the picture for each view."""

from collections.abc import Iterable, Iterator, Sequence

from mathutils import Vector

from .meshes import box
from .scene_cache import DrawItem
from .view import View

MAX_TRIANGLES = 384  # objects with more than that in all share boxes with their neighbors
BOX_TRIANGLES = 12

type Triangle = tuple[Vector, Vector, Vector]


class SceneBounds:
    """The bounds of `items` in the world [m]. `casters` are the corners of triangles that enclose all shadow casters."""

    def __init__(self, items: Sequence[DrawItem]) -> None:
        objects = list({(item.mesh, item.number): item for item in items}.values())  # once for all of an object's materials
        casting, visible = [item for item in objects if item.casts_shadow], [item for item in objects if item.is_visible]
        self._visible = _enclosing(visible)
        triangles = self._visible if casting == visible else _enclosing(casting)
        self.casters = [corner for triangle in triangles for corner in triangle]

    def visible(self, view: View) -> list[Vector]:
        """Return the corners of the polygons that enclose what is in the picture [m]: the bounds, clipped to `view`."""
        corners: list[Vector] = []
        for triangle in self._visible:
            polygon = [(view.projection @ Vector((*corner, 1.0)), corner) for corner in triangle]
            corners += (world for _, world in _clipped(polygon))
        return corners


def _enclosing(items: Sequence[DrawItem]) -> list[Triangle]:
    """Return triangles that enclose `items`: those of the meshes' hulls or, where they are too many, of boxes around groups."""
    if sum(len(item.mesh.hull) for item in items) <= 3 * MAX_TRIANGLES:
        corners = [item.matrix @ Vector(point) for item in items for point in item.mesh.hull]
    else:
        hulls = {item.mesh: [Vector(point) for point in set(item.mesh.hull)] for item in items}
        ranges = [_range([item.matrix @ corner for corner in hulls[item.mesh]]) for item in items if item.mesh.hull]
        corners = [Vector(corner) for low, high in _grouped(ranges, MAX_TRIANGLES // BOX_TRIANGLES) for corner in box(low, high)]
    return list(zip(corners[::3], corners[1::3], corners[2::3], strict=True))


def _range(points: Iterable[Vector]) -> tuple[Vector, Vector]:
    """Return the lowest and the highest coordinates of `points`."""
    axes = list(zip(*points, strict=True))
    return Vector(map(min, axes)), Vector(map(max, axes))


def _grouped(ranges: list[tuple[Vector, Vector]], count: int) -> Iterator[tuple[Vector, Vector]]:
    """Yield the ranges of at most `count` groups of neighboring `ranges`, which are halved along their longest axis."""
    low, high = _range(corner for ends in ranges for corner in ends)
    if count == 1 or len(ranges) == 1:
        yield low, high
        return
    size = high - low
    axis = max(range(3), key=lambda axis: size[axis])
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
