# SPDX-License-Identifier: GPL-3.0-or-later
"""What varies over a mesh besides positions and normals, for each corner of its faces: colors, UV maps, tangents."""

import struct
from array import array
from collections.abc import Sequence

import bpy

from .expressions import MeshAttribute

CORNERS = 3  # of a triangle
# By Blender's types of attributes: the property of an item that has its value, and its components
COMPONENTS = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}

type Floats = memoryview[float]


def item_values(items: bpy.types.bpy_prop_collection, name: str, width: int = 1, kind: str = "f") -> array:
    """Return the property `name` of all `items`, `width` numbers each: floats, or integers with `kind` "i"."""
    values = array(kind, bytes(4 * width * len(items)))
    items.foreach_get(name, values)
    return values


def gathered(values: Floats | array[float], width: int, indices: Sequence[int]) -> Floats:
    """Return the items at `indices`, in this order, of an array of items of `width` floats."""
    items = [item for (item,) in struct.iter_unpack(f"{4 * width}s", values)]
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


def corner_values(mesh: bpy.types.Mesh, attribute: MeshAttribute, corners: array[int]) -> Floats | array[float] | None:
    """Return an attribute of each corner, `corners` being their vertices; None where `mesh` lacks it.

    A tangent has the coordinates of its UV map. An attribute has the components of a color: a number three times and 1, a vector
    and 1.
    """
    kind, name = attribute
    match kind:
        case "uv" | "tangent":
            return _corner_uvs(mesh, name)
        case "generated":
            return _corner_generated(mesh, corners)
        case "attribute":
            return _corner_attribute(mesh, name, corners)
    raise ValueError(f"{kind} is no kind of attribute")


def _corner_uvs(mesh: bpy.types.Mesh, name: str) -> array[float] | None:
    """Return the UV coordinates of each corner; without a name those of the map that renders."""
    layer = mesh.uv_layers.get(name) if name else next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return item_values(layer.uv, "vector", 2) if layer else None


def _corner_generated(mesh: bpy.types.Mesh, corners: array[int]) -> Floats:
    """Return the place of each corner in the undeformed mesh's texture space, 0 to 1."""
    places = item_values(mesh.vertices, "undeformed_co", 3)
    for axis in range(3):
        middle, half = mesh.texspace_location[axis], mesh.texspace_size[axis]
        low, scale = middle - half, 0.5 / half if half else 0.0
        places[axis::3] = array("f", ((place - low) * scale for place in places[axis::3]))
    return gathered(places, 3, corners)


def _corner_attribute(mesh: bpy.types.Mesh, name: str, corners: array[int]) -> Floats | array[float] | None:
    """Return an attribute of each corner as a color; without a name the color attribute that renders."""
    index = mesh.color_attributes.render_color_index
    is_default = not name and 0 <= index < len(mesh.color_attributes)
    attribute = mesh.color_attributes[index] if is_default else mesh.attributes.get(name) if name else None
    colors = attribute_colors(attribute) if attribute else None
    if attribute is None or colors is None:
        return None
    match attribute.domain:
        case "CORNER":
            return colors
        case "POINT":
            return gathered(colors, 4, corners)
        case "FACE":
            totals = item_values(mesh.polygons, "loop_total", kind="i")
            return gathered(colors, 4, [face for face, total in enumerate(totals) for _ in range(total)])
    return None


def attribute_colors(attribute: bpy.types.Attribute) -> array[float] | None:
    """Return an attribute's items as colors; None for a type that is none of COMPONENTS."""
    if attribute.data_type not in COMPONENTS:
        return None
    item, width = COMPONENTS[attribute.data_type]
    if item == "value":
        numbers = [0] * len(attribute.data) if attribute.data_type != "FLOAT" else [0.0] * len(attribute.data)
        attribute.data.foreach_get("value", numbers)
        return _as_colors(array("f", (float(number) for number in numbers)), width)
    return _as_colors(item_values(attribute.data, item, width), width)


def _as_colors(values: array[float], width: int) -> array[float]:
    """Return items of `width` components as colors."""
    if width == 4:
        return values
    colors = array("f", (1.0,)) * (4 * (len(values) // width))
    for axis in range(3):
        if axis < width or width == 1:
            colors[axis::4] = values[min(axis, width - 1) :: width]
        else:
            colors[axis::4] = array("f", bytes(4 * (len(values) // width)))
    return colors
