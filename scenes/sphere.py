# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere under a sun, the smallest scene in which every angle of light and view occurs."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import bpy

import bmesh

from ..addon.blender import engines
from ..addon.material import materials
from ..addon.measure import error, render
from ..addon.models import Lambert, Model
from .elements import add, beside_viewer

COLOR = (0.8, 0.5, 0.2, 1.0)


@dataclass(frozen=True)
class SphereUnderSun:
    """The scene and its parts; `plain` is a Diffuse BSDF of COLOR."""

    scene: bpy.types.Scene
    sphere: bpy.types.Object
    sun: bpy.types.Object
    plain: bpy.types.Material
    surfaces: dict[float, error.GBuffer] = field(default_factory=dict)

    def measure(
        self, material: bpy.types.Material, models: Sequence[Model], engine: engines.Engine, samples: int, degrees: float
    ) -> tuple[float, list[error.Errors]]:
        """Return the seconds to render `material` lit from `degrees` beside the viewer, and its errors against each of `models`."""
        self.sun.matrix_world = beside_viewer(degrees)
        self.sphere.data.materials[0] = material
        camera, light = tuple(self.scene.camera.matrix_world.translation), render.light_of(self.sun)
        with render.measurement_scene(self.scene, self.sphere, self.sun) as scene:
            seconds, rgb = render.radiance(scene, engine, samples)
        *expected, lambert = error.analytic(self.surface(), [*models, Lambert()], camera, light)
        return seconds, [error.errors(rgb, one, lambert) for one in expected]

    def surface(self) -> error.GBuffer:
        """Return the surface that the camera sees, rendered once for each resolution."""
        size = self.scene.render.resolution_x
        if size not in self.surfaces:
            with render.measurement_scene(self.scene, self.sphere, self.sun) as scene:
                self.surfaces[size] = render.g_buffer(scene, self.plain)
        return self.surfaces[size]

    def radiance(
        self,
        material: bpy.types.Material,
        lights: Sequence[bpy.types.Object],
        sky: bpy.types.World | None,
        engine: engines.Engine,
        samples: int,
        shadows: bool = True,
    ) -> tuple[float, array[float]]:
        """Return the seconds to render `material` under `lights` and `sky`, and the linear RGB of the sphere's region."""
        self.sphere.data.materials[0] = material
        with render.measurement_scene(self.scene, self.sphere, *lights, shadows=shadows) as scene:
            scene.world = sky
            return render.radiance(scene, engine, samples)


def sphere_under_sun(size: int, scene: bpy.types.Scene | None = None) -> SphereUnderSun:
    """Return a smooth unit sphere that fills a picture of `size` pixels, 8 m from the camera, lit by a sun of irradiance pi.

    It is built in `scene`, by default the current one.
    """
    scene = scene or bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    mesh = bpy.data.meshes.new("Sphere")
    ball = bmesh.new()
    bmesh.ops.create_uvsphere(ball, u_segments=128, v_segments=64, radius=1.0)
    ball.to_mesh(mesh)
    ball.free()
    mesh.shade_smooth()
    plain, diffuse = materials.create_plain("Plain")
    diffuse.inputs["Color"].default_value = COLOR
    mesh.materials.append(plain)
    sphere = add(scene, "Sphere", mesh)
    camera = bpy.data.cameras.new("Camera")
    camera.lens = 125.0
    scene.camera = add(scene, "Camera", camera)
    scene.camera.location, scene.camera.rotation_euler = (0.0, -8.0, 0.0), (math.pi / 2, 0.0, 0.0)
    sun = add(scene, "Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = math.pi
    scene.view_layers[0].update()
    return SphereUnderSun(scene, sphere, sun, plain)
