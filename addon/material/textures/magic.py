# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Magic Texture (Cycles' kernel/svm/magic.h)."""

import math

from ...models.vector import Vector
from .float32 import f32, scaled

# What each further turn changes: the component, the signs of x, y and z, and the function of their sum with its sign.
TURNS = (
    (1, (1, -1, 1), math.cos, -1),
    (0, (1, -1, -1), math.cos, 1),
    (2, (-1, -1, -1), math.sin, 1),
    (0, (-1, 1, -1), math.cos, -1),
    (1, (-1, 1, 1), math.sin, -1),
    (1, (-1, 1, 1), math.cos, -1),
    (0, (1, 1, 1), math.cos, 1),
    (2, (1, 1, -1), math.sin, 1),
    (0, (-1, -1, 1), math.cos, -1),
    (1, (1, -1, 1), math.sin, -1),
)


def magic_color(turbulence_depth: int, vector: Vector, scale: float, distortion: float) -> Vector:
    """Return the output Color."""
    x, y, z = (math.fmod(v, f32(math.tau)) for v in scaled(vector, scale))

    def wave(a: float, b: float, c: float) -> float:
        return f32(f32(f32(a + b) + c) * 5.0)

    color = [math.sin(wave(x, y, z)), math.cos(wave(-x, y, -z)), -math.cos(wave(-x, -y, z))]
    if turbulence_depth > 0:
        color = [distortion * v for v in color]
    for at, signs, function, sign in TURNS[:turbulence_depth]:
        color[at] = distortion * sign * function(sum(s * v for s, v in zip(signs, color, strict=True)))
    if distortion:
        color = [v / (2.0 * distortion) for v in color]
    return (0.5 - color[0], 0.5 - color[1], 0.5 - color[2])


def magic_fac(turbulence_depth: int, vector: Vector, scale: float, distortion: float) -> float:
    """Return the output Fac: the mean of Color."""
    return sum(magic_color(turbulence_depth, vector, scale, distortion)) / 3.0
