# SPDX-License-Identifier: GPL-3.0-or-later
"""Realtime's light of a world that varies against Cycles: each model on a sphere under skies with a sun, and under an even one.

And what metal and a coat reflect of it, as they are rough.
"""

import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, partial

import bpy

from mathutils import Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import MODELS, Model, ReflectanceModel
from true_diffuse.addon.models.registry import IOR
from true_diffuse.addon.models.vector import Vector as Triple
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.scenes.sphere import COLOR, SphereUnderSun
from true_diffuse.scripts.studies.study import Step, Table, pivot

ROUGHNESS = 0.33
NOISELESS, QUICK_NOISELESS = 1024, 256  # Cycles' samples
SAMPLES = (1, 16)  # Realtime's
DIRECTIONS, EVERY = 512, 5  # of the sum over the sky, and of the pixels it is made for
GOLDEN_RATIO = 0.618033988749895
SUN_ELEVATION, SUN_ROTATION = math.radians(35.0), math.radians(140.0)  # of the Sky Texture
DUSK_ELEVATION = -2.0  # degrees
SKY_STRENGTH = 0.1
IMAGE_WIDTH = 256  # pixels around
SUN_PIXEL, SUN_RADIANCE = (96, 96), (3e4, 2.7e4, 2e4)  # 45 degrees high; it shines as much as the rest of the image, three times
GROUND, ZENITH, HORIZON = (0.2, 0.15, 0.1), (0.3, 0.4, 0.7), (0.3, 0.3, 0.0)
GLOSSY = {
    **{f"Metal, roughness {rough}": {"Metallic": 1.0, "Roughness": rough} for rough in (0.1, 0.3, 0.6, 1.0)},
    "Specular, roughness 0.3": {"Roughness": 0.3},
    "Coat, roughness 0.1": {"Roughness": 1.0, "Specular IOR Level": 0.0, "Coat Weight": 1.0, "Coat Roughness": 0.1},
}
"""Inputs of a Principled BSDF."""


def sky_texture() -> bpy.types.World:
    """Return a world of Blender's default sky, with its sun."""
    world, background = _world("Sky Texture")
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = SUN_ELEVATION, SUN_ROTATION
    background.inputs["Strength"].default_value = SKY_STRENGTH
    world.node_tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    return world


def dusk() -> bpy.types.World:
    """Return a world of the sky just after the sun has set, without its disc."""
    world = sky_texture()
    sky = next(node for node in world.node_tree.nodes if node.type == "TEX_SKY")
    sky.sun_disc, sky.sun_elevation = False, math.radians(DUSK_ELEVATION)
    return world


def image() -> bpy.types.World:
    """Return a world of an image: a sky over brown ground, with a sun of one pixel."""
    world, background = _world("Image")
    height = IMAGE_WIDTH // 2
    made = bpy.data.images.new("Sky", IMAGE_WIDTH, height, float_buffer=True)
    pixels = array("f")
    for row in range(height):
        pixels.extend([*_row_color(row), 1.0] * IMAGE_WIDTH)
    column, row = SUN_PIXEL
    start = 4 * (row * IMAGE_WIDTH + column)
    pixels[start : start + 3] = array("f", SUN_RADIANCE)
    made.pixels.foreach_set(pixels)
    made.pack()
    texture = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = made
    world.node_tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    return world


def even() -> bpy.types.World:
    """Return a gray world."""
    return _world("Even")[0]


def image_radiance(direction: Triple) -> Triple:
    """Return the radiance of `image` without its sun; between rows of pixels it changes linearly."""
    height = IMAGE_WIDTH // 2
    place = height * (0.5 + math.asin(max(-1.0, min(direction[2], 1.0))) / math.pi) - 0.5
    low = max(0, min(math.floor(place), height - 2))
    share = max(0.0, min(place - low, 1.0))
    red, green, blue = (a + (b - a) * share for a, b in zip(_row_color(low), _row_color(low + 1), strict=True))
    return red, green, blue


