# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere under a sun, the smallest scene in which every angle of light and view occurs; or under several lights and a sky."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import bpy

import bmesh
from mathutils import Matrix

from ..addon.blender import engines
from ..addon.material import materials
from ..addon.measure import error, render
from ..addon.models import Lambert, Model
from .elements import add, beside_viewer, towards

COLOR = (0.8, 0.5, 0.2, 1.0)
NOISELESS = 512  # Cycles' samples under a sky: its noise is far below what the engines differ by


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

    def between_engines(
        self, material: bpy.types.Material, lights: Sequence[bpy.types.Object], sky: bpy.types.World | None, samples: int
    ) -> tuple[float, float]:
        """Return EEVEE's seconds for `material` under `lights` and `sky`, with shadows, and its RMS difference from Cycles."""
        _, cycles = self.radiance(material, lights, sky, engines.CYCLES, NOISELESS)
        seconds, eevee = self.radiance(material, lights, sky, engines.EEVEE, samples)
        surface = self.surface()
        return seconds, error.difference(eevee, cycles, (i for i, good in enumerate(surface.measurable) if good))


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
