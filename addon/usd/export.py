# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes materials that hold a group of True Diffuse while Blender exports a stage. Needs pxr."""

import filecmp
import shutil
from array import array
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import bpy

from pxr import Sdf, Usd, UsdGeom, UsdShade

from ..blender import color_spaces, report
from ..material import node_record
from ..material.expression import Attribute, Constant, Expression, NormalMap, walk
from ..material.links import Place, is_used
from ..material.read import Reading, shown
from ..material.read_closures import TARGETS
from ..material.read_nodes import NodeReader, UnsupportedInput
from ..material.restore import kept
from ..material.surface import Loss
from ..nodes import GROUPS
from ..nodes.graph import key_and_version
from . import author, baking, materialx, preview, primvars
from .files import Files, ImageFile
from .network import Primvar
from .separate import VIEWPORT_SHADER, holders_of, separate
from .shapes import Written, shapes_of, spellings

type ExportTexture = Callable[[bpy.types.Image], str]

KEYS = {group.key for group in GROUPS}
OCCLUSION_GROUPS = ("glTF Material Output", "glTF Settings")  # of Blender's glTF importer
OPAQUE = 0.999


@dataclass
class Export:
    """What is known of one stage while Blender writes it."""

    stage: Usd.Stage
    requests: dict[Sdf.Path, dict[Sdf.Path, Primvar]] = field(default_factory=dict)
    messages: dict[Sdf.Path, tuple[str, list[str]]] = field(default_factory=dict)
    """For each material its name in Blender, and what the networks lack."""
    files: dict[str, ImageFile] = field(default_factory=dict)
    """By full name of the image in Blender."""
    paths: dict[str, str] = field(default_factory=dict)
    """In the stage, by full name of the image."""

    _by_name: dict[str, list[bpy.types.Material]] = field(default_factory=dict)
    """The materials of the file by their names in the stage."""

    def add(self, material: bpy.types.Material, usd_material: UsdShade.Material, export_texture: ExportTexture) -> bool:
        """Write a material where it holds a group of True Diffuse; returns whether it does.

        The images of other materials of its name are written, too: Blender writes none when it calls the hook for those.
        """
        if not self._by_name:
            for one in bpy.data.materials:
                for name in spellings(one.name):
                    self._by_name.setdefault(name, []).append(one)
        others = [one for one in self._by_name.get(usd_material.GetPrim().GetName(), ()) if one.name_full != material.name_full]
        for other in others:
            if other.users and other.node_tree and (shown(material) or shown(other)):
                for name in node_record.image_names(node_record.record(other.node_tree)):
                    self._path(name, export_texture)
        target = shown(material)
        if target:
            self._write(material, usd_material, export_texture, target)
        elif muted := _muted(material):
            loss = Loss("", "", f"the muted node {muted.label or muted.name}", "the material is written as Blender has it")
            report.add(material.name, str(loss))
        return target is not None

    def finish(self, written: Written) -> bool:
        """Separate materials of equal names, give UV maps and attributes the names that they have in the stage, and report what the
        materials lack; returns whether there was any of ours.
        """
        holders = holders_of(written)
        items = [item for items in written.values() for item in items if isinstance(item, bpy.types.Object)]
        lost = {slot.material for item in items for slot in item.material_slots if slot.material} - set(holders.values())
        if not self.requests and not any(map(shown, lost)):
            return False
        shapes = shapes_of(self.stage, written)
        if separate(self.stage, shapes, holders, self._write_later):
            shapes = shapes_of(self.stage, written)
        for path, (names, losses) in primvars.settle(self.stage, shapes, self.requests).items():
            material, messages = self.messages[path]
            messages += map(str, losses)
            author.write_names(self.stage.GetPrimAtPath(path), names, messages)
            for message in messages:
                report.add(material, message)
        return True

    def _write_later(self, material: bpy.types.Material, usd_material: UsdShade.Material) -> None:
        """Write a material, of ours or not, whose images are written already."""
        self._write(material, usd_material, lambda _: "", shown(material) or TARGETS[0])

    def _write(
        self, material: bpy.types.Material, usd_material: UsdShade.Material, export_texture: ExportTexture, target: str
    ) -> None:
        """Write both networks and the nodes of a material, of its surface for `target`."""
        stage, path = self.stage, usd_material.GetPath()
        reading = baking.read(material, scale_length(), target)
        losses = [*reading.losses, *_other_tangents(reading, material)]
        occlusion = _occlusion(material, reading)
        files = self._files(reading, material, export_texture, losses)
        own = {name: expression for name, place in reading.places.items() if (expression := _own(place))}
        made, lacking = materialx.network(reading.surface, files, millimeter(stage), own)
        losses += lacking
        simple = None
        if not usd_material.GetPrim().GetChild(VIEWPORT_SHADER):
            simpler = baking.read(material, scale_length(), target, for_preview=True)
            files |= self._files(simpler, material, export_texture, losses)
            simple, lacking = preview.network(simpler.surface, files, own, occlusion)
            said = {loss.parameter for loss in losses if loss.parameter}
            losses += [loss for loss in (*simpler.losses, *lacking) if not loss.parameter or loss.parameter not in said]
        self.requests[path] = author.write(usd_material, simple, made)
        nodes = kept(material)
        images = {name: self._path(name, export_texture) for name in node_record.image_names(nodes)}
        author.write_nodes(usd_material, reading.surface, nodes, {name: path for name, path in images.items() if path})
        self.messages[path] = material.name, [*map(str, dict.fromkeys(losses)), *reading.notes]

    # images

    def _files(self, reading: Reading, material: bpy.types.Material, export_texture: ExportTexture, losses: list[Loss]) -> Files:
        files = Files(attributes=_attribute_types(reading.surface.inputs.values(), material))
        for name, image in reading.images.items():
            path = self._path(name, export_texture)
            if not path:
                continue
            if name not in self.files:
                settings, is_data = image.colorspace_settings, color_spaces.is_data(image)
                space, is_known = ("", True) if is_data else color_spaces.name(settings.name)
                interop_id = "data" if is_data else color_spaces.interop_id(settings.name)
                self.files[name] = ImageFile(path, space, interop_id, *_channels(image), is_known=is_known)
            files[name] = self.files[name]
            if not files[name].is_known:
                what = f"the color space {image.colorspace_settings.name} of the image {image.name}"
                losses.append(Loss("", "", what, f"{files[name].color_space} is written"))
        return files

    def _path(self, name: str, export_texture: ExportTexture) -> str:
        """Write the image of a full name and return its path in the stage; empty where there is no file afterwards.

        Images of one file name are written in the order of their names, whatever the order in which Blender hands over materials.
        """
        if name in self.paths:
            return self.paths[name]
        image = next((image for image in bpy.data.images if image.name_full == name), None)
        if image is None:
            self.paths[name] = ""
            return ""
        earlier = [one for one in bpy.data.images if one.users and one.name_full < name and _file_name(one) == _file_name(image)]
        for one in sorted(earlier, key=lambda one: one.name_full):
            if one.name_full not in self.paths:
                self.paths[one.name_full] = self._written(one, export_texture)
        self.paths[name] = self._written(image, export_texture)
        return self.paths[name]

    def _written(self, image: bpy.types.Image, export_texture: ExportTexture) -> str:
        path = export_texture(image)
        file = Path(self.stage.GetRootLayer().ComputeAbsolutePath(path)) if path else Path()
        if not path or not _exists(file):
            return ""
        if image.source not in ("FILE", "GENERATED"):
            return path
        holder = next((one for one in bpy.data.images if one != image and self.paths.get(one.name_full) == path), None)
        source = _source(holder) if holder else None
        if holder and (source is None or not _equal(source, file)):  # Overwrite Textures has put this image in the holder's place
            separated = self._separated(image, path, file)
            _save(holder, file)
            return separated
        return path if self._is_own(image, file) else self._separated(image, path, file)

    def _is_own(self, image: bpy.types.Image, file: Path) -> bool:
        """Return whether a file has an image's content rather than that of another image of the same file name."""
        source = _source(image)
        if source is not None:
            return _equal(source, file)
        return not any(Path(self.stage.GetRootLayer().ComputeAbsolutePath(path)) == file for path in self.paths.values() if path)

    def _separated(self, image: bpy.types.Image, path: str, file: Path) -> str:
        """Write an image beside `file`, which is another's, and return its path in the stage."""
        for number in count(1):
            free = file.with_name(f"{file.stem}_{number:03}{file.suffix}")
            source = _source(image)
            if not free.exists():
                _save(image, free)
            elif source is None or not _equal(source, free):
                continue
            return path.removesuffix(file.name) + free.name
        raise AssertionError("numbers do not end")


