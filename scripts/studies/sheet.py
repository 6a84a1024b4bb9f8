# SPDX-License-Identifier: GPL-3.0-or-later
"""A sheet bent along lines, convex and seen from afar: each column of it stands at one N.V, each row has inputs of its own.

The mesh carries the inputs as attributes, so one picture holds every combination.
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Matrix

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.measure import render
from true_diffuse.scenes.elements import add, add_sun, towards
from true_diffuse.scripts.studies.rough import MeasuredModel

USUAL = {
    "Roughness": (1.0,) * 3,
    "Color": (0.8, 0.8, 0.8),
    "IOR": (1.5,) * 3,
    "Specular": (0.5,) * 3,
    "Exponent": (30.0,) * 3,
    "Normal": (0.0, 0.0, 0.0),
}
BEYOND, HUGE, ONE = " beyond", 1e30, (1.0, 1.0, 1.0)  # HUGE squared is infinite in 32-bit floats

type Inputs = dict[str, tuple[float, ...]]


def beside_viewer_above(degrees: float) -> Matrix:
    """Return the rotation of a light that is `degrees` beside a viewer above."""
    return towards((math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees))))


def camera_above(scene: bpy.types.Scene, x: float, y: float, z: float, width: float) -> bpy.types.Object:
    """Give `scene` an orthographic camera that looks down from (x, y, z) on `width` [m], and return it."""
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", width
    scene.camera = add(scene, "Camera", camera, Matrix.Translation((x, y, z)))
    return scene.camera


@dataclass(frozen=True)
class Sheet:
    """A convex sheet of as many columns as `mus`, seen by an orthographic camera, and a sun of irradiance pi."""

    scene: bpy.types.Scene
    subject: bpy.types.Object
    sun: bpy.types.Object
    columns: int
    rows: int
    cell: int

    def cells(
        self, material: bpy.types.Material, engine: Engine, samples: int, light: "float | bpy.types.World", traced: bool = False
    ) -> list[list[float]]:
        """Return the values of each cell, row by row: all pixels but those on its edge, all channels.

        `light` is the sun's angle in degrees, or a world; `traced`: with EEVEE's ray tracing.
        """
        self.subject.data.materials[0] = material
        world = light if isinstance(light, bpy.types.World) else None
        if world is None:
            self.sun.matrix_world = beside_viewer_above(light)
        with render.measurement_scene(self.scene, self.subject, *(() if world else (self.sun,))) as scene:
            scene.world = world
            scene.eevee.use_raytracing = traced
            _, rgb = render.radiance(scene, engine, samples)
        return [self._cell(rgb, column, row) for row in range(self.rows) for column in range(self.columns)]

    def _cell(self, rgb: array[float], column: int, row: int) -> list[float]:
        values: list[float] = []
        width = 3 * self.columns * self.cell
        for y in range(row * self.cell + 1, (row + 1) * self.cell - 1):
            start = y * width + 3 * column * self.cell
            values += rgb[start + 3 : start + 3 * (self.cell - 1)]
        return values


def sheet(mus: Sequence[float], rows: Sequence[Inputs], cell: int) -> Sheet:
    """Return a sheet whose columns stand at the cosines `mus`, falling, and whose rows have a group's inputs `rows`."""
    scene = bpy.data.scenes.new("Sheet")
    columns, count = len(mus), len(rows)
    slopes = [math.sqrt(1.0 - mu * mu) / mu for mu in mus]
    heights = [-sum(slopes[:column]) for column in range(columns + 1)]
    # the first row of the picture is at the top
    points = [(float(x), -float(y), heights[x]) for y in range(count + 1) for x in range(columns + 1)]
    line = columns + 1
    faces = [
        (y * line + x, (y + 1) * line + x, (y + 1) * line + x + 1, y * line + x + 1) for y in range(count) for x in range(columns)
    ]
    mesh = bpy.data.meshes.new("Sheet")
    mesh.from_pydata(points, [], faces)
    for name in USUAL:
        values = [x for row in rows for _ in range(columns) for x in row[name]]
        for kind, numbers in (("", map(_finite, values)), (BEYOND, (0.0 if math.isfinite(x) else HUGE for x in values))):
            attribute = mesh.attributes.new(name + kind, "FLOAT_VECTOR", "FACE")
            attribute.data.foreach_set("vector", list(numbers))
    mesh.materials.append(None)
    subject = add(scene, "Sheet", mesh)
    camera = camera_above(scene, 0.5 * columns, -0.5 * count, 10.0, float(max(columns, count)))
    camera.data.clip_end = 20.0 - heights[-1]
    sun = add_sun(scene, "Sun", (0.0, 0.0, 1.0), math.pi)
    scene.render.resolution_x, scene.render.resolution_y = columns * cell, count * cell
    scene.view_layers[0].update()
    return Sheet(scene, subject, sun, columns, count, cell)


def fed(measured: MeasuredModel, quality: str) -> bpy.types.Material:
    """Return a material whose inputs come from the mesh's attributes: numbers that no socket's limits hold back.

    EEVEE reads 0 for an attribute that is not finite, so infinity and NaN are made in nodes: x (1 + HUGE^2), x being 1 and 0.
    """
    material = measured.material(quality)
    tree = material.node_tree
    for name in inputs_of(measured):
        x, huge = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeAttribute")
        x.attribute_name, huge.attribute_name = name, name + BEYOND
        sources = (huge.outputs["Vector"], huge.outputs["Vector"]), (None, ONE), (None, x.outputs["Vector"])
        previous = None
        for operation, pair in zip(("MULTIPLY", "ADD", "MULTIPLY"), sources, strict=True):
            node = tree.nodes.new("ShaderNodeVectorMath")
            node.operation = operation
            for source, socket in zip(pair, node.inputs, strict=False):
                if source is ONE:
                    socket.default_value = ONE
                else:
                    tree.links.new(source or previous, socket)
            previous = node.outputs["Vector"]
        tree.links.new(previous, tree.nodes[measured.group.name].inputs[name])
    return material


def inputs_of(measured: MeasuredModel) -> list[str]:
    """Return which of the sheet's attributes are inputs of a model's group."""
    return [socket.name for socket in measured.group.inputs if socket.name in USUAL]


def _finite(x: float) -> float:
    """Return x, or the factor that makes of infinity what x is."""
    return x if math.isfinite(x) else 0.0 if math.isnan(x) else math.copysign(1.0, x)
