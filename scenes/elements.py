# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects, suns and skies that the scenes have in common."""

import math
from collections.abc import Sequence

import bpy

from mathutils import Matrix, Vector

WHITE = (1.0, 1.0, 1.0)


def add(scene: bpy.types.Scene, name: str, data: bpy.types.ID | None, matrix: Matrix | None = None) -> bpy.types.Object:
    """Return a new object of `data`, an empty for None, linked to `scene` and placed by `matrix`."""
    item = bpy.data.objects.new(name, data)
    item.matrix_world = matrix or Matrix()
    scene.collection.objects.link(item)
    return item


def towards(direction: Sequence[float]) -> Matrix:
    """Return the rotation that turns +Z to `direction`, which has any length: that of a light shining from there."""
    return Vector(direction).to_track_quat("Z", "Y").to_matrix().to_4x4()


def beside_viewer(degrees: float) -> Matrix:
    """Return the rotation of a light that is `degrees` to the right of a camera looking along +Y."""
    angle = math.radians(degrees)
    return towards((math.sin(angle), -math.cos(angle), 0.0))


def add_sun(
    scene: bpy.types.Scene,
    name: str,
    direction: Sequence[float],
    irradiance: float,
    angle: float = 0.0,
    color: tuple[float, float, float] = WHITE,
) -> bpy.types.Object:
    """Return a new sun in `scene`: `direction` towards it, `irradiance` [W/m^2] on a plane facing it, `angle` [radians] across."""
    data = bpy.data.lights.new(name, "SUN")
    data.energy, data.angle, data.color = irradiance, angle, color
    return add(scene, name, data, towards(direction))


def uniform_world(name: str = "White", color: tuple[float, float, float] = WHITE, strength: float = 1.0) -> bpy.types.World:
    """Return a new world whose radiance [W/(m^2 sr)] is `color`, linear RGB, times `strength` in all directions."""
    world = bpy.data.worlds.new(name)
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (*color, 1.0), strength
    return world
