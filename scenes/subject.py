# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes made ready for the scenes: upright on the ground, smooth, with one material slot and a color attribute."""

import math

import bpy

from mathutils import Matrix

ALBEDO_ATTRIBUTE = "True Diffuse Albedo"  # color attribute of linear colors in [0, 1]
HEIGHT = 1.8  # meters
WHITE = (1.0, 1.0, 1.0)  # of a mesh without paint of ours: it then has the albedo that the scene asks for
FLAT = 1e-6  # a height below this fraction of the largest extent


def can_stand(mesh: bpy.types.Mesh) -> bool:
    """Return whether `mesh`, which has vertices, is not flat and has none at infinity."""
    sizes = [max(values) - min(values) for values in zip(*(vertex.co for vertex in mesh.vertices), strict=True)]
    return all(map(math.isfinite, sizes)) and sizes[2] > FLAT * max(sizes)


def standing(mesh: bpy.types.Mesh) -> Matrix:
    """Return the transform that puts `mesh`, which can stand, on the ground around the origin, HEIGHT tall."""
    xs, ys, zs = ([vertex.co[axis] for vertex in mesh.vertices] for axis in range(3))
    size = max(zs) - min(zs)
    center = (-(min(xs) + max(xs)) / 2, -(min(ys) + max(ys)) / 2, -min(zs))
    return Matrix.Scale(HEIGHT / size, 4) @ Matrix.Translation(center)


def stand(mesh: bpy.types.Mesh, color: tuple[float, float, float], matrix: Matrix | None = None) -> bpy.types.Mesh:
    """Transform `mesh` by `matrix` (by default to stand on the ground), make it smooth with one color and one slot; return it."""
    mesh.transform(matrix or standing(mesh))
    mesh.shade_smooth()
    mesh.materials.clear()
    mesh.materials.append(None)
    if existing := mesh.attributes.get(ALBEDO_ATTRIBUTE):
        mesh.attributes.remove(existing)
    attribute = mesh.color_attributes.new(ALBEDO_ATTRIBUTE, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", (*color, 1.0) * len(mesh.vertices))
    return mesh


def from_object(item: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """Return a new mesh of `item` with modifiers and pose applied, standing and white.

    Raises ValueError with one line for the user where it has no faces or cannot stand.
    """
    mesh = bpy.data.meshes.new_from_object(item.evaluated_get(depsgraph), depsgraph=depsgraph)
    mesh.transform(item.matrix_world)
    if item.matrix_world.is_negative:  # mirrored: its faces would look inwards
        mesh.flip_normals()
    reason = ""
    if not mesh.polygons:
        reason = f"{item.name} has no faces"
    elif not can_stand(mesh):
        reason = f"{item.name} is flat or has vertices at infinity: it cannot stand upright"
    if reason:
        bpy.data.meshes.remove(mesh)
        raise ValueError(reason)
    return stand(mesh, WHITE)
