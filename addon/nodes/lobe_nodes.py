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

from ..closures.lobe import CYCLES_AWAY, GRAZING
from .graph import Graph, Group, Number, Operand, Socket, Value

BLACK = (0.0, 0.0, 0.0, 1.0)
WHITE = (1.0, 1.0, 1.0, 1.0)
FAINT = (2e-5, 2e-5, 2e-5, 1.0)  # EEVEE drops what is below 1e-5
DOUBLINGS = 3  # each leaves a quarter of the multiple scattering: at rho = 1 and sigma = 1 some 0.1 % of the whole


def _vector(name: str, description: str) -> Socket:
    return Socket(name, "NodeSocketVector", description, (0.0, 0.0, 0.0))


def _number(name: str, description: str) -> Socket:
    return Socket(name, "NodeSocketFloat", description, 0.0)


N = _vector("N", "Shading normal")
TANGENT = _vector("Tangent", "Unit vector V_t across N, towards the viewer")
MU = _number("N.V", "Cosine of the angle between normal and viewer")
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


def build_signed(graph: Graph, under: bool) -> Value:
    """The lobes of either sign; `under`: with the one from under the surface, which equation (1) does without."""
    inputs = {socket.name: graph.input(socket) for socket in (SIGNED_LOBES_UNDER if under else SIGNED_LOBES).inputs}
    n, tangent = inputs["N"], inputs["Tangent"]
    slope = 1.0 / graph.maximum(inputs["N.V"], GRAZING)
    far_up = inputs["Far Steep"] * slope
    back = tangent * -1.0
    across = graph.vector_math("CROSS_PRODUCT", n, tangent) * inputs["Side"]

    def lobe(name: str, direction: Value, up: Operand, share: float = 1.0) -> Value:
        bent, length = _along(graph, direction, n, up)
        white = graph.shader_to_rgb(_noise_free_pair(graph, FAINT, n, WHITE, bent))
        return white * (inputs[name] * (length * share))

    # Over far_up, up to 18, inside, times it outside: EEVEE clamps what a world adds to a closure, to a radiance of 10 by default
    facing, toward = graph.maximum(inputs["Facing"], 0.0), graph.maximum(inputs["Toward"], 0.0) / far_up
    total = graph.shader_to_rgb(_noise_free_pair(graph, facing, n, toward, tangent)) * far_up
    total += lobe("Away", back, 0.0)
    total += lobe("Near", tangent, inputs["Near Steep"] * slope * -1.0)
    total += lobe("Far", back + across, far_up, 0.5)
    total += lobe("Far", back - across, far_up, 0.5)
    if under:
        total += lobe("Under", back, inputs["Under Up"])
    base = graph.diffuse(graph.maximum(inputs["Base"], 0.0), n)
    return graph.add_shader(base, graph.emission(graph.maximum(total, 0.0)))


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


def _inner(key: str, label: str, description: str, inputs: tuple[Socket, ...], build: Callable[[Graph], Value]) -> Group:
    return Group(key, f".True Diffuse {label}", label, 2, description, inputs, lambda graph: {"BSDF": build(graph)})


SINGLE_LOBE = _inner(
    "single", "Single Lobe", "EEVEE: one Diffuse closure around the sum of two lobes", (N, TANGENT, FACING, TOWARD), build_single
)
LOBE_PAIR = _inner(
    "pair",
    "Lobe Pair",
    "EEVEE: a lobe around the normal and one bent towards the viewer, both in every sample",
    (N, TANGENT, FACING, TOWARD, _number("Up", "How far the bent lobe rises towards N")),
    build_pair,
)
_SIGNED = (
    N,
    TANGENT,
    MU,
    _vector("Base", "Color of the closure that is not part of the sum"),
    FACING,
    TOWARD,
    AWAY,
    _vector("Near", "Color of the lobe whose crease is nearer to the horizon"),
    _vector("Far", "Color of the lobes whose crease is farther from it"),
    _number("Near Steep", "How steep the nearer crease is"),
    _number("Far Steep", "How steep the farther crease is"),
    _number("Side", "How far the farther crease is split sideways"),
)
SIGNED_LOBES = _inner(
    "signed", "Signed Lobes", "EEVEE: lobes of either sign through Shader to RGB", _SIGNED, partial(build_signed, under=False)
)
SIGNED_LOBES_UNDER = _inner(
    "signed_under",
    "Signed Lobes, Under",
    "EEVEE: lobes of either sign through Shader to RGB, one of them from under the surface",
    (*_SIGNED, _vector("Under", "Color of the lobe from under the surface"), _number("Under Up", "How far it rises, below 0")),
    partial(build_signed, under=True),
)
