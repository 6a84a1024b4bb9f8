# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime engine's lights, shadows, world, subsurface, colors and normal maps, against closed forms, models and Cycles."""

import itertools
import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import fmean
from typing import NamedTuple

import bpy

import bmesh
import pytest
from mathutils import Matrix, Vector

from support import scene_at_centers
from true_diffuse.addon import models
from true_diffuse.addon.blender import engines
from true_diffuse.addon.closures import subsurface_fit
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import Model
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.addon.realtime import program, shadows
from true_diffuse.addon.realtime.lights import Light
from true_diffuse.addon.realtime.shadow_maps import ShadowMaps
from true_diffuse.scenes.slab import slab
from true_diffuse.scripts.studies.edge_profile import edge_width
from true_diffuse.scripts.studies.slab_light import half_plane

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("registered", "driver")]

UP = (0.0, 0.0, 1.0)
COLOR = (0.8, 0.5, 0.2)
SIZE = 36  # pixels
EYE = Vector((0.4, -2.0, 1.5))
LENS = 50.0  # mm: N.V from 0.3 to 0.8 over the picture
# Of 32-bit floats: interpolated positions are off by a few times 1e-7 of the scene's size, the cosine of a cone's edge by 1e-7,
# which its fade divides by 0.1.
ROUND = 5e-6

USUAL = {"Roughness": 0.5, "IOR": 1.5}
FORMULAS: dict[str, tuple[Model, dict[str, float]]] = {
    **{model.label: (model.reference(USUAL), USUAL) for model in models.MODELS.values()},
    "Specular": (models.Specular(0.06, 30.0), {"Specular": 0.06, "Exponent": 30.0}),
}


def material(name: str, color: Sequence[float] = COLOR) -> bpy.types.Material:
    """Return a material of one of FORMULAS."""
    group, menu = (SPECULAR_GROUP, {}) if name == "Specular" else (ROUGH_DIFFUSE, {"Model": name})
    return materials.create(name, group, Color=(*color, 1.0), **menu, **FORMULAS[name][1])


def empty_scene(size: int = SIZE) -> bpy.types.Scene:
    """Return the scene with nothing in it, of pictures whose samples are all at the pixels' centers."""
    return scene_at_centers(size, size)


def add(scene: bpy.types.Scene, data: bpy.types.ID, matrix: Matrix | None = None) -> bpy.types.Object:
    item = bpy.data.objects.new("Item", data)
    item.matrix_world = matrix or Matrix()
    scene.collection.objects.link(item)
    return item


def square(half: float, shown: bpy.types.Material | None) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata([(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)], [], [(0, 1, 2, 3)])
    if shown:
        mesh.materials.append(shown)
    return mesh


def looking(place: Vector, at: Vector) -> Matrix:
    """Return where something stands at `place` whose -Z axis points to `at`."""
    return Matrix.Translation(place) @ (place - at).to_track_quat("Z", "Y").to_matrix().to_4x4()


def camera(scene: bpy.types.Scene, place: Vector, at: Vector, lens: float = LENS) -> bpy.types.Object:
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    scene.camera = add(scene, data, looking(place, at))
    return scene.camera


def add_light(scene: bpy.types.Scene, kind: str, matrix: Matrix, **settings: object) -> bpy.types.Object:
    data = bpy.data.lights.new(kind, kind)
    for name, value in settings.items():
        setattr(data, name, value)
    return add(scene, data, matrix)


def drawn(scene: bpy.types.Scene, engine: engines.Engine = engines.REALTIME, samples: int = 1) -> array[float]:
    return render.radiance(scene, engine, samples)[1]


def floor_points(scene: bpy.types.Scene) -> list[Vector]:
    """Return where the ray through the center of each pixel meets the plane z = 0, rows from the top."""
    size, eye = scene.render.resolution_x, scene.camera.matrix_world
    half = 18.0 / scene.camera.data.lens
    points = []
    for y in range(size):
        for x in range(size):
            ray = eye.to_3x3() @ Vector((half * ((2 * x + 1) / size - 1.0), half * (1.0 - (2 * y + 1) / size), -1.0))
            points.append(eye.translation - ray * (eye.translation.z / ray.z))
    return points


def rms_error(got: Sequence[float], expected: Sequence[float]) -> float:
    """Return the RMS difference over the RMS of what is expected."""
    difference = math.fsum((a - b) ** 2 for a, b in zip(got, expected, strict=True))
    return math.sqrt(difference / math.fsum(b * b for b in expected))


# ---- lights

type Irradiance = Callable[[Vector], tuple[Vector, float]]
"""A function of a point: the unit vector towards a light, and its irradiance on a plane that faces it [W/m^2]."""

POSITION = Vector((0.5, -0.3, 0.8))
TARGET = Vector((-0.1, 0.2, 0.0))


def from_point(power: float) -> Irradiance:
    return lambda at: ((POSITION - at).normalized(), power / (4.0 * math.pi * (POSITION - at).length_squared))


def from_area(power: float, half: float = math.pi / 2.0) -> Irradiance:
    def irradiance(at: Vector) -> tuple[Vector, float]:
        l, sphere = from_point(power)(at)
        theta = l.angle(POSITION - TARGET)
        gain = 1.0 if half == math.pi / 2.0 else max(0.0, math.tan(half) - math.tan(theta)) / (math.tan(half) - half)
        return l, sphere * 4.0 * math.cos(theta) * gain

    return irradiance