@cache
def _row_color(row: int) -> Triple:
    """Return the color of a row of `image`, from below."""
    up = math.sin(math.pi * ((row + 0.5) / (IMAGE_WIDTH // 2) - 0.5))
    red, green, blue = (a + b * math.exp(-5.0 * up) for a, b in zip(ZENITH, HORIZON, strict=True)) if up > 0.0 else GROUND
    return red, green, blue


def image_sun() -> tuple[Triple, Triple]:
    """Return the unit vector towards the sun of `image`, and its irradiance on a plane that faces it [W/m^2]."""
    column, row = SUN_PIXEL
    up, around = math.pi * ((row + 0.5) / (IMAGE_WIDTH // 2) - 0.5), math.tau * (0.5 - (column + 0.5) / IMAGE_WIDTH)
    size = (math.tau / IMAGE_WIDTH) ** 2 * math.cos(up)  # sr
    red, green, blue = (size * (sun - sky) for sun, sky in zip(SUN_RADIANCE, _row_color(row), strict=True))
    return (math.cos(up) * math.cos(around), math.cos(up) * math.sin(around), math.sin(up)), (red, green, blue)


def from_formula(formula: Model, normal: Triple, view: Triple) -> Triple:
    """Return what a `formula` makes of `image` in COLOR, summed over DIRECTIONS as dense as the cosine; unit vectors."""
    toward, irradiance = image_sun()
    across = Vector(normal).orthogonal().normalized()
    beside = Vector(normal).cross(across)
    sums = [e * formula.radiance(normal, toward, view, color) for e, color in zip(irradiance, COLOR, strict=False)]
    for k in range(DIRECTIONS):
        height, angle = (k + 0.5) / DIRECTIONS, math.tau * k * GOLDEN_RATIO
        flat, up = math.sqrt(height), math.sqrt(1.0 - height)
        light = tuple(flat * math.cos(angle) * across + flat * math.sin(angle) * beside + up * Vector(normal))
        radiance = image_radiance(light)
        for channel in range(3):
            part = formula.radiance(normal, light, view, COLOR[channel]) / up
            sums[channel] += math.pi / DIRECTIONS * part * radiance[channel]
    red, green, blue = sums
    return red, green, blue


def _world(name: str) -> tuple[bpy.types.World, bpy.types.Node]:
    """Return a world of one Background, and that."""
    world = bpy.data.worlds.new(name)
    nodes = world.node_tree.nodes
    nodes.clear()
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    world.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    return world, background


WORLDS: Mapping[str, Callable[[], bpy.types.World]] = {
    "sky texture": sky_texture,
    "dusk": dusk,
    "image": image,
    "even": even,
}


def steps(sphere: SphereUnderSun, quick: bool) -> list[Step]:
    """Return steps that yield Realtime's RMS difference from Cycles, which has the models in Open Shading Language."""
    sphere.scene.cycles.shading_system = compiles_osl()
    made = cache(lambda name: WORLDS[name]())
    pixels = [pixel for pixel, good in enumerate(sphere.surface().measurable) if good]

    def differences(name: str, surface: str, material: bpy.types.Material) -> Iterator[Record]:
        _, expected = sphere.radiance(material, [], made(name), engines.CYCLES, QUICK_NOISELESS if quick else NOISELESS)
        for samples in SAMPLES:
            _, got = sphere.radiance(material, [], made(name), engines.REALTIME, samples)
            rms = error.difference(got, expected, pixels)
            yield {"world": name, "model": surface, "samples": samples, "rms_difference": rms}

    def measure(name: str, model: str) -> Iterator[Record]:
        parameter = MODELS[model].parameter
        shape = {parameter.socket: parameter.usual if parameter is IOR else ROUGHNESS} if parameter else {}
        material = materials.create(model, ROUGH_DIFFUSE, Color=COLOR, Model=MODELS[model].label, **shape)
        yield from differences(name, model, material)
        if name == "image":
            _, got = sphere.radiance(material, [], made(name), engines.REALTIME, SAMPLES[-1])
            yield {"world": name, "model": model, "samples": SAMPLES[-1], "rms_error": error_of(got, MODELS[model], shape)}

    def error_of(got: array[float], model: ReflectanceModel, shape: Mapping[str, float]) -> float:
        """Return the RMS error of some pixels of a picture, from the formula itself."""
        surface, eye = sphere.surface(), sphere.scene.camera.matrix_world.translation
        some = pixels[::EVERY]
        expected = array("f", bytes(4 * len(got)))
        for pixel in some:
            channels = slice(3 * pixel, 3 * pixel + 3)
            normal, view = Vector(surface.normal[channels]).normalized(), (eye - Vector(surface.position[channels])).normalized()
            expected[channels] = array("f", from_formula(model.reference(shape), tuple(normal), tuple(view)))
        return error.difference(got, expected, some)

    def measure_gloss(name: str, surface: str) -> Iterator[Record]:
        material = bpy.data.materials.new(surface)
        node = material.node_tree.nodes["Principled BSDF"]
        node.inputs["Base Color"].default_value = COLOR
        for socket, value in GLOSSY[surface].items():
            node.inputs[socket].default_value = value
        yield from differences(name, surface, material)

    of_models = ["image"] if quick else [name for name in WORLDS if name != "dusk"]
    of_gloss = ["dusk"] if quick else [name for name in WORLDS if name != "image"]  # whose sun of one pixel has corners
    models = [Step(f"{name}  {model}", partial(measure, name, model)) for name in of_models for model in MODELS]
    return models + [Step(f"{name}  {surface}", partial(measure_gloss, name, surface)) for name in of_gloss for surface in GLOSSY]


def table(records: Sequence[Record]) -> Table:
    """Return the differences, a row for each model and world, a column for each number of samples, and one of formulas."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        return f"{100.0 * one.get('rms_difference', one.get('rms_error')):.2f} %"

    def row(one: Record) -> tuple[str, ...]:
        surface = one["model"]
        return MODELS[surface].label if surface in MODELS else surface, one["world"]

    def column(one: Record) -> str:
        return f"{one['samples']} samples" if "rms_difference" in one else "from the formula"

    return pivot(records, ("Surface", "World"), row, column, cell)
