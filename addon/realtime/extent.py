# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a scene's meshes are: triangles that hold all of them, few enough to be cut off at a picture's edges for each view."""

from collections.abc import Iterable, Iterator, Sequence

from mathutils import Vector

from .contents import Part
from .meshes import box
from .view import View

MOST = 384  # triangles; of more parts than that near ones share a box
BOX = 12  # triangles

type Triangle = tuple[Vector, Vector, Vector]


class Extent:
    """Of `parts` in the world: `casters` are corners of what holds all that casts shadows."""

    def __init__(self, parts: Sequence[Part]) -> None:
        whole = list({(part.mesh, part.number): part for part in parts}.values())  # objects, of any number of materials
        casting, shown = [part for part in whole if part.casts], [part for part in whole if part.is_seen]
        self._receivers = _around(shown)
        self.casters = [corner for triangle in (self._receivers if casting == shown else _around(casting)) for corner in triangle]

    def seen(self, view: View) -> list[Vector]:
        """Return corners of what of the scene is in the picture: triangles that hold it, cut off at the picture's edges."""
        cut: list[Vector] = []
        for triangle in self._receivers:
            polygon = [(view.projection @ Vector((*corner, 1.0)), corner) for corner in triangle]
            cut += (world for _, world in _clipped(polygon))
        return cut


def _around(parts: Sequence[Part]) -> list[Triangle]:
    """Return triangles that hold `parts`: their meshes' own, or where those are too many the boxes of groups of them."""
    if sum(len(part.mesh.hull) for part in parts) <= 3 * MOST:
        corners = [part.matrix @ Vector(point) for part in parts for point in part.mesh.hull]
    else:
        hulls = {part.mesh: [Vector(point) for point in set(part.mesh.hull)] for part in parts}
        ranges = [_range([part.matrix @ corner for corner in hulls[part.mesh]]) for part in parts if part.mesh.hull]
        corners = [Vector(corner) for low, high in _grouped(ranges, MOST // BOX) for corner in box(low, high)]
    return list(zip(corners[::3], corners[1::3], corners[2::3], strict=True))


def _range(points: Iterable[Vector]) -> tuple[Vector, Vector]:
    """Return the lowest and the highest coordinates of `points`."""
    axes = list(zip(*points, strict=True))
    return Vector(map(min, axes)), Vector(map(max, axes))


def _grouped(ranges: list[tuple[Vector, Vector]], count: int) -> Iterator[tuple[Vector, Vector]]:
    """Yield the ranges of at most `count` groups of near `ranges`, halved along the axis in which they are longest."""
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
    """Return a polygon cut at the six planes of the clip space, its corners there and in the world."""
    if all(abs(place) <= clip.w for clip, _ in polygon for place in clip[:3]):
        return polygon
    for axis in range(3):
        for sign in (1.0, -1.0):
            cut = []
            for k, (clip, world) in enumerate(polygon):
                next_clip, next_world = polygon[(k + 1) % len(polygon)]
                here, there = clip.w + sign * clip[axis], next_clip.w + sign * next_clip[axis]
                if here >= 0.0:
                    cut.append((clip, world))
                if (here >= 0.0) != (there >= 0.0):
                    t = here / (here - there)
                    cut.append((clip.lerp(next_clip, t), world.lerp(next_world, t)))
            polygon = cut
            if not polygon:
                return []
    return polygon