def from_spot(power: float, size: float, blend: float, stretch: tuple[float, float] = (1.0, 1.0)) -> Irradiance:
    turn = looking(POSITION, TARGET).to_3x3().inverted()

    def irradiance(at: Vector) -> tuple[Vector, float]:
        l, sphere = from_point(power)(at)
        x, y, z = turn @ l
        cosine = Vector((x / stretch[0], y / stretch[1], z)).normalized().z
        edge = math.cos(size / 2.0)
        t = min(max((cosine - edge) / ((1.0 - edge) * blend), 0.0), 1.0)
        return l, sphere * t * t * (3.0 - 2.0 * t)

    return irradiance


class LightCase(NamedTuple):
    """One of Blender's lights and the irradiance expected of it; `scale` is the object's."""

    name: str
    kind: str
    settings: dict[str, object]
    expected: Irradiance
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


SUN = (POSITION - TARGET).normalized()
OF_ANGLE = math.pi * math.sin(0.05) ** 2  # the projected solid angle of a sun 0.1 wide
LIGHT_CASES = (
    LightCase("sun", "SUN", {"energy": 3.0, "angle": 0.0}, lambda _: (SUN, 3.0), (2.0, 3.0, 4.0)),
    LightCase("sun of an angle", "SUN", {"energy": 3.0, "angle": 0.1}, lambda _: (SUN, 3.0)),
    LightCase("exposed", "SUN", {"energy": -3.0, "exposure": 1.5}, lambda _: (SUN, -3.0 * 2.0**1.5)),
    LightCase(
        "sun per angle",
        "SUN",
        {"energy": 3.0, "angle": 0.1, "normalize": False},
        lambda _: (SUN, 3.0 * math.pi * math.sin(0.05) ** 2),
    ),
    LightCase("point", "POINT", {"energy": 30.0}, from_point(30.0), (2.0, 3.0, 4.0)),
    LightCase("negative point", "POINT", {"energy": -30.0}, from_point(-30.0)),
    LightCase(
        "point per area",
        "POINT",
        {"energy": 30.0, "shadow_soft_size": 0.02, "normalize": False},
        from_point(30.0 * 4.0 * math.pi * 0.02**2),
        (2.0, 2.0, 2.0),
    ),
    LightCase("spot", "SPOT", {"energy": 30.0, "spot_size": 1.2, "spot_blend": 0.6}, from_spot(30.0, 1.2, 0.6)),
    LightCase(
        "stretched spot",
        "SPOT",
        {"energy": 30.0, "spot_size": 1.2, "spot_blend": 0.6},
        from_spot(30.0, 1.2, 0.6, (0.5, 2.0)),
        (0.35, 1.4, 0.7),
    ),
    LightCase("area", "AREA", {"energy": 30.0, "size": 0.01}, from_area(30.0), (3.0, 2.0, 5.0)),
    LightCase(
        "area per area",
        "AREA",
        {"energy": 3e5, "shape": "ELLIPSE", "size": 0.01, "size_y": 0.02, "normalize": False},
        from_area(3e5 * math.pi / 4.0 * 0.01 * 0.02 * 6.0),
        (3.0, -2.0, 5.0),
    ),
    LightCase("area of a spread", "AREA", {"energy": 30.0, "size": 0.01, "spread": 1.5}, from_area(30.0, 0.75)),
)


def lit_floor(case: LightCase, shown: bpy.types.Material) -> bpy.types.Scene:
    scene = empty_scene()
    add(scene, square(9.0, shown))
    camera(scene, EYE, Vector())
    place = looking(POSITION, TARGET) @ Matrix.Diagonal((*case.scale, 1.0))
    add_light(scene, case.kind, place, **({"use_shadow": False} | case.settings))
    bpy.context.view_layer.update()
    return scene


@pytest.mark.parametrize("case", LIGHT_CASES, ids=lambda case: case.name)
def test_light_has_the_irradiance_of_its_formula(case: LightCase) -> None:
    scene = lit_floor(case, material("Lambert"))
    expected = []
    for at in floor_points(scene):
        l, irradiance = case.expected(at)
        expected += [irradiance * max(l.z, 0.0) * color / math.pi for color in COLOR]
    assert rms_error(drawn(scene), expected) < ROUND


@pytest.mark.parametrize("name", ("sun per angle", "point per area", "stretched spot", "area per area", "area of a spread"))
def test_light_is_that_of_cycles(name: str) -> None:
    """A light 0.02 m wide at 1 m differs by (0.02 / 1)^2 from a point, and 64 samples leave as much noise; a cone has more."""
    scene = lit_floor(next(case for case in LIGHT_CASES if case.name == name), material("Lambert"))
    assert rms_error(drawn(scene), drawn(scene, engines.CYCLES, 64)) < 3e-3


