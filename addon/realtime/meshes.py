# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes on the driver: one buffer of positions and normals, indices for each material slot, other attributes on demand."""

import math
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain, compress

import bpy

import gpu

from .expressions import WIDTHS, MeshAttribute, attribute_name
from .mesh_attributes import CORNERS, Faces, Floats, corner_values, gathered, item_values

MAX_HULL_TRIANGLES = 64  # meshes of more triangles have their box as hull
LARGEST = 1e18  # its square is a finite 32-bit float, too

type Point = tuple[float, float, float]


class Geometry[Data: bpy.types.ID]:
    """What a mesh or curves are on the driver.

    `slots` holds the index buffer of each material slot that is used; `hull` the corners of triangles that enclose the geometry,
    `is_hull_a_box` whether as its box rather than as its own triangles; `bounds` its lowest and highest coordinates; `triangles` is
    the number of triangles drawn, `skipped` of those left out because a vertex is not finite; `batches` what is ready to draw, by
    slot and attributes. `points` are the control points of curves.
    """

    points: gpu.types.GPUTexture | None = None

    def __init__(self) -> None:
        self.slots: dict[int, gpu.types.GPUIndexBuf] = {}
        self.hull: list[Point] = []
        self.is_hull_a_box = False
        self.bounds: tuple[Point, Point] = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self.skipped = 0
        self.triangles = 0
        self.batches: dict[tuple[int, tuple[MeshAttribute, ...]], gpu.types.GPUBatch] = {}

    def prepare(
        self, data: Data, wanted: Mapping[int, tuple[MeshAttribute, ...]], scratch: Callable[[], bpy.types.Mesh], /
    ) -> None:
        """Make each slot ready to draw with the attributes of the evaluated `data` that are `wanted` for it."""
        raise NotImplementedError


