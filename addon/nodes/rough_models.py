# SPDX-License-Identifier: GPL-3.0-or-later
"""The rough diffuse models in node arithmetic: as shares of lobes, and over Lambert under one lamp.

The formulas, their symbols and sources are in `models/`.
"""

import math
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import NamedTuple

from ..closures.lobe import Weight
from ..closures.lobe_table import TRANSMITTANCE
from ..models.eon import K2
from ..models.fujii import K1
from .graph import COLOR, Graph, Number, Socket, Value

LEAST = 1e-6  # of a divisor
HEAD_ON = 1e-6  # keeps the tangent defined where V = N; all that follows it is 0 there

ROUGHNESS = Socket(
    "Roughness",
    "NodeSocketFloat",
    "0 is Lambert, chalk and clay are 0.3 to 0.5. Oren-Nayar: sigma, the spread of the facets' slope angles in radians. "
    "Fujii, EON, Cycles Diffuse: 0 to 1",
    0.33,
    0.0,
    math.pi / 2,
    subtype="FACTOR",
)
IOR = Socket("IOR", "NodeSocketFloat", "Index of refraction of Wolff's dielectric", 1.5, 1.0, 3.0)
N = Socket("N", "NodeSocketVector", "Shading normal at unit length", (0.0, 0.0, 0.0))


class Terms(NamedTuple):
    """A model in units of (rho / pi) E0, as in `closures.lobes.expansion`; the numbers may be vectors, one component a channel."""

    facing: Number
    functions: Mapping[str, Number]


class Surface:
    """The inputs inside their ranges, and the view."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.color = graph.clamp(graph.input(COLOR), 0.0, 1.0)
        self.sigma = graph.clamp(graph.input(ROUGHNESS), 0.0, 100.0)
        self.n = graph.input(N)
        self.v = graph.geometry("Incoming")
        self.mu = graph.maximum(graph.dot(self.n, self.v), 0.0)
        across = self.v - self.n * (self.mu - HEAD_ON)
        self.sine = graph.vector_math("LENGTH", across, output="Value")
        self.tangent = graph.normalize(across)
        self.weights: dict[Weight, Number] = {}

    @cached_property
    def r(self) -> Value:
        """The roughness of Fujii's model and those made of it."""
        return self.graph.minimum(self.sigma, 1.0)

    @cached_property
    def variance(self) -> Value:
        return self.sigma * self.sigma

    @cached_property
    def a(self) -> Value:
        return 1.0 - 0.5 * (self.variance / (self.variance + 0.33))

    @cached_property
    def b(self) -> Value:
        return 0.45 * (self.variance / (self.variance + 0.09))

    @cached_property
    def fujii_a(self) -> Value:
        return 1.0 / (1.0 + K1 * self.r)

    @cached_property
    def fujii_average(self) -> Value:
        return (1.0 + K2 * self.r) * self.fujii_a

    @cached_property
    def ior(self) -> Value:
        return self.graph.clamp(self.graph.input(IOR), 1.0, 3.0)

    @cached_property
    def missing(self) -> Value:
        """(1 - E(mu)) / (A r): what Fujii's model reflects too little of light from the viewer's direction."""
        return missing(self.graph, self.mu, self.sine)

    @cached_property
    def again(self) -> Value:
        """rho_ms / rho of EON, a color."""
        average = self.fujii_average
        return self.color * average / (1.0 - self.color * (1.0 - average))

    @cached_property
    def twice(self) -> Value:
        """Interreflection of the 1994 model, over (rho / pi) E0, a color."""
        return self.color * (0.17 * (self.variance / (self.variance + 0.13)))

    @cached_property
    def transmittance(self) -> Value:
        """1 - F(mu) of Wolff's dielectric."""
        return transmittance(self.graph, self.mu, self.ior)

    @cached_property
    def average_transmittance(self) -> Value:
        f = (self.ior - 1.0) / (self.ior + 1.0)
        c_1, c_2, c_3 = TRANSMITTANCE
        return 1.0 - f * (c_1 + f * (c_2 + f * c_3))

    def weight(self, weight: Weight) -> Number:
        """Return c(mu) as a value, or a number where it is the same everywhere; nodes are made once for each weight."""
        if weight not in self.weights:
            self.weights[weight] = self._weight(weight)
        return self.weights[weight]

    def _weight(self, weight: Weight) -> Number:
        constant, *factors = weight
        while factors and factors[-1] == 0.0:
            factors.pop()
        if not factors:
            return constant
        total: Number = factors.pop()
        while factors:
            total = self.graph.multiply_add(self.mu, total, factors.pop())
        return self.graph.multiply_add(self.sine, total, constant)