def test_lights_of_all_types_add_up() -> None:
    """With one type of light a shader has no branch for it; with several it has."""
    mixed = [next(case for case in LIGHT_CASES if case.kind == kind) for kind in program.LIGHT_TYPES]
    scene = lit_floor(mixed[0], material("Lambert"))
    for case in mixed[1:]:
        place = looking(POSITION, TARGET) @ Matrix.Diagonal((*case.scale, 1.0))
        add_light(scene, case.kind, place, **({"use_shadow": False} | case.settings))
    bpy.context.view_layer.update()
    expected = []
    for at in floor_points(scene):
        lit = math.fsum(irradiance * max(l.z, 0.0) for l, irradiance in (case.expected(at) for case in mixed))
        expected += [lit * color / math.pi for color in COLOR]
    assert rms_error(drawn(scene), expected) < ROUND


def test_light_tint_is_color_times_temperature() -> None:
    scene = lit_floor(LIGHT_CASES[0], material("Lambert"))
    data = scene.objects[-1].data
    data.color, data.use_temperature, data.temperature = (0.2, 0.5, 1.0), True, 3200.0
    assert rms_error(drawn(scene), drawn(scene, engines.CYCLES)) < 10.0 * ROUND


@pytest.mark.parametrize("name", FORMULAS)
def test_every_model_is_exact_under_a_point_light(name: str) -> None:
    case = next(case for case in LIGHT_CASES if case.name == "point")
    scene = lit_floor(case, material(name))
    expected = []
    for at in floor_points(scene):
        l, irradiance = case.expected(at)
        v = (EYE - at).normalized()
        expected += [irradiance * FORMULAS[name][0].radiance(UP, tuple(l), tuple(v), color) for color in COLOR]
    assert rms_error(drawn(scene), expected) < 2.0 * ROUND


# ---- the world's light

WORLD = (0.5, 0.6, 0.7)  # radiance [W/(m^2 sr)]
# What directional_albedo.glsl states, in units of the albedo.
FITTED = {"Lambert": 0.0, "Oren-Nayar": 0.0, "EON": 0.0, "Oren-Nayar 1994": 0.0011, "Wolff": 0.002}


def give_world(scene: bpy.types.Scene) -> None:
    scene.world = bpy.data.worlds.new("World")
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (*WORLD, 1.0), 1.0


@pytest.mark.parametrize("name", FITTED)
def test_world_is_reflected_by_the_directional_albedo(name: str) -> None:
    scene = empty_scene(12)
    add(scene, square(9.0, material(name)))
    camera(scene, EYE, Vector())
    give_world(scene)
    got = drawn(scene)
    for pixel, at in list(enumerate(floor_points(scene)))[::17]:
        mu = (EYE - at).normalized().z
        for channel, (color, light) in enumerate(zip(COLOR, WORLD, strict=True)):
            expected = light * models.directional_albedo(FORMULAS[name][0], mu, color)
            assert got[3 * pixel + channel] == pytest.approx(expected, abs=light * color * FITTED[name] + ROUND)


def reroute(tree: bpy.types.NodeTree, link: bpy.types.NodeLink) -> None:
    """Lay a link over two reroutes."""
    source, target = link.from_socket, link.to_socket
    for _ in range(2):
        node = tree.nodes.new("NodeReroute")
        tree.links.new(source, node.inputs[0])
        source = node.outputs[0]
    tree.links.new(source, target)


def test_world_and_materials_are_found_behind_reroutes_and_constants() -> None:
    """A square of twice WORLD's light on Lambert's material of ours, then on another's, then none where a link is muted."""
    scene = empty_scene(4)
    shown = material("Lambert")
    add(scene, square(9.0, shown))
    camera(scene, EYE, Vector())
    give_world(scene)
    world, tree = scene.world.node_tree, shown.node_tree
    background = next(node for node in world.nodes if node.type == "BACKGROUND")
    color, strength = world.nodes.new("ShaderNodeRGB"), world.nodes.new("ShaderNodeValue")
    color.outputs[0].default_value, strength.outputs[0].default_value = (*WORLD, 1.0), 2.0
    background.inputs["Color"].default_value = (1.0, 0.0, 1.0, 1.0)
    world.links.new(color.outputs[0], background.inputs["Color"])
    world.links.new(strength.outputs[0], background.inputs["Strength"])
    for part in (world, tree):
        for link in list(part.links):
            reroute(part, link)
    expected = [2.0 * light * own for light, own in zip(WORLD, COLOR, strict=True)] * 16
    assert list(drawn(scene)) == pytest.approx(expected, rel=ROUND)
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    principled.inputs["Base Color"].default_value, principled.inputs["Specular IOR Level"].default_value = (*COLOR, 1.0), 0.0
    output = tree.get_output_node("ALL").inputs["Surface"]
    tree.links.new(principled.outputs[0], output)
    reroute(tree, output.links[0])
    assert list(drawn(scene)) == pytest.approx(expected, rel=ROUND)
    world.get_output_node("ALL").inputs["Surface"].links[0].is_muted = True
    assert max(drawn(scene)) == 0.0


def test_white_coat_and_scattering_return_the_whole_world() -> None:
    scene = empty_scene(16)
    shown = materials.create("Furnace", SUBSURFACE, Color=(1.0, 1.0, 1.0, 1.0), Subsurface=0.6, Specular=1.0, Model="Lambert")
    add(scene, square(9.0, shown))
    camera(scene, EYE, Vector())
    give_world(scene)
    assert list(drawn(scene)) == pytest.approx([*WORLD] * 256, rel=ROUND)


# ---- shadows


