# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine's shadow maps hold, against rays towards lights."""

import math
import random
from array import array
from collections.abc import Sequence

import bpy  # noqa: F401 - brings mathutils

import pytest
from mathutils import Matrix, Vector

from true_diffuse.addon.realtime import meshes, objects, scene_bounds
from true_diffuse.addon.realtime.lights import Light
from true_diffuse.addon.realtime.shadow_bounds import ShadowBounds
from true_diffuse.addon.realtime.shadows import MAP_SIZE, Tile, shadow_tiles
from true_diffuse.addon.realtime.view import View, eye_of

ZERO = (0.0, 0.0, 0.0)
FLOOR = [(-1e3, -1e3, 0.0), (1e3, -1e3, 0.0), (1e3, 1e3, 0.0), (-1e3, -1e3, 0.0), (1e3, 1e3, 0.0), (-1e3, 1e3, 0.0)]


class Hull:
    """What of a mesh its extent asks for."""

    def __init__(self, points: list[meshes.Point], is_hull_a_box: bool = False) -> None:
        self.hull, self.is_hull_a_box = points, is_hull_a_box
        self.bounds = tuple(tuple(pick(point[axis] for point in points) for axis in range(3)) for pick in (min, max))


def light(kind: str, place: Vector, angle: float = 1.0) -> Light:
    """Return a light at `place` that shines at the origin; `angle`: of a spot, half its cone."""
    return Light(kind, tuple(place), tuple(place.normalized()), (1.0,) * 3, math.cos(angle), 0.1, *_axes(place), True)


def _axes(place: Vector) -> tuple[tuple[float, ...], tuple[float, ...]]:
    x, y, _ = place.to_track_quat("Z", "Y").to_matrix().col
    return tuple(x), tuple(y)


def bounds(hulls: Sequence[tuple[Hull, Matrix]]) -> scene_bounds.SceneBounds:
    groups: dict[objects.Part, list[int]] = {}
    for index, (hull, _) in enumerate(hulls):
        groups.setdefault(objects.Part(hull, 0, 0, True, True), []).append(index)
    matrices = array("f", (value for _, place in hulls for column in place.col for value in column))
    return scene_bounds.SceneBounds(groups, matrices)


def looking_down(width: float) -> View:
    """Return a view from above of a square so wide around the origin [m]."""
    return View(Matrix.Diagonal((2.0 / width, 2.0 / width, -0.01, 1.0)), Vector((0.0, 0.0, 1.0)), False, 64, 64)


def holds(tile: Tile, point: Vector) -> bool:
    clip = tile.matrix @ point.to_4d()
    return clip.w > 0.0 and all(abs(x) <= clip.w * (1.0 + 1e-5) for x in clip[:3])


@pytest.mark.parametrize("kind", ("SUN", "POINT", "SPOT", "AREA"))
@pytest.mark.parametrize("below", (0.0, 0.01, 0.4))
def test_tiles_hold_every_shaded_point_that_is_seen_and_what_shades_it(kind: str, below: float) -> None:
    """Boxes that stand on a wide floor or reach `below` it, and a view that cuts some: a point of a box or of the floor in the
    picture from which the ray to the light goes through a point of a box or of the floor has to be in a tile, with that point."""
    numbers = random.Random(7)
    box = Hull(meshes.box((-0.5, -0.5, -below), (0.5, 0.5, 2.0)))
    places = [
        Matrix.Translation((3.0 * x + numbers.random(), 3.0 * y, 0.0)) @ Matrix.Rotation(numbers.random(), 4, "Z")
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
    ]
    made = bounds([(Hull(FLOOR), Matrix()), *((box, place) for place in places)])
    view, shaded = looking_down(6.5), 0
    for _ in range(12):
        here = Vector((numbers.uniform(-4, 4), numbers.uniform(-4, 4), numbers.uniform(0.5, 5.0)))
        lamp = light(kind, here * (1.0 if kind != "SUN" else 1.0 / here.length))
        tiles = shadow_tiles([lamp], [ShadowBounds(made.casters, made.visible(view))], MAP_SIZE)
        for _ in range(300):
            # two points on one ray to the light, each in a box or on the floor
            x, y, z = numbers.uniform(-0.5, 0.5), numbers.uniform(-0.5, 0.5), numbers.uniform(-below, 2.0)
            start = numbers.choice(places) @ Vector((x, y, z))
            towards = Vector(lamp.axis) if kind == "SUN" else Vector(lamp.position) - start
            if start.z < -0.01:  # below the floor, which shades it
                caster = start - towards * (start.z / towards.z)
            elif numbers.random() < 0.5:
                start, caster = start - towards * (start.z / towards.z), start
                if towards.z * (caster.z - start.z) < 0.0:
                    continue  # the floor is between the caster and the light
            else:
                caster = start + towards * numbers.uniform(0.0, 0.6)
                if not any(
                    abs(local.x) <= 0.5 and abs(local.y) <= 0.5 and -below <= local.z <= 2.0
                    for local in (place.inverted() @ caster for place in places)
                ):
                    continue
            if max(abs(start.x), abs(start.y)) > 3.25 or (caster - start).length < 1e-3:
                continue
            is_in_cone = kind != "SPOT" or towards.normalized().dot(Vector(lamp.axis)) > math.cos(0.99)
            if not is_in_cone or (kind == "AREA" and towards.normalized().dot(Vector(lamp.axis)) <= 0.01):
                continue
            shaded += 1
            assert any(holds(tile, start) and holds(tile, caster) for tile in tiles), (here, start, caster)
    assert shaded > 500


