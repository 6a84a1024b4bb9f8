# SPDX-License-Identifier: GPL-3.0-or-later
"""Realtime's light of a world that varies against Cycles: each model on a sphere under skies with a sun, and under an even one."""

import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, partial

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.models.registry import IOR
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.scenes.sphere import COLOR, SphereUnderSun
from true_diffuse.scripts.studies.study import Step, Table, pivot

ROUGHNESS = 0.33
NOISELESS, QUICK_NOISELESS = 1024, 256  # Cycles' samples
SAMPLES = (1, 16, 64)  # Realtime's
SUN_ELEVATION, SUN_ROTATION = math.radians(35.0), math.radians(140.0)  # of the Sky Texture
SKY_STRENGTH = 0.1
IMAGE_WIDTH = 256  # pixels around
SUN_PIXEL, SUN_RADIANCE = (96, 96), (3e4, 2.7e4, 2e4)  # 45 degrees high; it shines as much as the rest of the image, three times
GROUND, ZENITH, HORIZON = (0.2, 0.15, 0.1), (0.3, 0.4, 0.7), (0.3, 0.3, 0.0)


def sky_texture() -> bpy.types.World:
    """Return a world of Blender's default sky, with its sun."""
    world, background = _world("Sky Texture")
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = SUN_ELEVATION, SUN_ROTATION
    background.inputs["Strength"].default_value = SKY_STRENGTH
    world.node_tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    return world


def image() -> bpy.types.World:
    """Return a world of an image: a sky over brown ground, with a sun of one pixel."""
    world, background = _world("Image")
    height = IMAGE_WIDTH // 2
    made = bpy.data.images.new("Sky", IMAGE_WIDTH, height, float_buffer=True)
    pixels = array("f")
    for row in range(height):
        up = math.sin(math.pi * ((row + 0.5) / height - 0.5))
        color = [a + b * math.exp(-5.0 * up) for a, b in zip(ZENITH, HORIZON, strict=True)] if up > 0.0 else GROUND
        pixels.extend([*color, 1.0] * IMAGE_WIDTH)
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


def _world(name: str) -> tuple[bpy.types.World, bpy.types.Node]:
    """Return a world of one Background, and that."""
    world = bpy.data.worlds.new(name)
    nodes = world.node_tree.nodes
    nodes.clear()
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    world.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    return world, background


WORLDS: Mapping[str, partial[bpy.types.World]] = {
    "sky texture": partial(sky_texture),
    "image": partial(image),
    "even": partial(even),
}


def steps(sphere: SphereUnderSun, quick: bool) -> list[Step]:
    """Return steps that yield Realtime's RMS difference from Cycles, which has the models in Open Shading Language."""
    sphere.scene.cycles.shading_system = compiles_osl()
    made = cache(lambda name: WORLDS[name]())
    pixels = [pixel for pixel, good in enumerate(sphere.surface().measurable) if good]

    def measure(name: str, model: str) -> Iterator[Record]:
        shape = {"Roughness": ROUGHNESS} if MODELS[model].parameter not in (None, IOR) else {}
        material = materials.create(model, ROUGH_DIFFUSE, Color=COLOR, Model=MODELS[model].label, **shape)
        _, expected = sphere.radiance(material, [], made(name), engines.CYCLES, QUICK_NOISELESS if quick else NOISELESS)
        for samples in SAMPLES:
            _, got = sphere.radiance(material, [], made(name), engines.REALTIME, samples)
            rms = error.difference(got, expected, pixels)
            yield {"world": name, "model": model, "samples": samples, "rms_difference": rms}

    worlds = list(WORLDS)[:1] if quick else WORLDS
    return [Step(f"{name}  {model}", partial(measure, name, model)) for name in worlds for model in MODELS]


def table(records: Sequence[Record]) -> Table:
    """Return the differences, a row for each model and world and a column for each number of samples."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        return f"{100.0 * one['rms_difference']:.2f} %"

    def row(one: Record) -> tuple[str, ...]:
        return MODELS[one["model"]].label, one["world"]

    return pivot(records, ("Model", "World"), row, lambda one: f"{one['samples']} samples", cell)
