# SPDX-License-Identifier: GPL-3.0-or-later
"""The subject of a comparison as one mesh: the painted human, Blender's monkey, or the meshes of a file.

The mesh is upright (Z up), faces -Y and stands on z = 0 around the origin, 1.8 m tall. It is smooth and has one material slot and
the color attribute ALBEDO_ATTRIBUTE.
"""

import re
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import bpy

import bmesh
from mathutils import Vector

from true_diffuse.addon.blender.object_types import WITH_FACES
from true_diffuse.scenes.subject import WHITE, Figure, check, figure, monkey, points_of, stand, standing
from true_diffuse.scripts.characters import dependencies, reading
from true_diffuse.scripts.characters.dependencies import Dependencies
from true_diffuse.scripts.characters.human import human_mesh

type Say = Callable[[str], None]  # is told a line for the user


class CharacterError(Exception):
    """The character cannot be loaded; the message is one line for the user."""


def load(character: str, say: Say = print) -> bpy.types.Mesh:
    """Return the mesh for "human", "monkey" or the path of a .blend, .usd, .usda, .usdc, .usdz, .glb, .gltf or .obj file.

    `say` is told in a line what of a file is not shown. Raises CharacterError where there is no such file, it cannot be read, it
    holds no faces, or a file that it needs is missing.
    """
    return load_frames(character, (None,), say)[None]


def load_frames[Frame: int | None](character: str, frames: Sequence[Frame], say: Say = print) -> dict[Frame, bpy.types.Mesh]:
    """Return the mesh at each of `frames`, as `load` does; None is the frame that the file was saved at.

    All are scaled and placed like the first, so that a jump stays a jump. Raises CharacterError as `load` does.
    """
    if character in INCLUDED:
        return dict.fromkeys(frames, INCLUDED[character]())
    path = check_file(character)
    with _imported(path, say) as file:
        meshes = {frame: _merged(file.scene, frame) for frame in frames}
        file.kept += meshes.values()
    matrix = None
    for frame, mesh in meshes.items():
        points = points_of(mesh)
        _check(path, frame, bool(mesh.polygons), points)
        matrix = matrix or standing(points)
        stand(mesh, WHITE, matrix)
    return meshes


def load_figures[Frame: int | None](path: Path, frames: Sequence[Frame], say: Say) -> dict[Frame, Figure]:
    """Return what a character's file shows at each of `frames` as it is: all of its meshes with their materials.

    Frames are as in `load_frames`, and so are scale and place. Raises CharacterError as `load` does.
    """
    figures = {}
    with _imported(path, say) as file:
        for frame in frames:
            _show_as_rendered(file.scene, frame)
            depsgraph = file.scene.view_layers[0].depsgraph
            figures[frame] = figure(depsgraph, partial(_is_rendered, _visible(file.scene)), say)
            file.kept += {part.mesh for part in figures[frame].parts}
    matrix = None
    for frame, one in figures.items():
        points = list(one.points)
        _check(path, frame, bool(one.parts), points)
        matrix = matrix or standing(points)
        figures[frame] = one.moved(matrix)
    return figures


def _check(path: Path, frame: int | None, has_faces: bool, points: Sequence[Vector]) -> None:
    """Raise CharacterError where what a file holds at a frame has no faces or cannot stand."""
    when = "" if frame is None else f" at frame {frame}"
    if not has_faces:
        raise CharacterError(f"{path} holds no mesh with faces{when}, or is damaged")
    try:
        check(f"{path}{when}", has_faces, points)
    except ValueError as error:
        raise CharacterError(str(error)) from error


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


INCLUDED: dict[str, Callable[[], bpy.types.Mesh]] = {"human": human_mesh, "monkey": monkey}


def _import_blend(path: Path) -> dict[bpy.types.Scene, str]:
    """Append the scenes of a file, or all objects of a file without scenes; return the scenes with their names in the file."""
    with bpy.data.libraries.load(str(path)) as (source, target):
        names = list(source.scenes)
        if names:
            target.scenes = source.scenes
        else:
            target.objects = source.objects
    for item in filter(None, target.objects):  # Blender has None for what it could not read
        bpy.context.collection.objects.link(item)
    return {scene: name for scene, name in zip(target.scenes, names, strict=True) if scene}


