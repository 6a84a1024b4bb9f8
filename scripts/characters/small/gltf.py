# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a glTF 2.0 binary file: one node with one mesh, a primitive for each material. No bpy.

Numbers of glTF's JSON: component types 5126 float, 5125 unsigned int; targets 34962 vertices, 34963 indices.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from true_diffuse.scripts.characters.small.figure import Part, Vector

type Json = Mapping[str, Json] | Sequence[Json] | str | float | bool

TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
LINEAR, LINEAR_MIPMAP_LINEAR, REPEAT = 9729, 9987, 10497


@dataclass
class Primitive:
    """A mesh with one material, in glTF's JSON; in place of a texture's index a material has the name of an image."""

    part: Part
    material: Mapping[str, Json]
    colors: Sequence[Vector] = ()
    """Linear RGBA of each vertex, or none."""


@dataclass
class _Buffer:
    data: bytearray = field(default_factory=bytearray)
    views: list[dict[str, int]] = field(default_factory=list)
    accessors: list[dict[str, Json]] = field(default_factory=list)

    def view(self, data: bytes, **target: int) -> int:
        """Append bytes; return the index of their view."""
        self.data += bytes(-len(self.data) % 4)
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **target})
        self.data += data
        return len(self.views) - 1

    def floats(self, values: Sequence[Vector]) -> int:
        """Append a float attribute of the vertices; return the index of its accessor."""
        width = len(values[0])
        flat = [component for value in values for component in value]
        view = self.view(struct.pack(f"<{len(flat)}f", *flat), target=34962)
        limits = {
            name: [struct.unpack("<f", struct.pack("<f", limit(column)))[0] for column in zip(*values, strict=True)]
            for name, limit in (("min", min), ("max", max))
        }
        self.accessors.append({"bufferView": view, "componentType": 5126, "count": len(values), "type": TYPES[width], **limits})
        return len(self.accessors) - 1

    def indices(self, triangles: Sequence[Vector]) -> int:
        """Append the corners of triangles; return the index of their accessor."""
        flat = [int(corner) for triangle in triangles for corner in triangle]
        view = self.view(struct.pack(f"<{len(flat)}I", *flat), target=34963)
        self.accessors.append({"bufferView": view, "componentType": 5125, "count": len(flat), "type": "SCALAR"})
        return len(self.accessors) - 1


def glb(name: str, primitives: Sequence[Primitive], images: Mapping[str, bytes], second_uv_map: bool = False) -> bytes:
    """Return the file. `images` are PNG files by the names that the materials use."""
    buffer = _Buffer()
    used = list(images)
    parts = []
    for index, primitive in enumerate(primitives):
        part = primitive.part
        attributes = {"POSITION": part.positions, "NORMAL": part.normals, "TEXCOORD_0": part.uvs}
        if second_uv_map:
            attributes["TEXCOORD_1"] = part.front_uvs
        if primitive.colors:
            attributes["COLOR_0"] = list(primitive.colors)
        parts.append(
            {
                "attributes": {key: buffer.floats(values) for key, values in attributes.items()},
                "indices": buffer.indices(part.triangles),
                "material": index,
            }
        )
    materials = [_with_indices(primitive.material, used) for primitive in primitives]
    extensions = sorted(_extensions(materials))
    document: dict[str, Json] = {
        "asset": {"version": "2.0", "generator": "True Diffuse", "copyright": "CC0"},
        **({"extensionsUsed": extensions} if extensions else {}),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0}],
        "meshes": [{"name": name, "primitives": parts}],
        "materials": materials,
    }
    if used:
        document["images"] = [{"name": image, "mimeType": "image/png", "bufferView": buffer.view(images[image])} for image in used]
        document["samplers"] = [
            {"magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": REPEAT, "wrapT": REPEAT},
        ]
        document["textures"] = [{"source": index, "sampler": 0} for index in range(len(used))]
    buffer.data += bytes(-len(buffer.data) % 4)
    document |= {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(buffer.data), 0x004E4942) + buffer.data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _with_indices(value: Json, images: Sequence[str]) -> Json:
    """Return a part of the JSON with the index of a texture in place of the name of an image."""
    if isinstance(value, Mapping):
        return {
            key: images.index(item) if key == "index" and isinstance(item, str) else _with_indices(item, images)
            for key, item in value.items()
        }
    return [_with_indices(item, images) for item in value] if isinstance(value, list) else value


def _extensions(value: Json) -> set[str]:
    """Return the names of all extensions in a part of the JSON."""
    if isinstance(value, list):
        return set().union(*map(_extensions, value))
    if not isinstance(value, Mapping):
        return set()
    extensions = value.get("extensions", {})
    own = set(extensions) if isinstance(extensions, Mapping) else set()
    return own.union(*map(_extensions, value.values()))
