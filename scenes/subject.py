# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes a mesh a subject that the scenes can be built with."""

import math

import bpy

from mathutils import Matrix

ALBEDO_ATTRIBUTE = "True Diffuse Albedo"  # color attribute of linear colors in [0, 1]
HEIGHT = 1.8  # meters
WHITE = (1.0, 1.0, 1.0)  # of what has no paint of ours: it is seen at the albedo asked for
FLAT = 1e-6  # a height of less than this share of the largest extent


def can_stand(mesh: bpy.types.Mesh) -> bool:
    """Return whether `mesh`, which has vertices, is neither flat nor has vertices at infinity."""
    sizes = [max(values) - min(values) for values in zip(*(vertex.co for vertex in mesh.vertices), strict=True)]
    return all(map(math.isfinite, sizes)) and sizes[2] > FLAT * max(sizes)


def standing(mesh: bpy.types.Mesh) -> Matrix:
    """Return what puts `mesh`, which can stand, on the ground around the origin, HEIGHT tall."""
    xs, ys, zs = ([vertex.co[axis] for vertex in mesh.vertices] for axis in range(3))
    size = max(zs) - min(zs)
    center = (-(min(xs) + max(xs)) / 2, -(min(ys) + max(ys)) / 2, -min(zs))
    return Matrix.Scale(HEIGHT / size, 4) @ Matrix.Translation(center)


def stand(mesh: bpy.types.Mesh, color: tuple[float, float, float], place: Matrix | None = None) -> bpy.types.Mesh:
    """Stand `mesh` on the ground at HEIGHT, or put it by `place`, smooth it, give it one color and one slot; returns it."""
    mesh.transform(place or standing(mesh))
    mesh.shade_smooth()
    mesh.materials.clear()
    mesh.materials.append(None)
    if taken := mesh.attributes.get(ALBEDO_ATTRIBUTE):
        mesh.attributes.remove(taken)
    attribute = mesh.color_attributes.new(ALBEDO_ATTRIBUTE, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", (*color, 1.0) * len(mesh.vertices))
    return mesh


def from_object(item: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """Return a copy of the mesh that `item` shows, modifiers and pose applied, standing and white.

    Raises ValueError, its message one line for the user, where it has no faces or cannot stand.
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
