# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's Math and Vector Math nodes make of plain numbers, for the operations that our groups use. No bpy.

They never fail: a number over 0 is 0, the root of a negative number 0, an arccosine's argument is cut to [-1, 1]; and the larger or
smaller of a number and NaN is the number. The nodes have 32 bits, here are 64.
"""

import math
from collections.abc import Callable, Mapping, Sequence

type Vector = tuple[float, ...]  # three components
type Plain = float | Vector


def add(a: float, b: float) -> float:
    return a + b


def subtract(a: float, b: float) -> float:
    return a - b


def multiply(a: float, b: float) -> float:
    return a * b


def divide(a: float, b: float) -> float:
    return a / b if b != 0.0 else 0.0


def multiply_add(a: float, b: float, c: float) -> float:
    return a * b + c


def power(base: float, exponent: float) -> float:
    """Return base^exponent; 0 where that is no number, infinity where it is too large for one."""
    try:
        result = math.pow(base, exponent)
    except ValueError:
        return 0.0
    except OverflowError:
        return math.inf
    return result


def maximum(a: float, b: float) -> float:
    return b if math.isnan(a) else max(a, b)


def minimum(a: float, b: float) -> float:
    return b if math.isnan(a) else min(a, b)


def sqrt(a: float) -> float:
    return math.sqrt(a) if a > 0.0 else 0.0


def arccosine(a: float) -> float:
    return math.acos(minimum(maximum(-1.0, a), 1.0))


def greater_than(a: float, b: float) -> float:
    return float(a > b)


def less_than(a: float, b: float) -> float:
    return float(a < b)


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def length(a: Vector) -> float:
    return math.sqrt(dot(a, a))


def normalize(a: Vector) -> Vector:
    size = length(a)
    return (divide(a[0], size), divide(a[1], size), divide(a[2], size))


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


SCALARS: Mapping[str, Callable[..., float]] = {
    "ADD": add,
    "SUBTRACT": subtract,
    "MULTIPLY": multiply,
    "DIVIDE": divide,
    "MULTIPLY_ADD": multiply_add,
    "POWER": power,
    "MAXIMUM": maximum,
    "MINIMUM": minimum,
    "SQRT": sqrt,
    "ARCCOSINE": arccosine,
    "COSINE": math.cos,
    "GREATER_THAN": greater_than,
    "LESS_THAN": less_than,
    "ABSOLUTE": abs,
}
VECTORS: Mapping[str, Callable[..., Plain]] = {
    "DOT_PRODUCT": dot,
    "LENGTH": length,
    "NORMALIZE": normalize,
    "CROSS_PRODUCT": cross,
}


def scalar(operation: str, *operands: float) -> float:
    """Return what a Math node gives. Raises KeyError for an operation that is not here."""
    return SCALARS[operation](*operands)


def vector(operation: str, *operands: Plain) -> Plain:
    """Return what a Vector Math node gives; numbers count for each component. Raises KeyError for an operation that is not here."""
    wide = [spread(operand) for operand in operands]
    if operation in VECTORS:
        return VECTORS[operation](*wide)
    red, green, blue = (scalar(operation, *components) for components in zip(*wide, strict=True))
    return (red, green, blue)


def node(is_vector: bool, operation: str, operands: Sequence[Plain]) -> Plain:
    """Return what a node of either kind gives; raises KeyError as they do."""
    if is_vector:
        return vector(operation, *operands)
    return scalar(operation, *(each for each in operands if not isinstance(each, tuple)))


def spread(value: Plain) -> Vector:
    """Return a number as a vector that has it thrice; a vector as it is."""
    return value if isinstance(value, tuple) else (value, value, value)
