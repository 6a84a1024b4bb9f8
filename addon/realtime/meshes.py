# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes on the driver: one buffer of positions and normals, indices for each material slot, colors and UV maps on demand."""

from array import array
from collections.abc import Iterable
from itertools import compress

import bpy

import gpu

from ..usd.read import DEFAULT_COLOR, DEFAULT_UV
from .program import Paint

CORNERS = 3  # of a triangle
FEW = 64  # triangles: so many or less tell where a mesh is better than its box does
LARGEST = 1e18  # its square is a number of 32 bits, too
WIDTHS = {Paint.ATTRIBUTE: ("color", 4), Paint.IMAGE: ("uv", 2)}  # what the shader calls it, and its components

type Point = tuple[float, float, float]
type Floats = memoryview[float]


class Mesh:
    """A mesh on the driver. Its corners are its vertices there, as normals and UVs differ between the faces of one vertex.

    `parts` has the indices of each material slot that faces have; `hull` the corners of triangles that hold all of it; `triangles`
    says how many are drawn, `lost` how many are left out, as their vertices are not sound.
    """

    def __init__(self, mesh: bpy.types.Mesh) -> None:
        """Send `mesh`, an evaluated one, to the driver."""
        self.parts: dict[int, gpu.types.GPUIndexBuf] = {}
        self.hull: list[Point] = []
        self.lost = 0
        self.triangles = 0
        self._batches: dict[tuple[int, Paint, str], gpu.types.GPUBatch] = {}
        self._paints: dict[tuple[Paint, str], gpu.types.GPUVertBuf] = {}
        if not len(mesh.loop_triangles):
            return
        self._corners = array("i", bytes(4 * len(mesh.loops)))
        mesh.attributes[".corner_vert"].data.foreach_get("value", self._corners)
        positions = array("f", bytes(12 * len(mesh.vertices)))
        mesh.attributes["position"].data.foreach_get("vector", positions)
        normals = array("f", bytes(12 * len(mesh.loops)))
        mesh.corner_normals.foreach_get("vector", normals)
        triangles = array("i", bytes(4 * CORNERS * len(mesh.loop_triangles)))
        mesh.loop_triangles.foreach_get("loops", triangles)
        slots = array("i", bytes(4 * len(mesh.loop_triangles)))
        mesh.loop_triangles.foreach_get("material_index", slots)
        placed = _gathered(positions, 3, self._corners)
        if not sum(map(abs, positions)) < LARGEST:  # or no number
            triangles, slots = self._sound(placed, triangles, slots)
        if not slots:
            return
        self.triangles = len(slots)
        self.hull = _hull(positions, placed, triangles)
        self._surface = _vertices(len(self._corners), {"position": (3, placed), "normal": (3, normals)})
        for slot in set(slots):
            self.parts[slot] = _indices(triangles, [index == slot for index in slots] if len(set(slots)) > 1 else None)

    def _sound(self, placed: Floats, triangles: array[int], slots: array[int]) -> tuple[array[int], array[int]]:
        """Return `triangles` and `slots` without the triangles that are not sound."""
        sound = [is_sound(placed[3 * at : 3 * at + 3]) for at in range(len(placed) // 3)]
        keep = [all(sound[corner] for corner in triangles[at : at + CORNERS]) for at in range(0, len(triangles), CORNERS)]
        self.lost = keep.count(False)
        return _chosen(triangles, keep), array("i", compress(slots, keep))

    def prepare(self, mesh: bpy.types.Mesh, slot: int, paint: Paint, name: str) -> None:
        """Have the triangles of `slot` ready to draw, with the color attribute or UV map `name` of `mesh`; each is sent once."""
        key = (slot, paint, name)
        if key not in self._batches:
            batch = gpu.types.GPUBatch(type="TRIS", buf=self._surface, elem=self.parts[slot])
            if paint:
                batch.vertbuf_add(self._paint(mesh, paint, name))
            self._batches[key] = batch

    def batch(self, slot: int, paint: Paint, name: str) -> gpu.types.GPUBatch:
        """Return what `prepare` made ready. Raises KeyError where it did not."""
        return self._batches[slot, paint, name]

    def _paint(self, mesh: bpy.types.Mesh, paint: Paint, name: str) -> gpu.types.GPUVertBuf:
        key = (paint, name)
        if key not in self._paints:
            shader_name, width = WIDTHS[paint]
            values = _colors(mesh, name, self._corners) if paint is Paint.ATTRIBUTE else _uv_map(mesh, name)
            if values is None:  # as Blender has it: what is not there is 0
                values = array("f", bytes(4 * width * len(self._corners)))
            self._paints[key] = _vertices(len(self._corners), {shader_name: (width, values)})
        return self._paints[key]


def is_sound(numbers: Iterable[float]) -> bool:
    """Return whether shaders can compute with `numbers`: all are some, and not too large."""
    return all(abs(number) < LARGEST for number in numbers)


def _gathered(values: array[float], width: int, indices: array[int]) -> Floats:
    """Return the `width` floats of each of `indices`, in their order."""
    raw, size = values.tobytes(), 4 * width
    items = [raw[at : at + size] for at in range(0, len(raw), size)]
    return memoryview(b"".join(map(items.__getitem__, indices))).cast("f")


def _chosen(triangles: array[int], keep: list[bool]) -> array[int]:
    return array("i", compress(triangles, (kept for kept in keep for _ in range(CORNERS))))


def _indices(triangles: array[int], keep: list[bool] | None) -> gpu.types.GPUIndexBuf:
    chosen = triangles if keep is None else _chosen(triangles, keep)
    return gpu.types.GPUIndexBuf(type="TRIS", seq=memoryview(chosen).cast("B").cast("i", (len(chosen) // CORNERS, CORNERS)))


def _vertices(count: int, attributes: dict[str, tuple[int, Floats | array[float]]]) -> gpu.types.GPUVertBuf:
    """Return a buffer of `count` vertices with `attributes`: for each its components and its values."""
    layout = gpu.types.GPUVertFormat()
    for name, (width, _) in attributes.items():
        layout.attr_add(id=name, comp_type="F32", len=width, fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, count)
    for name, (width, values) in attributes.items():
        vertices.attr_fill(name, gpu.types.Buffer("FLOAT", (count, width), values))
    return vertices


def _hull(positions: array[float], placed: Floats, triangles: array[int]) -> list[Point]:
    """Return the corners of few triangles themselves, of many those of their box: 12 triangles."""
    if len(triangles) <= FEW * CORNERS:
        return [(placed[3 * corner], placed[3 * corner + 1], placed[3 * corner + 2]) for corner in triangles]
    axes = [positions[axis::3] for axis in range(3)]
    ranges = [(min(values), max(values)) for values in ([x for x in axis if abs(x) < LARGEST] for axis in axes)]
    (x0, x1), (y0, y1), (z0, z1) = ranges
    box = [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return [box[corner] for a, b, c, d in faces for corner in (a, b, c, a, c, d)]


def _colors(mesh: bpy.types.Mesh, name: str, corners: array[int]) -> Floats | array[float] | None:
    """Return a linear color for each corner; None where `mesh` has no such attribute."""
    shown = mesh.color_attributes.render_color_index
    found = mesh.color_attributes[shown] if name == DEFAULT_COLOR and 0 <= shown < len(mesh.color_attributes) else None
    attribute = found or mesh.color_attributes.get(name)
    if attribute is None:
        return None
    values = array("f", bytes(16 * len(attribute.data)))
    attribute.data.foreach_get("color", values)
    return _gathered(values, 4, corners) if attribute.domain == "POINT" else values


def _uv_map(mesh: bpy.types.Mesh, name: str) -> array[float] | None:
    """Return the UV coordinates of each corner; None where `mesh` has no such map."""
    shown = next((layer for layer in mesh.uv_layers if layer.active_render), None) if name == DEFAULT_UV else None
    layer = shown or mesh.uv_layers.get(name)
    if layer is None:
        return None
    values = array("f", bytes(8 * len(layer.uv)))
    layer.uv.foreach_get("vector", values)
    return values
