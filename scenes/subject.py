# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scenes show, upright on the ground: a character as it is, or as one mesh of plaster with one color attribute."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import bpy

import bmesh
from mathutils import Matrix, Vector

from ..addon.blender.object_types import WITH_FACES

ALBEDO_ATTRIBUTE = "True Diffuse Albedo"  # color attribute of linear colors in [0, 1]
HEIGHT = 1.8  # meters
MONKEY_COLOR = (0.55, 0.36, 0.22)
WHITE = (1.0, 1.0, 1.0)  # of a mesh without paint of ours: it then has the albedo that the scene asks for
FLAT = 1e-6  # a height below this fraction of the largest extent
WITHOUT_FACES = {"CURVES": "hair", "POINTCLOUD": "a point cloud", "VOLUME": "a volume", "GREASEPENCIL": "Grease Pencil"}

type Point = Sequence[float] | Vector


@dataclass(frozen=True)
class Part:
    """One object of a character: its mesh, posed and with its materials in its slots, and the `matrix` that places it."""

    name: str
    mesh: bpy.types.Mesh
    matrix: Matrix

    @property
    def points(self) -> Iterator[Vector]:
        """The vertices where `matrix` places them."""
        return (self.matrix @ vertex.co for vertex in self.mesh.vertices)


@dataclass(frozen=True)
class Figure:
    """A character as it is. `scale` is its length in its scene [m], given its length in its own scene's units."""

    parts: tuple[Part, ...]
    scale: float = 1.0

    @property
    def points(self) -> Iterator[Vector]:
        """The vertices of all parts, in place."""
        return (point for part in self.parts for point in part.points)

    @property
    def materials(self) -> list[bpy.types.Material | None]:
        """The materials of all parts, each once; None stands for empty slots."""
        return list(dict.fromkeys(material for part in self.parts for material in part.mesh.materials))

    def moved(self, matrix: Matrix) -> "Figure":
        """Return the figure moved by `matrix`, which scales all axes alike."""
        parts = tuple(replace(part, matrix=matrix @ part.matrix) for part in self.parts)
        return Figure(parts, self.scale * matrix.median_scale)


def can_stand(points: Iterable[Point]) -> bool:
    """Return whether `points`, of which there are some, are not all at one height and none at infinity."""
    sizes = [max(values) - min(values) for values in zip(*points, strict=True)]
    return all(map(math.isfinite, sizes)) and sizes[2] > FLAT * max(sizes)


def standing(points: Iterable[Point]) -> Matrix:
    """Return the transform that puts `points`, which can stand, on the ground around the origin, HEIGHT tall."""
    xs, ys, zs = zip(*points, strict=True)
    size = max(zs) - min(zs)
    center = (-(min(xs) + max(xs)) / 2, -(min(ys) + max(ys)) / 2, -min(zs))
    return Matrix.Scale(HEIGHT / size, 4) @ Matrix.Translation(center)


def points_of(mesh: bpy.types.Mesh) -> list[Vector]:
    """Return the vertices of `mesh`."""
    return [vertex.co for vertex in mesh.vertices]


