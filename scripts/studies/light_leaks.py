# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from behind on closed bodies, which the node groups should hold back."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import bpy

from mathutils import Vector

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.closures.lobe import PAIR, SIGNED
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import chosen_lights
from true_diffuse.scenes.elements import add_sun
from true_diffuse.scripts.studies.rough import QUICK_MODELS, Configuration, MeasuredModel, configurations
from true_diffuse.scripts.studies.sheet import beside_viewer_above, camera_above
from true_diffuse.scripts.studies.study import Step, Table, percent, pivot

COLOR = (0.8, 0.8, 0.8, 1.0)
SIGMA = 1.0
SIZE = 48  # pixels across
UNLIT = -0.1  # N.L below which nothing may be lit: above it EEVEE fades the light out
BODIES = {"sphere": None, "slab 1 mm": 0.001, "slab 5 mm": 0.005}  # thickness of slabs [m]
TILT = math.radians(50.0)  # of a slab's normal from the viewer
DEGREES = (120.0, 180.0)  # between sun and viewer


@dataclass(frozen=True)
class Body:
    """A closed body under a sun: a sphere of 1 m radius, or a slab of 1 m x 1 m, tilted, that fills the picture."""

    scene: bpy.types.Scene
    subject: bpy.types.Object
    sun: bpy.types.Object
    axis: Vector | None
    """The slab's normal towards the viewer; None for the sphere."""

    def leak(self, material: bpy.types.Material, engine: Engine, degrees: float, shadows: bool) -> float:
        """Return the greatest radiance where N.L < UNLIT, lit from `degrees` beside the viewer, over a lit Lambert surface's."""
        self.subject.data.materials[0] = material
        self.sun.matrix_world = beside_viewer_above(degrees)
        light = (self.sun.matrix_world.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
        with render.measurement_scene(self.scene, self.subject, self.sun, shadows=shadows) as scene:
            _, rgb = render.radiance(scene, engine, 4)
        width = self.scene.render.resolution_x
        worst = 0.0
        for pixel in range(len(rgb) // 3):
            n = self.axis or _sphere_normal(pixel, width)
            if n is not None and n.dot(light) < UNLIT:
                worst = max(worst, *rgb[3 * pixel : 3 * pixel + 3])
        return worst / max(COLOR[:3])


def _sphere_normal(pixel: int, width: int) -> Vector | None:
    """Return the normal of a unit sphere that fills a square picture; None beside it."""
    x, y = 2.0 * (pixel % width + 0.5) / width - 1.0, 1.0 - 2.0 * (pixel // width + 0.5) / width
    rest = 1.0 - x * x - y * y
    return Vector((x, y, math.sqrt(rest))) if rest > 0.0 else None


def body(thickness: float | None) -> Body:
    """Return a sphere, or a slab that is `thickness` [m] thick."""
    bpy.context.window.scene = scene = bpy.data.scenes.new("Body")  # where operators add to
    if thickness is None:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1.0)
        bpy.context.object.data.shade_smooth()
    else:
        bpy.ops.mesh.primitive_cube_add(size=1.0)
        bpy.context.object.scale = (1.0, 1.0, thickness)
        bpy.context.object.rotation_euler = (0.0, -TILT, 0.0)  # away from all of DEGREES
    subject = bpy.context.object
    subject.data.materials.append(None)
    camera_above(scene, 0.0, 0.0, 5.0, 2.0 if thickness is None else 0.5)
    sun = add_sun(scene, "Sun", (0.0, 0.0, 1.0), math.pi)
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.view_layers[0].update()
    axis = None if thickness is None else subject.matrix_world.to_quaternion() @ Vector((0.0, 0.0, 1.0))
    return Body(scene, subject, sun, axis)


def leak(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield how much light from behind shows on closed bodies: its radiance over a lit Lambert surface's.

    Where a quality has Subsurface closures, once with the material as `materials.create` makes it and once with EEVEE's own idea of
    how thick the body is: `thickness` is whether the Material Output has one.
    """
    bodies = {name: body(thickness) for name, thickness in BODIES.items()}

    def measure(name: str, configuration: Configuration, measured: MeasuredModel) -> Iterator[Record]:
        solid = bodies[name]
        chosen_lights.choose([solid.sun])
        solid.scene.cycles.shading_system = configuration.osl
        material = measured.material(configuration.quality, Color=COLOR, Roughness=SIGMA)
        for wired in (True, False) if configuration.lobe_set in (PAIR, SIGNED) else (True,):
            if not wired:
                _unwire(material)
            for degrees, shadows in product(DEGREES, (False, True)):
                about = {"body": name, "light_degrees": degrees, "shadows": shadows, "thickness": wired}
                share = solid.leak(material, configuration.engine, degrees, shadows)
                yield {**configuration.record, "model": measured.name, **about, "leak": share}

    cases = product(bodies, configurations(used, QUICK_MODELS[:1] if quick else QUICK_MODELS))
    return [Step(f"Leak  {one.name}  {each.name}  {name}", partial(measure, name, one, each)) for name, (one, each) in cases]


def _unwire(material: bpy.types.Material) -> None:
    """Leave the thickness to EEVEE."""
    tree = material.node_tree
    for link in tree.get_output_node("EEVEE").inputs["Thickness"].links:
        tree.links.remove(link)


def table(records: Sequence[Record]) -> Table:
    """Return the greatest leak over the lights, by body, without and with shadows."""

    def row(one: Record) -> tuple[str, ...]:
        return one["engine"], f"{one['target']}, {one['quality']}", one["model"], "as made" if one["thickness"] else "EEVEE's"

    def cell(found: list[Record]) -> str:
        return f"{percent(max(one['leak'] for one in found))} %"

    titles = ("Engine", "Target and quality", "Model", "Thickness")
    return pivot(records, titles, row, lambda one: f"{one['body']}{', shadows' * one['shadows']}", cell)
