# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in Blender's own File > Import > glTF: made again of the extras that `extras.py` writes, or of the extension
KHR_materials_diffuse_roughness of other programs.

The importer makes its own nodes first, and animates them. They are replaced when it has made the scene, and stay where that fails.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..blender import report
from ..material.restore import restore, undone_on_failure, with_settings
from . import rough_diffuse
from .extras import FAILURES, FORMAT, KEY, Value, core_values

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import Image, Material
    from io_scene_gltf2.io.imp.gltf2_io_gltf import glTFImporter


class Import:
    """One run of the importer. Failures are reported instead of raised: the import goes on."""

    def __init__(self) -> None:
        self._extras: dict[int, object] = {}
        self._made: list[tuple[Material, str | None, bpy.types.Material]] = []
        self._scene_is_made = False
        self._images_before: set[int] = set()

    def begin(self) -> None:
        """Get ready for a file."""
        self.__init__()
        self._images_before = {image.session_uid for image in bpy.data.images}

    def take_extras(self, gltf_material: "Material") -> None:
        """Take our extras, of which the importer would make a custom property."""
        if isinstance(gltf_material.extras, dict) and KEY in gltf_material.extras:
            self._extras[id(gltf_material)] = gltf_material.extras.pop(KEY)

    def add(self, gltf: "glTFImporter", gltf_material: "Material", vertex_color: str | None, material: bpy.types.Material) -> None:
        """Note a material that the importer has made; it is ours at `finish`, or now where that was."""
        self._made.append((gltf_material, vertex_color, material))
        if self._scene_is_made:
            self.finish(gltf)

    def finish(self, gltf: "glTFImporter") -> None:
        """Make the materials ours that are so in the file."""
        self._scene_is_made = True
        restored: dict[int, bpy.types.Material] = {}
        for gltf_material, vertex_color, material in self._made:
            there = restored.get(id(gltf_material))
            if there:  # the importer makes a material of each vertex color that it multiplies the base color by
                material.user_remap(there)
                bpy.data.materials.remove(material)
            elif id(gltf_material) in self._extras and self._restore(gltf, gltf_material, material):
                restored[id(gltf_material)] = material
            else:
                _convert(gltf, gltf_material, vertex_color, material)
        self._made.clear()

    def _restore(self, gltf: "glTFImporter", gltf_material: "Material", material: bpy.types.Material) -> bool:
        """Make a material again of our extras; returns whether that was possible, and says so where not."""
        try:
            data = self._extras[id(gltf_material)]
            if not isinstance(data, dict):
                raise TypeError("they are no object")
            if not isinstance(data["format"], int) or data["format"] > FORMAT:
                raise ValueError("a newer True Diffuse has written them")
            changed = list(_changes(data.get("written", {}), core_values(gltf.data, gltf_material)))
            if changed:
                report.add(material.name, f"another program has changed its {', '.join(changed)}: its nodes are made of that")
                return False
            with undone_on_failure(material):
                messages = self._rebuild(gltf, data, material)
        except FAILURES as error:
            reason = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error) or type(error).__name__
            report.add(material.name, f"its extras are damaged, and glTF's values are used: {reason.partition('\n')[0]}")
            return False
        for message in messages:
            report.add(material.name, message)
        return True

    def _rebuild(self, gltf: "glTFImporter", data: Mapping[str, Any], material: bpy.types.Material) -> list[str]:
        def load(name: str, settings: Mapping[str, Any], problems: list[str]) -> bpy.types.Image | None:
            found = _image(gltf, data["images"][name]) if name in data["images"] else None
            image = bpy.data.images.get(found.blender_image_name or "") if found else None
            if not (found and image):
                return None
            is_new = image.session_uid not in self._images_before
            if is_new and image.name == Path(name).stem:  # the exporter drops the suffix of a file's name
                image.name = name
                found.blender_image_name = image.name
            if missing := rough_diffuse.missing_file(image):
                problems.append(f"the image file {missing} is missing")
            return with_settings(image, settings, problems, is_shared=not is_new)

        names = {kind: {name: _imported(one) for name, one in data["names"][kind].items()} for kind in ("uv", "color")}
        is_animated = material.node_tree.animation_data is not None
        messages = restore(material, data["nodes"], names, load)
        return [*messages, "its animation is not restored"] if is_animated else messages


def _convert(gltf: "glTFImporter", gltf_material: "Material", vertex_color: str | None, material: bpy.types.Material) -> None:
    """Make a material ours that has another program's rough diffuse reflection."""
    try:
        with undone_on_failure(material):
            for message in rough_diffuse.convert(gltf, gltf_material, vertex_color, material):
                report.add(material.name, message)
    except FAILURES as error:
        report.add(material.name, f"is left as Blender has it: {str(error).partition('\n')[0] or type(error).__name__}")


def _image(gltf: "glTFImporter", entry: Mapping[str, Any]) -> "Image | None":
    """Return an image of the file, imported, by name where other programs have changed indices; None where it is not there."""
    from io_scene_gltf2.blender.imp.image import BlenderImage

    images, index = gltf.data.images or [], entry["index"]
    if not isinstance(index, int) or not 0 <= index < len(images) or images[index].name != entry["name"]:
        matching = [number for number, one in enumerate(images) if one.name == entry["name"]]
        if len(matching) != 1:
            return None
        index = matching[0]
    BlenderImage.create(gltf, index)
    return images[index]


def _imported(attribute: str) -> str:
    """Return what the importer calls an attribute of a mesh."""
    kind, _, number = attribute.rpartition("_")
    name = {"TEXCOORD": "UVMap", "COLOR": "Color"}.get(kind)
    if name is None:
        return attribute
    return f"{name}.{int(number):03}" if int(number) else name


def _changes(written: Mapping[str, Value], found: Mapping[str, Value]) -> Iterator[str]:
    """Yield the names of values that are not those that we wrote."""

    def differ(a: Value, b: Value) -> bool:
        if isinstance(a, list) and isinstance(b, list):
            return len(a) != len(b) or any(map(differ, a, b))
        if isinstance(a, (int, float)) and isinstance(b, (int, float)):  # which other programs may write as 32-bit floats
            return not math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-6)
        return a != b

    for name, value in found.items():
        if name in written and differ(written[name], value):
            yield name
