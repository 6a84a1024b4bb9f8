# SPDX-License-Identifier: GPL-3.0-or-later
"""What each material of a glTF file holds, by the specification of glTF 2.0 and of its KHR extensions. No bpy."""

import json
import math
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from true_diffuse.scripts.census.values import PLACES, ImageUse, Place, Value, constant, moved, product

VERTEX_COLOR = "COLOR_0"
# By glTF's number of a component type: struct's letter and the value that stands for 1
COMPONENTS = {5121: ("B", 255), 5123: ("H", 65535), 5126: ("f", 1.0)}
# Channel: where its texture and its factor are, in an extension or in the material; the factor's default; the texture's channel
EXTENSIONS = {
    "specular": ("KHR_materials_specular", "specularTexture", "specularFactor", 1.0, "a"),
    "coat": ("KHR_materials_clearcoat", "clearcoatTexture", "clearcoatFactor", 0.0, "r"),
    "sheen": ("KHR_materials_sheen", "sheenColorTexture", "sheenColorFactor", (0.0, 0.0, 0.0), "rgb"),
    "transmission": ("KHR_materials_transmission", "transmissionTexture", "transmissionFactor", 0.0, "r"),
    "anisotropy": ("KHR_materials_anisotropy", "anisotropyTexture", "anisotropyStrength", 0.0, "b"),
    "thin film": ("KHR_materials_iridescence", "iridescenceTexture", "iridescenceFactor", 0.0, "r"),
}

type Json = Mapping[str, Any]
type Candidates = dict[str, list[Value]]


def read(path: Path) -> dict[str, Candidates]:
    """Return what the materials of a .glb file have on each channel, by name. Raises ValueError where it is no such file."""
    document, buffer = _chunks(path)
    colored: set[int] = set()
    white: set[int] = set()
    for mesh in document.get("meshes", ()):
        for primitive in mesh["primitives"]:
            if "material" in primitive and VERTEX_COLOR in primitive["attributes"]:
                is_white = _is_white(document, buffer, primitive["attributes"][VERTEX_COLOR])
                (white if is_white else colored).add(primitive["material"])
    found = {}
    for index, material in enumerate(document.get("materials", ())):
        channels = _channels(document, material, index in colored)
        if index in white - colored:  # as good as none
            channels["base color"] += _channels(document, material, True)["base color"]
        found[material["name"]] = channels
    return found


def _chunks(path: Path) -> tuple[Json, bytes]:
    """Return the JSON and the buffer of a .glb file."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        raise ValueError(f"{path.name} is no binary glTF file")
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def _is_white(document: Json, buffer: bytes, index: int) -> bool:
    """Return whether an accessor's colors are white everywhere, as those that Blender's exporter fills in."""
    accessor = document["accessors"][index]
    if "bufferView" not in accessor:
        return False
    view = document["bufferViews"][accessor["bufferView"]]
    kind, white = COMPONENTS[accessor["componentType"]]
    width = 3 if accessor["type"] == "VEC3" else 4
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", width * struct.calcsize(kind))
    colors = (struct.unpack_from(f"<{width}{kind}", buffer, start + row * stride) for row in range(accessor["count"]))
    return all(component == white for color in colors for component in color)


def _channels(document: Json, material: Json, has_colors: bool) -> Candidates:
    base = material.get("pbrMetallicRoughness", {})
    extensions = material.get("extensions", {})
    *rgb, alpha = base.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    color_texture = base.get("baseColorTexture")
    packed = base.get("metallicRoughnessTexture")
    colors = Value(attributes=frozenset({VERTEX_COLOR})) if has_colors else Value()
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    emission = product((constant(material.get("emissiveFactor", (0.0, 0.0, 0.0))), constant(strength)))
    found = {
        "base color": product((_texture(document, color_texture, "rgb"), colors, constant(rgb))),
        "roughness": product((_texture(document, packed, "g"), constant(base.get("roughnessFactor", 1.0)))),
        "metallic": product((_texture(document, packed, "b"), constant(base.get("metallicFactor", 1.0)))),
        "emission": product((_texture(document, material.get("emissiveTexture"), "rgb"), emission)),
        "alpha": _alpha(document, material, color_texture, alpha),
        "culling": constant(0.0 if material.get("doubleSided") else 1.0),
    }
    if normal := material.get("normalTexture"):
        found["normal"] = _texture(document, normal, "rgb").but("NORMAL_MAP")
    if occlusion := material.get("occlusionTexture"):
        found["occlusion"] = _texture(document, occlusion, "r")
    for channel, (extension, texture, factor, default, name) in EXTENSIONS.items():
        if extension in extensions:
            values = extensions[extension]
            found[channel] = product((_texture(document, values.get(texture), name), constant(values.get(factor, default))))
    if (specular := extensions.get("KHR_materials_specular")) and (texture := specular.get("specularColorTexture")):
        found["specular"] = product((found["specular"], _texture(document, texture, "rgb")))
    if "KHR_materials_unlit" in extensions:
        found["emission"] = found["base color"]
    return {channel: [value] for channel, value in found.items()}


def _alpha(document: Json, material: Json, texture: Json | None, factor: float) -> Value:
    mode = material.get("alphaMode", "OPAQUE")
    if mode == "OPAQUE":
        return constant(1.0)
    alpha = product((_texture(document, texture, "a"), constant(factor)))
    return alpha.but("CUTOFF") if mode == "MASK" else alpha


def _texture(document: Json, info: Json | None, channel: str) -> Value:
    """Return what a texture of a material gives; 1 where there is none."""
    if info is None:
        return Value()
    texture = document["textures"][info["index"]]
    source = texture.get("source", texture.get("extensions", {}).get("EXT_texture_webp", {}).get("source"))
    image = document["images"][source]
    transform = info.get("extensions", {}).get("KHR_texture_transform", {})
    index = transform.get("texCoord", info.get("texCoord", 0))
    name = image.get("name") or Path(image.get("uri", "")).stem
    return Value(images=frozenset({ImageUse(name, channel, f"TEXCOORD_{index}", _places(transform))}))


def _places(transform: Json) -> tuple[Place, ...] | None:
    offset: Sequence[float] = transform.get("offset", (0.0, 0.0))
    scale: Sequence[float] = transform.get("scale", (1.0, 1.0))
    sine, cosine = math.sin(transform.get("rotation", 0.0)), math.cos(transform.get("rotation", 0.0))

    def place(u: float, v: float) -> Place:
        """Look up a UV coordinate of Blender's, whose v is glTF's 1 - v. The rotation is counter-clockwise in Blender's axes."""
        u, v = u * scale[0], (1.0 - v) * scale[1]
        u, v = cosine * u + sine * v + offset[0], -sine * u + cosine * v + offset[1]
        return u, 1.0 - v

    return moved(place, PLACES)
