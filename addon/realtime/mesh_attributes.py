# SPDX-License-Identifier: GPL-3.0-or-later
"""What varies over a mesh besides positions and normals, for each corner of its faces: colors, UV maps, tangents."""

from array import array
from collections.abc import Sequence

import bpy

from ..material.read import DEFAULT_COLOR, DEFAULT_UV

CORNERS = 3  # of a triangle

type Floats = memoryview[float]
type MeshAttribute = tuple[str, str]
"""The shader's name for it, a key of WIDTHS, and the name of the mesh's color attribute or UV map that it is made of."""

WIDTHS = {"color": 4, "uv": 2, "normal_uv": 2, "tangent": 4}  # components


def item_values(items: bpy.types.bpy_prop_collection, name: str, width: int = 1, kind: str = "f") -> array:
    """Return the property `name` of all `items`, `width` numbers each: floats, or integers with `kind` "i"."""
    values = array(kind, bytes(4 * width * len(items)))
    items.foreach_get(name, values)
    return values


def gathered(values: Floats | array[float], width: int, indices: Sequence[int]) -> Floats:
    """Return the items at `indices`, in this order, of an array of items of `width` floats."""
    raw, size = values.tobytes(), 4 * width
    items = [raw[start : start + size] for start in range(0, len(raw), size)]
    return memoryview(b"".join(map(items.__getitem__, indices))).cast("f")


class Faces:
    """The triangles of `mesh`; `corners` has the vertex of each corner, `triangles` three corners for each triangle."""

    def __init__(self, mesh: bpy.types.Mesh, corners: array[int], triangles: array[int]) -> None:
        self.positions = item_values(mesh.attributes["position"].data, "vector", 3)
        self.normals = item_values(mesh.corner_normals, "vector", 3)
        self.corners, self.triangles = corners, triangles

    def tangents(self, uv: Floats | array[float], scratch: bpy.types.Mesh) -> Floats:
        """Return MikkTSpace's unit tangent along u for each corner, and in w the sign with which n x tangent is along v.

        Corners without a triangle have 0. `uv` are the corners' UV coordinates; `scratch` is overwritten. The tangents are those of
        the triangulated mesh, as in Cycles: Blender computes none for faces of more than four corners.
        """
        count = len(self.triangles)
        scratch.clear_geometry()
        scratch.vertices.add(len(self.positions) // 3)
        scratch.attributes["position"].data.foreach_set("vector", self.positions)
        scratch.loops.add(count)
        scratch.loops.foreach_set("vertex_index", array("i", map(self.corners.__getitem__, self.triangles)))
        scratch.polygons.add(count // CORNERS)
        scratch.polygons.foreach_set("loop_start", array("i", range(0, count, CORNERS)))
        normals = scratch.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", gathered(self.normals, 3, self.triangles))
        scratch.uv_layers.new(name="UVMap").uv.foreach_set("vector", gathered(uv, 2, self.triangles))
        scratch.calc_tangents(uvmap="UVMap")
        tangents, signs = item_values(scratch.loops, "tangent", 3), item_values(scratch.loops, "bitangent_sign")
        both = array("f", bytes(16 * count + 16))  # the last item is for corners without a triangle
        for axis in range(3):
            both[axis:-4:4] = tangents[axis::3]
        both[3:-4:4] = signs
        last = [count] * len(self.corners)
        for index, corner in enumerate(self.triangles):
            last[corner] = index
        return gathered(both, 4, last)


def corner_colors(mesh: bpy.types.Mesh, name: str, corners: array[int]) -> Floats | array[float] | None:
    """Return the linear color of each corner, `corners` being their vertices; None where `mesh` has no such attribute."""
    index = mesh.color_attributes.render_color_index
    is_default = name == DEFAULT_COLOR and 0 <= index < len(mesh.color_attributes)
    attribute = mesh.color_attributes[index] if is_default else mesh.color_attributes.get(name)
    if attribute is None:
        return None
    colors = item_values(attribute.data, "color", 4)
    return gathered(colors, 4, corners) if attribute.domain == "POINT" else colors


def corner_uvs(mesh: bpy.types.Mesh, name: str) -> array[float] | None:
    """Return the UV coordinates of each corner; None where `mesh` has no such map."""
    active = next((layer for layer in mesh.uv_layers if layer.active_render), None) if name == DEFAULT_UV else None
    layer = active or mesh.uv_layers.get(name)
    return item_values(layer.uv, "vector", 2) if layer else None
