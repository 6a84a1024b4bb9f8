# SPDX-License-Identifier: GPL-3.0-or-later
"""The sphere under several lights and a sky, and how far EEVEE is from Cycles there."""

from collections.abc import Sequence

import bpy

from mathutils import Matrix

from true_diffuse.addon.blender import engines
from true_diffuse.addon.measure import error
from true_diffuse.scenes.elements import beside_viewer, towards
from true_diffuse.scenes.sphere import SphereUnderSun

AREA_POWER = 300.0  # W
NOISELESS = 512  # Cycles' samples under a sky: its noise is far below what the engines differ by


def between_engines(
    sphere: SphereUnderSun,
    material: bpy.types.Material,
    lights: Sequence[bpy.types.Object],
    sky: bpy.types.World | None,
    samples: int,
) -> tuple[float, float]:
    """Return EEVEE's seconds for `material` under `lights` and `sky`, with shadows, and its RMS difference from Cycles."""
    _, cycles = sphere.radiance(material, lights, sky, engines.CYCLES, NOISELESS)
    seconds, eevee = sphere.radiance(material, lights, sky, engines.EEVEE, samples)
    measurable = (i for i, good in enumerate(sphere.surface().measurable) if good)
    return seconds, error.difference(eevee, cycles, measurable)


def three_lights() -> list[bpy.types.Object]:
    """Return a warm sun, a blue point light and an area light from below, around the origin; in no scene."""
    lights = []
    for kind, position, energy, color in (
        ("SUN", (2.0, -2.0, 3.0), 1.5, (1.0, 0.9, 0.8)),
        ("POINT", (-3.0, -3.0, 1.0), 150.0, (0.6, 0.8, 1.0)),
        ("AREA", (0.5, -2.5, -3.0), 120.0, (1.0, 1.0, 0.9)),
    ):
        data = bpy.data.lights.new(kind.title(), kind)
        data.energy, data.color = energy, color
        if kind == "POINT":
            data.shadow_soft_size = 0.0
        elif kind == "AREA":
            data.size = 0.5
        light = bpy.data.objects.new(kind.title(), data)
        light.matrix_world = Matrix.Translation(position) @ towards(position)
        lights.append(light)
    return lights


def area_light(degrees: float, size: float, distance: float) -> bpy.types.Object:
    """Return a square area light, `size` [m] across, `distance` [m] from the origin, `degrees` beside the viewer; in no scene."""
    data = bpy.data.lights.new("Area", "AREA")
    data.energy, data.size = AREA_POWER, size
    light = bpy.data.objects.new("Area", data)
    light.matrix_world = beside_viewer(degrees) @ Matrix.Translation((0.0, 0.0, distance))
    return light


def sky(below: tuple[float, float, float], above: tuple[float, float, float], strength: float) -> bpy.types.World:
    """Return a sky whose color goes linearly with height from `below` to `above`: EEVEE's two bands of harmonics hold it."""
    world = bpy.data.worlds.new("Sky")
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    coordinates, split = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeSeparateXYZ")
    height, mix = nodes.new("ShaderNodeMapRange"), nodes.new("ShaderNodeMix")
    height.inputs["From Min"].default_value = -1.0
    mix.data_type = "RGBA"
    factor, low, high = (socket for socket in mix.inputs if socket.enabled)
    low.default_value, high.default_value = (*below, 1.0), (*above, 1.0)
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    background.inputs["Strength"].default_value = strength
    links.new(coordinates.outputs["Generated"], split.inputs[0])
    links.new(split.outputs["Z"], height.inputs["Value"])
    links.new(height.outputs[0], factor)
    links.new(next(socket for socket in mix.outputs if socket.enabled), background.inputs["Color"])
    links.new(background.outputs[0], output.inputs["Surface"])
    return world