class Lamp:
    """The geometry of one lamp: L, N.L and s at the shading point."""

    def __init__(self, surface: Surface, l: Value) -> None:
        graph = surface.graph
        self.surface = surface
        self.mu = graph.clamp(graph.dot(surface.n, l), 0.0, 1.0)
        self.s = graph.dot(surface.v, l) - self.mu * surface.mu
        self.over_t = 1.0 / graph.maximum(graph.maximum(self.mu, surface.mu), LEAST)

    @cached_property
    def sine(self) -> Value:
        return self.surface.graph.sqrt(1.0 - self.mu * self.mu)


def missing(graph: Graph, mu: Value, sine: Value) -> Value:
    """Return (1 - E(mu)) / (A r) of Fujii's model: K1 - G(mu) / pi."""
    cubic = mu * (1.0 + sine + sine * sine) / (1.0 + sine)
    g = sine * (graph.math("ARCCOSINE", mu) - sine * mu + 2.0 / 3.0 * (cubic - 1.0))
    return K1 - g * (1.0 / math.pi)


def transmittance(graph: Graph, mu: Value, ior: Value) -> Value:
    """Return 1 - F(mu) of a smooth dielectric."""
    refracted = graph.sqrt(ior * ior - 1.0 + mu * mu)  # n cos(theta_t)
    across, along = graph.maximum(mu + refracted, LEAST), graph.maximum(ior * mu + refracted / ior, LEAST)
    return 2.0 * (mu * refracted) * (1.0 / (across * across) + 1.0 / (along * along))


def oren_nayar(surface: Surface) -> Terms:
    return Terms(surface.a, {"oren_nayar": surface.b})


def oren_nayar_under(lamp: Lamp) -> Value:
    graph, surface = lamp.surface.graph, lamp.surface
    return surface.a + surface.b * graph.maximum(lamp.s, 0.0) * lamp.over_t


def oren_nayar_albedo(surface: Surface) -> Value:
    # E of Fujii's model is A (1 + r (K1 - missing)); T lacks its part for s < 0, which is 2/3 sin(v) / pi
    return surface.a + surface.b * (K1 - surface.missing + surface.sine * (2.0 / (3.0 * math.pi)))


def fujii(surface: Surface) -> Terms:
    return Terms(surface.fujii_a, {"fujii": surface.fujii_a * surface.r})


def fujii_under(lamp: Lamp) -> Value:
    graph, surface = lamp.surface.graph, lamp.surface
    over_t = graph.maximum(lamp.s, 0.0) * lamp.over_t + graph.minimum(lamp.s, 0.0)
    return surface.fujii_a * (1.0 + surface.r * over_t)


def fujii_albedo(surface: Surface) -> Value:
    return 1.0 - surface.fujii_a * surface.r * surface.missing


def eon(surface: Surface) -> Terms:
    single = fujii(surface)
    return Terms(surface.again * (surface.fujii_a * surface.r * surface.missing) + single.facing, single.functions)


def eon_under(lamp: Lamp, again: Value | None = None) -> Value:
    surface = lamp.surface
    # (1 - E_i)(1 - E_o) / (1 - <E>), with A r taken out of each
    both = missing(surface.graph, lamp.mu, lamp.sine) * surface.missing * (1.0 / (K1 - K2))
    return (again or surface.again) * (surface.fujii_a * surface.r * both) + fujii_under(lamp)


def eon_albedo(surface: Surface) -> Value:
    return surface.again * (surface.fujii_a * surface.r * surface.missing) + fujii_albedo(surface)


def cycles_diffuse(surface: Surface) -> Terms:
    single = fujii(surface)
    again = surface.again * surface.color
    return Terms(again * (surface.fujii_a * surface.r * surface.missing) + single.facing, single.functions)


def cycles_diffuse_under(lamp: Lamp) -> Value:
    return eon_under(lamp, lamp.surface.again * lamp.surface.color)