def test_floor_takes_no_texels_from_what_stands_on_it() -> None:
    """A map grows by 19 % at most: shadows.STEP."""
    box = Hull(meshes.box((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)))
    made = bounds([(Hull(FLOOR), Matrix()), (box, Matrix())])
    sun = light("SUN", Vector((0.0, -1.0, 1.0)).normalized())
    (tile,) = shadow_tiles([sun], [ShadowBounds(made.casters, made.visible(looking_down(100.0)))], MAP_SIZE)
    across = math.sqrt(2.0)  # of the box, seen along the sun's rays: 1 m wide, and (1 + 1) / sqrt(2) m high
    assert across <= tile.texel * MAP_SIZE <= across * 1.2
    alone = bounds([(Hull(FLOOR), Matrix())])
    assert not shadow_tiles([sun], [ShadowBounds(alone.casters, alone.visible(looking_down(100.0)))], MAP_SIZE)


def test_wall_before_the_sun_shades_what_is_near_it() -> None:
    """A wall of 2 km, the sun behind it: its shadow is where something is seen, and that it shades all."""
    turn = Matrix.Rotation(math.pi / 2.0, 4, "X")
    box = Hull(meshes.box((-0.5, -1.5, 0.0), (0.5, -0.5, 1.0)))
    made = bounds([(Hull(FLOOR), turn), (box, Matrix())])
    sun = light("SUN", Vector((0.0, 1.0, 1.0)).normalized())
    (tile,) = shadow_tiles([sun], [ShadowBounds(made.casters, made.visible(looking_down(100.0)))], MAP_SIZE)
    for x, y, z in ((0.5, -0.5, 0.0), (-0.5, -1.5, 1.0)):
        point = Vector((x, y, z))
        on_wall = point + Vector(sun.axis) * (-point.y / sun.axis[1])
        assert holds(tile, point) and holds(tile, on_wall)
    assert tile.texel * MAP_SIZE < 3.0


# ---- a camera within what is bounded

ROOM = meshes.box((-3.0, -3.0, 0.0), (3.0, 3.0, 3.0))


def at(place: tuple[float, float, float], turn: float, projection: Matrix, is_perspective: bool) -> View:
    """Return the view of a camera at `place` that looks along +Y, turned by `turn` around Z."""
    camera = Matrix.Translation(place) @ Matrix.Rotation(turn, 4, "Z") @ Matrix.Rotation(math.pi / 2.0, 4, "X")
    return View(projection @ camera.inverted(), eye_of(camera, is_perspective), is_perspective, 64, 64)


def perspective(near: float, far: float, slope: float = 1.8, shift: float = 0.0) -> Matrix:
    rows = (-(far + near) / (far - near), -2.0 * far * near / (far - near))
    return Matrix(((slope, 0.0, shift, 0.0), (0.0, slope, 0.0, 0.0), (0.0, 0.0, *rows), (0.0, 0.0, -1.0, 0.0)))


def parallel(near: float, far: float, width: float) -> Matrix:
    depth = Matrix.Translation((0.0, 0.0, -(far + near) / (far - near))) @ Matrix.Diagonal((1.0, 1.0, -2.0 / (far - near), 1.0))
    return depth @ Matrix.Diagonal((2.0 / width, 2.0 / width, 1.0, 1.0))