def ball(radius: float, shown: bpy.types.Material) -> bpy.types.Mesh:
    mesh, solid = bpy.data.meshes.new("Ball"), bmesh.new()
    bmesh.ops.create_uvsphere(solid, u_segments=128, v_segments=64, radius=radius)
    solid.to_mesh(mesh)
    solid.free()
    mesh.shade_smooth()
    mesh.materials.append(shown)
    return mesh


RADIUS, CENTER = 0.4, Vector((0.1, 0.0, 0.6))
LIGHT = Vector((2.0, 1.0, 3.0))
SPOT = {"energy": 300.0, "spot_size": 1.2, "spot_blend": 0.0}


def ray_distance(eye: Vector, direction: Vector) -> float:
    """Return the smallest distance of a ray from CENTER [m]."""
    away = CENTER - eye
    return (away - direction * max(0.0, away.dot(direction))).length


LOW = Vector((0.9, 0.7, 0.9))  # from where the floor that is seen spans more than one projection holds


@pytest.mark.parametrize("half", (4.0, 2000.0))
@pytest.mark.parametrize(
    ("kind", "settings", "place"),
    (
        ("SUN", {"energy": 3.0, "angle": 0.0}, LIGHT),
        ("SPOT", SPOT, LIGHT),
        ("POINT", {"energy": 300.0}, LIGHT),
        ("POINT", {"energy": 30.0}, LOW),
        ("AREA", {"energy": 30.0, "size": 0.2}, LOW),
    ),
)
def test_shadow_is_where_the_ray_to_the_light_is_blocked(
    kind: str, settings: dict[str, object], place: Vector, half: float
) -> None:
    """But within 0.02 m of the ball's outline: two texels of a map that is 4096 wide over some 10 m, and the facets' 0.0005 m."""
    scene = empty_scene(64)
    shown = material("Lambert")
    add(scene, square(half, shown))
    add(scene, ball(RADIUS, shown), Matrix.Translation(CENTER))
    camera(scene, Vector((0.4, -2.0, 2.5)), Vector((0.0, -0.3, 0.0)), 35.0)
    light = add_light(scene, kind, looking(place, Vector((-0.2, -0.1, 0.0))), **settings)
    got = drawn(scene)
    light.data.use_shadow = False
    plain = drawn(scene)
    eye, lit, dark = scene.camera.matrix_world.translation, 0, 0
    for pixel, at in enumerate(floor_points(scene)):
        towards = (place - Vector((-0.2, -0.1, 0.0)) if kind == "SUN" else place - at).normalized()
        near = ray_distance(at, towards)
        if ray_distance(eye, (at - eye).normalized()) < RADIUS + 0.02 or abs(near - RADIUS) < 0.02 or plain[3 * pixel] == 0.0:
            continue
        lit, dark = lit + (near > RADIUS), dark + (near < RADIUS)
        assert got[3 * pixel] == pytest.approx(plain[3 * pixel] if near > RADIUS else 0.0, rel=ROUND), (pixel, near)
    assert lit > 500 and dark > 150


def points_of(light: Light, count: int = 1024) -> list[Light]:
    return [light.at_sample(sample, 3) for sample in range(count)]


SOFT = Light("POINT", (1.0, 2.0, 3.0), UP, (1.0, 1.0, 1.0), 0.0, 0.0, (0.0,) * 3, (0.0,) * 3, True, size=0.5)
# How far fractions of 1024 points of Halton's sequence are from the areas they stand for, of the order of log(n)^2 / n
FRACTION = 0.02


def test_points_of_a_sun_give_a_facing_plane_its_strength_and_stay_in_its_cone() -> None:
    axis = Vector((1.0, -2.0, 2.0)) / 3.0
    sun = replace(SOFT, kind="SUN", axis=tuple(axis), size=0.4)
    seen = [(point.strength[0], axis.dot(Vector(point.axis))) for point in points_of(sun)]
    assert all(strength * cosine == pytest.approx(1.0, rel=ROUND) for strength, cosine in seen)
    assert min(cosine for _, cosine in seen) == pytest.approx(math.cos(0.4), abs=0.005)
    mean = sum((Vector(point.axis) * point.strength[0] for point in points_of(sun)), Vector()) / 1024
    assert (mean - axis).length < FRACTION * math.tan(0.4)  # so every plane that sees all of it gets its strength times N.L


@pytest.mark.parametrize("direction", (UP, (1.0, 0.0, 0.0), (0.6, -0.48, 0.64)))
def test_points_of_a_point_light_fill_a_disk_from_everywhere(direction: tuple[float, float, float]) -> None:
    towards, center = Vector(direction), Vector(SOFT.position)
    away = [Vector(point.position) - center for point in points_of(SOFT)]
    across = [(vector - towards * vector.dot(towards)).length / SOFT.size for vector in away]
    assert max(across) <= 1.0 + 1e-6
    for radius in (0.25, 0.5, 0.75, 0.9):
        assert sum(one <= radius for one in across) / len(across) == pytest.approx(radius * radius, abs=FRACTION)


