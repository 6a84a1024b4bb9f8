# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes on the driver: one buffer of positions and normals, indices for each material slot, other layers on demand."""

from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain, compress

import bpy

import gpu

from .layers import CORNERS, WIDTHS, Faces, Floats, Layer, gathered, layer_values

FEW = 64  # triangles: so many or less tell where a mesh is better than its box does
LARGEST = 1e18  # its square is a number of 32 bits, too

type Point = tuple[float, float, float]


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
        self._batches: dict[tuple[int, tuple[Layer, ...]], gpu.types.GPUBatch] = {}
        self._layers: dict[Layer, gpu.types.GPUVertBuf] = {}
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
        placed = gathered(positions, 3, self._corners)
        if not sum(map(abs, positions)) < LARGEST:  # or no number
            triangles, slots = self._sound(placed, triangles, slots)
        if not slots:
            return
        self.triangles = len(slots)
        self._triangles = triangles
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

    def prepare(self, mesh: bpy.types.Mesh, wanted: Mapping[int, tuple[Layer, ...]], spare: Callable[[], bpy.types.Mesh]) -> None:
        """Have the triangles of each slot ready to draw, with the layers `wanted` for it of `mesh`; each is sent once.

        `spare` returns a mesh that may be overwritten, in the place of `mesh` maybe.
        """
        lacking = [layer for layer in dict.fromkeys(chain.from_iterable(wanted.values())) if layer not in self._layers]
        found = {layer: layer_values(mesh, layer, self._corners) for layer in lacking}
        has_tangents = any(kind == "tangent" for kind, _ in lacking)
        faces = Faces.of(mesh, self._corners, self._triangles) if has_tangents else None
        for (kind, name), values in found.items():
            if faces and kind == "tangent" and values is not None:
                values = faces.tangents(values, spare())
            if values is None:  # as Blender has it: what is not there is 0
                values = array("f", bytes(4 * WIDTHS[kind] * len(self._corners)))
            self._layers[kind, name] = _vertices(len(self._corners), {kind: (WIDTHS[kind], values)})
        for slot, layers in wanted.items():
            if (slot, layers) not in self._batches:
                batch = gpu.types.GPUBatch(type="TRIS", buf=self._surface, elem=self.parts[slot])
                for layer in layers:
                    batch.vertbuf_add(self._layers[layer])
                self._batches[slot, layers] = batch

    def batch(self, slot: int, layers: tuple[Layer, ...]) -> gpu.types.GPUBatch:
        """Return what `prepare` made ready. Raises KeyError where it did not."""
        return self._batches[slot, layers]


def is_sound(numbers: Iterable[float]) -> bool:
    """Return whether shaders can compute with `numbers`: all are some, and not too large."""
    return all(abs(number) < LARGEST for number in numbers)


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
    return box([low for low, _ in ranges], [high for _, high in ranges])


def box(low: Sequence[float], high: Sequence[float]) -> list[Point]:
    """Return the corners of the 12 triangles of a box."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = [(x, y, z) for x in (x0, x1) for y in (y0, y1) for z in (z0, z1)]
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return [corners[corner] for a, b, c, d in faces for corner in (a, b, c, a, c, d)]