def _muted(material: bpy.types.Material) -> bpy.types.Node | None:
    """Return a muted group of True Diffuse that would reach the output of a material; None where there is none."""
    nodes = material.node_tree.nodes if material.node_tree else ()
    muted = (node for node in nodes if node.mute and key_and_version(node)[0] in KEYS)
    return next((node for node in muted if is_used(node.outputs[0])), None)


def scale_length() -> float:
    """Return the scene's unit in meters."""
    scale = bpy.context.scene.unit_settings.scale_length if bpy.context.scene else 1.0
    return scale if scale > 0.0 else 1.0


def millimeter(stage: Usd.Stage) -> float:
    """Return a millimeter in the stage's units. Blender's exporter takes its own unit for a meter, whatever the scene says."""
    return 0.001 / scale_length() / UsdGeom.GetStageMetersPerUnit(stage)


def _occlusion(material: bpy.types.Material, reading: Reading) -> Expression | None:
    """Return what is linked to the occlusion of the group that Blender's glTF importer makes for it."""
    for node in material.node_tree.nodes:
        if node.type == "GROUP" and node.node_tree and node.node_tree.name.partition(".")[0] in OCCLUSION_GROUPS:
            socket = node.inputs.get("Occlusion")
            if socket and socket.is_linked:
                reader = NodeReader()
                try:
                    expression = reader.expression(Place(socket))
                except UnsupportedInput:
                    return None
                reading.images.update(reader.images)
                return expression
    return None


