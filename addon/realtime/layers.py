# SPDX-License-Identifier: GPL-3.0-or-later
"""What varies over a mesh beside its places and normals, for each corner of its faces: colors, UV maps, tangents."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..material.read import DEFAULT_COLOR, DEFAULT_UV

CORNERS = 3  # of a triangle

type Floats = memoryview[float]
type Layer = tuple[str, str]
"""What the shader calls it, one of WIDTHS; the color attribute or UV map of the mesh that it is made of."""

WIDTHS = {"color": 4, "uv": 2, "relief_uv": 2, "tangent": 4}  # components


def layer_values(mesh: bpy.types.Mesh, layer: Layer, corners: array[int]) -> Floats | array[float] | None:
    """Return a color attribute's or UV map's values for each corner of `mesh`; None where it has no such layer.

    Of tangents those of their UV map, of which `Faces` makes them. `corners` are their vertices.
    """
    kind, name = layer
    return _colors(mesh, name, corners) if kind == "color" else _uv_map(mesh, name)


def gathered(numbers: Floats | array[float], width: int, indices: Sequence[int]) -> Floats:
    """Return the `width` floats of each of `indices`, in their order."""
    raw, size = numbers.tobytes(), 4 * width
    items = [raw[at : at + size] for at in range(0, len(raw), size)]
    return memoryview(b"".join(map(items.__getitem__, indices))).cast("f")


def _colors(mesh: bpy.types.Mesh, name: str, corners: array[int]) -> Floats | array[float] | None:
    """Return a linear color for each corner; None where `mesh` has no such attribute."""
    shown = mesh.color_attributes.render_color_index
    found = mesh.color_attributes[shown] if name == DEFAULT_COLOR and 0 <= shown < len(mesh.color_attributes) else None
    attribute = found or mesh.color_attributes.get(name)
    if attribute is None:
        return None
    colors = array("f", bytes(16 * len(attribute.data)))
    attribute.data.foreach_get("color", colors)
    return gathered(colors, 4, corners) if attribute.domain == "POINT" else colors


def _uv_map(mesh: bpy.types.Mesh, name: str) -> array[float] | None:
    """Return the UV coordinates of each corner; None where `mesh` has no such map."""
    shown = next((layer for layer in mesh.uv_layers if layer.active_render), None) if name == DEFAULT_UV else None
    layer = shown or mesh.uv_layers.get(name)
    if layer is None:
        return None
    places = array("f", bytes(8 * len(layer.uv)))
    layer.uv.foreach_get("vector", places)
    return places


@dataclass(frozen=True)
class Faces:
    """Triangles of a mesh, by its corners, each of which has a vertex and a normal."""

    positions: array[float]  # of vertices
    normals: array[float]
    corners: array[int]
    triangles: array[int]

    @classmethod
    def of(cls, mesh: bpy.types.Mesh, corners: array[int], triangles: array[int]) -> "Faces":
        positions, normals = array("f", bytes(12 * len(mesh.vertices))), array("f", bytes(12 * len(corners)))
        mesh.attributes["position"].data.foreach_get("vector", positions)
        mesh.corner_normals.foreach_get("vector", normals)
        return cls(positions, normals, corners, triangles)

    def tangents(self, places: Floats | array[float], spare: bpy.types.Mesh) -> Floats:
        """Return for each corner MikkTSpace's unit tangent along u, and the sign of n x tangent along v; 0 where no triangle is.

        `places` are UV coordinates; `spare` is overwritten. They are those of triangles, as in Cycles, and as Blender has none of
        faces of more than four corners.
        """
        count = len(self.triangles)
        spare.clear_geometry()
        spare.vertices.add(len(self.positions) // 3)
        spare.attributes["position"].data.foreach_set("vector", self.positions)
        spare.loops.add(count)
        spare.loops.foreach_set("vertex_index", array("i", map(self.corners.__getitem__, self.triangles)))
        spare.polygons.add(count // CORNERS)
        spare.polygons.foreach_set("loop_start", array("i", range(0, count, CORNERS)))
        normals = spare.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER")
        normals.data.foreach_set("vector", gathered(self.normals, 3, self.triangles))
        spare.uv_layers.new(name="UVMap").uv.foreach_set("vector", gathered(places, 2, self.triangles))
        spare.calc_tangents(uvmap="UVMap")
        tangents, signs = array("f", bytes(12 * count)), array("f", bytes(4 * count))
        spare.loops.foreach_get("tangent", tangents)
        spare.loops.foreach_get("bitangent_sign", signs)
        both = array("f", bytes(16 * count + 16))  # the last for corners without a triangle
        for axis in range(3):
            both[axis:-4:4] = tangents[axis::3]
        both[3:-4:4] = signs
        last = [count] * len(self.corners)
        for at, corner in enumerate(self.triangles):
            last[corner] = at
        return gathered(both, 4, last)
