# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime engine's worlds of nodes and images: what the camera sees against Cycles, what surfaces reflect by closed forms."""

import math
from array import array
from collections.abc import Callable, Sequence

import bpy

import gpu
import pytest
from mathutils import Euler, Matrix, Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.addon.realtime import driver
from true_diffuse.addon.realtime.lights import Light
from true_diffuse.addon.realtime.renderer import Renderer
from true_diffuse.addon.realtime.scene_cache import SceneCache
from true_diffuse.addon.realtime.world_maps import WorldMaps
from true_diffuse.scenes.elements import add

pytestmark = [pytest.mark.render, pytest.mark.usefixtures("registered", "driver")]

SIZE = 16  # pixels
LOOKING = Euler((1.2, 0.3, 0.9))
WIDTH = 32  # pixels around an environment map

type Nodes = Callable[[bpy.types.ShaderNodeTree, bpy.types.NodeSocket], None]
"""Feeds an input of a world's output with nodes."""


@pytest.fixture
def scene() -> bpy.types.Scene:
    """Return a scene of a camera alone, whose samples are at the pixels' centers."""
    scene = bpy.context.scene
    settings = scene.render
    settings.resolution_x = settings.resolution_y = SIZE
    settings.film_transparent, settings.filter_size = False, 0.0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", render.CENTER
    data = bpy.data.cameras.new("Camera")
    data.lens, data.ortho_scale = 12.0, 2.0  # 113 degrees
    scene.camera = add(scene, "Camera", data, Matrix.Translation((1.0, 2.0, 3.0)) @ LOOKING.to_matrix().to_4x4())
    scene.world = bpy.data.worlds.new("World")
    scene.world.node_tree.nodes.clear()
    return scene


def feed(world: bpy.types.World, nodes: Nodes) -> None:
    tree = world.node_tree
    tree.nodes.clear()
    nodes(tree, tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])


def linked(tree: bpy.types.ShaderNodeTree, kind: str, *chain: bpy.types.NodeSocket) -> bpy.types.Node:
    """Return a new node whose first inputs are fed by `chain`."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for socket, source in zip((socket for socket in node.inputs if socket.enabled), chain, strict=False):
        tree.links.new(source, socket)
    return node


def shine(tree: bpy.types.ShaderNodeTree, color: bpy.types.NodeSocket, surface: bpy.types.NodeSocket) -> bpy.types.Node:
    background = linked(tree, "Background", color)
    tree.links.new(background.outputs[0], surface)
    return background


def picture(name: str, pixels: Sequence[float], width: int) -> bpy.types.Image:
    """Return an image of floats, of red, green and blue from below."""
    made = bpy.data.images.new(name, width, len(pixels) // (3 * width), float_buffer=True)
    made.pixels.foreach_set([value for k in range(0, len(pixels), 3) for value in (*pixels[k : k + 3], 1.0)])
    made.pack()
    return made


def checked() -> bpy.types.Image:
    """Return an image in which every pixel differs."""
    return picture("Checked", [0.1 + (7 * k % 23) / 23.0 for k in range(3 * WIDTH * WIDTH // 2)], WIDTH)


def coordinates(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """Feed a sum of all coordinates that depend on the direction alone, each with a weight of its own; an object's, too."""
    empty = bpy.data.objects.new("Empty", None)
    empty.matrix_world = Matrix.Translation((0.5, 0.1, 0.0)) @ Euler((0.5, 0.6, 0.7)).to_matrix().to_4x4()
    bpy.context.scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    texture, geometry, around = (linked(tree, name) for name in ("TexCoord", "NewGeometry", "TexCoord"))
    around.object = empty
    sources = [
        *(texture.outputs[name] for name in ("Generated", "Normal", "UV", "Object", "Reflection")),
        *(geometry.outputs[name] for name in ("Position", "Normal", "True Normal", "Incoming", "Backfacing")),
        around.outputs["Object"],
    ]
    total = None
    for index, source in enumerate(sources):
        weighted = tree.nodes.new("ShaderNodeVectorMath")
        weighted.operation = "MULTIPLY_ADD"
        tree.links.new(source, weighted.inputs[0])
        weighted.inputs[1].default_value = (math.sqrt(index + 2.0),) * 3
        if total is not None:
            tree.links.new(total, weighted.inputs[2])
        total = weighted.outputs[0]
    absolute = linked(tree, "VectorMath", total)
    absolute.operation = "ABSOLUTE"
    shine(tree, absolute.outputs[0], surface)


