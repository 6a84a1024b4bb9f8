# SPDX-License-Identifier: GPL-3.0-or-later
"""What varies over a mesh besides positions and normals, for each corner of its faces: colors, UV maps, tangents."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..material.read import DEFAULT_COLOR, DEFAULT_UV

CORNERS = 3  # of a triangle

type Floats = memoryview[float]
type MeshAttribute = tuple[str, str]
"""The shader's name for it, a key of WIDTHS, and the name of the mesh's color attribute or UV map that it is made of."""

WIDTHS = {"color": 4, "uv": 2, "normal_uv": 2, "tangent": 4}  # components


def attribute_values(mesh: bpy.types.Mesh, attribute: MeshAttribute, corners: array[int]) -> Floats | array[float] | None:
    """Return the values of a color attribute or UV map for each corner of `mesh`; None where `mesh` does not have it.

    For a tangent these are the values of its UV map, from which `Faces.tangents` computes it. `corners` are the corners' vertices.
    """
    kind, name = attribute
    return _colors(mesh, name, corners) if kind == "color" else _uv_map(mesh, name)


def gathered(values: Floats | array[float], width: int, indices: Sequence[int]) -> Floats:
    """Return the items at `indices`, in this order, of an array of items of `width` floats."""
    raw, size = values.tobytes(), 4 * width
    items = [raw[start : start + size] for start in range(0, len(raw), size)]
    return memoryview(b"".join(map(items.__getitem__, indices))).cast("f")


@dataclass(frozen=True)
class Faces:
    """A mesh's triangles. `positions` are those of vertices, `normals` those of corners; `corners` has the vertex of each corner,
    `triangles` three corners for each triangle.
    """

    positions: array[float]
    normals: array[float]
    corners: array[int]
    triangles: array[int]

    @classmethod
    def of(cls, mesh: bpy.types.Mesh, corners: array[int], triangles: array[int]) -> "Faces":
        """Return the faces of `mesh`, of which `corners` and `triangles` have been read already."""
        positions, normals = array("f", bytes(12 * len(mesh.vertices))), array("f", bytes(12 * len(corners)))
        mesh.attributes["position"].data.foreach_get("vector", positions)
        mesh.corner_normals.foreach_get("vector", normals)
        return cls(positions, normals, corners, triangles)

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
        tangents, signs = array("f", bytes(12 * count)), array("f", bytes(4 * count))
        scratch.loops.foreach_get("tangent", tangents)
        scratch.loops.foreach_get("bitangent_sign", signs)
        both = array("f", bytes(16 * count + 16))  # the last item is for corners without a triangle
        for axis in range(3):
            both[axis:-4:4] = tangents[axis::3]
        both[3:-4:4] = signs
        last = [count] * len(self.corners)
        for index, corner in enumerate(self.triangles):
            last[corner] = index
        return gathered(both, 4, last)


def _colors(mesh: bpy.types.Mesh, name: str, corners: array[int]) -> Floats | array[float] | None:
    """Return the linear color of each corner; None where `mesh` has no such attribute."""
    index = mesh.color_attributes.render_color_index
    is_default = name == DEFAULT_COLOR and 0 <= index < len(mesh.color_attributes)
    attribute = mesh.color_attributes[index] if is_default else mesh.color_attributes.get(name)
    if attribute is None:
        return None
    colors = array("f", bytes(16 * len(attribute.data)))
    attribute.data.foreach_get("color", colors)
    return gathered(colors, 4, corners) if attribute.domain == "POINT" else colors


def _uv_map(mesh: bpy.types.Mesh, name: str) -> array[float] | None:
    """Return the UV coordinates of each corner; None where `mesh` has no such map."""
    active = next((layer for layer in mesh.uv_layers if layer.active_render), None) if name == DEFAULT_UV else None
    layer = active or mesh.uv_layers.get(name)
    if layer is None:
        return None
    values = array("f", bytes(8 * len(layer.uv)))
    layer.uv.foreach_get("vector", values)
    return values
