# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic in 32-bit floats, as the renderers compute coordinates: their last bit decides the cell of a pattern, and its hash."""

import math
import struct
from collections.abc import Iterable

type Coordinates = tuple[float, ...]


def f32(x: float) -> float:
    """Return `x` rounded to a 32-bit float."""
    try:
        return struct.unpack("<f", struct.pack("<f", x))[0]
    except OverflowError:
        return math.copysign(math.inf, x)


def bits(x: float) -> int:
    """Return the bits of `x` as a 32-bit float, 0 to 2^32 - 1."""
    return struct.unpack("<I", struct.pack("<f", f32(x)))[0]


def scaled(p: Iterable[float], factor: float) -> Coordinates:
    return tuple(f32(x * factor) for x in p)


def moved(p: Iterable[float], offset: Iterable[float]) -> Coordinates:
    return tuple(f32(x + by) for x, by in zip(p, offset, strict=True))


def off_borders(p: Iterable[float]) -> Coordinates:
    """Return `p` moved a little off the whole numbers, as Checker and Wave Texture do."""
    return tuple(f32(f32(x + f32(1e-6)) * f32(0.999999)) for x in p)


def coordinates(dimensions: int, vector: Coordinates, w: float, scale: float = 1.0) -> Coordinates:
    """Return what a texture of so many dimensions reads of its two inputs: `w` alone, the first of `vector`, or all four."""
    return scaled((w,) if dimensions == 1 else (*vector, w)[:dimensions], scale)