def images(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """Feed the sum of a turned environment map and a mirror ball."""
    mapping = linked(tree, "Mapping", linked(tree, "TexCoord").outputs["Generated"])
    mapping.inputs["Rotation"].default_value = (0.4, -0.2, 2.0)
    image, made = checked(), []
    for projection, interpolation in (("EQUIRECTANGULAR", "Linear"), ("MIRROR_BALL", "Cubic")):
        texture = linked(tree, "TexEnvironment", mapping.outputs[0])
        texture.image, texture.projection, texture.interpolation = image, projection, interpolation
        made.append(linked(tree, "Background", texture.outputs[0]).outputs[0])
    tree.links.new(linked(tree, "AddShader", *made).outputs[0], surface)


def mixed(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """A gradient for the camera, with a part of noise and an emission over it; nothing else for the rest."""
    noise = linked(tree, "TexNoise").outputs["Color"]
    background = linked(tree, "Background", noise)
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (0.1, 0.3, 0.2, 1.0), 1.5
    both = linked(tree, "AddShader", background.outputs[0], emission.outputs[0])
    blend = linked(tree, "SeparateXYZ", linked(tree, "TexCoord").outputs["Generated"])
    inner = linked(tree, "MixShader", blend.outputs["X"], both.outputs[0], linked(tree, "Background").outputs[0])
    unseen = tree.nodes.new("ShaderNodeBackground")
    unseen.inputs["Strength"].default_value = 9.0
    outer = linked(tree, "MixShader", linked(tree, "LightPath").outputs["Is Camera Ray"], unseen.outputs[0], inner.outputs[0])
    tree.links.new(outer.outputs[0], surface)


@pytest.mark.parametrize(("nodes", "camera"), [(coordinates, "PERSP"), (coordinates, "ORTHO"), (images, "PERSP"), (mixed, "PERSP")])
def test_background_is_that_of_cycles(scene: bpy.types.Scene, nodes: Nodes, camera: str) -> None:
    feed(scene.world, nodes)
    scene.camera.data.type = camera
    _, expected = render.radiance(scene, engines.CYCLES, 1)
    _, got = render.radiance(scene, engines.REALTIME, 1)
    # Cycles moves its rays by up to render.CENTER of a pixel: 1e-3 rad, by which the maps here change by up to 10 a radian
    assert list(got) == pytest.approx(list(expected), abs=0.01)


def test_film_and_visibility_hide_the_background(scene: bpy.types.Scene) -> None:
    feed(scene.world, gradient)
    scene.render.film_transparent = True
    assert max(render.radiance(scene, engines.REALTIME, 1)[1]) == 0.0
    scene.render.film_transparent = False
    scene.world.cycles_visibility.camera = False
    assert max(render.radiance(scene, engines.REALTIME, 1)[1]) == 0.0


# ---- what surfaces reflect


def facing(scene: bpy.types.Scene, shown: bpy.types.Material, tilt: float) -> Vector:
    """Add a square before the camera, turned away from it by `tilt` [rad]; return its normal."""
    mesh = bpy.data.meshes.new("Square")
    corners = [(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(shown)
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 0.1
    place = scene.camera.matrix_world @ Matrix.Translation((0.0, 0.0, -2.0)) @ Matrix.Rotation(tilt, 4, "X")
    add(scene, "Square", mesh, place)
    return place.to_3x3() @ Vector((0.0, 0.0, 1.0))


def rough(model: str, color: float = 0.8) -> bpy.types.Material:
    return materials.create(model, ROUGH_DIFFUSE, Color=(color, color, color, 1.0), Model=MODELS[model].label, Roughness=0.5)


def gradient(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """Feed the radiance 1 + z of the direction."""
    height = linked(tree, "SeparateXYZ", linked(tree, "TexCoord").outputs["Generated"]).outputs["Z"]
    shine(tree, linked(tree, "Math", height).outputs[0], surface)
    next(node for node in tree.nodes if node.type == "MATH").inputs[1].default_value = 1.0


def middle(pixels: array[float]) -> float:
    return pixels[3 * (SIZE * SIZE // 2 + SIZE // 2)]


def test_lambert_reflects_the_irradiance_of_a_gradient(scene: bpy.types.Scene) -> None:
    """The irradiance of 1 + z is pi (1 + 2/3 N.z)."""
    feed(scene.world, gradient)
    normal = facing(scene, rough("lambert"), 0.6)
    got = middle(render.radiance(scene, engines.REALTIME, 1)[1])
    # the map's texels are 3.6 degrees wide, and round to 11 bits
    assert got == pytest.approx(0.8 * (1.0 + 2.0 / 3.0 * normal.z), rel=1e-3)


@pytest.mark.parametrize("model", ["oren_nayar", "eon"])
def test_rough_models_reflect_a_gradient_by_their_own_lobe(scene: bpy.types.Scene, model: str) -> None:
    """The formula summed over the hemisphere; Lambert's shape of the same albedo would be 4 % and more away."""
    feed(scene.world, gradient)
    formula, color, tilt = MODELS[model].reference({"Roughness": 0.5}), 0.8, 1.2
    normal = facing(scene, rough(model, color), tilt)
    view = scene.camera.matrix_world.to_3x3() @ Vector((0.0, 0.0, 1.0))
    across = normal.orthogonal().normalized()
    axes = Matrix((across, normal.cross(across), normal)).transposed()
    total, steps = 0.0, 48
    for k in range(steps):
        for j in range(2 * steps):  # as dense as the cosine
            height, angle = (k + 0.5) / steps, math.pi * (j + 0.5) / steps
            flat, up = math.sqrt(height), math.sqrt(1.0 - height)
            light = axes @ Vector((flat * math.cos(angle), flat * math.sin(angle), up))
            total += (1.0 + light.z) * formula.radiance(tuple(normal), tuple(light), tuple(view), color) / up
    expected = total * math.pi / (2 * steps * steps)
    got = middle(render.radiance(scene, engines.REALTIME, 16)[1])
    assert got == pytest.approx(expected, rel=0.01)


def gray(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """Feed an image of a gray of 0.5."""
    texture = linked(tree, "TexEnvironment")
    texture.image = picture("Gray", [0.5] * (3 * 4 * 2), 4)
    shine(tree, texture.outputs[0], surface)


def even(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """Feed the same gray as a color."""
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    tree.links.new(background.outputs[0], surface)


def test_image_of_one_color_is_an_even_world(scene: bpy.types.Scene) -> None:
    """For a rough model, and for a coat and a sheen over metal, at a grazing view."""
    layered = bpy.data.materials.new("Layered")
    inputs = layered.node_tree.nodes["Principled BSDF"].inputs
    for name, value in (("Metallic", 0.5), ("Roughness", 0.4), ("Coat Weight", 0.7), ("Sheen Weight", 0.5)):
        inputs[name].default_value = value
    for shown in (rough("oren_nayar"), layered):
        facing(scene, shown, 1.3)
        feed(scene.world, gray)
        got = render.radiance(scene, engines.REALTIME, 2)[1]
        feed(scene.world, even)
        expected = render.radiance(scene, engines.REALTIME, 2)[1]
        bpy.data.objects.remove(bpy.data.objects["Square"])
        assert list(got) == pytest.approx(list(expected), rel=1e-3)  # 16-bit floats round to 5e-4


# ---- suns

SUN_WIDTH = 256  # pixels around the map
SUN_COLUMN, SUN_ROW = 30, 100  # of the pixel that is the sun
SUN = (4e4, 3e4, 2e4)
TURN = 0.5  # of what is looked up, against which the picture turns


def with_sun(tree: bpy.types.ShaderNodeTree, surface: bpy.types.NodeSocket) -> None:
    """Feed an image of 0.25 with a sun of one pixel, turned by a Mapping."""
    pixels = [0.25] * (3 * SUN_WIDTH * SUN_WIDTH // 2)
    start = 3 * (SUN_ROW * SUN_WIDTH + SUN_COLUMN)
    pixels[start : start + 3] = SUN
    mapping = linked(tree, "Mapping", linked(tree, "TexCoord").outputs["Generated"])
    mapping.inputs["Rotation"].default_value[2] = TURN
    texture = linked(tree, "TexEnvironment", mapping.outputs[0])
    texture.image = picture("Sun", pixels, SUN_WIDTH)
    shine(tree, texture.outputs[0], surface)


def suns() -> tuple[list[Light], WorldMaps]:
    """Return the lights of the scene, which are its world's suns, and that world's maps."""
    gpu.init()
    cache = SceneCache()
    cache.update(bpy.context.evaluated_depsgraph_get())
    maps = WorldMaps()
    maps.refresh(cache.environment, cache.has_glossy)
    return list(maps.suns), maps


def test_sun_of_an_image_becomes_a_light(scene: bpy.types.Scene) -> None:
    """The pixel's radiance fades linearly over two pixels, so that its irradiance is its radiance times its solid angle."""
    feed(scene.world, with_sun)
    (sun,), _ = suns()
    around, up = math.tau * ((SUN_COLUMN + 0.5) / SUN_WIDTH - 0.5), math.pi * (2.0 * (SUN_ROW + 0.5) / SUN_WIDTH - 0.5)
    around += TURN
    direction = Vector((math.cos(up) * math.cos(around), -math.cos(up) * math.sin(around), math.sin(up)))
    assert Vector(sun.axis).angle(direction) < math.radians(0.05)
    solid_angle = (math.tau / SUN_WIDTH) ** 2 * math.cos(up)
    # less the threshold of 10 of the 4e4, and by the sums over texels that are a few to a pixel
    assert sun.strength == pytest.approx([value * solid_angle for value in SUN], rel=0.01)


def test_radiance_from_directions_adds_up(scene: bpy.types.Scene) -> None:
    """Its mean over the sphere is that of the gradient, here without the sun."""
    feed(scene.world, gradient)
    _, maps = suns()
    count = 4096
    heights = [(2.0 * k + 1.0) / count - 1.0 for k in range(count)]
    circles = [(math.sqrt(1.0 - z * z), math.pi * (3.0 - math.sqrt(5.0)) * k, z) for k, z in enumerate(heights)]  # a spiral
    found = [maps.radiance(Vector((r * math.cos(turn), r * math.sin(turn), z)))[0] for r, turn, z in circles]
    assert math.fsum(found) / count == pytest.approx(1.0, rel=0.02)


def test_world_that_turns_compiles_nothing(scene: bpy.types.Scene) -> None:
    feed(scene.world, with_sun)
    facing(scene, rough("oren_nayar"), 0.5)
    gpu.init()
    cache = SceneCache()
    cache.update(bpy.context.evaluated_depsgraph_get())
    renderer = Renderer(cache)
    renderer.refresh()
    list(renderer.compile())
    before, lights = driver.compiled.cache_info().misses, list(cache.lights)
    mapping = next(node for node in scene.world.node_tree.nodes if node.type == "MAPPING")
    handler = bpy.app.handlers.depsgraph_update_post
    handler.append(lambda _scene, depsgraph: cache.update(depsgraph))
    mapping.inputs["Rotation"].default_value[2] = TURN + 1.0
    bpy.context.view_layer.update()
    handler.pop()
    assert renderer.refresh()
    list(renderer.compile())
    assert driver.compiled.cache_info().misses == before
    turned = Matrix.Rotation(-1.0, 3, "Z") @ Vector(lights[0].axis)
    assert Vector(cache.lights[0].axis).angle(turned) < math.radians(0.1)
