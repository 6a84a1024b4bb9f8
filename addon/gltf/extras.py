# SPDX-License-Identifier: GPL-3.0-or-later
"""All of a material's nodes in the extras of its glTF material, from which `importer.py` makes the same material again.

`trueDiffuse` in the extras holds

- format: a number, larger where an earlier version cannot read it;
- nodes: what `material/restore.py` keeps of a material;
- images: for the full name of each image in the nodes its index and name among the file's images;
- names: what the UV maps and attributes that nodes name are called in the file (TEXCOORD_1, COLOR_0, _NAME);
- written: what the core of the material had, by which an import finds out that another program has changed it.
"""

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..blender.id_properties import MATERIAL_MARKS
from ..material import node_record
from ..material.restore import NAMES, UNNAMED, kept, nodes_of
from . import diffuse_roughness

if TYPE_CHECKING:
    from io_scene_gltf2.blender.exp.material.encode_image import ExportImage
    from io_scene_gltf2.blender.exp.primitive_extract import PrimitiveCreator
    from io_scene_gltf2.io.com.gltf2_io import Gltf, Image, Material

KEY = "trueDiffuse"
FORMAT = 1

FAILURES = (
    RuntimeError, TypeError, ValueError, LookupError, AttributeError, ImportError, AssertionError, ArithmeticError, OSError,
    ReferenceError,
)  # fmt: skip
"""After which an export or import goes on."""

type Value = float | bool | str | list[float] | None


class Kept(dict[str, Any]):
    """What the extras of a material hold. The copies that the exporter makes of materials, for meshes that number their UV maps in
    another way, hold the same, so that it can be filled in the end."""

    def __deepcopy__(self, _memo: object) -> "Kept":
        return self


@dataclass
class Names:
    """What the UV maps and attributes of the meshes with a material are called in the file, by their names in Blender."""

    uv: dict[str, str] = field(default_factory=dict)
    color: dict[str, str] = field(default_factory=dict)
    disagreements: dict[str, list[str]] = field(default_factory=dict)
    """Messages, by name."""

    def add(self, mesh: str, uv: Mapping[str, str], color: Mapping[str, str]) -> None:
        """Add those of one more mesh; where meshes disagree, the first counts."""
        for own, found in ((self.uv, uv), (self.color, color)):
            for name, attribute in found.items():
                if own.setdefault(name, attribute) != attribute:
                    what = name or "what renders"
                    line = f"{what} is {attribute} in the mesh {mesh}, an import takes {own[name]} for all meshes"
                    self.disagreements.setdefault(name, []).append(line)

    @staticmethod
    def used(names: Mapping[str, str], named: Collection[str]) -> dict[str, str]:
        """Return those of `names` that are `named`, without what renders where that is the first, which renders in an import."""
        return {name: one for name, one in sorted(names.items()) if name in named and (name or not one.endswith("_0"))}


