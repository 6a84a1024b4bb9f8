# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Checker Texture (Cycles' kernel/svm/checker.h)."""

import math

from ...models.vector import Vector
from .float32 import off_borders, scaled


def checker_fac(vector: Vector, _color1: Vector, _color2: Vector, scale: float) -> float:
    """Return the output Fac: 1 in every other cube, which has Color1, else 0."""
    return float(sum(math.floor(x) for x in off_borders(scaled(vector, scale))) % 2)


def checker_color(vector: Vector, color1: Vector, color2: Vector, scale: float) -> Vector:
    """Return the output Color."""
    return color1 if checker_fac(vector, color1, color2, scale) else color2