@pytest.mark.parametrize("is_round", (False, True))
def test_points_of_an_area_light_fill_it(is_round: bool) -> None:
    light = replace(SOFT, kind="AREA", size=0.0, sides=((0.5, 0.0, 0.0), (0.0, 2.0, 0.0)), is_round=is_round)
    away = [Vector(point.position) - Vector(light.position) for point in points_of(light)]
    inside = [(vector.x / 0.5, vector.y / 2.0) for vector in away]
    assert all(math.hypot(x, y) <= 1.0 + 1e-6 if is_round else max(abs(x), abs(y)) <= 1.0 for x, y in inside)
    assert sum(x < 0.0 for x, _ in inside) / 1024 == pytest.approx(0.5, abs=FRACTION)
    small = sum(math.hypot(x, y) < 0.5 if is_round else max(abs(x), abs(y)) < 0.5 for x, y in inside)
    assert small / 1024 == pytest.approx(0.25, abs=FRACTION)


@pytest.mark.parametrize(
    ("kind", "settings"),
    (
        ("SUN", {"energy": 3.0, "angle": 0.4}),
        ("POINT", {"energy": 300.0, "shadow_soft_size": 0.3}),
        ("SPOT", {**SPOT, "shadow_soft_size": 0.3}),
        ("AREA", {"energy": 300.0, "shape": "ELLIPSE", "size": 1.5, "size_y": 0.7}),
    ),
)
def test_soft_shadow_is_that_of_cycles(kind: str, settings: dict[str, object], monkeypatch: pytest.MonkeyPatch) -> None:
    """64 points of a light miss the visible part of it by 0.016 in the mean, which counts in the third of the picture where only a
    part is visible; Cycles' noise and the texels along the ball's outline are of that order."""
    monkeypatch.setattr(shadows, "MAP_SIZE", 1024)  # a graphics driver in software is slow with more
    scene = empty_scene(64)
    shown = material("Lambert")
    add(scene, square(4.0, shown))
    add(scene, ball(RADIUS, shown), Matrix.Translation(CENTER))
    camera(scene, Vector((0.4, -2.0, 2.5)), Vector((0.0, -0.3, 0.0)), 35.0)
    add_light(scene, kind, looking(LIGHT, Vector((-0.2, -0.1, 0.0))), **settings)
    engines.leave_out_bounces(scene)
    expected = drawn(scene, engines.CYCLES, 256)
    assert rms_error(drawn(scene, samples=64), expected) < 0.02
    assert rms_error(drawn(scene), expected) > 0.04  # a single sample's shadow is hard


def test_samples_draw_the_shadow_maps_of_soft_lights_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shadows, "MAP_SIZE", 512)
    scene = empty_scene(64)
    shown = material("Lambert")
    add(scene, square(4.0, shown))
    add(scene, ball(RADIUS, shown), Matrix.Translation(CENTER))
    camera(scene, Vector((0.4, -2.0, 2.5)), Vector((0.0, -0.3, 0.0)), 35.0)
    for x, angle in ((2.0, 0.0), (1.0, 0.4), (-1.0, 0.0)):
        add_light(scene, "SUN", looking(Vector((x, 1.0, 3.0)), Vector()), energy=1.0, angle=angle)
    draw, counts = ShadowMaps._draw, []

    def counted(maps: ShadowMaps, tiles: list[shadows.Tile], sample: int) -> None:
        counts.append(len(tiles))
        draw(maps, tiles, sample)

    monkeypatch.setattr(ShadowMaps, "_draw", counted)
    got = drawn(scene, samples=4)
    assert counts == [3, 1, 1, 1]
    monkeypatch.setattr(ShadowMaps, "_draw", lambda maps, _, sample: draw(maps, maps._tiles, sample))
    assert drawn(scene, samples=4) == got


def test_lit_side_of_a_ball_does_not_shade_itself() -> None:
    scene = empty_scene(64)
    add(scene, ball(RADIUS, material("Lambert")), Matrix.Translation(CENTER))
    camera(scene, Vector((0.4, -2.0, 2.5)), CENTER, 100.0)
    light = add_light(scene, "SUN", looking(LIGHT, Vector()), energy=math.pi, angle=0.0)
    got = drawn(scene)
    light.data.use_shadow = False
    plain = drawn(scene)
    # facets are 2.8 degrees wide: where N.L is above sin(2.8), all of them face the sun
    lit = [(a, b) for a, b in zip(got[::3], plain[::3], strict=True) if b > COLOR[0] * 0.05]
    assert len(lit) > 1000 and all(a == pytest.approx(b, rel=ROUND) for a, b in lit)


def test_lights_share_the_shadow_map_without_touching_each_other() -> None:
    scene = empty_scene(64)
    shown = material("Lambert")
    add(scene, square(4.0, shown))
    add(scene, ball(RADIUS, shown), Matrix.Translation(CENTER))
    camera(scene, Vector((0.4, -2.0, 2.5)), Vector(), 35.0)
    lights = []
    for k, kind in enumerate(("SUN", "SPOT", "POINT", "SUN", "SPOT", "SPOT")):
        turn = Vector((3.0 * math.cos(k), 3.0 * math.sin(k), 3.0))
        lights.append(add_light(scene, kind, looking(turn, Vector()), **(SPOT if kind == "SPOT" else {"energy": 3.0})))
    together = drawn(scene)
    total = array("f", bytes(4 * len(together)))
    for chosen in lights:
        for light in lights:
            light.hide_render = light is not chosen
        total = array("f", map(sum, zip(total, drawn(scene), strict=True)))
    inside = 0
    for x, y in itertools.product(range(1, 63), range(1, 63)):
        around = [total[3 * (64 * (y + j) + x + i)] for i in (-1, 0, 1) for j in (-1, 0, 1)]
        # no edge of a shadow, which is finer where a light has the map for itself, but of a light that hardly counts
        if max(around) < 1.04 * min(around):
            inside += 1
            assert together[3 * (64 * y + x)] == pytest.approx(around[4], rel=0.04), (x, y)
    assert inside > 2000


