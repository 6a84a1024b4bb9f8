# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounced light of the realtime engine against form factors and furnaces.

A picture of 16 samples has 64 directions, which integrate the cosine around a normal with an RMS error of 0.4 %. Surfaces that
hide a part of the sky have an outline, which so many directions resolve to some 1 / 64 ** 0.75 or 4 %.
"""

import math
from array import array
from collections.abc import Iterator, Sequence
from itertools import pairwise

import bpy

import pytest
from mathutils import Matrix, Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.realtime.ray_bundles import MAX_BUNDLES, ORDER, _fibonacci
from true_diffuse.scenes.elements import add, towards, uniform_world

pytestmark = pytest.mark.usefixtures("registered", "driver")
SIZE, SAMPLES = 8, 16
ALBEDO, SKY, EMITTED = 0.6, 2.0, 3.0
OUTLINE = 0.04
BLACK = 0.0


@pytest.fixture
def scene() -> bpy.types.Scene:
    """A scene of small pictures with a camera that looks down at the 0.02 m around the origin, from 0.01 m above it."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.film_transparent, scene.render.filter_size = True, 0.0
    scene.true_diffuse.bounces_light = True
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale, data.clip_start = "ORTHO", 0.02, 1e-3
    scene.camera = add(scene, "Camera", data, Matrix.Translation((0.0, 0.0, 0.01)))
    return scene


def drawn(scene: bpy.types.Scene, samples: int = SAMPLES) -> array[float]:
    """The red radiance of each pixel."""
    return render.radiance(scene, engines.REALTIME, samples)[1][::3]


def mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def diffuse(albedo: float) -> bpy.types.Material:
    material, node = materials.create_plain("Diffuse")
    node.inputs["Color"].default_value = (albedo, albedo, albedo, 1.0)
    return material


def emitting(radiance: float, albedo: float = 0.0) -> bpy.types.Material:
    material = bpy.data.materials.new("Emitting")
    node = material.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value = (albedo, albedo, albedo, 1.0)
    node.inputs["Specular IOR Level"].default_value = 0.0
    node.inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    node.inputs["Emission Strength"].default_value = radiance
    return material


def polygon(scene: bpy.types.Scene, corners: Sequence[Sequence[float]], material: bpy.types.Material) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Polygon")
    mesh.from_pydata([tuple(corner) for corner in corners], [], [tuple(range(len(corners)))])
    mesh.materials.append(material)
    return add(scene, "Polygon", mesh)


def square(half: float, height: float = 0.0) -> list[tuple[float, float, float]]:
    return [(-half, -half, height), (half, -half, height), (half, half, height), (-half, half, height)]


def disk(radius: float, height: float) -> list[tuple[float, float, float]]:
    angles = [math.tau * k / 64 for k in range(64)]
    return [(radius * math.cos(angle), radius * math.sin(angle), height) for angle in angles]


def test_directions_integrate_the_cosine_at_any_time() -> None:
    """The mean over directions of 4 max(0, n.w) is 1 for every normal n."""
    normals = [_fibonacci(k, 200) for k in range(200)]
    directions = [_fibonacci(k, len(ORDER)) for k in ORDER]
    assert sorted(ORDER) == list(range(64)) and MAX_BUNDLES == 4
    for count, most in ((4, 0.11), (8, 0.09), (16, 0.05), (32, 0.03), (64, 0.005)):
        sums = [math.fsum(max(0.0, n.dot(w)) for w in directions[:count]) for n in normals]
        assert math.sqrt(mean([(4.0 * one / count - 1.0) ** 2 for one in sums])) < most


def test_open_plane_has_the_whole_sky_without_noise(scene: bpy.types.Scene) -> None:
    polygon(scene, square(1.0), diffuse(ALBEDO))
    scene.world = uniform_world(strength=SKY)
    assert drawn(scene, 1) == pytest.approx([ALBEDO * SKY] * SIZE**2, rel=1e-5)


