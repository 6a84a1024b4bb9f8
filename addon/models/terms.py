# SPDX-License-Identifier: GPL-3.0-or-later
"""Models over (rho / pi) E0, written once in arithmetic that plain floats and the sockets of node trees have in common.

With x, y, z the components of L along V_t (the unit tangent towards the viewer), N x V_t and N, and mu = N.V, every model is a
weighted sum of z and of functions of the light that know neither roughness nor color:

    L_r = (rho / pi) E0 [ facing z + sum of weight F(L, mu) ]

The node groups evaluate these classes on sockets, `closures/lobes.py` and the tests on floats.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

from .protocol import Model
from .quadrature import NORMAL
from .vector import Vector, from_polar

SMALLEST_DIVISOR = 1e-6  # sockets have 32-bit floats

type Number = Any  # a float, or a socket that calculates with + - * / and **: a number, or one for each color channel


class Arithmetic(Protocol):
    """What numbers need beside + - * / and **."""

    def minimum(self, a: Number, b: Number, /) -> Number: ...
    def maximum(self, a: Number, b: Number, /) -> Number: ...
    def clamp(self, a: Number, low: float, high: float) -> Number: ...
    def sqrt(self, a: Number, /) -> Number: ...
    def arccosine(self, a: Number, /) -> Number: ...
    def absolute(self, a: Number, /) -> Number: ...
    def power(self, base: Number, exponent: Number, /) -> Number: ...
    def multiply_add(self, a: Number, b: Number, c: Number) -> Number:
        """Return a b + c."""
        ...

    def less_than(self, a: Number, b: Number) -> Number:
        """Return 1 where a < b, else 0."""
        ...


class _FloatArithmetic:
    minimum, maximum = staticmethod(min), staticmethod(max)
    sqrt, arccosine = staticmethod(math.sqrt), staticmethod(math.acos)
    absolute, power = staticmethod(abs), staticmethod(math.pow)

    def clamp(self, a: float, low: float, high: float) -> float:
        return min(max(low, a), high)

    def less_than(self, a: float, b: float) -> float:
        return float(a < b)

    def multiply_add(self, a: float, b: float, c: float) -> float:
        return a * b + c


FLOATS = _FloatArithmetic()
"""The arithmetic of plain floats."""


def polynomial(ops: Arithmetic, coefficients: Sequence[float], x: Number) -> Number:
    """Return c_0 + c_1 x + ..., two terms or more."""
    *rest, last, highest = coefficients
    total = ops.multiply_add(x, highest, last)
    for coefficient in reversed(rest):
        total = ops.multiply_add(x, total, coefficient)
    return total


@dataclass(frozen=True)
class View:
    """A surface and its viewer: the albedo `color` rho in [0, 1], `mu` = N.V in [0, 1], and the sine of that angle."""

    ops: Arithmetic
    color: Number
    mu: Number
    sine: Number


def float_view(mu: float, albedo: float) -> View:
    """Return the view at N.V = `mu` of a surface of one albedo, both in [0, 1]."""
    return View(FLOATS, albedo, mu, math.sqrt(max(0.0, 1.0 - mu * mu)))


class Light:
    """One light over the surface of a `view`: `mu` = N.L in [0, 1], `s` = L.V - (N.L)(N.V)."""

    def __init__(self, view: View, mu: Number, s: Number) -> None:
        self.view, self.mu, self.s = view, mu, s
        self.over_t = 1.0 / view.ops.maximum(view.ops.maximum(mu, view.mu), SMALLEST_DIVISOR)  # 1 / max(N.L, N.V)

    @cached_property
    def sine(self) -> Number:
        return self.view.ops.sqrt(1.0 - self.mu * self.mu)


class LightFunction(NamedTuple):
    """A function F(L, mu) that models are made of; `value` takes L in the frame (V_t, N x V_t, N), z > 0."""

    name: str
    value: Callable[[Vector, float], float]
    is_signed: bool = False
    """Whether it can be negative; it is then at least -z sin(v)."""


class Expansion(NamedTuple):
    """`facing` times z, and light functions by name with their weights, none of them negative."""

    facing: Number
    functions: Mapping[str, Number]


class Terms:
    """A model of a `value` of its parameter, inside its range (None for a model without), seen as in `view`."""

    def __init__(self, view: View, value: Number = None) -> None:
        self.view, self.ops, self.value = view, view.ops, value

    def expansion(self) -> Expansion:
        """Return the model as z and functions of the light.

        Where a factor depends on the light alone, its mean over all lights stands in, so that the energy is kept.
        """
        raise NotImplementedError


class SingleLightTerms(Terms):
    """A model that is also short enough, as a function of one light, to be evaluated at each point by nodes."""

    def single_light(self, light: Light) -> Number:
        """Return the radiance over Lambert's, (rho / pi) E0 (N.L)."""
        raise NotImplementedError

    def directional_albedo(self) -> Number:
        """Return the fraction of light from everywhere that is reflected to the viewer, over rho; or nearly."""
        raise NotImplementedError


def relative_radiance(model: Model, l: Vector, mu: float, albedo: float = 1.0) -> float:
    """Return `model`'s radiance over (rho / pi) E0 for L in the frame (V_t, N x V_t, N)."""
    return math.pi / albedo * model.radiance(NORMAL, l, from_polar(mu, 0.0), albedo)
