# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Gradient Texture (Cycles' kernel/svm/gradient.h)."""

import math

from ...models.vector import Vector

TYPES = ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL")


def gradient_fac(gradient_type: str, vector: Vector) -> float:
    """Return the output Fac, 0 to 1."""
    x, y, z = vector
    along = _fraction(x)
    inside = _fraction(0.999999 - math.hypot(x, y, z))  # a little less than 1, so that it is 0 at unit vectors
    return {
        "LINEAR": along,
        "QUADRATIC": along * along,
        "EASING": (3.0 - 2.0 * along) * along * along,
        "DIAGONAL": _fraction(0.5 * (x + y)),
        "SPHERICAL": inside,
        "QUADRATIC_SPHERE": inside * inside,
        "RADIAL": math.atan2(y, x) / math.tau + 0.5,
    }[gradient_type]


def gradient_color(gradient_type: str, vector: Vector) -> Vector:
    """Return the output Color, a gray."""
    gray = gradient_fac(gradient_type, vector)
    return (gray, gray, gray)


def _fraction(x: float) -> float:
    return min(max(x, 0.0), 1.0)
