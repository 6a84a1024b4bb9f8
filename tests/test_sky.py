# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Sky Texture in the realtime engine, and its sun as a light, against Cycles' own render of the world."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import replace

import bpy

import pytest
from mathutils import Matrix

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material.expression import Coordinate, Image, ImageTexture, SkyTexture, apply, walk
from true_diffuse.addon.material.links import Place
from true_diffuse.addon.material.read_nodes import NodeReader, UnsupportedInput
from true_diffuse.addon.material.sky import Atmosphere, Sky, Sun, SunDisc
from true_diffuse.addon.material.suns import DIRECTION, without_suns
from true_diffuse.addon.measure import render
from true_diffuse.addon.models.vector import from_polar
from true_diffuse.addon.usd.expressions import Writer
from true_diffuse.addon.usd.files import Unsupported
from true_diffuse.addon.usd.network import Network
from true_diffuse.scripts.studies.glsl_values import evaluate

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("registered", "driver", "empty_file")]

WIDTH, HEIGHT = 64, 32  # pixels of a sky, all around
# Nodes' settings. The first is as Blender adds the node.
SKIES: dict[str, dict[str, object]] = {
    "new": {},
    "noon": {"sun_elevation": 1.3, "sun_rotation": 2.5},
    "sunset": {"sun_elevation": 0.02, "sun_rotation": -1.0},
    "night": {"sun_elevation": -0.12, "sun_rotation": 4.0},
    "mountain": {"sun_elevation": 0.4, "altitude": 9000.0, "ozone_density": 3.0},
    "dusty": {"sun_elevation": 2.6, "aerosol_density": 8.0, "air_density": 1.7},
    "once": {"sky_type": "SINGLE_SCATTERING"},
    "sunset once": {"sky_type": "SINGLE_SCATTERING", "sun_elevation": 0.02, "altitude": 3000.0},
    "preetham": {"sky_type": "PREETHAM", "sun_direction": (0.6, -0.64, 0.48), "turbidity": 5.0},
    "preetham at sunset": {"sky_type": "PREETHAM", "sun_direction": (-1.0, 0.0, 0.0)},
}
SUNS: dict[str, dict[str, object]] = {
    "new": {},
    "rising": {"sun_elevation": 0.001, "sun_intensity": 0.5},
    "large": {"sun_size": 0.6, "sun_elevation": 0.5, "sun_rotation": -0.7},
    "rising once": {"sky_type": "SINGLE_SCATTERING", "sun_elevation": 0.001, "altitude": 2000.0},
}
WHOLE = (-math.pi, math.pi, -math.pi / 2.0, math.pi / 2.0)  # longitudes from +Y, growing towards +X, and latitudes

type Range = tuple[float, float, float, float]