# ---- subsurface


def skin(color: Sequence[float] = COLOR, path: float = 100.0) -> bpy.types.Material:
    settings = {"Subsurface Radius": (path, path, path), "Subsurface": 1.0, "Specular": 0.0}
    return materials.create("Skin", SUBSURFACE, Color=(*color, 1.0), **settings)


@pytest.mark.parametrize("pixels", (4.0, 12.0))
def test_edge_of_a_shadow_is_as_wide_as_on_the_medium(pixels: float) -> None:
    """To 3 %: of 36 rows' noise and, at 4 pixels, of their steps and the shadow's own edge, which is one pixel wide."""
    width, size = 100.0 * subsurface_fit.edge_width(0.5), 144
    view = width * size / pixels
    body = slab(1.5 * view)
    rows = range(54, 90)  # as the picture's edges cut off light on its way up and down
    red, *_ = body.picture([skin((0.5,) * 3)], engines.REALTIME, 4, (size, size), view, half_plane(body))
    profile = [fmean(red[y * size + x] for y in rows) for x in range(size)]
    assert edge_width(profile, view / size) == pytest.approx(width, rel=0.03)
    assert fmean(profile) == pytest.approx(0.25, rel=0.01)  # no light is lost


def test_scattering_stays_within_its_object() -> None:
    """A lit square beside one that the sun grazes from behind: nothing gets to the dark one, and the other lacks nothing.

    To 1 %, as along its edges what the pixels do not show is estimated from the light's map.
    """
    scene = empty_scene(32)
    shown = skin()
    add(scene, square(1.0, shown), Matrix.Translation((-1.0, 0.0, 0.0)))
    add(scene, square(1.0, shown), Matrix.Rotation(math.radians(60.0), 4, "Y") @ Matrix.Translation((1.0, 0.0, 0.0)))
    camera(scene, Vector((0.0, 0.0, 3.0)), Vector((0.0, 0.0, 0.0)), 60.0)
    add_light(scene, "SUN", Matrix.Rotation(math.radians(-45.0), 4, "Y"), energy=math.pi, angle=0.0, use_shadow=False)
    got = drawn(scene)[::3]
    lit = COLOR[0] * math.cos(math.radians(45.0))
    assert min(got) == 0.0 and all(value == 0.0 or value == pytest.approx(lit, rel=0.01) for value in got)
    assert sum(value > 0.0 for value in got) == len(got) / 2


# ---- colors


def test_film_has_color_times_coverage() -> None:
    scene = empty_scene(16)
    scene.render.filter_size = 1.5
    add(scene, square(0.5, material("Lambert")))
    camera(scene, Vector((0.1, 0.05, 3.0)), Vector((0.1, 0.05, 0.0)))
    add_light(scene, "SUN", Matrix(), energy=math.pi, angle=0.0)
    engines.use(scene, engines.REALTIME, 8)
    _, channels = render._render(scene)
    alpha = render.interleaved(channels, "Combined", "A")
    rgb = render.interleaved(channels)
    assert sum(0.0 < a < 1.0 for a in alpha) > 20
    assert list(rgb) == pytest.approx([color * a for a in alpha for color in COLOR], abs=ROUND)


def floor(shown: bpy.types.Material | None, mesh: bpy.types.Mesh | None = None) -> bpy.types.Scene:
    """Return a scene of a floor of `shown` under a sun, seen from above."""
    scene = empty_scene(5)
    add(scene, mesh or square(1.0, shown))
    camera(scene, Vector((0.0, 0.0, 3.0)), Vector())
    add_light(scene, "SUN", Matrix(), energy=math.pi, angle=0.0)
    return scene


def floor_color(shown: bpy.types.Material | None, mesh: bpy.types.Mesh | None = None) -> list[float]:
    """Return the color that the middle of a floor of `shown` has."""
    return list(drawn(floor(shown, mesh))[36:39])