def _import_gltf(path: Path) -> dict[bpy.types.Scene, str]:
    """Import the default scene of a file into the current one, others into scenes of their own; return these with their names.

    What is in no scene is not rendered, but in a file without scenes.
    """
    before, collections = set(bpy.data.scenes), set(bpy.data.collections)
    bpy.ops.import_scene.gltf(filepath=str(path), import_scene_as_collection=False)
    added = [scene for scene in bpy.data.scenes if scene not in before]
    if dependencies.gltf_document(path).get("scenes"):
        for collection in set(bpy.data.collections) - collections:
            collection.hide_render |= collection.name.startswith("Orphan Nodes")
    return {scene: scene.name for scene in (bpy.context.scene, *added)}


def _import_obj(path: Path) -> dict[bpy.types.Scene, str]:
    bpy.ops.wm.obj_import(filepath=str(path))
    return {bpy.context.scene: path.stem}


def _import_usd(path: Path) -> dict[bpy.types.Scene, str]:
    bpy.ops.wm.usd_import(filepath=str(path))
    return {bpy.context.scene: path.stem}


IMPORTERS: Mapping[str, Callable[[Path], dict[bpy.types.Scene, str]]] = {
    ".blend": _import_blend,
    ".glb": _import_gltf,
    ".gltf": _import_gltf,
    ".obj": _import_obj,
    ".usd": _import_usd,
    ".usda": _import_usd,
    ".usdc": _import_usd,
    ".usdz": _import_usd,
}
USD_ERROR = re.compile(r"^Error in '.*?' at line \d+ in file .*? : '(.*)")  # which also names its source
USD_PLACE = re.compile(r":(\d+):(\d+): (?:parse error|Expected)")  # and the rest of a line, which may be a whole mesh
LONGEST_REASON = 200  # characters
# Compressions of glTF by what names the library that Blender reads them with; not every Blender has it
COMPRESSIONS = {"draco": "Draco", "meshopt": "meshopt"}


@dataclass
class _File:
    """What a file holds while its meshes are made: the `scene` that is shown, what it needs, the meshes that are `kept` of it."""

    scene: bpy.types.Scene
    needs: Dependencies
    kept: list[bpy.types.Mesh] = field(default_factory=list)


@contextmanager
def _imported(path: Path, say: Say) -> Generator[_File]:
    """Yield a file once it is imported; afterwards remove all of it but the meshes kept. Raises CharacterError.

    Scripts in it do not run, nor do Python expressions of its drivers, nor its nodes of Open Shading Language.
    """
    bpy.context.preferences.filepaths.use_scripts_auto_execute = False
    before = {scene: set(scene.objects) for scene in bpy.data.scenes}
    blocks = set(bpy.data.user_map())
    kept: list[bpy.types.Mesh] = []
    with reading.limited(path):
        try:
            named = _named(path, say)
            with _readable(path):
                scenes = IMPORTERS[path.suffix.lower()](path.absolute())
                loaded = bpy.data.user_map().keys() - blocks
                _stop_programs(path, loaded, say)
                scene = _scene_with_faces(path, scenes, say)
                others = dependencies.of_loaded(_shown(scene), loaded, path.absolute())
            _check_dependencies(path, others, say)
            file = _File(scene, dependencies.joined((named, others)))
            kept = file.kept
            with _readable(path):
                yield file
        finally:
            _remove_imported(before, kept)


def open_blend(path: Path, say: Say) -> bpy.types.Scene:
    """Open a .blend file in place of what is open, and return its scene, in the window: the open one, or if empty one with faces.

    Scripts in it do not run. `say` is told in a line which of several scenes it is. Raises CharacterError as `load` does.
    """
    with reading.limited(path):
        with _readable(path):
            bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), load_ui=False, use_scripts=False)
        first = bpy.context.scene
        scenes = dict.fromkeys((first, *bpy.data.scenes))
        scene = _scene_with_faces(path, {scene: scene.name for scene in scenes}, say) if not first.objects else first
        loaded = bpy.data.user_map().keys()
        _check_dependencies(path, dependencies.of_loaded(scene.objects, loaded, path.resolve()), say)
    bpy.context.window.scene = scene
    return scene


