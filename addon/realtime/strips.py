# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair on the driver: curves' control points as a texture, and the strips that shaders lay along them."""

from array import array
from collections import defaultdict
from collections.abc import Callable, Mapping
from itertools import pairwise

import bpy

import gpu

from .expressions import WIDTHS, MeshAttribute, attribute_name
from .mesh_attributes import Floats, attribute_colors, gathered, item_values
from .meshes import LARGEST, Geometry, box, index_buffer, is_finite, vertex_buffer

PIECES = 4  # of a strip between two control points, as Cycles has by default
POINTS_ACROSS = 1024  # in a row of the texture of control points, as in shaders/realtime/strip.glsl
RADIUS = 0.005  # m, of curves without radii, as in Cycles
ROOT_UV = "surface_uv_coordinate"  # Blender's attribute of where on its mesh a hair grows
# A Catmull-Rom spline leaves the box around its points by at most twice the largest negative weight, 1/16, of the box's size.
OVERSHOOT = 0.125


class Strips(Geometry[bpy.types.Curves]):
    """Curves through their control points, as Catmull-Rom splines, whose strips face whoever looks.

    `points` has the control points: position and radius [m]. A vertex is four numbers: the control point before it, how far it is
    towards the next, 0 to 1, the side, -1 or 1, and whether the piece is the curve's first (1), last (2) or both (3).
    """

    @classmethod
    def of(cls, curves: bpy.types.Curves) -> "Strips":
        """Return the strips of the evaluated `curves`."""
        if not len(curves.points):
            return cls(array("i"), array("f"), array("f"))
        radius = curves.attributes.get("radius")
        return cls(
            item_values(curves.curve_offset_data, "value", kind="i"),
            item_values(curves.attributes["position"].data, "vector", 3),
            item_values(radius.data, "value") if radius else array("f", (RADIUS,)) * len(curves.points),
        )

    def __init__(self, offsets: array[int], positions: array[float], radii: array[float]) -> None:
        """Send curves to the driver: `offsets` are the first control point of each, and the end."""
        super().__init__()
        self._offsets = offsets
        by_count = self._by_count(offsets, positions, radii)
        self._curves = [curve for curves_of_count in by_count.values() for curve in curves_of_count]
        if not self._curves:
            return
        self.points = _points(positions, radii)
        self._build(by_count, offsets)
        self.bounds = self._bounds(by_count, offsets, positions, radii)
        self.hull, self.is_hull_a_box = box(*self.bounds), True

    def prepare(
        self, curves: bpy.types.Curves | None, wanted: Mapping[int, tuple[MeshAttribute, ...]], _: Callable[[], bpy.types.Mesh], /
    ) -> None:
        """Make the strips ready to draw with the attributes of `curves` that are `wanted`. Without `curves`, all are 0."""
        for slot, attributes in wanted.items():
            batch = gpu.types.GPUBatch(type="TRIS", buf=self._strips, elem=self.slots[slot])
            for attribute in attributes:
                width = WIDTHS[attribute[0]]
                values = self._values(curves, attribute) or array("f", bytes(4 * width * self._count))
                batch.vertbuf_add(vertex_buffer(self._count, {attribute_name(attribute): (width, values)}))
            self.batches[slot, attributes] = batch

    def _by_count(self, offsets: array[int], positions: array[float], radii: array[float]) -> dict[int, list[int]]:
        """Return the curves by their number of control points, without those that cannot be drawn, which are counted."""
        found: dict[int, list[int]] = defaultdict(list)
        all_finite = sum(map(abs, positions)) < LARGEST and sum(map(abs, radii)) < LARGEST  # the sums may be NaN
        for curve, (first, end) in enumerate(pairwise(offsets)):
            if end - first < 2:
                continue
            if all_finite or is_finite((*positions[3 * first : 3 * end], *radii[first:end])):
                found[end - first].append(curve)
            else:
                self.skipped += 2 * PIECES * (end - first - 1)
        return found

    def _build(self, by_count: Mapping[int, list[int]], offsets: array[int]) -> None:
        """Make the vertices and triangles of the strips, those of curves of as many points after each other."""
        vertices, triangles, self._count = array("f"), array("i"), 0
        for count, curves in by_count.items():
            rows = [(segment, piece / PIECES) for segment in range(count - 1) for piece in range(PIECES)] + [(count - 2, 1.0)]
            of_curve = [
                (segment, t, side, (segment == 0) + 2.0 * (segment == count - 2)) for segment, t in rows for side in (-1.0, 1.0)
            ]
            part = array("f", [number for vertex in of_curve for number in vertex]) * len(curves)
            part[0::4] = array("f", (offsets[curve] + vertex[0] for curve in curves for vertex in of_curve))
            vertices += part
            quads = [2 * row + corner for row in range(len(rows) - 1) for corner in (0, 1, 2, 2, 1, 3)]
            starts = range(self._count, self._count + len(of_curve) * len(curves), len(of_curve))
            triangles.extend(start + corner for start in starts for corner in quads)
            self._count += len(of_curve) * len(curves)
        self._vertices = vertices
        self._strips = vertex_buffer(self._count, {"strip": (4, vertices)})
        self.triangles = len(triangles) // 3
        self.slots[0] = index_buffer(triangles)

    def _bounds(
        self, by_count: Mapping[int, list[int]], offsets: array[int], positions: array[float], radii: array[float]
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Return the lowest and highest coordinates of the strips."""
        starts = ((offsets[curve], count) for count, curves in by_count.items() for curve in curves)
        drawn = [index for first, count in starts for index in range(first, first + count)]
        thick = max(abs(radii[index]) for index in drawn)
        low, high = [], []
        for axis in range(3):
            places = [positions[3 * index + axis] for index in drawn]
            margin = OVERSHOOT * (max(places) - min(places)) + (1.0 + OVERSHOOT) * thick
            low.append(min(places) - margin)
            high.append(max(places) + margin)
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

    def _values(self, curves: bpy.types.Curves | None, wanted: MeshAttribute) -> Floats | array[float] | None:
        """Return an attribute of each vertex: the curve's own or, of control points, what lies between the two. None without it."""
        kind, name = wanted
        if curves is None or kind not in {"uv", "attribute"}:
            return None
        attribute = curves.attributes.get(name or (ROOT_UV if kind == "uv" else ""))
        if attribute is None:
            return None
        if kind == "uv":
            values = item_values(attribute.data, "vector", 2) if attribute.data_type == "FLOAT2" else None
        else:
            values = attribute_colors(attribute)
        if values is None:
            return None
        width = WIDTHS[kind]
        if attribute.domain == "CURVE":
            return gathered(values, width, self._curve_of_vertex())
        points, along = self._vertices[0::4], self._vertices[1::4]
        before = gathered(values, width, [int(point) for point in points])
        after = gathered(values, width, [int(point) + 1 for point in points])
        fractions = (fraction for fraction in along for _ in range(width))
        return array("f", (a + (b - a) * t for a, b, t in zip(before, after, fractions, strict=True)))

    def _curve_of_vertex(self) -> list[int]:
        offsets = self._offsets
        return [curve for curve in self._curves for _ in range(2 * (PIECES * (offsets[curve + 1] - offsets[curve] - 1) + 1))]


def _points(positions: array[float], radii: array[float]) -> gpu.types.GPUTexture:
    """Return the texture of control points."""
    rows = -(-len(radii) // POINTS_ACROSS)
    texels = array("f", bytes(16 * POINTS_ACROSS * rows))
    for axis in range(3):
        texels[axis : 4 * len(radii) : 4] = positions[axis::3]
    texels[3 : 4 * len(radii) : 4] = radii
    return gpu.types.GPUTexture((POINTS_ACROSS, rows), format="RGBA32F", data=gpu.types.Buffer("FLOAT", len(texels), texels))
