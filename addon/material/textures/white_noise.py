# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's White Noise Texture (Cycles' kernel/svm/white_noise.h): hashes of the coordinates, whose last bit changes all."""

from ...models.vector import Vector
from .float32 import coordinates
from .hashing import random


def white_noise_value(dimensions: int, vector: Vector, w: float) -> float:
    """Return the output Value, 0 to 1. One dimension reads `w`, two and three `vector`, four both."""
    return random(*coordinates(dimensions, vector, w))


def white_noise_color(dimensions: int, vector: Vector, w: float) -> Vector:
    """Return the output Color; its red is the value."""
    p = coordinates(dimensions, vector, w)
    if dimensions == 4:
        x, y, z, w = p
        return (random(*p), random(z, x, w, y), random(w, z, y, x))
    return (random(*p), random(*p, 1.0), random(*p, 2.0))
