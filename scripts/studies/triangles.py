# SPDX-License-Identifier: GPL-3.0-or-later
"""Shades many inputs in one picture: a triangle of its own normal around the middle of each pixel, seen from above, under a sun."""

import math
from array import array
from collections.abc import Sequence

import bpy

from true_diffuse.addon.blender.engines import EEVEE, Engine
from true_diffuse.addon.measure import render
from true_diffuse.addon.models.vector import Vector
from true_diffuse.scenes.elements import add

VIEWER: Vector = (0.0, 0.0, 1.0)
HALF = 0.45  # of a pixel: how far each triangle reaches
SMALLEST = 4  # pixels, the least that Blender renders
EEVEE_SAMPLES = 4


def triangles(normals: Sequence[Vector], slots: Sequence[int]) -> bpy.types.Mesh:
    """Return the mesh of a triangle for each normal, with the material slots; attributes of its faces are in their order.

    The first rows are nearest to the bottom of the picture. Triangles beyond `normals` that fill the last row are missing.
    """
    width, _ = size(len(normals))
    corners = array("f")
    for index, n in enumerate(normals):
        for x, y in ((-HALF, -HALF), (HALF, -HALF), (0.0, HALF)):
            corners.extend((index % width + 0.5 + x, index // width + 0.5 + y, -(n[0] * x + n[1] * y) / n[2]))
    count = len(normals)
    mesh = bpy.data.meshes.new("Triangles")
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", corners)
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", range(3 * count))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", range(0, 3 * count, 3))
    mesh.polygons.foreach_set("material_index", slots)
    mesh.shade_flat()  # Cycles rounds the normals of smooth shading to 1e-5
    mesh.update(calc_edges=True)
    return mesh


def set_attribute(mesh: bpy.types.Mesh, name: str, values: Sequence[float], *, is_vector: bool) -> None:
    """Give each triangle a number, or three, which Attribute nodes read."""
    kind, key = ("FLOAT_VECTOR", "vector") if is_vector else ("FLOAT", "value")
    mesh.attributes.new(name, kind, "FACE").data.foreach_set(key, array("f", values))


def size(count: int) -> tuple[int, int]:
    """Return width and height in pixels of the picture of `count` triangles."""
    width = max(SMALLEST, math.ceil(math.sqrt(count)))
    return width, max(SMALLEST, math.ceil(count / width))


def shade(mesh: bpy.types.Mesh, rotation: Sequence[float], engine: Engine, *, osl: bool = False) -> array[float]:
    """Return red, green and blue of each triangle for a sun of irradiance 1 W/m^2 of this Euler rotation."""
    count = len(mesh.polygons)
    width, height = size(count)
    source = bpy.data.scenes.new("Triangles")
    light, lens = bpy.data.lights.new("Triangles", "SUN"), bpy.data.cameras.new("Triangles")
    try:
        subject, lamp = add(source, "Triangles", mesh), add(source, "Triangles", light)
        light.energy, lamp.rotation_euler = 1.0, rotation
        lens.type, lens.ortho_scale, lens.clip_end = "ORTHO", max(width, height), 4000.0
        source.camera = add(source, "Triangles", lens)
        source.camera.location = (0.5 * width, 0.5 * height, 2000.0)
        source.render.resolution_x, source.render.resolution_y = width, height
        source.cycles.shading_system = osl
        source.view_layers[0].update()
        with render.measurement_scene(source, subject, lamp) as scene:
            rows = render.radiance(scene, engine, EEVEE_SAMPLES if engine is EEVEE else 1)[1]
    finally:
        for data, group in ((source, "scenes"), (light, "lights"), (lens, "cameras")):
            getattr(bpy.data, group).remove(data)
    # rows come from the top
    pixels = array("f", [value for row in reversed(range(height)) for value in rows[3 * width * row : 3 * width * (row + 1)]])
    return pixels[: 3 * count]
