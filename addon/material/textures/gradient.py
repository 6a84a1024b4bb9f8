# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Gradient Texture (Cycles' kernel/svm/gradient.h)."""

import math
from collections.abc import Callable

from ...models.vector import Vector

INSIDE = 0.999999  # the radius of the sphere, a little below 1 so that the gradient is 0 on a unit sphere

TYPES: dict[str, Callable[[float, float, float], float]] = {
    "LINEAR": lambda x, y, z: x,
    "QUADRATIC": lambda x, y, z: max(x, 0.0) ** 2,
    "EASING": lambda x, y, z: (3.0 - 2.0 * _fraction(x)) * _fraction(x) ** 2,
    "DIAGONAL": lambda x, y, z: 0.5 * (x + y),
    "SPHERICAL": lambda x, y, z: max(INSIDE - math.hypot(x, y, z), 0.0),
    "QUADRATIC_SPHERE": lambda x, y, z: max(INSIDE - math.hypot(x, y, z), 0.0) ** 2,
    "RADIAL": lambda x, y, z: math.atan2(y, x) / math.tau + 0.5,
}


def gradient_color(gradient_type: str, vector: Vector) -> Vector:
    """Return the output Color, a gray."""
    gray = gradient_fac(gradient_type, vector)
    return (gray, gray, gray)


def gradient_fac(gradient_type: str, vector: Vector) -> float:
    """Return the output Fac, 0 to 1."""
    return _fraction(TYPES[gradient_type](*vector))


def _fraction(x: float) -> float:
    return min(max(x, 0.0), 1.0)