class Extras:
    """What one export keeps of our materials."""

    def __init__(self) -> None:
        self._materials: list[tuple[bpy.types.Material, Kept]] = []
        self._images: dict[str, Image | None] = {}
        self._names: dict[int, Names] = {}

    def add_material(self, gltf_material: "Material", material: bpy.types.Material) -> None:
        """Add the extras to one of our materials, beside the artist's custom properties; `write` fills them."""
        data, own = Kept(), gltf_material.extras or {}
        gltf_material.extras = {key: value for key, value in own.items() if key not in MATERIAL_MARKS} | {KEY: data}
        self._materials.append((material.original, data))

    def add_image(self, image: "Image", export_image: "ExportImage", settings: dict) -> None:
        """Note an image that the exporter writes for any material, if it is one of Blender's as it is."""
        own = export_image.original or export_image.blender_image(settings)
        if own:
            self._images.setdefault(own.name_full, image)

    def add_mesh(self, creator: "PrimitiveCreator") -> None:
        """Note what the exporter calls the UV maps and attributes of a mesh."""
        mesh = creator.blender_mesh
        layers = mesh.uv_layers[: creator.tex_coord_max]
        uv = {layer.name: f"TEXCOORD_{index}" for index, layer in enumerate(layers)}
        uv |= {name: f"TEXCOORD_{len(layers) + index}" for index, name in enumerate(creator.uvmap_attribute_list)}
        if layers:
            uv[""] = f"TEXCOORD_{mesh.uv_layers.active_render_index}"
        custom = {one["blender_name"]: one["gltf_attribute_name"] for one in creator.blender_attributes if "blender_name" in one}
        colors = {one["color"]: one["gltf_name"] for one in creator.vc_infos if not one["forced"]}
        rendered = mesh.color_attributes.render_color_index
        if rendered >= 0 and mesh.color_attributes[rendered].name in colors:
            colors[""] = colors[mesh.color_attributes[rendered].name]
        for material in filter(None, creator.materials):
            self._names.setdefault(material.original.session_uid, Names()).add(mesh.name, uv, custom | colors)

    def write(self, settings: dict) -> Iterator[tuple[str, str]]:
        """Fill the extras; yields messages on what is not in them, each with a material's name.

        Images that are in no texture are added to the file. Call it when all materials and meshes are known.
        """
        for material, data in self._materials:
            try:
                messages = list(self._fill(data, material, settings))
            except FAILURES as error:
                messages = [f"an import will not make the nodes again: {error or type(error).__name__}"]
            for message in dict.fromkeys(messages):
                yield material.name, message

    def write_values(self, document: "Gltf") -> None:
        """Add what the core of each material has, once the indices of its textures are known, and remove extras with nothing."""
        for material in document.materials:
            data = (material.extras or {}).get(KEY)
            if data:
                data["written"] = core_values(document, material)
            elif data is not None:
                del material.extras[KEY]
                material.extras = material.extras or None

    def _fill(self, data: Kept, material: bpy.types.Material, settings: dict) -> Iterator[str]:
        nodes = kept(material)
        try:
            json.dumps(nodes, allow_nan=False)
        except ValueError:
            yield "a value is not a number: an import will not make the nodes again"
            return
        full_names = node_record.image_names(nodes)
        if any(image.source == "TILED" for image in _found(full_names)):
            yield "an image has tiles: an import will not make the nodes again"
            return
        names = self._names.get(material.session_uid, Names())
        images, messages = {}, []
        for name in full_names:
            image = self._image(name, settings, messages)
            if image:
                images[name] = {"index": image, "name": image.name}
        yield from messages
        uv, color = _named(nodes)
        used = {"uv": names.used(names.uv, uv), "color": names.used(names.color, color)}
        for name in sorted(uv | color):
            yield from names.disagreements.get(name, ())
        for name in sorted((uv | color) - names.uv.keys() - names.color.keys() - {""}):
            yield f"an import will find no UV map or attribute {name}"
        if names.used(names.uv, {""}) and _reads_unnamed(nodes):
            yield "the UV map that renders is not the first: an import will take the first"
        data |= {"format": FORMAT, "nodes": nodes, "images": images, "names": used}

    def _image(self, name: str, settings: dict, messages: list[str]) -> "Image | None":
        """Return the image of a full name in the file, None where there is none; adds what it lacks to `messages`."""
        image = next(iter(_found([name])), None)
        if image and name not in self._images:
            self._images[name] = _written(image, settings) if settings["gltf_image_format"] != "NONE" else None
        if self._images.get(name) is None:
            messages.append(f"the image {name} is not in the file")
        elif image and image.is_float and (image.source != "FILE" or image.file_format != "PNG"):  # one of 16 bits goes as it is
            messages.append(f"the image {name} has 8 bits a channel in the file")
        return self._images.get(name)


def _found(full_names: list[str]) -> list[bpy.types.Image]:
    return [image for image in bpy.data.images if image.name_full in full_names]