def test_wall_hides_half_of_the_sky_from_its_foot(scene: bpy.types.Scene) -> None:
    """The wall is black; it is 1 m wide and high, 0.015 m away: it hides all but 0.1 % of that half."""
    polygon(scene, square(1.0), diffuse(ALBEDO))
    polygon(scene, [(0.015, -1.0, 0.0), (0.015, 1.0, 0.0), (0.015, 1.0, 1.0), (0.015, -1.0, 1.0)], diffuse(BLACK))
    scene.world = uniform_world(strength=SKY)
    assert mean(drawn(scene)) == pytest.approx(ALBEDO * SKY / 2.0, rel=OUTLINE)
    scene.true_diffuse.bounces_light = False
    assert mean(drawn(scene)) == pytest.approx(ALBEDO * SKY, rel=1e-5)


def test_block_shades_a_ground_up_to_the_horizon(scene: bpy.types.Scene) -> None:
    """From a point of a plane, a distance d before the middle of a wall of height h and width 2b, the wall's form factor is
    (atan(b / d) - d / c atan(b / c)) / pi with c^2 = d^2 + h^2 (J. Howell's catalog, B-4, twice): .35 at a quarter of its width.

    The ground is 500 times as wide: one map of it would have texels of 10 m. Those around the block are some 0.05 m wide, by which
    the form factor changes by 0.02.
    """
    half, height, distance = 1.0, 2.0, 0.5
    polygon(scene, square(500.0), diffuse(ALBEDO))
    polygon(scene, [(-half, 0.0, 0.0), (half, 0.0, 0.0), (half, 0.0, height), (-half, 0.0, height)], diffuse(BLACK))
    scene.world = uniform_world(strength=SKY)
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.camera.data.ortho_scale, scene.camera.location = 4.0, (0.0, -distance, 10.0)  # pixels of 0.125 m
    found = drawn(scene, 64)
    away = math.hypot(distance, height)
    factor = (math.atan(half / distance) - distance / away * math.atan(half / away)) / math.pi
    middle = [found[32 * y + x] for x in (15, 16) for y in (15, 16)]
    assert mean(middle) == pytest.approx(ALBEDO * SKY * (1.0 - factor), abs=ALBEDO * SKY * (OUTLINE / 2.0 + 0.02))


@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0])
def test_disk_hides_its_form_factor_of_the_sky_and_shines_as_much(scene: bpy.types.Scene, radius: float) -> None:
    """Seen from a point of a plane 1 m below its center, a disk's form factor is r^2 / (r^2 + 1)."""
    polygon(scene, square(4.0), diffuse(ALBEDO))
    above = polygon(scene, disk(radius, 1.0), diffuse(BLACK))
    factor = radius**2 / (radius**2 + 1.0)
    scene.world = uniform_world(strength=SKY)
    assert mean(drawn(scene, 64)) == pytest.approx(ALBEDO * SKY * (1.0 - factor), abs=ALBEDO * SKY * OUTLINE / 2.0)
    scene.world = None
    above.data.materials[0] = emitting(EMITTED)
    assert mean(drawn(scene, 64)) == pytest.approx(ALBEDO * EMITTED * factor, abs=ALBEDO * EMITTED * OUTLINE / 2.0)


def test_light_between_two_squares(scene: bpy.types.Scene) -> None:
    """Of what one of two parallel unit squares sends out, 0.1998 reaches the other, 1 m away (J. Howell's catalog, C-11).

    A sun shines on the upper one's lower side through the lower one, which casts no shadow.
    """
    lower, upper = polygon(scene, square(0.5), diffuse(ALBEDO)), polygon(scene, square(0.5, 1.0), diffuse(0.8))
    lower.visible_shadow = False
    upper.visible_camera = False
    scene.camera.data.ortho_scale, scene.camera.location.z = 1.0, 0.5
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 5.0, 0.0
    add(scene, "Sun", sun, Matrix.Rotation(math.pi, 4, "X"))
    assert mean(drawn(scene, 64)) == pytest.approx(ALBEDO * 0.8 * 5.0 / math.pi * 0.1998, rel=OUTLINE)


