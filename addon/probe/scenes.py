# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes and materials whose renders say what an error costs: by the benchmark of this machine and by scripts/report.py alike.

- sphere: under its sun 60 degrees beside the viewer, without bounces. Exact: the model's own radiance of every pixel.
- five: five characters as an artist renders them, with shadows, sky and bounces, all in one material.

All materials take their color from the meshes' paint.
"""

import math
from array import array
from collections.abc import Callable, Sequence
from functools import cached_property

import bpy

from mathutils import Vector

from ...scenes import five_characters
from ...scenes.sphere import COLOR, sphere_under_sun
from ...scenes.subject import ALBEDO_ATTRIBUTE
from ..blender.engines import CYCLES, Engine
from ..material import materials
from ..material.presets import PRESETS
from ..measure import error, render
from ..models import Model
from ..nodes import ROUGH_DIFFUSE, SUBSURFACE, chosen_lights

ALBEDO = 0.8  # of the lightest paint
DEGREES = 60.0  # between the sphere's sun and the viewer
SIZE = 64  # pixels across the sphere
LENS = 100.0  # mm: leaves room at the left for the pixels that give EEVEE's noise another pattern
FIVE = (168, 72)  # pixels
ROOM = 8  # of those, at the left of the five
MASK_SAMPLES, INSIDE = 64, 0.999
MEDIUM = PRESETS["skin_2"]  # of translucent materials

type Paint = Callable[[bpy.types.Material, bpy.types.NodeSocket], None]
"""Links the paint of a scene's meshes to a color socket."""


def paint(material: bpy.types.Material, socket: bpy.types.NodeSocket) -> None:
    """Link the paint of these scenes' meshes to a color socket."""
    materials.paint(material, socket, ALBEDO_ATTRIBUTE, ALBEDO)


def rough_material(model: str, roughness: float, quality: str | None, paint: Paint) -> bpy.types.Material:
    """Return a new material of Rough Diffuse with the `model` of that label; without a `quality` in the usual one."""
    chosen = {} if quality is None else {"Quality": quality}
    material = materials.create(f"{model} {quality or ''}", ROUGH_DIFFUSE, Model=model, Roughness=roughness, **chosen)
    paint(material, material.node_tree.nodes[ROUGH_DIFFUSE.name].inputs["Color"])
    return material


def translucent_material(method: str, paint: Paint) -> bpy.types.Material:
    """Return a new material of Subsurface, all of whose light enters, without a coat."""
    inputs = {"Method": method, "Subsurface Radius": MEDIUM.inputs["Subsurface Radius"], "Subsurface": 1.0, "Specular": 0.0}
    material = materials.create(f"Subsurface {method}", SUBSURFACE, **inputs)
    paint(material, material.node_tree.nodes[SUBSURFACE.name].inputs["Color"])
    return material


class StudyScene:
    """Base of the scenes, which are built when they are made."""

    name: str
    suns: Sequence[bpy.types.Object]

    def prepare(self) -> None:
        """Choose the suns of this scene for materials that are exact for chosen lights."""
        chosen_lights.choose(self.suns)

    def picture(
        self, material: bpy.types.Material, engine: Engine, osl: bool, samples: int, seed: int
    ) -> tuple[float, array[float]]:
        """Return the seconds of a render and its linear RGB."""
        raise NotImplementedError


class SphereScene(StudyScene):
    """The scene "sphere"."""

    name = "sphere"
    world: bpy.types.World | None = None

    def __init__(self, title: str) -> None:
        self.built = sphere_under_sun(SIZE, bpy.data.scenes.new(title))
        self.built.scene.camera.data.lens = LENS
        mesh = self.built.sphere.data
        painted = mesh.color_attributes.new(ALBEDO_ATTRIBUTE, "FLOAT_COLOR", "POINT")
        painted.data.foreach_set("color", [*(x / ALBEDO for x in COLOR[:3]), 1.0] * len(mesh.vertices))
        angle = math.radians(DEGREES)
        towards = Vector((math.sin(angle), -math.cos(angle), 0.0))
        self.built.sun.matrix_world = towards.to_track_quat("Z", "Y").to_matrix().to_4x4()
        self.built.scene.view_layers[0].update()  # the sun's direction is what Blender makes of its rotation, from now on
        self.suns = [self.built.sun]

    def picture(
        self, material: bpy.types.Material, engine: Engine, osl: bool, samples: int, seed: int
    ) -> tuple[float, array[float]]:
        self.built.scene.cycles.shading_system = osl
        self.built.sphere.data.materials[0] = material
        with render.measurement_scene(self.built.scene, self.built.sphere, *self.suns) as scene:
            scene.world = self.world
            return render.radiance(scene, engine, samples, seed)

    def analytic(self, model: Model) -> error.Analytic:
        """Return the radiance of a model at every pixel that faces the light."""
        camera = tuple(self.built.scene.camera.matrix_world.translation)
        return error.analytic(self.built.surface(), [model], camera, render.light_of(self.built.sun))[0]


class FiveScene(StudyScene):
    """The scene "five" with a character's `mesh`; with `bust` its head and shoulders are seen."""

    name = "five"

    def __init__(self, mesh: bpy.types.Mesh, bust: bool) -> None:
        self.built = five_characters.build(mesh, ALBEDO, bust, FIVE)
        self.scene, self.suns = self.built.scene, [self.built.key]
        render.crop(self.scene, render.Region(ROOM, 0, FIVE[0] - ROOM, FIVE[1]))

    def picture(
        self, material: bpy.types.Material, engine: Engine, osl: bool, samples: int, seed: int
    ) -> tuple[float, array[float]]:
        self.scene.cycles.shading_system = osl
        self._show(material)
        return render.radiance(self.scene, engine, samples, seed)

    @cached_property
    def pixels(self) -> Sequence[int]:
        """The pixels of which every sample falls on a character."""
        white, node = materials.create_plain("White")
        node.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        self._show(white)
        return [pixel for pixel, rho in enumerate(render.mean_albedo(self.scene, CYCLES, MASK_SAMPLES)) if rho >= INSIDE]

    def _show(self, material: bpy.types.Material) -> None:
        for character in self.built.characters:
            character.subject.material_slots[0].material = material
