# SPDX-License-Identifier: GPL-3.0-or-later
"""Node group Specular: the standard specular of the paper's first character, as near as Blender's closures come to it.

No closure of EEVEE, or of Cycles without OSL, is a Blinn-Phong lobe, so a microfacet lobe stands in: Beckmann's in Cycles, which
with alpha^2 = 2 / (n + 2) has nearly the same shape (B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces",
EGSR 2007); EEVEE takes it for GGX, whose tail is longer. A factor gives it Blinn-Phong's height in the mirror direction from every
view: (n + 8) / (n + 2) times mu^2 / G, with G = 1 / sqrt(1 + alpha^2 (1 / mu^2 - 1)) for GGX's own masking and shadowing at
N.L = N.V = mu; Beckmann's is next to 1.
"""

from .graph import COLOR, NORMAL, Graph, Group, Socket, Value

SPECULAR = Socket("Specular", "NodeSocketFloat", "Weight k_s of the highlight, without Fresnel", 0.06, 0.0, 1.0, subtype="FACTOR")
EXPONENT = Socket(
    "Exponent", "NodeSocketFloat", "Blinn-Phong exponent n: the higher, the smaller the highlight", 30.0, 0.0, 10000.0
)


def build(graph: Graph) -> dict[str, Value]:
    normal = graph.normal()
    n = graph.maximum(graph.input(EXPONENT), 0.0)
    alpha2 = 2.0 / (n + 2.0)
    mu = graph.clamp(graph.dot(normal, graph.geometry("Incoming")), 0.0, 1.0)
    mu2 = mu * mu
    masking = graph.in_eevee()
    same_height = mu * graph.sqrt(mu2 + masking * alpha2 * (1.0 - mu2))
    weight = graph.input(SPECULAR) * ((n + 8.0) / (n + 2.0)) * same_height
    base = graph.diffuse(graph.input(COLOR), normal)
    return {"BSDF": graph.add_shader(base, graph.beckmann(weight, alpha2**0.25, normal))}


SPECULAR_GROUP = Group(
    key="specular",
    name="Standard Specular",
    label="Standard Specular",
    version=1,
    description="Standard specular: a highlight of fixed weight over a Lambert base, as games used to shade",
    inputs=(COLOR, SPECULAR, EXPONENT, NORMAL),
    build=build,
)
