# SPDX-License-Identifier: GPL-3.0-or-later
"""Inner node groups: the closures of each set of lobes in `closures/lobes.py`, given the color of each lobe.

EEVEE keeps one closure of a kind per pixel and picks at random among several; a material that is also translucent keeps its Diffuse
closure apart from its Subsurface one. So a Subsurface closure without any scattering, a Diffuse one and a Translucent one without
any color shade two lobes in every sample, without noise. It also cuts the light from behind the first one's normal off from all.

Cycles' Diffuse closure adds Fujii's multiple scattering, which grows with the cube of the color. Added to itself DOUBLINGS times at
a color as many times halved, it reflects the same once and next to nothing twice.
"""

import math
from collections.abc import Callable
from functools import partial

from ..closures.lobe import CYCLES_AWAY
from .graph import Graph, Group, Number, Operand, Socket, Value

BLACK = (0.0, 0.0, 0.0, 1.0)
WHITE = (1.0, 1.0, 1.0, 1.0)
DOUBLINGS = 3  # each leaves a quarter of the multiple scattering: at rho = 1 and sigma = 1 some 0.1 % of the whole


def _vector(name: str, description: str) -> Socket:
    return Socket(name, "NodeSocketVector", description, (0.0, 0.0, 0.0))


def _number(name: str, description: str) -> Socket:
    return Socket(name, "NodeSocketFloat", description, 0.0)


N = _vector("N", "Shading normal")
TANGENT = _vector("Tangent", "Unit vector V_t across N, towards the viewer")
FACING = _vector("Facing", "Color of the lobe around N")
TOWARD = _vector("Toward", "Color of the lobe towards the viewer")
AWAY = _vector("Away", "Color of the lobe away from the viewer")


def _along(graph: Graph, tangent: Operand, n: Value, up: Operand) -> tuple[Value, Value]:
    """Return tangent + up N and its length; closures normalize it."""
    d = tangent + n * up
    return d, graph.vector_math("LENGTH", d, output="Value")


def _noise_free_pair(graph: Graph, facing: Operand, n: Value, color: Operand, bent: Value) -> Value:
    """Return EEVEE's two lobes without noise: `facing` around `n` and `color` around `bent`.

    EEVEE keeps the radius of the first one in steps of 2 mm, dithered; `materials.set_thickness` keeps light from behind out.
    """
    return graph.add_shader(graph.unscattered(facing, n), graph.diffuse(color, bent), graph.translucent(BLACK))


def build_single(graph: Graph) -> Value:
    n, tangent, facing, toward = map(graph.input, SINGLE_LOBE.inputs)
    d = n * graph.mean(facing) + tangent * graph.mean(toward)
    bent = graph.normalize(d)
    color = facing * graph.dot(bent, n) + toward * graph.dot(bent, tangent)
    return graph.diffuse(graph.maximum(color, 0.0), bent)


def build_pair(graph: Graph) -> Value:
    n, tangent, facing, toward, up = map(graph.input, LOBE_PAIR.inputs)
    bent, length = _along(graph, tangent, n, up)
    return _noise_free_pair(graph, graph.maximum(facing, 0.0), n, graph.maximum(toward, 0.0) * length, bent)


