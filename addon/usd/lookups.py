# SPDX-License-Identifier: GPL-3.0-or-later
"""What UsdPreviewSurface can hold of an expression: one image, whose channels are scaled and moved.

Whether an expression is that is tried on values of the image, so that a tint, an inverted channel, a mix with a constant and any
other arithmetic that comes to it are found alike.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from ..material.expression import (
    Apply,
    Attribute,
    Bump,
    Constant,
    Coordinate,
    Curve,
    Expression,
    ImageTexture,
    NormalMap,
    UvMap,
    children,
    evaluate,
    triple,
)
from ..material.operations import Kind, Triple, Value
from ..material.points import Unknown

CHANNELS = "rgba"
# Values of red, green, blue and alpha
PROBES = ((0.2, 0.7, 0.4, 0.9), (0.9, 0.1, 0.6, 0.3), (0.5, 0.5, 0.5, 0.6), (0.05, 0.95, 0.8, 0.15))
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Lookup:
    """A channel of a texture, or its color, times `scale` plus `bias`, by channel."""

    texture: ImageTexture
    output: Literal["rgb", "r", "g", "b", "a"]
    scale: tuple[float, ...]
    bias: tuple[float, ...]
    is_exact: bool = True
    """Whether it is all of the expression."""


@dataclass(frozen=True)
class _Pixel(Unknown):
    """A shaded point at which the texture `chosen` has a color and alpha, and other textures and attributes are 1."""

    chosen: ImageTexture
    color: Triple
    alpha: float

    def image(self, texture: ImageTexture, coordinates: Triple) -> Value:
        is_other = color_of(texture) != self.chosen
        if texture.output == "alpha":
            return 1.0 if is_other else self.alpha
        return (1.0, 1.0, 1.0) if is_other else self.color

    def attribute(self, attribute: Attribute) -> Value:
        return 1.0 if attribute.kind == "number" else (1.0, 1.0, 1.0)

    def uv(self, name: str) -> Triple:
        return 0.0, 0.0, 0.0


def lookup(expression: Expression, kind: Kind, is_gray: Callable[[ImageTexture], bool]) -> Lookup | None:
    """Return the lookup that an expression is or, where it is more than one image, that of its first image, not exact.

    `is_gray` says whether a texture has equal channels. None where there is no image, or it cannot be told what is made of it.
    """
    found = list(leaves(expression))
    textures = [one for one in found if isinstance(one, ImageTexture)]
    if not textures:
        return None
    texture = color_of(textures[0])
    is_alone = all(isinstance(one, ImageTexture) and color_of(one) == texture for one in found)

    def value(red: float, green: float, blue: float, alpha: float) -> Triple:
        return triple(evaluate(expression, _Pixel(texture, (red, green, blue), alpha)))

    try:
        exact = _exact(texture, kind, value, is_gray(texture)) if is_alone else None
        if exact:
            return exact
        output = "a" if textures[0].output == "alpha" else "rgb" if kind == "triple" else "r"
        low, high = value(0.0, 0.0, 0.0, 0.0), value(1.0, 1.0, 1.0, 1.0)
    except (LookupError, ArithmeticError, ValueError):
        return None
    slope = tuple(b - a for a, b in zip(low, high, strict=True))
    width = 3 if output == "rgb" else 1
    return Lookup(texture, output, slope[:width], low[:width], is_exact=False)


def _exact(texture: ImageTexture, kind: Kind, value: Callable[..., Triple], is_gray: bool) -> Lookup | None:
    if kind == "triple":
        bias, top = value(0.0, 0.0, 0.0, 1.0), value(1.0, 1.0, 1.0, 1.0)
        scale = tuple(b - a for a, b in zip(bias, top, strict=True))

        def expected(probe: tuple[float, ...]) -> Triple:
            red, green, blue = (s * p + b for s, p, b in zip(scale, probe, bias, strict=False))
            return red, green, blue

        return Lookup(texture, "rgb", scale, bias) if _holds(value, expected, is_gray=False) else None
    for index, channel in enumerate(CHANNELS):
        at_one = [0.0] * 4
        at_one[index] = 1.0
        bottom = value(0.0, 0.0, 0.0, 0.0)[0]
        slope = value(*at_one)[0] - bottom
        if is_gray and channel == "r":
            slope = value(1.0, 1.0, 1.0, 0.0)[0] - bottom

        def of_channel(probe: tuple[float, ...], index: int = index, slope: float = slope, bottom: float = bottom) -> Triple:
            return triple(probe[index] * slope + bottom)

        if abs(slope) > TOLERANCE and _holds(value, of_channel, is_gray):
            return Lookup(texture, channel, (slope,), (bottom,))  # ty: ignore[invalid-argument-type] - a channel's letter
    return None


def _holds(value: Callable[..., Triple], expected: Callable[[tuple[float, ...]], Triple], is_gray: bool) -> bool:
    for probe in PROBES:
        given = (probe[0], probe[0], probe[0], probe[3]) if is_gray else probe
        pairs = zip(value(*given), expected(given), strict=True)
        if not all(math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=TOLERANCE) for a, b in pairs):
            return False
    return True


def leaves(expression: Expression) -> Iterator[Expression]:
    """Yield the images, attributes and properties of the point that an expression is made of, without the images' coordinates."""
    if isinstance(expression, (ImageTexture, Attribute, UvMap, Coordinate, NormalMap, Bump)):
        yield expression
    elif not isinstance(expression, Constant):
        for child in children(expression):
            yield from leaves(child)


def color_of(texture: ImageTexture) -> ImageTexture:
    """Return the lookup of a texture without what is made of it."""
    return replace(texture, output="color", is_unassociated=False)


def clipped(opacity: Expression) -> tuple[Expression, float] | None:
    """Return what an opacity of 0 or 1 compares, and the threshold from which on it is 1; None for any other opacity."""
    match opacity:
        case Apply("clamp", (inside, Constant(0 | 0.0), Constant(1 | 1.0))):
            return clipped(inside)
        case Apply("mix", (Constant(0 | 0.0), Constant(1 | 1.0), inside)):
            return clipped(inside)
        case Apply("greater_than", (alpha, Constant(float() as threshold))):
            return alpha, threshold
        case Apply("less_than", (Constant(float() as threshold), alpha)):
            return alpha, threshold
        case Apply("subtract", (Constant(1 | 1.0), Apply("less_than", (alpha, Constant(float() as threshold))))):
            return alpha, threshold
        case Apply("subtract", (Constant(1 | 1.0), Apply("greater_than", (Constant(float() as threshold), alpha)))):
            return alpha, threshold
        case Apply("round", (alpha,)):
            return alpha, 0.5
        case Curve(points=((_, 0 | 0.0), (threshold, 1 | 1.0)), argument=alpha, is_stepped=True):
            return alpha, threshold
    return None