def _own(place: Place) -> Expression | None:
    """Return the own value of an input."""
    value = getattr(place.socket, "default_value", None)
    if value is None or isinstance(value, str):
        return None
    return Constant(tuple(value)[:3] if hasattr(value, "__len__") else float(value))


def _attribute_types(inputs: Iterable[Expression], material: bpy.types.Material) -> dict[str, str]:
    """Return the data types of the attributes that `inputs` name, on the first mesh with the material that has them."""
    names = {one.name for expression in inputs for one in walk(expression) if isinstance(one, Attribute) and one.name}
    types: dict[str, str] = {}
    for mesh in _meshes(material) if names else ():
        for name in names - set(types):
            if name in mesh.attributes:
                types[name] = mesh.attributes[name].data_type
    return types


def _meshes(material: bpy.types.Material) -> list[bpy.types.Mesh]:
    """Return the meshes with a material, by its name, as Blender hands copies of materials to the hook."""
    return [mesh for mesh in bpy.data.meshes if any(one and one.name_full == material.name_full for one in mesh.materials)]


def _other_tangents(reading: Reading, material: bpy.types.Material) -> list[Loss]:
    """Return the normal maps whose UV map is not the one that renders, of which USD's readers make tangents."""
    meshes = _meshes(material) if reading.surface.uses("normal") else []
    rendered = {layer.name for mesh in meshes for layer in mesh.uv_layers if layer.active_render}
    normals = (one for expression in reading.surface.inputs.values() for one in walk(expression) if isinstance(one, NormalMap))
    return [
        Loss(
            "normal", "", f"a normal map with the tangents of the UV map {one.uv_map}", "those of the UV map that renders are used"
        )
        for one in normals
        if one.uv_map and one.space == "TANGENT" and rendered and one.uv_map not in rendered
    ]


def _channels(image: bpy.types.Image) -> tuple[bool, bool]:
    """Return whether an image's alpha is 1 everywhere, and whether its red, green and blue are equal everywhere."""
    if image.channels < 3 or (not image.has_data and not image.pixels):
        return True, image.channels == 1
    pixels = array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(pixels)
    red, green, blue = (pixels[index :: image.channels].tobytes() for index in range(3))
    is_opaque = image.channels < 4 or min(pixels[3::4], default=1.0) > OPAQUE
    return is_opaque, red == green == blue


def _file_name(image: bpy.types.Image) -> str:
    """Return the name of an image's file, for which Blender takes the image's own where it has none."""
    return bpy.path.basename(image.filepath) or image.name


def _exists(file: Path) -> bool:
    if "<UDIM>" in file.name:
        return any(file.parent.glob(file.name.replace("<UDIM>", "[0-9][0-9][0-9][0-9]")))
    return file.is_file()


def _source(image: bpy.types.Image) -> bytes | Path | None:
    """Return an image's packed file or its path on disk; None where it is in memory alone."""
    if image.packed_file:
        return bytes(image.packed_file.data)
    if image.source == "FILE" and not image.is_dirty:
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        return path if path.is_file() else None
    return None


def _save(image: bpy.types.Image, file: Path) -> None:
    """Write an image's packed file, its file on disk, or what it has in memory, to another file."""
    source = _source(image)
    if isinstance(source, bytes):
        file.write_bytes(source)
    elif source is not None:
        shutil.copyfile(source, file)
    else:
        image.save(filepath=str(file), save_copy=True)


def _equal(source: bytes | Path, file: Path) -> bool:
    if isinstance(source, bytes):
        return file.stat().st_size == len(source) and file.read_bytes() == source
    return source == file or filecmp.cmp(source, file, shallow=False)