def add_sky(tree: bpy.types.NodeTree, settings: dict[str, object]) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeTexSky")
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def cycles(settings: dict[str, object], shown: Range = WHOLE) -> array[float]:
    """Return Cycles' picture of the directions `shown` of a world, as a map of longitude and latitude."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    scene.world.cycles.sampling_method = "NONE"  # of a sky that lights nothing
    tree = scene.world.node_tree
    tree.links.new(add_sky(tree, settings).outputs["Color"], tree.nodes["Background"].inputs["Color"])
    data = bpy.data.cameras.new("Panorama")
    data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
    data.longitude_min, data.longitude_max, data.latitude_min, data.latitude_max = shown
    camera = bpy.data.objects.new("Panorama", data)
    camera.matrix_world = Matrix.Rotation(math.pi / 2.0, 4, "X")
    scene.collection.objects.link(camera)
    return picture(scene, camera, engines.CYCLES)


def picture(scene: bpy.types.Scene, camera: bpy.types.Object, engine: engines.Engine) -> array[float]:
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y, scene.render.filter_size = WIDTH, HEIGHT, 0.0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", render.CENTER
    return render.radiance(scene, engine, 1)[1]


def realtime(settings: dict[str, object], shown: Range = WHOLE) -> array[float]:
    """Return the realtime engine's picture of a square that emits the sky as `cycles` shows it."""
    material = bpy.data.materials.new("Sky")
    tree = material.node_tree
    tree.nodes.clear()

    def add(kind: str, *inputs: object, **properties: object) -> bpy.types.Node:
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in properties.items():
            setattr(node, name, value)
        for socket, value in zip(node.inputs, inputs, strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node

    def calculate(operation: str, *inputs: object) -> bpy.types.NodeSocket:
        return add("Math", *inputs, operation=operation).outputs[0]

    place = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], place.inputs[0])
    left, right, bottom, top = shown
    longitude = calculate("MULTIPLY_ADD", place.outputs["X"], (right - left) / 2.0, (left + right) / 2.0)
    latitude = calculate("MULTIPLY_ADD", place.outputs["Z"], top - bottom, (bottom + top) / 2.0)
    flat = calculate("COSINE", latitude)
    x, y = (calculate("MULTIPLY", calculate(function, longitude), flat) for function in ("SINE", "COSINE"))
    direction = add("CombineXYZ", x, y, calculate("SINE", latitude))
    sky = add_sky(tree, settings)
    tree.links.new(direction.outputs[0], sky.inputs["Vector"])
    add("OutputMaterial", add("Emission", sky.outputs["Color"]).outputs[0])
    mesh = bpy.data.meshes.new("Square")
    mesh.from_pydata([(-1.0, 0.0, -0.5), (1.0, 0.0, -0.5), (1.0, 0.0, 0.5), (-1.0, 0.0, 0.5)], [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", 2.0
    camera = bpy.data.objects.new("Camera", data)
    camera.matrix_world = Matrix.Translation((0.0, -1.0, 0.0)) @ Matrix.Rotation(math.pi / 2.0, 4, "X")
    scene, square = bpy.context.scene, bpy.data.objects.new("Square", mesh)
    for item in (camera, square):
        scene.collection.objects.link(item)
    made = picture(scene, camera, engines.REALTIME)
    bpy.data.objects.remove(square)
    return made


def relative_error(got: Sequence[float], expected: Sequence[float]) -> float:
    """Return the RMS difference over the RMS of what is expected."""
    differences = [a - b for a, b in zip(got, expected, strict=True)]
    return math.sqrt(math.sumprod(differences, differences) / math.sumprod(expected, expected))


@pytest.mark.parametrize("name", SKIES)
def test_sky_is_that_of_cycles(name: str) -> None:
    """Both look up a table of 32-bit floats of the same texels, of which the driver's functions have errors of some 1e-5."""
    settings = SKIES[name] | {"sun_disc": False}
    assert relative_error(realtime(settings), cycles(settings)) < 5e-4


def sky_of(settings: dict[str, object]) -> Sky:
    """Return the sky that a node with these settings is read as."""
    node = add_sky(bpy.data.materials.new("Read").node_tree, settings)
    expression = NodeReader().expression(Place(node.outputs["Color"]))
    assert isinstance(expression, SkyTexture) and expression.direction == Coordinate("generated")
    return expression.sky


def around(sun: Sun) -> Range:
    """Return a range of directions around a sun, each pixel as high as wide in its middle."""
    x, y, z = sun.direction
    longitude, latitude = math.atan2(x, y), math.asin(z)
    across, up = 0.505 * sun.diameter * WIDTH / HEIGHT / math.cos(latitude), 0.505 * sun.diameter
    return longitude - across, longitude + across, latitude - up, latitude + up


@pytest.mark.parametrize("name", SUNS)
def test_sun_is_that_of_cycles(name: str) -> None:
    """Its light, of which the pixels at the edge of the disc leave 0.2 % uncertain, and its picture, where they may be off."""
    sky = sky_of(SUNS[name])
    sun = sky.sun()
    assert sun and sky.disc
    left, right, bottom, top = shown = around(sun)
    pairs = zip(cycles(SUNS[name], shown), cycles(SUNS[name] | {"sun_disc": False}, shown), strict=True)
    disc = [whole - air for whole, air in pairs]
    latitudes = [top - (row + 0.5) / HEIGHT * (top - bottom) for row in range(HEIGHT)]
    longitudes = [left + (column + 0.5) / WIDTH * (right - left) for column in range(WIDTH)]
    pixel = (right - left) * (top - bottom) / (WIDTH * HEIGHT)  # solid angle at the horizon
    areas = [math.cos(latitude) * pixel for latitude in latitudes for _ in longitudes]
    light = [math.sumprod(areas, disc[channel::3]) for channel in range(3)]
    assert sun.irradiance == pytest.approx(light, rel=3e-3)
    directions = [from_polar(math.sin(up), math.pi / 2.0 - across) for up in latitudes for across in longitudes]
    place = (sky.atmosphere.sun_elevation, sky.disc.diameter, sky.lowest_elevation)
    numbers = ", ".join(f"vec3{value}" for value in (place, *sky.disc_ends))
    drawn = evaluate("realtime/sky", f"rgb_of_xyz(sun_xyz(a.xyz, {sky.sun_rotation}, {numbers}))", [(one,) for one in directions])
    assert relative_error([value for color in drawn for value in color], disc) < 5e-3


def test_sun_that_does_not_show_is_no_light() -> None:
    below = {"sun_elevation": -0.03}
    assert sky_of(below).sun() is None
    assert sky_of({"sun_disc": False}).sun() is None
    assert sky_of(below | {"altitude": 20000.0}).sun()  # from where the ground begins at -0.08
    assert sky_of(below | {"altitude": 20000.0, "sky_type": "SINGLE_SCATTERING"}).sun() is None  # as Blender has it


def test_sun_is_placed_as_blender_wraps_its_angles() -> None:
    for elevation in (-7.0, -3.0, -1.6, 0.3, 1.6, 3.0, 5.0, 9.0):
        sky = sky_of({"sun_elevation": elevation, "sun_rotation": 0.4})
        assert -math.pi / 2.0 <= sky.atmosphere.sun_elevation <= math.pi / 2.0
        flat = math.cos(elevation)
        expected = flat * math.sin(0.4), flat * math.cos(0.4), math.sin(elevation)
        assert sky.sun_direction == pytest.approx(expected, abs=1e-6)


def test_mapping_turns_a_sky_without_its_sun() -> None:
    """Blender takes the sky's direction from nobody while it shows the sun."""
    tree = bpy.data.materials.new("Mapped").node_tree
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 1.0)
    for has_sun in (False, True):
        node = add_sky(tree, {"sun_disc": False})
        tree.links.new(mapping.outputs[0], node.inputs[0])
        node.sun_disc = has_sun
        expression = NodeReader().expression(Place(node.outputs["Color"]))
        assert isinstance(expression, SkyTexture)
        assert (expression.direction == Coordinate("generated")) == has_sun


def test_hosek_and_wilkie_is_refused() -> None:
    with pytest.raises(UnsupportedInput, match="Hosek/Wilkie"):
        NodeReader().expression(Place(add_sky(bpy.data.materials.new("Read").node_tree, {"sky_type": "HOSEK_WILKIE"}).outputs[0]))


def test_materialx_has_no_sky() -> None:
    texture = SkyTexture(sky_of({}), Coordinate("position"), "My Sky")
    with pytest.raises(Unsupported, match="sky") as problem:
        Writer(Network("MaterialX_"), {}).color(texture)
    assert problem.value.node == "My Sky"


# ---- the suns of a world's radiance

SUNNY = SkyTexture(Sky(Atmosphere(True, 0.3, 100.0, 1.0, 1.0, 1.0), 0.5, SunDisc(0.01, 1.0)), DIRECTION)
SUNLESS = SkyTexture(replace(SUNNY.sky, disc=None), DIRECTION)


def sun_of(texture: SkyTexture) -> Sun:
    found = texture.sky.sun()
    assert found
    return found


def test_sun_of_a_radiance_is_scaled_as_its_sky() -> None:
    tinted = apply("add", apply("multiply", SUNNY, (0.5, 0.25, 2.0)), (3.0, 3.0, 3.0))
    rest, (sun,) = without_suns(tinted)
    assert rest == apply("add", apply("multiply", SUNLESS, (0.5, 0.25, 2.0)), (3.0, 3.0, 3.0))
    own = sun_of(SUNNY)
    assert (sun.direction, sun.diameter) == (own.direction, own.diameter)
    expected = [a * b for a, b in zip(own.radiance, (0.5, 0.25, 2.0), strict=True)]
    assert sun.radiance == pytest.approx(expected)


def test_suns_of_two_skies_are_two_lights() -> None:
    other = replace(SUNNY, sky=replace(SUNNY.sky, sun_rotation=2.0))
    rest, suns = without_suns(apply("mix", SUNNY, other, 0.25))
    assert not [one for one in walk(rest) if isinstance(one, SkyTexture) and one.sky.disc]
    assert [sun.radiance for sun in suns] == [
        pytest.approx([share * value for value in sun_of(texture).radiance]) for texture, share in ((SUNNY, 0.75), (other, 0.25))
    ]


def test_sun_behind_what_depends_on_direction_is_seen_in_its_own() -> None:
    upper = apply("multiply", SUNNY, apply("greater_than", apply("z", DIRECTION), 0.0))
    assert without_suns(upper)[1] == [sun_of(SUNNY)]
    lower = apply("multiply", SUNNY, apply("less_than", apply("z", DIRECTION), 0.0))
    assert without_suns(lower) == (apply("multiply", SUNLESS, apply("less_than", apply("z", DIRECTION), 0.0)), [])


def test_sun_behind_an_image_stays() -> None:
    clouds = apply("multiply", SUNNY, ImageTexture(Image("Clouds", "sRGB", is_data=False), DIRECTION))
    assert without_suns(clouds) == (clouds, [])
