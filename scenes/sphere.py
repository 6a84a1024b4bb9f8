# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere under a sun: the smallest scene in which every angle of light and view occurs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Vector

from ..addon import engines, materials
from ..addon.measure import error, render
from ..addon.models import Lambert, Model
from ..addon.nodes import LAMBERT

COLOR = (0.8, 0.5, 0.2, 1.0)


@dataclass(frozen=True)
class SphereUnderSun:
    """The scene and what measures a material in it."""

    scene: bpy.types.Scene
    sphere: bpy.types.Object
    sun: bpy.types.Object
    plain: bpy.types.Material

    def measure(
        self, material: bpy.types.Material, models: Sequence[Model], engine: engines.Engine, samples: int, degrees: float
    ) -> tuple[float, list[error.Errors]]:
        """Return the seconds to render `material` lit from `degrees` beside the viewer, and how far it is from each of `models`."""
        angle = math.radians(degrees)
        towards = Vector((math.sin(angle), -math.cos(angle), 0.0))
        self.sun.matrix_world = towards.to_track_quat("Z", "Y").to_matrix().to_4x4()
        self.sphere.data.materials[0] = material
        camera, light = tuple(self.scene.camera.matrix_world.translation), render.light_of(self.sun)
        with render.measurement_scene(self.scene, self.sphere, self.sun) as scene:
            seconds, rgb = render.radiance(scene, engine, samples)
            surface = render.surface(scene, self.plain)
        *expected, lambert = error.analytic(surface, [*models, Lambert()], camera, light)
        return seconds, [error.errors(rgb, one, lambert) for one in expected]


def sphere_under_sun(size: int) -> SphereUnderSun:
    """A smooth unit sphere filling a picture of `size` pixels, 8 m from the camera, lit by a sun of irradiance pi."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1.0)
    sphere = bpy.context.object
    sphere.data.shade_smooth()
    plain = materials.create("Plain", LAMBERT, Color=COLOR)
    sphere.data.materials.append(plain)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 125.0
    camera.location = (0.0, -8.0, 0.0)
    camera.rotation_euler = (math.pi / 2, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = math.pi
    for item in (camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.view_layers[0].update()
    return SphereUnderSun(scene, sphere, sun, plain)