def test_other_materials_show_their_base_color() -> None:
    principled = bpy.data.materials.new("Principled")
    node = next(node for node in principled.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value, node.inputs["Specular IOR Level"].default_value = (*COLOR, 1.0), 0.0
    assert floor_color(principled) == pytest.approx(COLOR, rel=ROUND)


def test_face_without_material_is_light_gray() -> None:
    assert floor_color(None) == pytest.approx((0.8,) * 3, rel=ROUND)


@pytest.mark.parametrize(("kind", "step"), (("FLOAT_COLOR", ROUND), ("BYTE_COLOR", 0.01)))
def test_color_attribute_is_linear(kind: str, step: float) -> None:
    """A byte of sRGB is at most 0.009 of a linear color."""
    shown = material("Lambert")
    materials.paint(shown, shown.node_tree.nodes[ROUGH_DIFFUSE.name].inputs["Color"], "ColorInput", 0.5)
    mesh = square(1.0, shown)
    for item in mesh.color_attributes.new("ColorInput", kind, "CORNER").data:
        item.color = (0.1, 0.4, 0.9, 1.0)
    assert floor_color(shown, mesh) == pytest.approx((0.05, 0.2, 0.45), abs=step)


@pytest.mark.parametrize("is_float", (False, True))
def test_image_is_read_in_its_color_space(is_float: bool) -> None:
    """One of sRGB in bytes, one of linear floats, whose driver may hold them in 16 bits."""
    image = bpy.data.images.new("Image", 4, 4, float_buffer=is_float)
    image.pixels[:] = [0.5, 0.25, 0.75, 1.0] * 16
    image.update()
    shown = material("Lambert")
    nodes, links = shown.node_tree.nodes, shown.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    links.new(texture.outputs["Color"], nodes[ROUGH_DIFFUSE.name].inputs["Color"])
    mesh = square(1.0, shown)
    mesh.uv_layers.new(name="UVMap")
    decoded = (0.5, 0.25, 0.75) if is_float else (0.2140, 0.0509, 0.5225)
    assert floor_color(shown, mesh) == pytest.approx(decoded, abs=1e-3 if is_float else 0.004)


# ---- normal maps

TILT = (0.75, 0.625, 0.875)  # a color, of (0.5, 0.25, 0.75) in tangent space
HEXAGON = [(3.0 * math.cos(k * math.pi / 3.0), 3.0 * math.sin(k * math.pi / 3.0), 0.0) for k in range(6)]
BUMPS = 0.3  # the steepest slope of a bumpy map along u and v


def flat(color: Sequence[float] = TILT) -> bpy.types.Image:
    return picture_of(2, [color] * 4)


def picture_of(size: int, colors: Sequence[Sequence[float]]) -> bpy.types.Image:
    image = bpy.data.images.new("Normals", size, size, float_buffer=True, is_data=True)
    image.pixels[:] = [channel for color in colors for channel in (*color, 1.0)]
    image.update()
    return image


def bumpy(size: int = 64) -> bpy.types.Image:
    def color(x: int, y: int) -> Vector:
        slopes = Vector((math.sin(6.0 * math.pi * (x + 0.5) / size), math.cos(4.0 * math.pi * (y + 0.5) / size), 0.0))
        return (BUMPS * slopes + Vector(UP)).normalized() * 0.5 + Vector((0.5, 0.5, 0.5))

    return picture_of(size, [color(x, y) for y in range(size) for x in range(size)])


def map_normals(shown: bpy.types.Material, image: bpy.types.Image | None, node: str = ROUGH_DIFFUSE.name) -> bpy.types.Node:
    """Feed the Normal of a material's `node` by a map, and return its Normal Map node."""
    nodes, links = shown.node_tree.nodes, shown.node_tree.links
    texture, made = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeNormalMap")
    texture.image = image
    links.new(texture.outputs["Color"], made.inputs["Color"])
    links.new(made.outputs["Normal"], nodes[node].inputs["Normal"])
    shown.cycles.use_bump_map_correction = False  # which dims light at grazing angles, in Cycles alone
    return made


def placed(corners: Sequence[Sequence[float]], turn: Matrix, shown: bpy.types.Material) -> bpy.types.Mesh:
    """Return a face whose UV map is that of the plane, a unit to a meter, turned and mirrored by `turn`."""
    mesh = bpy.data.meshes.new("Face")
    mesh.from_pydata(corners, [], [range(len(corners))])
    mesh.materials.append(shown)
    for place, corner in zip(mesh.uv_layers.new(name="UVMap").uv, corners, strict=True):
        place.vector = (turn @ Vector(corner)).to_2d()
    return mesh


SQUARE = [(-9.0, -9.0, 0.0), (9.0, -9.0, 0.0), (9.0, 9.0, 0.0), (-9.0, 9.0, 0.0)]
MIRROR = Matrix.Diagonal((1.0, -1.0, 1.0))
TURN = Matrix.Rotation(0.7, 3, "Z")
# For each: corners, UV map, convention, strength, and the normal that the floor should have.
FLOORS = {
    "square": (SQUARE, Matrix.Identity(3), "OPENGL", 1.0, Vector((0.5, 0.25, 0.75))),
    "face of six corners": (HEXAGON, Matrix.Identity(3), "OPENGL", 1.0, Vector((0.5, 0.25, 0.75))),
    "turned": (SQUARE, TURN, "OPENGL", 1.0, TURN.transposed() @ Vector((0.5, 0.25, 0.75))),
    "mirrored": (SQUARE, MIRROR, "OPENGL", 1.0, Vector((0.5, -0.25, 0.75))),
    "DirectX": (SQUARE, Matrix.Identity(3), "DIRECTX", 1.0, Vector((0.5, -0.25, 0.75))),
    "weak": (SQUARE, Matrix.Identity(3), "OPENGL", 0.5, Vector((0.25, 0.125, 0.875))),
    "strong": (SQUARE, Matrix.Identity(3), "OPENGL", 1.5, Vector((0.75, 0.375, 0.75))),
}


@pytest.mark.parametrize("name", FLOORS)
def test_map_of_one_color_is_a_plane_of_that_normal(name: str) -> None:
    """Numbers of 16 bits hold TILT. A strength multiplies what is along the surface; below 1 the rest goes that part from 1."""
    corners, turn, convention, strength, normal = FLOORS[name]
    shown = material("Oren-Nayar")
    node = map_normals(shown, flat())
    node.convention, node.inputs["Strength"].default_value = convention, strength
    scene = empty_scene()
    add(scene, placed(corners, turn, shown))
    camera(scene, Vector((0.2, -0.5, 2.0)), Vector())
    light = Vector((0.3, 0.2, 1.0)).normalized()
    add_light(scene, "SUN", looking(light, Vector()), energy=1.0, angle=0.0, use_shadow=False)
    eye, n = scene.camera.matrix_world.translation, tuple(normal.normalized())
    model = FORMULAS["Oren-Nayar"][0]
    views = [tuple((eye - at).normalized()) for at in floor_points(scene)]
    expected = [model.radiance(n, tuple(light), v, color) for v in views for color in COLOR]
    assert rms_error(drawn(scene), expected) < 2.0 * ROUND


# A graphics driver in software filters textures to 8 bits: normals are off by up to 1 / 255 along each axis, and N.L, whose RMS is
# 0.7 or more here, by up to sqrt(3) / 255.
FILTERED = math.sqrt(3.0) / (255.0 * 0.7)


@pytest.mark.parametrize("scale", ((1.0, 1.0, 1.0), (-1.2, 0.6, 0.8)))
def test_bumpy_square_is_as_in_cycles(scale: tuple[float, float, float]) -> None:
    shown = material("Lambert")
    map_normals(shown, bumpy())
    scene = empty_scene(48)
    turn = Matrix.Rotation(0.3, 4, "X") @ Matrix.Diagonal((*scale, 1.0))
    mesh = placed([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.2), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.3)], TURN, shown)
    mesh.shade_smooth()
    add(scene, mesh, turn)
    camera(scene, Vector((0.2, -0.5, 3.0)), Vector(), 120.0)
    add_light(scene, "SUN", looking(Vector((1.0, -0.5, 2.0)), Vector()), energy=3.0, angle=0.0, use_shadow=False)
    assert rms_error(drawn(scene), drawn(scene, engines.CYCLES)) < FILTERED


