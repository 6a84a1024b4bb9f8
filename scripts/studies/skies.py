# SPDX-License-Identifier: GPL-3.0-or-later
"""Realtime's Sky Texture against Cycles: the picture of a sky all around, and the light of its sun."""

import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import bpy

from mathutils import Matrix

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material.expression import SkyTexture
from true_diffuse.addon.material.links import Place
from true_diffuse.addon.material.read_nodes import NodeReader
from true_diffuse.addon.material.sky import Sky, Sun
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.study import Step, Table

type Settings = Mapping[str, object]
type Range = tuple[float, float, float, float]
"""Of longitudes from +Y, growing towards +X, and of latitudes [rad]."""

WIDTH, HEIGHT = 64, 32  # pixels of a sky, all around
# Nodes' settings. The first is as Blender adds the node; what is "once" is scattered so.
SKIES: Mapping[str, Settings] = {
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
SUNS: Mapping[str, Settings] = {
    "new": {},
    "smallest": {"sun_size": 0.0},
    "rising": {"sun_elevation": 0.001, "sun_intensity": 0.5},
    "large": {"sun_size": 0.6, "sun_elevation": 0.5, "sun_rotation": -0.7},
    "rising once": {"sky_type": "SINGLE_SCATTERING", "sun_elevation": 0.001, "altitude": 2000.0},
}
WHOLE: Range = (-math.pi, math.pi, -math.pi / 2.0, math.pi / 2.0)


def add_sky(tree: bpy.types.NodeTree, settings: Settings) -> bpy.types.Node:
    node = tree.nodes.new("ShaderNodeTexSky")
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def cycles(settings: Settings, shown: Range = WHOLE) -> array[float]:
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


def realtime(settings: Settings, shown: Range = WHOLE) -> array[float]:
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


def sky_of(settings: Settings) -> Sky:
    """Return the sky that a node with these settings is read as. Raises TypeError for a type that has none."""
    node = add_sky(bpy.data.materials.new("Read").node_tree, settings)
    expression = NodeReader().expression(Place(node.outputs["Color"]))
    if not isinstance(expression, SkyTexture):
        raise TypeError(f"{settings!r} is no sky of scattered light")
    return expression.sky


def around(sun: Sun) -> Range:
    """Return a range of directions around a sun, each pixel as high as wide in its middle."""
    x, y, z = sun.direction
    longitude, latitude = math.atan2(x, y), math.asin(z)
    across, up = 0.505 * sun.diameter * WIDTH / HEIGHT / math.cos(latitude), 0.505 * sun.diameter
    return longitude - across, longitude + across, latitude - up, latitude + up


def directions(shown: Range) -> list[tuple[float, float]]:
    """Return longitude and latitude of the pixels' centers of a picture, rows from the top."""
    left, right, bottom, top = shown
    across = [left + (column + 0.5) / WIDTH * (right - left) for column in range(WIDTH)]
    return [(x, top - (row + 0.5) / HEIGHT * (top - bottom)) for row in range(HEIGHT) for x in across]


def disc(settings: Settings, shown: Range) -> array[float]:
    """Return what the sun adds to Cycles' picture of the sky."""
    pairs = zip(cycles(settings, shown), cycles({**settings, "sun_disc": False}, shown), strict=True)
    return array("f", (whole - air for whole, air in pairs))


def irradiance(picture: array[float], shown: Range) -> tuple[float, ...]:
    """Return the sum of a picture's radiance times solid angles, for each channel."""
    pixel = (shown[1] - shown[0]) * (shown[3] - shown[2]) / (WIDTH * HEIGHT)  # at the horizon
    areas = [math.cos(latitude) * pixel for _, latitude in directions(shown)]
    return tuple(math.sumprod(areas, picture[channel::3]) for channel in range(3))


def steps() -> list[Step]:
    """Return steps that yield Realtime's RMS difference of each sky, and the difference of each sun's light, in red."""

    def measure_sky(name: str) -> Iterator[Record]:
        settings = {**SKIES[name], "sun_disc": False}
        got, expected = realtime(settings), cycles(settings)
        yield {"sky": name, "rms_difference": error.difference(got, expected, range(WIDTH * HEIGHT))}

    def measure_sun(name: str) -> Iterator[Record]:
        sun = sky_of(SUNS[name]).sun()
        if sun is None:
            raise ValueError(f"the sky {name} shows no sun")
        shown = around(sun)
        expected = irradiance(disc(SUNS[name], shown), shown)
        yield {"sky": name, "sun_difference": sun.irradiance[0] / expected[0] - 1.0}

    return [
        *(Step(f"{name} sky", partial(measure_sky, name)) for name in SKIES),
        *(Step(f"{name} sun", partial(measure_sun, name)) for name in SUNS),
    ]


def table(records: Sequence[Record]) -> Table:
    """Return the differences of skies and of suns, a row for each."""
    rows: list[tuple[str, ...]] = []
    for kind, name in (("sky", "rms_difference"), ("sun", "sun_difference")):
        rows += [(kind, one["sky"], f"{100.0 * one[name]:.3f} %") for one in records if name in one]
    return ("", "Settings", "Difference"), rows