def build_signed(graph: Graph, both: bool) -> Value:
    """What `closures.lobe.capped` gives towards the viewer, as light that is emitted; `both`: without what it gives away from it.

    Each lobe is a Diffuse closure of its own Shader to RGB, which needs no light from those that face away from it: EEVEE leaves
    that out before it looks for shadows.
    """
    inputs = {socket.name: graph.input(socket) for socket in (SIGNED_LOBES_BOTH if both else SIGNED_LOBES).inputs}
    n, tangent = inputs["N"], inputs["Tangent"]
    across = graph.vector_math("CROSS_PRODUCT", n, tangent)

    def lit(d: Value) -> Value:
        return graph.shader_to_rgb(graph.diffuse(WHITE, d))

    under = lit(n * -1.0)

    def capped(color: Value, color_under: Value, along: Value, up: Value, side: Value) -> Value:
        middle, aside = along - n * up, across * side
        length = graph.vector_math("LENGTH", middle + aside, output="Value")
        beyond = (lit(middle + aside) + lit(middle - aside)) * (length * 0.5)
        rest = graph.maximum(beyond * color - under * color_under, 0.0)
        return graph.maximum(lit(along) * color - rest, 0.0)

    total = capped(inputs["Toward"], inputs["Under"], tangent, inputs["Crease"], inputs["Side"])
    if both:
        away = capped(inputs["Away"], inputs["Away Under"], tangent * -1.0, inputs["Away Crease"], inputs["Away Side"])
        total = graph.maximum(graph.multiply_add(lit(n), inputs["Reserve"], total) - away, 0.0)
    return graph.add_shader(graph.diffuse(graph.maximum(inputs["Base"], 0.0), n), graph.emission(total))


def single_scattering(graph: Graph, n: Value, color: Value, factor: Number, roughness: Operand) -> Value:
    """Return, in Cycles, Fujii's model of albedo `color` times `factor`, without multiple scattering."""
    base = graph.diffuse(color * (factor * 0.5**DOUBLINGS), n, roughness)
    for _ in range(DOUBLINGS):
        base = graph.add_shader(base, base)
    return base


def away_lobe(graph: Graph, tangent: Value, n: Value, color: Value, mapped: bool) -> Value:
    """Return, in Cycles, the lobe away from the viewer; `mapped`: where N may be another than the mesh's normal."""
    if mapped:
        mesh = graph.geometry("Normal")  # closures.lobe.away
        up = graph.maximum(graph.dot(mesh, tangent), 0.0) + 1.0 / math.tan(CYCLES_AWAY)
        direction = mesh * up - tangent
    else:
        direction = graph.multiply_add(tangent, -math.tan(CYCLES_AWAY), n)
    return graph.diffuse(graph.maximum(color, 0.0), direction)


def _inner(
    key: str, label: str, description: str, version: int, inputs: tuple[Socket, ...], build: Callable[[Graph], Value]
) -> Group:
    return Group(key, f".True Diffuse {label}", label, version, description, inputs, lambda graph: {"BSDF": build(graph)})


SINGLE_LOBE = _inner(
    "single", "Single Lobe", "EEVEE: one Diffuse closure around the sum of two lobes", 2, (N, TANGENT, FACING, TOWARD), build_single
)
LOBE_PAIR = _inner(
    "pair",
    "Lobe Pair",
    "EEVEE: a lobe around the normal and one bent towards the viewer, both in every sample",
    2,
    (N, TANGENT, FACING, TOWARD, _number("Up", "How far the bent lobe rises towards N")),
    build_pair,
)
_SIGNED = (
    N,
    TANGENT,
    _vector("Base", "Color of the closure around N, which is not part of the sum"),
    TOWARD,
    _vector("Under", "Color of the lobe under the surface, beside the lobe towards the viewer"),
    _number("Crease", "How steep the crease is up to which light counts whole, towards the viewer"),
    _number("Side", "How far that crease is split sideways"),
)
SIGNED_LOBES = _inner(
    "signed", "Signed Lobes", "EEVEE: lobes of either sign through Shader to RGB", 3, _SIGNED, partial(build_signed, both=False)
)
SIGNED_LOBES_BOTH = _inner(
    "signed_both",
    "Signed Lobes, Both Sides",
    "EEVEE: lobes of either sign through Shader to RGB, towards the viewer and away",
    1,
    (
        *_SIGNED,
        _vector("Reserve", "Color of the lobe around N that keeps the sum above 0"),
        AWAY,
        _vector("Away Under", "Color of the lobe under the surface, beside the lobe away from the viewer"),
        _number("Away Crease", "How steep the crease is, away from the viewer"),
        _number("Away Side", "How far that crease is split sideways"),
    ),
    partial(build_signed, both=True),
)
