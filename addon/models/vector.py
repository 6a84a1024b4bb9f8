# SPDX-License-Identifier: GPL-3.0-or-later
"""The few operations on 3-vectors that the models need, on plain tuples of floats."""

import math

type Vector = tuple[float, float, float]


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def add(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def scale(a: Vector, factor: float) -> Vector:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def normalize(a: Vector) -> Vector:
    """Return `a` at length 1, or the zero vector where `a` has no direction: no length, or a component that is not finite."""
    length = math.hypot(*a)
    if not 1e-290 < length < 1e290:
        # Next to the ends of the range of floats the length loses its digits or overflows: move away from there by a power of 2.
        a = scale(a, 2.0**600 if length < 1.0 else 2.0**-600)
        length = math.hypot(*a)
        if not 0.0 < length < math.inf:
            return (0.0, 0.0, 0.0)
    return (a[0] / length, a[1] / length, a[2] / length)


def from_polar(mu: float, azimuth: float) -> Vector:
    """Return the unit vector with cosine `mu` to the z axis, `azimuth` in radians from the x axis."""
    sine = math.sqrt(max(0.0, 1.0 - mu * mu))
    return (sine * math.cos(azimuth), sine * math.sin(azimuth), mu)
