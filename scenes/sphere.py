# SPDX-License-Identifier: GPL-3.0-or-later
"""A sphere under a sun: the smallest scene in which every angle of light and view occurs. And the same under lamps and a sky."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import bpy

import bmesh
from mathutils import Vector

from ..addon.blender import engines
from ..addon.material import materials
from ..addon.measure import error, render
from ..addon.models import Lambert, Model

COLOR = (0.8, 0.5, 0.2, 1.0)
NOISELESS = 512  # Cycles' samples under a sky: its noise is far below what the engines differ by


@dataclass(frozen=True)
class SphereUnderSun:
    """The scene and what measures a material in it."""

    scene: bpy.types.Scene
    sphere: bpy.types.Object
    sun: bpy.types.Object
    plain: bpy.types.Material
    surfaces: dict[float, error.Surface] = field(default_factory=dict)

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
        *expected, lambert = error.analytic(self.surface(), [*models, Lambert()], camera, light)
        return seconds, [error.errors(rgb, one, lambert) for one in expected]

    def surface(self) -> error.Surface:
        """Return what the camera sees, rendered once for each size of picture."""
        size = self.scene.render.resolution_x
        if size not in self.surfaces:
            with render.measurement_scene(self.scene, self.sphere, self.sun) as scene:
                self.surfaces[size] = render.surface(scene, self.plain)
        return self.surfaces[size]

    def radiance(
        self,
        material: bpy.types.Material,
        lamps: Sequence[bpy.types.Object],
        sky: bpy.types.World | None,
        engine: engines.Engine,
        samples: int,
        shadows: bool = True,
    ) -> tuple[float, array[float]]:
        """Return the seconds to render `material` under `lamps` and `sky`, and the picture: linear RGB of the sphere's region."""
        self.sphere.data.materials[0] = material
        with render.measurement_scene(self.scene, self.sphere, *lamps, shadows=shadows) as scene:
            scene.world = sky
            return render.radiance(scene, engine, samples)

    def between_engines(
        self, material: bpy.types.Material, lamps: Sequence[bpy.types.Object], sky: bpy.types.World | None, samples: int
    ) -> tuple[float, float]:
        """Return EEVEE's seconds for `material` under `lamps` and `sky`, with shadows, and its RMS difference from Cycles."""
        _, cycles = self.radiance(material, lamps, sky, engines.CYCLES, NOISELESS)
        seconds, eevee = self.radiance(material, lamps, sky, engines.EEVEE, samples)
        surface = self.surface()
        return seconds, error.difference(eevee, cycles, (i for i, good in enumerate(surface.measurable) if good))


def sphere_under_sun(size: int, scene: bpy.types.Scene | None = None) -> SphereUnderSun:
    """A smooth unit sphere filling a picture of `size` pixels, 8 m from the camera, lit by a sun of irradiance pi.

    All is put into `scene`, the current one where none is given.
    """
    scene = scene or bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    mesh = bpy.data.meshes.new("Sphere")
    ball = bmesh.new()
    bmesh.ops.create_uvsphere(ball, u_segments=128, v_segments=64, radius=1.0)
    ball.to_mesh(mesh)
    ball.free()
    mesh.shade_smooth()
    sphere = bpy.data.objects.new("Sphere", mesh)
    plain, diffuse = materials.create_plain("Plain")
    diffuse.inputs["Color"].default_value = COLOR
    sphere.data.materials.append(plain)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 125.0
    camera.location = (0.0, -8.0, 0.0)
    camera.rotation_euler = (math.pi / 2, 0.0, 0.0)
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy = math.pi
    for item in (sphere, camera, sun):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.view_layers[0].update()
    return SphereUnderSun(scene, sphere, sun, plain)


def three_lights() -> list[bpy.types.Object]:
    """A warm sun, a blue point lamp and an area lamp from below, around the origin; in no scene."""
    lamps = []
    for kind, place, energy, color in (
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
        lamp = bpy.data.objects.new(kind.title(), data)
        lamp.matrix_world = Vector(place).to_track_quat("Z", "Y").to_matrix().to_4x4()
        lamp.matrix_world.translation = place
        lamps.append(lamp)
    return lamps


def sky(below: tuple[float, float, float], above: tuple[float, float, float], strength: float) -> bpy.types.World:
    """A sky whose color goes evenly with height from `below` to `above`: what EEVEE's two bands of spherical harmonics can hold."""
    world = bpy.data.worlds.new("Sky")
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    place, split = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeSeparateXYZ")
    height, mix = nodes.new("ShaderNodeMapRange"), nodes.new("ShaderNodeMix")
    height.inputs["From Min"].default_value = -1.0
    mix.data_type = "RGBA"
    factor, low, high = (socket for socket in mix.inputs if socket.enabled)
    low.default_value, high.default_value = (*below, 1.0), (*above, 1.0)
    background, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    background.inputs["Strength"].default_value = strength
    links.new(place.outputs["Generated"], split.inputs[0])
    links.new(split.outputs["Z"], height.inputs["Value"])
    links.new(height.outputs[0], factor)
    links.new(next(socket for socket in mix.outputs if socket.enabled), background.inputs["Color"])
    links.new(background.outputs[0], output.inputs["Surface"])
    return world