def test_bumpy_ball_is_as_in_cycles() -> None:
    """Its front, of faces of four corners, with tangents that turn within them."""
    shown = material("Lambert")
    map_normals(shown, bumpy())
    mesh, solid = bpy.data.meshes.new("Ball"), bmesh.new()
    bmesh.ops.create_uvsphere(solid, u_segments=16, v_segments=8, radius=1.0, calc_uvs=True)
    solid.to_mesh(mesh)
    solid.free()
    for place, corner in zip(mesh.uv_layers.new(name="UVMap").uv, mesh.loops, strict=True):
        x, y, z = mesh.vertices[corner.vertex_index].co
        place.vector = (math.atan2(x, -y) / math.pi, z)
    mesh.shade_smooth()
    mesh.materials.append(shown)
    scene = empty_scene(48)
    add(scene, mesh)
    camera(scene, Vector((0.1, -4.0, 0.1)), Vector(), 160.0)
    add_light(scene, "SUN", looking(Vector((1.0, -2.0, 1.0)), Vector()), energy=3.0, angle=0.0, use_shadow=False)
    assert rms_error(drawn(scene), drawn(scene, engines.CYCLES)) < FILTERED


def test_no_light_comes_through_a_surface_whose_normal_is_turned_towards_it() -> None:
    shown = material("Lambert")
    map_normals(shown, flat((1.0, 0.5, 0.5)))  # along x
    scene = empty_scene(8)
    add(scene, placed(SQUARE, Matrix.Identity(3), shown))
    camera(scene, Vector((0.5, 0.0, 2.0)), Vector((0.5, 0.0, 0.0)))
    light = add_light(scene, "SUN", looking(Vector((1.0, 0.0, -0.5)), Vector()), energy=3.0, angle=0.0, use_shadow=False)
    assert max(drawn(scene)) == 0.0
    light.matrix_world = looking(Vector((1.0, 0.0, 0.5)), Vector())
    assert min(drawn(scene)) > 0.0


def tilted_floor(shown: bpy.types.Material) -> bpy.types.Scene:
    """Return a scene of a white floor, whose radiance is N.L."""
    shown.use_fake_user = True
    return floor(shown, placed(SQUARE, Matrix.Identity(3), shown))


def test_normals_of_other_materials_are_mapped() -> None:
    principled = bpy.data.materials.new("Principled")
    node = next(node for node in principled.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value, node.inputs["Specular IOR Level"].default_value = (1.0, 1.0, 1.0, 1.0), 0.0
    map_normals(principled, flat(), node.name)
    assert drawn(tilted_floor(principled))[36] == pytest.approx(Vector((0.5, 0.25, 0.75)).normalized().z, rel=ROUND)


@pytest.mark.parametrize(("name", "value"), [("uv_map", "Another"), ("space", "WORLD"), ("space", "OBJECT")])
def test_map_of_another_space_or_mesh_is_as_in_cycles(name: str, value: str) -> None:
    shown = materials.create("White", ROUGH_DIFFUSE, Color=(1.0, 1.0, 1.0, 1.0), Model="Lambert")
    setattr(map_normals(shown, flat()), name, value)
    scene = tilted_floor(shown)
    assert drawn(scene)[36] == pytest.approx(drawn(scene, engines.CYCLES)[36], rel=ROUND)