class Mesh(Geometry[bpy.types.Mesh]):
    """A mesh on the driver. Its vertices there are the mesh's corners, as the faces at a vertex differ in normals and UVs."""

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        """Send the evaluated `mesh` to the driver."""
        super().__init__()
        self._attributes: dict[MeshAttribute, gpu.types.GPUVertBuf] = {}
        if not len(mesh.loop_triangles):
            return
        self._corners = item_values(mesh.attributes[".corner_vert"].data, "value", kind="i")
        positions = item_values(mesh.attributes["position"].data, "vector", 3)
        normals = item_values(mesh.corner_normals, "vector", 3)
        triangles = item_values(mesh.loop_triangles, "loops", CORNERS, "i")
        slots = array("i", bytes(4 * len(mesh.loop_triangles)))
        if "material_index" in mesh.attributes:  # else all faces use the first
            mesh.loop_triangles.foreach_get("material_index", slots)
        corner_positions = gathered(positions, 3, self._corners)
        axes = [positions[axis::3] for axis in range(3)]
        bounds = _bounds(axes)
        if not (math.isfinite(sum(positions)) and is_finite(chain(*bounds))):  # the bounds do not show NaN
            triangles, slots = self._finite(corner_positions, triangles, slots)
            bounds = _bounds([[x for x in axis if abs(x) < LARGEST] for axis in axes]) if slots else bounds
        if not slots:
            return
        self.triangles = len(slots)
        self._triangles = triangles
        self.bounds = bounds
        self.is_hull_a_box = len(slots) > MAX_HULL_TRIANGLES
        self.hull = box(*bounds) if self.is_hull_a_box else _triangles(corner_positions, triangles)
        self._surface = vertex_buffer(len(self._corners), {"position": (3, corner_positions), "normal": (3, normals)})
        for slot in set(slots):
            self.slots[slot] = index_buffer(triangles, [index == slot for index in slots] if len(set(slots)) > 1 else None)

    def prepare(
        self, mesh: bpy.types.Mesh, wanted: Mapping[int, tuple[MeshAttribute, ...]], scratch: Callable[[], bpy.types.Mesh], /
    ) -> None:
        """Make the triangles of each slot ready to draw with the attributes of `mesh` that are `wanted` for the slot.

        Each attribute is sent to the driver once. `scratch` returns a mesh that may be overwritten, possibly `mesh` itself.
        """
        missing = [name for name in dict.fromkeys(chain.from_iterable(wanted.values())) if name not in self._attributes]
        all_values = {attribute: corner_values(mesh, attribute, self._corners) for attribute in missing}
        has_tangents = any(kind == "tangent" for kind, _ in missing)
        faces = Faces(mesh, self._corners, self._triangles) if has_tangents else None
        for (kind, name), values in all_values.items():
            if faces and kind == "tangent" and values is not None:
                values = faces.tangents(values, scratch())
            if values is None:  # as in Blender, a missing attribute is 0
                values = array("f", bytes(4 * WIDTHS[kind] * len(self._corners)))
            self._attributes[kind, name] = vertex_buffer(len(self._corners), {attribute_name((kind, name)): (WIDTHS[kind], values)})
        for slot, attributes in wanted.items():
            if (slot, attributes) not in self.batches:
                batch = gpu.types.GPUBatch(type="TRIS", buf=self._surface, elem=self.slots[slot])
                for attribute in attributes:
                    batch.vertbuf_add(self._attributes[attribute])
                self.batches[slot, attributes] = batch

    def _finite(self, corner_positions: Floats, triangles: array[int], slots: array[int]) -> tuple[array[int], array[int]]:
        """Return `triangles` and `slots` without the triangles that have a vertex which is not finite; count those."""
        finite = [is_finite(corner_positions[3 * at : 3 * at + 3]) for at in range(len(corner_positions) // 3)]
        keep = [all(finite[corner] for corner in triangles[at : at + CORNERS]) for at in range(0, len(triangles), CORNERS)]
        self.skipped = keep.count(False)
        return _selected(triangles, keep), array("i", compress(slots, keep))


def is_finite(numbers: Iterable[float]) -> bool:
    """Return whether shaders can compute with `numbers`: all are below 1e18 in size, so that their squares are finite."""
    return all(abs(number) < LARGEST for number in numbers)


def box(low: Sequence[float], high: Sequence[float]) -> list[Point]:
    """Return the corners of the 12 triangles of a box from `low` to `high`."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return [corners[corner] for a, b, c, d in faces for corner in (a, b, c, a, c, d)]


def _bounds(axes: Sequence[Sequence[float]]) -> tuple[Point, Point]:
    """Return the lowest and the highest of the coordinates along three axes."""
    (x0, x1), (y0, y1), (z0, z1) = ((min(values), max(values)) for values in axes)
    return (x0, y0, z0), (x1, y1, z1)


def _triangles(corner_positions: Floats, triangles: array[int]) -> list[Point]:
    """Return the positions of the corners of `triangles`."""
    return [(corner_positions[3 * k], corner_positions[3 * k + 1], corner_positions[3 * k + 2]) for k in triangles]


def _selected(triangles: array[int], keep: list[bool]) -> array[int]:
    return array("i", compress(triangles, (kept for kept in keep for _ in range(CORNERS))))


def index_buffer(triangles: array[int], keep: list[bool] | None = None) -> gpu.types.GPUIndexBuf:
    """Return the indices of `triangles`, of those alone that are to be kept."""
    selected = triangles if keep is None else _selected(triangles, keep)
    return gpu.types.GPUIndexBuf(type="TRIS", seq=memoryview(selected).cast("B").cast("i", (len(selected) // CORNERS, CORNERS)))


def vertex_buffer(count: int, attributes: dict[str, tuple[int, Floats | array[float]]]) -> gpu.types.GPUVertBuf:
    """Return a buffer of `count` vertices with `attributes`: for each the number of its components, and its values."""
    layout = gpu.types.GPUVertFormat()
    for name, (width, _) in attributes.items():
        layout.attr_add(id=name, comp_type="F32", len=width, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, count)
    for name, (width, values) in attributes.items():
        vertices.attr_fill(name, gpu.types.Buffer("FLOAT", (count, width), values))
    return vertices
