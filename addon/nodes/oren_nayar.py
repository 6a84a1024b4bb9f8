# SPDX-License-Identifier: GPL-3.0-or-later
"""Node group Oren-Nayar: equation (1) for every light, shadow and bounce, out of the closures described in `models/lobes.py`.

Drivers that read the scene's engine give one graph the weights of EEVEE or those of Cycles.

EEVEE: the lobe around N is a Subsurface closure without any scattering, and beside it stands a Translucent one without any color.
EEVEE keeps one closure of a kind per pixel and picks at random among several; a material that is also translucent keeps its
Diffuse closure apart from its Subsurface one. So both lobes are shaded in every sample, without noise.

Cycles: the Diffuse closure adds Fujii's multiple scattering, which grows with the cube of the color. Added to itself DOUBLINGS
times at a color as many times halved, it reflects the same once and next to nothing twice. `per_engine` weights of 0 cost nothing:
both engines drop such closures.
"""

import math

from ..models.fujii import K1
from ..models.lobes import CYCLES_LOBE, EEVEE_LOBE
from .graph import COLOR, NORMAL, Graph, Group, Socket, Value

SIGMA = Socket(
    "Sigma",
    "NodeSocketFloat",
    "Roughness: the standard deviation of the slope angles of the surface's facets, in radians. 0 is Lambert",
    0.33,
    0.0,
    math.pi / 2,
)
DOUBLINGS = 3  # each leaves a quarter of the multiple scattering: at rho = 1 and sigma = 1 some 0.1 % of the whole
HEAD_ON = 1e-6  # keeps the bent normal defined where V = N, and its weight is 0
BLACK = (0.0, 0.0, 0.0, 1.0)


def build(graph: Graph) -> Value:
    color, n, v = graph.input(COLOR), graph.normal(), graph.geometry("Incoming")
    sigma = graph.maximum(graph.input(SIGMA), 0.0)
    variance = sigma * sigma
    a = 1.0 - 0.5 * (variance / (variance + 0.33))
    b = 0.45 * (variance / (variance + 0.09))
    bent, weight = bent_lobe(graph, n, v)
    lobe = graph.diffuse(graph.scale(color, b * weight), bent)

    in_eevee = graph.per_engine("In EEVEE", eevee=1.0, other=0.0)
    facing = graph.unscattered(graph.scale(color, in_eevee * a), n)
    kept_apart = graph.translucent(BLACK)

    in_cycles = graph.per_engine("In Cycles", eevee=0.0, other=1.0 / 2**DOUBLINGS)
    fujii = graph.diffuse(graph.scale(color, in_cycles * (a + K1 * b)), n, roughness=b / a)
    for _ in range(DOUBLINGS):
        fujii = graph.add_shader(fujii, fujii)

    return graph.add_shader(graph.add_shader(fujii, facing), graph.add_shader(lobe, kept_apart))


def bent_lobe(graph: Graph, n: Value, v: Value) -> tuple[Value, Value]:
    """Return the bent lobe's normal M and its weight over B."""
    side, w_0, w_1, cot_0, cot_1 = (
        graph.per_engine(label, eevee=getattr(EEVEE_LOBE, name), other=getattr(CYCLES_LOBE, name))
        for name, label in (
            ("side", "Side: viewer's or other"),
            ("w_0", "Weight"),
            ("w_1", "Weight by N.V"),
            ("cot_0", "Cotangent"),
            ("cot_1", "Cotangent by N.V"),
        )
    )
    mu = graph.minimum(graph.maximum(graph.dot(n, v), 0.0), 1.0)
    sine = graph.sqrt(1.0 - mu * mu)
    tangent = graph.vector_math("SUBTRACT", v, graph.scale(n, mu))
    rise = (cot_0 + cot_1 * mu) * sine + HEAD_ON
    bent = graph.vector_math("NORMALIZE", graph.vector_math("ADD", graph.scale(tangent, side), graph.scale(n, rise)))
    return bent, sine * (w_0 + w_1 * mu)


OREN_NAYAR = Group(
    key="oren_nayar",
    name="True Diffuse Oren-Nayar",
    version=1,
    description="Rough diffuse reflection: chalk, clay, plaster, felt, dusty skin",
    inputs=(COLOR, SIGMA, NORMAL),
    build=build,
)