def needs(character: str) -> tuple[Path, ...]:
    """Return the files that a character's file needs beside itself. Raises CharacterError as `load` does.

    A file of a format that names them is not imported for that.
    """
    path = check_file(character)
    if path.suffix.lower() in (".blend", ".obj"):
        with _imported(path, _unsaid) as file:
            return file.needs.files
    with reading.limited(path):
        return _named(path, _unsaid).files


def _unsaid(_line: str) -> None:
    """Say nothing: it is said where the file is shown."""


def _named(path: Path, say: Say) -> Dependencies:
    """Return the files that a file names. Raises CharacterError where it cannot be read or one that it needs is missing."""
    with _readable(path):
        named = dependencies.of_file(path.absolute())
    _check_dependencies(path, named, say)
    return named


def _check_dependencies(path: Path, found: Dependencies, say: Say) -> None:
    """Raise CharacterError where a file is missing that a character needs; say which are missing otherwise."""
    if found.missing:
        more = f" ({len(found.missing)} such files)" if len(found.missing) > 1 else ""
        raise CharacterError(f"{path} needs {found.missing[0]}, which does not exist{more}")
    for name in found.spared:
        say(f"{path.name} names {name}, which does not exist; nothing shown needs it")


@contextmanager
def _readable(path: Path) -> Generator[None]:
    """Raise CharacterError for whatever a reader fails of, or who makes something of what it read."""
    try:
        yield
    except CharacterError:
        raise
    except Exception as error:  # of many kinds, as damage may be anywhere
        raise CharacterError(f"cannot read {path}: {importer_reason(error)}") from error


