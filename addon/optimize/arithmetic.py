# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Math and Vector Math nodes on plain numbers, for the operations that our groups use. No bpy.

As in the nodes, no operation fails: x / 0 is 0, the square root of a negative number is 0, the argument of arccosine is clamped to
[-1, 1], and the maximum or minimum of a number and NaN is the number. The nodes compute in 32 bits, these functions in 64.
"""

import math
import operator
from collections.abc import Callable, Mapping

from ..models.vector import dot

type Vector = tuple[float, ...]  # three components
type Plain = float | Vector


def divide(a: float, b: float) -> float:
    return a / b if b != 0.0 else 0.0


def power(base: float, exponent: float) -> float:
    """Return base^exponent: 0 where it is undefined, infinity where it overflows."""
    try:
        return math.pow(base, exponent)
    except ValueError:
        return 0.0
    except OverflowError:
        return math.inf


def maximum(a: float, b: float) -> float:
    return b if math.isnan(a) else max(a, b)


def minimum(a: float, b: float) -> float:
    return b if math.isnan(a) else min(a, b)


def sqrt(a: float) -> float:
    return math.sqrt(a) if a > 0.0 else 0.0


def arccosine(a: float) -> float:
    return math.acos(minimum(maximum(-1.0, a), 1.0))


def normalize(a: Vector) -> Vector:
    size = math.hypot(*a)
    return (divide(a[0], size), divide(a[1], size), divide(a[2], size))


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


SCALARS: Mapping[str, Callable[..., float]] = {
    "ADD": operator.add,
    "COMPARE": lambda a, b, epsilon: float(abs(a - b) <= epsilon),
    "SUBTRACT": operator.sub,
    "MULTIPLY": operator.mul,
    "DIVIDE": divide,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": power,
    "MAXIMUM": maximum,
    "MINIMUM": minimum,
    "SQRT": sqrt,
    "ARCCOSINE": arccosine,
    "COSINE": math.cos,
    "GREATER_THAN": lambda a, b: float(a > b),
    "LESS_THAN": lambda a, b: float(a < b),
    "ABSOLUTE": abs,
}
VECTORS: Mapping[str, Callable[..., Plain]] = {
    "DOT_PRODUCT": dot,
    "LENGTH": lambda a: math.hypot(*a),
    "NORMALIZE": normalize,
    "CROSS_PRODUCT": cross,
}


def scalar(operation: str, *operands: Plain) -> float:
    """Return the result of a Math node. Raises KeyError for an unsupported operation."""
    return SCALARS[operation](*operands)


def vector(operation: str, *operands: Plain) -> Plain:
    """Return the result of a Vector Math node; a number stands for three equal components. Raises KeyError as `scalar` does."""
    vectors = [spread(operand) for operand in operands]
    if operation in VECTORS:
        return VECTORS[operation](*vectors)
    red, green, blue = (scalar(operation, *components) for components in zip(*vectors, strict=True))
    return (red, green, blue)


def spread(value: Plain) -> Vector:
    """Return a number as a vector of three equal components, and a vector unchanged."""
    return value if isinstance(value, tuple) else (value, value, value)
