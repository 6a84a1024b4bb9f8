# SPDX-License-Identifier: GPL-3.0-or-later
"""A character's triangles in few bytes, which viewer.js unpacks: quantized, as differences from the vertex before, and deflated.

All numbers have 16 bits: positions and image coordinates across their bounds, normals on an octahedron, colors linear. Of the
octahedron see Z. Cigolle and others, "A Survey of Efficient Representations for Independent Unit
Vectors" (JCGT 3(2), 2014).
"""

import gzip
import math
from array import array
from base64 import b64encode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy

from mathutils import Matrix, Vector

MOST = 65535
type Corner = tuple[int, ...]  # all that a vertex of the viewer has, quantized: 3 of position, 2 of normal, 3 of color, 2 of image


@dataclass(frozen=True)
class Piece:
    """The faces of a material's `slot` of a mesh, where `matrix` puts it, in the `colors` (linear RGB) of its corners.

    Or in the `image` of that number, in place of colors, of which its corners have the coordinates `uv`.
    """

    mesh: bpy.types.Mesh
    matrix: Matrix
    slot: int = 0
    colors: Sequence[float] = ()
    uv: Sequence[float] = ()
    image: int | None = None


@dataclass
class _Triangles:
    corners: dict[Corner, int] = field(default_factory=dict)
    indices: array[int] = field(default_factory=lambda: array("i"))


def pack(pieces: Sequence[Piece]) -> dict[str, Any]:
    """Return the pieces as viewer.js takes them: bounds, numbers of vertices, runs of triangles by image, and `data` in base64.

    Raises RuntimeError where they have more vertices than 24 bits number.
    """
    points = [piece.matrix @ vertex.co for piece in pieces for vertex in piece.mesh.vertices]
    low = [min(values) for values in zip(*points, strict=True)]
    high = [max(values) for values in zip(*points, strict=True)]
    uv = [value for piece in pieces for value in piece.uv] or [0.0]
    uv_low, uv_high = min(uv), max(uv)
    found, runs = _Triangles(), []
    for piece in pieces:
        first = len(found.indices)
        _add(found, piece, low, high, (uv_low, uv_high))
        runs.append({"first": first, "count": len(found.indices) - first, "image": piece.image})
    if len(found.corners) > 1 << 24:
        raise RuntimeError(f"the viewer has room for {1 << 24:,} vertices, and the character has {len(found.corners):,}")
    columns = list(zip(*found.corners, strict=True))
    data = b"".join([*map(_differences, columns), _indices(found.indices)])
    return {
        "low": low,
        "high": high,
        "uv": [uv_low, uv_high],
        "vertices": len(found.corners),
        "indices": len(found.indices),
        "runs": runs,
        "data": b64encode(gzip.compress(data, mtime=0)).decode(),
    }


def _add(found: _Triangles, piece: Piece, low: Sequence[float], high: Sequence[float], uv: tuple[float, float]) -> None:
    """Add a piece's triangles."""
    mesh = piece.mesh
    turned = piece.matrix.to_3x3().inverted_safe().transposed()
    places = [_quantized(piece.matrix @ vertex.co, low, high) for vertex in mesh.vertices]
    vertices = _numbers(mesh.loops, "vertex_index", "i", 1)
    normals = _numbers(mesh.corner_normals, "vector", "f", 3)
    mesh.calc_loop_triangles()
    known: dict[tuple[float, ...], Corner] = {}
    order = (0, 2, 1) if piece.matrix.is_negative else (0, 1, 2)  # mirrored: its faces would look inwards
    last = max(len(mesh.materials) - 1, 0)
    for triangle in mesh.loop_triangles:
        if min(triangle.material_index, last) != piece.slot:  # as Blender has it
            continue
        for side in order:
            k = triangle.loops[side]
            normal = tuple(normals[3 * k : 3 * k + 3])
            if normal not in known:
                known[normal] = _octahedral(turned @ Vector(normal))
            color = _quantized(piece.colors[3 * k : 3 * k + 3], (0.0,) * 3, (1.0,) * 3) if piece.colors else (0, 0, 0)
            place = _quantized(piece.uv[2 * k : 2 * k + 2], (uv[0],) * 2, (uv[1],) * 2) if piece.uv else (0, 0)
            corner = (*places[vertices[k]], *known[normal], *color, *place)
            found.indices.append(found.corners.setdefault(corner, len(found.corners)))


def _numbers(items: bpy.types.bpy_prop_collection, name: str, kind: str, size: int) -> array[Any]:
    values = array(kind, bytes(4 * size * len(items)))
    items.foreach_get(name, values)
    return values


def _quantized(values: Iterable[float], low: Iterable[float], high: Iterable[float]) -> tuple[int, ...]:
    """Return values between their bounds as whole numbers of 16 bits."""
    return tuple(round(MOST * (x - a) / (b - a)) if b > a else 0 for x, a, b in zip(values, low, high, strict=True))


def _octahedral(n: Vector) -> tuple[int, ...]:
    """Return a direction of any length as whole numbers of 16 bits, from a square around the octahedron's upper half."""
    size = abs(n.x) + abs(n.y) + abs(n.z) or 1.0
    x, y = n.x / size, n.y / size
    if n.z < 0.0:
        x, y = math.copysign(1.0 - abs(y), x), math.copysign(1.0 - abs(x), y)
    return _quantized((x, y), (-1.0, -1.0), (1.0, 1.0))


def _differences(column: Sequence[int]) -> bytes:
    """Return numbers of 16 bits as differences from the one before, small where these are near 0; all low bytes first."""
    coded, before = [], 0
    for value in column:
        difference = (value - before + 32768) % 65536 - 32768
        coded.append(2 * difference if difference >= 0 else -2 * difference - 1)
        before = value
    return bytes(code & 255 for code in coded) + bytes(code >> 8 for code in coded)


def _indices(indices: Sequence[int]) -> bytes:
    """Return how far below the next new vertex each index is, as three planes of bytes: 0 for a new one, and little for most."""
    codes, following = [], 0
    for index in indices:
        codes.append(following - index)
        following += index == following
    return b"".join(bytes(code >> shift & 255 for code in codes) for shift in (0, 8, 16))