CAMERAS = {
    "within": at((0.5, -2.0, 1.5), 0.3, perspective(0.1, 100.0), True),
    "within, ends within": at((0.5, -2.0, 1.5), 0.3, perspective(0.1, 2.0), True),
    "shifted": at((0.5, -2.0, 1.5), 0.3, perspective(0.1, 100.0, shift=0.9), True),
    "straddling a wall": at((0.0, -3.05, 0.1), 0.8, perspective(0.2, 100.0, slope=0.4), True),
    "at an edge": at((-2.9, -2.9, 2.9), -0.8, perspective(0.3, 100.0, slope=0.5), True),
    "parallel, within": at((0.5, -2.0, 1.5), 0.3, parallel(0.1, 100.0, 2.0), False),
    "parallel, before and behind": at((0.5, -2.0, 1.5), 0.3, parallel(-4.0, 1.0, 2.0), False),
    "without": at((0.5, -9.0, 1.5), 0.1, perspective(0.1, 100.0), True),
}


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("neighbors", (0, 60))
def test_what_is_seen_of_a_box_is_within_the_polygons_around_it(name: str, neighbors: int) -> None:
    """A room of one mesh may have things anywhere: each point of it in the picture is between the polygons along any direction.

    With `neighbors`, which are far away, boxes are shared.
    """
    numbers, view = random.Random(3), CAMERAS[name]
    turn = Matrix.Rotation(0.4 if neighbors == 0 else 0.0, 4, "Z")  # a box around several has the axes of the world
    others = [(Hull(meshes.box((90.0, k, 0.0), (91.0, k + 0.5, 1.0)), True), Matrix()) for k in range(neighbors)]
    polygons = bounds([(Hull(ROOM, True), turn), *others]).visible(view)
    corners = [corner for polygon in polygons for corner in polygon]
    directions = [Vector([numbers.gauss(0.0, 1.0) for _ in range(3)]).normalized() for _ in range(50)]
    reaches = [max(direction.dot(corner) for corner in corners) for direction in directions]
    seen = 0
    for _ in range(20_000):
        point = turn @ Vector((numbers.uniform(-3, 3), numbers.uniform(-3, 3), numbers.uniform(0, 3)))
        clip = view.projection @ point.to_4d()
        if max(map(abs, clip[:3])) > clip.w:
            continue
        seen += 1
        assert all(direction.dot(point) <= reach + 1e-5 for direction, reach in zip(directions, reaches, strict=True)), point
    assert seen > 100
    assert all(max(map(abs, clip[:3])) <= clip.w + 1e-4 for clip in (view.projection @ corner.to_4d() for corner in corners))


@pytest.mark.parametrize("kind", ("SUN", "POINT", "AREA"))
def test_things_within_one_mesh_shade_each_other_before_the_camera(kind: str) -> None:
    """A light in the room, or a sun outside: a point that is seen is in a tile, with what is a little towards the light of it."""
    numbers, view = random.Random(5), CAMERAS["within"]
    lamp = light(kind, Vector((0.3, -1.0, 2.9)) if kind != "SUN" else Vector((0.3, -0.4, 0.9)).normalized())
    made = bounds([(Hull(ROOM, True), Matrix())])
    tiles = shadow_tiles([lamp], [ShadowBounds(made.casters, made.visible(view), made.caster_boxes)], MAP_SIZE)
    seen = 0
    while seen < 300:
        point = Vector((numbers.uniform(-3, 3), numbers.uniform(-3, 3), numbers.uniform(0, 2.8)))
        clip = view.projection @ point.to_4d()
        if max(map(abs, clip[:3])) > clip.w:
            continue
        towards = Vector(lamp.axis) if kind == "SUN" else Vector(lamp.position) - point
        if kind == "AREA" and towards.normalized().dot(Vector(lamp.axis)) <= 0.01:
            continue
        seen += 1
        caster = point + towards * 0.1
        assert any(holds(tile, point) and holds(tile, caster) for tile in tiles), (point, caster)


def test_floor_shares_no_box_with_a_crowd_that_stands_on_it() -> None:
    """Else its box is as high as they are, and all of the floor may shade what is seen."""
    crowd = [(Hull(meshes.box((-0.3, -0.3, 0.0), (0.3, 0.3, 1.8))), Matrix.Translation((k % 10, k // 10, 0.0))) for k in range(100)]
    found = bounds([(Hull(FLOOR), Matrix()), *crowd])
    standing = [corner for corner in found.casters if corner.z > 0.0]
    assert all(-0.301 < corner.x < 9.301 and -0.301 < corner.y < 9.301 for corner in standing)  # 32 bits
    assert {tuple(corner) for corner in found.casters} >= set(FLOOR)
    assert len(found.casters) <= 3 * scene_bounds.MAX_TRIANGLES