def test_convex_block_has_the_whole_sky_up_to_its_edges(scene: bpy.types.Scene) -> None:
    """No ray that leaves it meets it, neither where it starts nor around a corner.

    But one that grazes a face may, where the map shows that face a few texels wide: next to an edge it looks up the face around the
    corner. One of 64 rays brings 4 cos / 64 of the sky: 0.003 of it at 87 degrees, and up to 0.05 if several do.
    """
    cube(scene, diffuse(ALBEDO))
    scene.world = uniform_world(strength=SKY)
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.camera.data.ortho_scale = 4.0
    scene.camera.matrix_world = towards((3.0, -2.0, 1.5)) @ Matrix.Translation((0.0, 0.0, 10.0))
    found = [value for value in drawn(scene) if value]
    assert len(found) > 500 and min(found) > 0.95 * ALBEDO * SKY
    assert mean(found) == pytest.approx(ALBEDO * SKY, rel=0.005)


def cube(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Add a cube of 2 m around the origin."""
    corners = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new("Cube")
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(material)
    add(scene, "Cube", mesh)


def closed_box(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Add a box around the camera, which looks into a corner of it from afar."""
    cube(scene, material)
    scene.camera.data.type, scene.camera.data.angle = "PERSP", 1.2
    eye = Vector((-0.6, -0.5, 0.2))
    scene.camera.matrix_world = Matrix.Translation(eye) @ towards(eye - Vector((1.0, 1.0, -1.0)))


def test_furnace(scene: bpy.types.Scene) -> None:
    """Within a closed box that emits, one bounce adds the albedo's part of what is emitted, everywhere and up to the edges."""
    closed_box(scene, emitting(EMITTED, ALBEDO))
    assert drawn(scene) == pytest.approx([EMITTED * (1.0 + ALBEDO)] * SIZE**2, rel=0.01)


@pytest.mark.parametrize("samples", [1, 3])
def test_nothing_is_below_zero_unless_a_light_is(scene: bpy.types.Scene, samples: int) -> None:
    """So few directions hide up to 1.3 times the sky from a corner of a closed box; a light of negative power takes light away."""
    closed_box(scene, diffuse(ALBEDO))
    scene.world = uniform_world(strength=SKY)
    assert min(drawn(scene, samples)) >= 0.0
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = -10.0
    add(scene, "Lamp", lamp)
    assert min(drawn(scene, samples)) < -0.1


def test_no_sky_shines_into_a_closed_box(scene: bpy.types.Scene) -> None:
    """All is left of it is the directions' error, of the walls and of what they bounce; in the open, it were ALBEDO SKY."""
    closed_box(scene, diffuse(ALBEDO))
    scene.world = uniform_world(strength=SKY)
    found = drawn(scene)
    assert abs(mean(found)) < 0.02 * ALBEDO * SKY
    assert max(map(abs, found)) < 0.1 * ALBEDO * SKY


def test_what_diffuse_rays_do_not_see_neither_bounces_nor_hides(scene: bpy.types.Scene) -> None:
    polygon(scene, square(4.0), diffuse(ALBEDO))
    above = polygon(scene, disk(2.0, 1.0), emitting(EMITTED))
    above.visible_diffuse = False
    scene.world = uniform_world(strength=SKY)
    assert drawn(scene, 1) == pytest.approx([ALBEDO * SKY] * SIZE**2, rel=1e-5)


def test_half_transparent_disk_hides_half_as_much(scene: bpy.types.Scene) -> None:
    polygon(scene, square(4.0), diffuse(ALBEDO))
    material, node = materials.create_plain("Half")
    node.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    tree = material.node_tree
    mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(node.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    polygon(scene, disk(2.0, 1.0), material)
    scene.world = uniform_world(strength=SKY)
    assert mean(drawn(scene)) == pytest.approx(ALBEDO * SKY * (1.0 - 0.5 * 0.8), rel=OUTLINE)


def test_more_samples_are_nearer_to_cycles() -> None:
    """A box open to the camera under a sky, as Cycles has it with one bounce; its noise of 64 samples is some 3 %."""
    from true_diffuse.scripts.studies import bounce

    picture = bounce.Picture(bounce.box(is_open=True))
    picture.scene.render.resolution_x = picture.scene.render.resolution_y = 32
    expected = render.radiance(picture.scene, engines.CYCLES, 64)[1]

    def errors() -> Iterator[float]:
        for samples in (1, 4, 16):
            _, got = picture.realtime(samples, bounces=True)
            yield error.difference(got, expected, range(len(got) // 3))

    found = list(errors())
    assert all(before > after for before, after in pairwise(found)) and found[-1] < 0.06, found