def oren_nayar_1994(surface: Surface) -> Terms:
    return Terms(surface.twice + surface.a, {"oren_nayar_1994": surface.b, "interreflection": surface.twice * -1.0})


def oren_nayar_1994_under(lamp: Lamp) -> Value:
    surface, graph = lamp.surface, lamp.surface.graph
    cos_phi = graph.clamp(lamp.s / graph.maximum(lamp.sine * surface.sine, LEAST), -1.0, 1.0)
    low, high = graph.minimum(lamp.mu, surface.mu), graph.maximum(lamp.mu, surface.mu)
    alpha, beta = graph.math("ARCCOSINE", low), graph.math("ARCCOSINE", high)
    sin_alpha, sin_beta = graph.maximum(lamp.sine, surface.sine), graph.minimum(lamp.sine, surface.sine)
    share = beta * (2.0 / math.pi)
    forward = graph.math("LESS_THAN", cos_phi, 0.0) * (share * share * share)
    c_2 = surface.b * (sin_alpha - forward)
    apart = alpha * beta * (4.0 / math.pi**2)
    c_3 = surface.b * (1.0 / 3.6) * (apart * apart)
    tan_half = (sin_alpha + sin_beta) / graph.maximum(lamp.mu + surface.mu, LEAST)
    once = surface.a + c_2 * cos_phi * sin_beta * lamp.over_t + c_3 * (1.0 - graph.math("ABSOLUTE", cos_phi)) * tan_half
    return graph.maximum(surface.twice * (1.0 - cos_phi * (share * share)) + once, 0.0)


def oren_nayar_1994_albedo(surface: Surface) -> Value:
    return surface.twice + oren_nayar_albedo(surface)


def wolff(surface: Surface) -> Terms:
    return Terms(surface.transmittance * surface.average_transmittance, {})


def wolff_under(lamp: Lamp) -> Value:
    return lamp.surface.transmittance * transmittance(lamp.surface.graph, lamp.mu, lamp.surface.ior)


def wolff_albedo(surface: Surface) -> Value:
    return surface.transmittance * surface.average_transmittance


def pits(surface: Surface) -> Terms:
    return Terms(surface.color / (4.0 - surface.color * 2.0), {"pits": 1.0})


class OneLamp(NamedTuple):
    """A model over Lambert's, where one lamp is known and where none is."""

    gain: Callable[[Lamp], Value]
    albedo: Callable[[Surface], Value]
    """The directional albedo over rho, or nearly."""


class Kind(NamedTuple):
    """An entry of the Model menu; its place is the number that the OSL shader knows it by."""

    name: str
    description: str
    terms: Callable[[Surface], Terms]
    one_lamp: OneLamp | None = None
    """None for Lambert, and for pits, whose formula is too much for nodes."""


KINDS = (
    Kind("Lambert", "Ideal diffuse reflection: the same brightness from every view", lambda _surface: Terms(1.0, {})),
    Kind(
        "Oren-Nayar",
        "Equation (1) of Kim and Lee (2021), the short form of 1994: chalk, clay, plaster",
        oren_nayar,
        OneLamp(oren_nayar_under, oren_nayar_albedo),
    ),
    Kind(
        "Fujii",
        "Fujii's improvement of Oren-Nayar, light reflected once: darkens as it gets rougher",
        fujii,
        OneLamp(fujii_under, fujii_albedo),
    ),
    Kind(
        "EON", "Energy-preserving Oren-Nayar of OpenPBR: Fujii and all that is reflected again", eon, OneLamp(eon_under, eon_albedo)
    ),
    Kind(
        "Cycles Diffuse",
        "What Blender's Diffuse BSDF does in Cycles, for EEVEE to match",
        cycles_diffuse,
        OneLamp(cycles_diffuse_under, eon_albedo),
    ),
    Kind(
        "Oren-Nayar 1994",
        "The full model with the interreflection of facets",
        oren_nayar_1994,
        OneLamp(oren_nayar_1994_under, oren_nayar_1994_albedo),
    ),
    Kind(
        "Wolff",
        "A smooth dielectric: light enters, is scattered inside and leaves. Uses IOR",
        wolff,
        OneLamp(wolff_under, wolff_albedo),
    ),
    Kind("Pitted (Koenderink)", "A surface of nothing but round pits, after Koenderink: brightest towards the light", pits),
)
