# SPDX-License-Identifier: GPL-3.0-or-later
"""The subject of a comparison as one mesh: the painted human, Blender's monkey, or the meshes of a file.

The mesh is upright (Z up), faces -Y and stands on z = 0 around the origin, 1.8 m tall. It is smooth and has one material slot and
the color attribute ALBEDO_ATTRIBUTE.
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import bpy

import bmesh

from true_diffuse.scenes.subject import WHITE, can_stand, stand, standing
from true_diffuse.scripts.characters.human import human_mesh

MONKEY_COLOR = (0.55, 0.36, 0.22)


class CharacterError(Exception):
    """The character cannot be loaded; the message is one line for the user."""


def load(character: str) -> bpy.types.Mesh:
    """Return the mesh for "human", "monkey" or the path of a .blend, .usd, .usda, .usdc, .usdz, .glb, .gltf or .obj file.

    Raises CharacterError where there is no such file, it cannot be read, or it holds no faces.
    """
    return load_frames(character, (None,))[None]


def load_frames[Frame: int | None](character: str, frames: Sequence[Frame]) -> dict[Frame, bpy.types.Mesh]:
    """Return the mesh at each of `frames`, as `load` does; None is the frame that the file was saved at.

    All are scaled and placed like the first, so that a jump stays a jump. Raises CharacterError as `load` does.
    """
    if character in INCLUDED:
        return dict.fromkeys(frames, INCLUDED[character]())
    return _from_file(check_file(character), frames)


def check_file(character: str) -> Path:
    """Return the path of a character's file. Raises CharacterError where it does not exist, is empty or of an unknown kind."""
    path = Path(character)
    if path.suffix.lower() not in IMPORTERS:
        known = ", ".join(IMPORTERS)
        raise CharacterError(f"character {path} is neither human, nor monkey, nor a file of a known kind ({known})")
    if not path.is_file():
        raise CharacterError(f"character file {path} does not exist")
    if path.stat().st_size == 0:
        raise CharacterError(f"character file {path} is empty")
    return path


def _monkey() -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new("Monkey")
    shape = bmesh.new()
    bmesh.ops.create_monkey(shape)
    bmesh.ops.subdivide_edges(shape, edges=shape.edges, cuts=2, smooth=1.0, use_grid_fill=True)
    shape.to_mesh(mesh)
    shape.free()
    return stand(mesh, MONKEY_COLOR)


INCLUDED: dict[str, Callable[[], bpy.types.Mesh]] = {"human": human_mesh, "monkey": _monkey}


def _import_blend(path: Path) -> None:
    """Append the file's first scene, or all objects of a file without scenes."""
    with bpy.data.libraries.load(str(path)) as (source, target):
        if source.scenes:
            target.scenes = source.scenes[:1]
        else:
            target.objects = source.objects
    for item in target.objects:
        bpy.context.collection.objects.link(item)


IMPORTERS: dict[str, Callable[[Path], object]] = {
    ".blend": _import_blend,
    ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=str(path)),
    ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=str(path)),
    ".obj": lambda path: bpy.ops.wm.obj_import(filepath=str(path)),
    ".usd": lambda path: bpy.ops.wm.usd_import(filepath=str(path)),
    ".usda": lambda path: bpy.ops.wm.usd_import(filepath=str(path)),
    ".usdc": lambda path: bpy.ops.wm.usd_import(filepath=str(path)),
    ".usdz": lambda path: bpy.ops.wm.usd_import(filepath=str(path)),
}


def _from_file[Frame: int | None](path: Path, frames: Sequence[Frame]) -> dict[Frame, bpy.types.Mesh]:
    before = {scene: list(scene.objects) for scene in bpy.data.scenes}
    try:
        IMPORTERS[path.suffix.lower()](path)
    except (OSError, RuntimeError) as error:
        reason = str(error).strip().splitlines()
        raise CharacterError(f"cannot read {path}: {reason[0] if reason else 'its importer gave no reason'}") from error
    imported = next((scene for scene in bpy.data.scenes if scene not in before), bpy.context.scene)
    meshes = {frame: _merged(imported, frame) for frame in frames}
    _remove_imported(imported, before, list(meshes.values()))
    matrix = None
    for frame, mesh in meshes.items():
        when = "" if frame is None else f" at frame {frame}"
        if len(mesh.polygons) == 0:
            raise CharacterError(f"{path} holds no mesh with faces{when}, or is damaged")
        if not can_stand(mesh):
            raise CharacterError(f"{path} is flat or has vertices at infinity{when}: it cannot stand upright")
        matrix = matrix or standing(mesh)
        stand(mesh, WHITE, matrix)
    return meshes


def _renderable(collection: bpy.types.LayerCollection) -> Iterator[bpy.types.Object]:
    """Yield the objects of a layer collection, and of those in it, that are not hidden in renders."""
    if collection.exclude or collection.collection.hide_render:
        return
    yield from (item for item in collection.collection.objects if not item.hide_render)
    for child in collection.children:
        yield from _renderable(child)


def _merged(scene: bpy.types.Scene, frame: int | None) -> bpy.types.Mesh:
    """Return one mesh of everything that a render of `scene` shows, with modifiers, poses, transforms and instances applied."""
    layer = scene.view_layers[0]
    if frame is not None:
        scene.frame_set(frame)
    visible = set(_renderable(layer.layer_collection))
    layer.update()
    used = {instance.object.original for instance in layer.depsgraph.object_instances}
    for modifier in (modifier for item in used for modifier in item.modifiers):
        modifier.show_viewport = modifier.show_render
        if hasattr(modifier, "render_levels"):
            modifier.levels = modifier.render_levels
    layer.update()
    whole = bmesh.new()
    for instance in layer.depsgraph.object_instances:
        item = instance.object
        owner = instance.parent if instance.is_instance else item
        if item.type != "MESH" or item.original.hide_render or owner.original not in visible or not instance.show_self:
            continue
        part = item.to_mesh()
        part.transform(instance.matrix_world)
        whole.from_mesh(part)
        item.to_mesh_clear()
    bmesh.ops.delete(whole, geom=[v for v in whole.verts if not v.link_faces], context="VERTS")
    mesh = bpy.data.meshes.new("Character")
    whole.to_mesh(mesh)
    whole.free()
    for attribute in list(mesh.color_attributes):
        mesh.color_attributes.remove(attribute)
    return mesh


def _remove_imported(
    imported: bpy.types.Scene, before: dict[bpy.types.Scene, list[bpy.types.Object]], meshes: Sequence[bpy.types.Mesh]
) -> None:
    """Remove all that an import added to the file, except `meshes`; `before` has the objects of the scenes that were there."""
    kept = before.get(imported, [])
    for item in [item for item in imported.objects if item not in kept]:
        bpy.data.objects.remove(item)
    if imported not in before:
        bpy.data.scenes.remove(imported)
    for mesh in meshes:
        mesh.use_fake_user = True
    bpy.data.orphans_purge(do_recursive=True)
    for mesh in meshes:
        mesh.use_fake_user = False
