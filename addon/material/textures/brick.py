# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Brick Texture (Cycles' kernel/svm/brick.h)."""

import math

from ...models.vector import Vector
from .float32 import f32, scaled


def brick_color(
    vector: Vector,
    color1: Vector,
    color2: Vector,
    mortar: Vector,
    scale: float,
    mortar_size: float,
    mortar_smooth: float,
    bias: float,
    brick_width: float,
    row_height: float,
    offset: float,
    offset_frequency: int,
    squash: float,
    squash_frequency: int,
) -> Vector:
    """Return the output Color: between the two colors by a number for each brick, and the mortar's."""
    tint, fac = _brick(
        vector, scale, mortar_size, mortar_smooth, bias, brick_width, row_height, offset, offset_frequency, squash, squash_frequency
    )
    red, green, blue = ((a + (b - a) * tint) * (1.0 - fac) + c * fac for a, b, c in zip(color1, color2, mortar, strict=True))
    return (red, green, blue)


def brick_fac(vector: Vector, _color1: Vector, _color2: Vector, _mortar: Vector, *numbers: float) -> float:
    """Return the output Fac: 1 in the mortar, 0 in bricks; the arguments are those of `brick_color`."""
    return _brick(vector, *numbers)[1]


def _brick(
    vector: Vector,
    scale: float,
    mortar_size: float,
    mortar_smooth: float,
    bias: float,
    width: float,
    height: float,
    offset: float,
    offset_frequency: float,
    squash: float,
    squash_frequency: float,
) -> tuple[float, float]:
    x, y, _ = scaled(vector, scale)
    row = math.floor(f32(y / height)) if height else 0
    if offset_frequency and squash_frequency:
        width = width if row % squash_frequency else f32(width * squash)
        x = x if row % offset_frequency else f32(x + width * offset)
    number = math.floor(f32(x / width)) if width else 0
    x, y = x - width * number, y - height * row
    tint = min(max(_random((row << 16) + (number & 0xFFFF)) + bias, 0.0), 1.0)
    to_edge = min(x, y, width - x, height - y)
    if to_edge >= mortar_size:
        return tint, 0.0
    if mortar_smooth == 0.0 or mortar_size == 0.0:
        return tint, 1.0
    t = min(max((1.0 - to_edge / mortar_size) / mortar_smooth, 0.0), 1.0)
    return tint, (3.0 - 2.0 * t) * t * t


def _random(n: int) -> float:
    """Return a number from 0 to 1 for an integer."""
    n = (n + 1013) & 0x7FFFFFFF
    n ^= n >> 13
    return f32((n * (n * n * 60493 + 19990303) + 1376312589) & 0x7FFFFFFF) / 2.0**31