def _written(image: bpy.types.Image, settings: dict) -> "Image | None":
    """Return a new image of the file with what `image` has, None where it has nothing."""
    from io_scene_gltf2.blender.exp.material.encode_image import ExportImage
    from io_scene_gltf2.blender.exp.material.image import set_real_uri
    from io_scene_gltf2.io.com.gltf2_io import Image
    from io_scene_gltf2.io.exp.binary_data import BinaryData
    from io_scene_gltf2.io.exp.image_data import ImageData

    kind = image.file_format if settings["gltf_image_format"] == "AUTO" else settings["gltf_image_format"]
    if kind not in ("JPEG", "WEBP") or (kind == "JPEG" and image.depth > 24):  # an alpha
        kind = "PNG"
    mime_type, name = f"image/{kind.lower()}", image.name.removesuffix(Path(image.name).suffix)
    pixels = ExportImage.from_blender_image(image)
    data = b"" if pixels.empty() else pixels.encode(mime_type, settings)[0]  # empty: its file is missing
    if not data:
        return None
    if settings["gltf_format"] != "GLTF_SEPARATE":
        return Image(BinaryData(data=data), None, None, mime_type, name, None)
    file = ImageData(data=data, mime_type=mime_type, name=name)
    set_real_uri(file, settings)
    return Image(None, None, None, mime_type, name, file)


def _named(nodes: node_record.Record) -> tuple[set[str], set[str]]:
    """Return the names of UV maps and of colors or other attributes in a record; an empty one for those that render."""
    uv: set[str] = set()
    color: set[str] = set()
    for node in nodes_of(nodes):
        properties = node.get("properties", {})
        for found, keys in ((uv, NAMES["uv"]), (color, NAMES["color"])):
            found |= {properties.get(key, "") for key in keys if key in properties or UNNAMED.get(node["kind"]) == key}
        if node["kind"] == "ShaderNodeAttribute" and "attribute_type" not in properties:
            color.add(properties.get("attribute_name", ""))
            uv.add(properties.get("attribute_name", ""))
    return uv, color


def _reads_unnamed(nodes: node_record.Record) -> bool:
    """Return whether a node takes the UV map that renders without a name that an import could give it."""
    links = [link for tree in _trees(nodes) for link in tree["links"]]
    linked = {(target, socket) for _, _, target, socket, _ in links}
    used = {(origin, socket) for origin, socket, *_ in links}
    for node in nodes_of(nodes):
        if node["kind"] == "ShaderNodeTexImage" and (node["name"], "Vector") not in linked:
            return True
        if node["kind"] == "ShaderNodeTexCoord" and (node["name"], "UV") in used:
            return True
    return False


def _trees(nodes: node_record.Record) -> Iterator[node_record.Record]:
    yield nodes
    for node in nodes_of(nodes):
        if "tree" in node:
            yield node["tree"]


def core_values(document: "Gltf", material: "Material") -> dict[str, Value]:
    """Return what a glTF material has for programs that do not know us, with the names of images instead of textures."""

    def image(info: object) -> str | None:
        index = info.get("index") if isinstance(info, dict) else getattr(info, "index", None)
        if not isinstance(index, int) or not 0 <= index < len(document.textures or ()):
            return None
        texture = document.textures[index]
        webp = (texture.extensions or {}).get("EXT_texture_webp", {})
        source = webp.get("source") if texture.source is None else texture.source
        return None if source is None else document.images[source].name

    pbr, rough = material.pbr_metallic_roughness, (material.extensions or {}).get(diffuse_roughness.NAME, {})
    values: dict[str, Value] = {
        "emissive factor": material.emissive_factor or [0.0, 0.0, 0.0],
        "emissive texture": image(material.emissive_texture),
        "normal texture": image(material.normal_texture),
        "alpha mode": material.alpha_mode or "OPAQUE",
        "double sided": bool(material.double_sided),
        "diffuse roughness": rough.get("diffuseRoughnessFactor", 0.0),
        "diffuse roughness texture": image(rough.get("diffuseRoughnessTexture")),
    }
    for name, extension in (material.extensions or {}).items():
        if name != diffuse_roughness.NAME:
            values |= {f"{name}.{key}": value for key, value in extension.items() if isinstance(value, (int, float, list))}
    if pbr:
        values |= {
            "base color": pbr.base_color_factor or [1.0, 1.0, 1.0, 1.0],
            "base color texture": image(pbr.base_color_texture),
            "metallic factor": 1.0 if pbr.metallic_factor is None else pbr.metallic_factor,
            "roughness factor": 1.0 if pbr.roughness_factor is None else pbr.roughness_factor,
            "metallic and roughness texture": image(pbr.metallic_roughness_texture),
        }
    return values