def _shown(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    """Yield the objects of a scene that are or bring what is shown of it: what has faces, and instances of collections."""
    return (item for item in _visible(scene) if item.type in WITH_FACES or item.instance_type == "COLLECTION")


def _stop_programs(path: Path, loaded: Collection[bpy.types.ID], say: Say) -> None:
    """Mute drivers with Python, which keep the value they were saved with, and remove programs in Open Shading Language.

    Blender would run a driver's Python even without the permission where it names no more than functions that it knows as safe or
    that somebody added to them. What it calls a simple expression is no Python.
    """
    owners = {owner for block in loaded for owner in (block, getattr(block, "node_tree", None)) if owner}
    drivers = nodes = 0
    for owner in owners:
        for curve in owner.animation_data.drivers if getattr(owner, "animation_data", None) else ():
            if curve.driver.type == "SCRIPTED" and not curve.driver.is_simple_expression:
                curve.mute = True
                drivers += 1
        for node in list(owner.nodes) if isinstance(owner, bpy.types.ShaderNodeTree) else ():
            if node.bl_idname == "ShaderNodeScript":
                owner.nodes.remove(node)
                nodes += 1
    if drivers:
        say(f"drivers with Python in {path.name} ({drivers}) do not run: what they drive stays as it was saved")
    if nodes:
        say(f"Script nodes in {path.name} ({nodes}) do not run: what they feed has its own value")


def importer_reason(error: Exception) -> str:
    """Return the reason of an importer's error in one line; where it is Python's own, what its traceback ends with."""
    if isinstance(error, MemoryError):
        return "it needs more memory than there is"
    lines = [line.strip() for line in _text(error).splitlines() if line.strip()]
    if lines and (found := USD_ERROR.search(lines[0])):
        place = USD_PLACE.search(found[1])
        return f"line {place[1]}, column {place[2]} is no USD" if place else found[1].removesuffix("'")[:LONGEST_REASON]
    missing = next((name for key, name in COMPRESSIONS.items() if any(f"{key}_bridge" in line for line in lines)), None)
    if missing:
        return f"it is compressed with {missing}, and this Blender lacks the library to read that; save it without compression"
    if any("Traceback (most recent call last)" in line for line in lines):
        last = [line for line in lines if not line.startswith("Location:")][-1]
        return f"its importer failed ({last[:LONGEST_REASON]})"
    return lines[0].removeprefix("Error: ") if lines else "its importer gave no reason"


def _text(error: Exception) -> str:
    """Return the message of an error, which may quote what is no text."""
    try:
        return str(error)
    except UnicodeDecodeError as quoting:
        return quoting.object.decode(errors="replace")


def _scene_with_faces(path: Path, scenes: Mapping[bpy.types.Scene, str], say: Say) -> bpy.types.Scene:
    """Return the first of a file's scenes that shows faces; `scenes` has their names in the file, the one shown first first."""
    if len(scenes) < 2:
        return next(iter(scenes), bpy.context.scene)
    for scene, name in scenes.items():
        if any(instance.object.data.polygons for instance in _instances(scene, None)):
            say(f"{path.name} holds {len(scenes)} scenes: {name} is shown, the first with a mesh")
            return scene
    return next(iter(scenes))


def _renderable(collection: bpy.types.LayerCollection) -> Iterator[bpy.types.Object]:
    """Yield the objects of a layer collection, and of those in it, that are not hidden in renders."""
    if collection.exclude or collection.collection.hide_render:
        return
    yield from (item for item in collection.collection.objects if not item.hide_render)
    for child in collection.children:
        yield from _renderable(child)


def _show_as_rendered(scene: bpy.types.Scene, frame: int | None) -> None:
    """Evaluate `scene` at a frame, with modifiers as they are rendered."""
    reading.go_on()
    layer = scene.view_layers[0]
    if frame is not None:
        scene.frame_set(frame)
    layer.update()
    used = {instance.object.original for instance in layer.depsgraph.object_instances}
    for modifier in (modifier for item in used for modifier in item.modifiers):
        modifier.show_viewport = modifier.show_render
        if hasattr(modifier, "render_levels"):
            modifier.levels = modifier.render_levels
    layer.update()


def _visible(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    return set(_renderable(scene.view_layers[0].layer_collection))


def _is_rendered(visible: Collection[bpy.types.Object], instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Return whether a render shows an instance; `visible` are the objects of collections that it shows."""
    item = instance.object
    owner = instance.parent if instance.is_instance else item
    return not item.original.hide_render and owner.original in visible and instance.show_self


def _instances(scene: bpy.types.Scene, frame: int | None) -> Iterator[bpy.types.DepsgraphObjectInstance]:
    """Yield the instances of meshes that a render of `scene` at a frame shows, with modifiers as they are rendered."""
    _show_as_rendered(scene, frame)
    visible = _visible(scene)
    for instance in scene.view_layers[0].depsgraph.object_instances:
        if instance.object.type == "MESH" and _is_rendered(visible, instance):
            yield instance


def _merged(scene: bpy.types.Scene, frame: int | None) -> bpy.types.Mesh:
    """Return one mesh of everything that a render of `scene` shows, with modifiers, poses, transforms and instances applied."""
    whole = bmesh.new()
    for instance in _instances(scene, frame):
        part = instance.object.to_mesh()
        part.transform(instance.matrix_world)
        whole.from_mesh(part)
        instance.object.to_mesh_clear()
    bmesh.ops.delete(whole, geom=[v for v in whole.verts if not v.link_faces], context="VERTS")
    mesh = bpy.data.meshes.new("Character")
    whole.to_mesh(mesh)
    whole.free()
    for attribute in list(mesh.color_attributes):
        mesh.color_attributes.remove(attribute)
    return mesh


def _remove_imported(before: Mapping[bpy.types.Scene, Collection[bpy.types.Object]], meshes: Sequence[bpy.types.Mesh]) -> None:
    """Remove all that an import added to the file, except `meshes`; `before` has the objects of the scenes that were there."""
    for scene in list(bpy.data.scenes):
        kept = before.get(scene, ())
        for item in [item for item in scene.objects if item not in kept]:
            bpy.data.objects.remove(item)
        if scene not in before:
            bpy.data.scenes.remove(scene)
    for mesh in meshes:
        mesh.use_fake_user = True
    bpy.data.orphans_purge(do_recursive=True)
    for mesh in meshes:
        mesh.use_fake_user = False