def stand(mesh: bpy.types.Mesh, color: tuple[float, float, float], matrix: Matrix | None = None) -> bpy.types.Mesh:
    """Transform `mesh` by `matrix` (by default to stand on the ground), make it smooth with one color and one slot; return it."""
    mesh.transform(matrix or standing(points_of(mesh)))
    mesh.shade_smooth()
    mesh.materials.clear()
    mesh.materials.append(None)
    if existing := mesh.attributes.get(ALBEDO_ATTRIBUTE):
        mesh.attributes.remove(existing)
    attribute = mesh.color_attributes.new(ALBEDO_ATTRIBUTE, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", (*color, 1.0) * len(mesh.vertices))
    return mesh


def monkey() -> bpy.types.Mesh:
    """Return Blender's monkey, painted brown."""
    mesh = bpy.data.meshes.new("Monkey")
    shape = bmesh.new()
    bmesh.ops.create_monkey(shape)
    bmesh.ops.subdivide_edges(shape, edges=shape.edges, cuts=2, smooth=1.0, use_grid_fill=True)
    shape.to_mesh(mesh)
    shape.free()
    return stand(mesh, MONKEY_COLOR)


def from_object(item: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """Return a new mesh of `item` with modifiers and pose applied, standing and white.

    Raises ValueError with one line for the user where it has no faces or cannot stand.
    """
    mesh = bpy.data.meshes.new_from_object(item.evaluated_get(depsgraph), depsgraph=depsgraph)
    mesh.transform(item.matrix_world)
    if item.matrix_world.is_negative:  # mirrored: its faces would look inwards
        mesh.flip_normals()
    try:
        check(item.name, bool(mesh.polygons), points_of(mesh))
    except ValueError:
        bpy.data.meshes.remove(mesh)
        raise
    return stand(mesh, WHITE)


def check(name: str, has_faces: bool, points: Iterable[Point]) -> None:
    """Raise ValueError, with one line for the user, where what is called `name` has no faces or cannot stand."""
    if not has_faces:
        raise ValueError(f"{name} has no faces")
    if not can_stand(points):
        raise ValueError(f"{name} is flat or has vertices at infinity: it cannot stand upright")


def character_of(item: bpy.types.Object) -> set[bpy.types.Object]:
    """Return the objects of the character of `item`: all below its topmost parent, and the same of armatures that move them."""
    found: set[bpy.types.Object] = set()
    waiting = {item}
    while waiting:
        root = waiting.pop()
        while root.parent:
            root = root.parent
        added = {root, *root.children_recursive} - found
        found |= added
        rigs = {modifier.object for one in added for modifier in one.modifiers if modifier.type == "ARMATURE" and modifier.object}
        waiting |= rigs - found
    return found


def figure(
    depsgraph: bpy.types.Depsgraph, is_shown: Callable[[bpy.types.DepsgraphObjectInstance], bool], say: Callable[[str], None]
) -> Figure:
    """Return what `depsgraph` evaluates of the instances that are shown: poses, modifiers and materials as they are.

    Instances of one mesh share it. `say` is told in a line what has no faces and is not shown.
    """
    meshes: dict[tuple[int, ...], bpy.types.Mesh] = {}
    parts = []
    for instance in depsgraph.object_instances:
        item = instance.object
        if not is_shown(instance):
            continue
        name = item.original.name if item.original else item.name
        if item.type not in WITH_FACES:
            if item.type in WITHOUT_FACES:
                say(f"{name} is {WITHOUT_FACES[item.type]}, which is not shown")
            continue
        slots = [slot.material.original if slot.material else None for slot in item.material_slots]
        key = (item.data.as_pointer(), *(material.as_pointer() if material else 0 for material in slots))
        if key not in meshes:
            meshes[key] = _mesh(item, slots, depsgraph)
        if not instance.is_instance and any(system.settings.render_type == "PATH" for system in item.particle_systems):
            say(f"{name} has hair of particles, which is not shown")
        if meshes[key].polygons:
            parts.append(Part(name, meshes[key], instance.matrix_world.copy()))
    for mesh in meshes.values():
        if not mesh.polygons:
            bpy.data.meshes.remove(mesh)
    return Figure(tuple(parts))


def character_figure(item: bpy.types.Object, depsgraph: bpy.types.Depsgraph, say: Callable[[str], None]) -> Figure:
    """Return the character that `item` belongs to, as `depsgraph` evaluates it, standing; `say` as for `figure`.

    Raises ValueError with one line for the user where it has no faces or cannot stand.
    """
    members = character_of(item)

    def is_shown(instance: bpy.types.DepsgraphObjectInstance) -> bool:
        owner = instance.parent if instance.is_instance else instance.object
        return owner.original in members and instance.show_self and not instance.object.original.hide_render

    found = figure(depsgraph, is_shown, say)
    points = list(found.points)
    try:
        check(item.name, bool(found.parts), points)
    except ValueError:
        remove(found)
        raise
    return found.moved(standing(points))


def _mesh(item: bpy.types.Object, materials: Sequence[bpy.types.Material | None], depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """Return a new mesh of an evaluated object with `materials` in its slots, of which it has one at least."""
    mesh = bpy.data.meshes.new_from_object(item, preserve_all_data_layers=True, depsgraph=depsgraph)
    for index, material in enumerate(materials):  # which may be the object's own, not the mesh's
        if index < len(mesh.materials):
            mesh.materials[index] = material
        else:
            mesh.materials.append(material)
    if not mesh.materials:
        mesh.materials.append(None)
    return mesh


def remove(shown: Figure) -> None:
    """Remove the meshes of a figure that nothing uses."""
    for mesh in {part.mesh for part in shown.parts}:
        if not mesh.users:
            bpy.data.meshes.remove(mesh)
