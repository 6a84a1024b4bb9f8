# SPDX-License-Identifier: GPL-3.0-or-later
"""Node group Standard Specular: the standard specular of the paper's first character, as close as Blender's closures come.

No closure of EEVEE, or of Cycles without OSL, is a Blinn-Phong lobe, so the quality Balanced uses a microfacet lobe: Beckmann's in
Cycles, which with alpha^2 = 2 / (n + 2) has nearly the same shape (B. Walter et al., "Microfacet Models for Refraction through
Rough Surfaces", EGSR 2007); EEVEE takes it for GGX, whose tail is longer. A factor gives it Blinn-Phong's height in the mirror
direction from every view: (n + 8) / (n + 2) times mu^2 / G, with G = 1 / sqrt(1 + alpha^2 (1 / mu^2 - 1)) for GGX's own masking and
shadowing at N.L = N.V = mu; Beckmann's is next to 1.

With Exact for Chosen Lights the base, a Lambert closure, gets the color that makes it the model under the chosen lights: rho and
k_s (n + 8) / 8 (N.H)^n. This color reflects all incoming light, so other lights brighten the highlight too, and it stays, fainter,
where its own light is in shadow. EEVEE keeps colors up to 8 times white.
"""

import math

from ..closures.quality import BALANCED, CHOSEN_LIGHTS
from ..models.blinn_phong import BELOW
from .chosen_lights import MENU_PATH, L, weighted_mean
from .graph import COLOR, NORMAL, Graph, Group, Number, Socket, Value
from .model_nodes import N

LEAST = 1e-12  # of a squared length

QUALITY = Socket("Quality", "NodeSocketMenu", "Every light, or an exact highlight for chosen lights", BALANCED)
QUALITIES = (
    (BALANCED, "A similar highlight under every light, with shadows and bounces"),
    (CHOSEN_LIGHTS, f"Exact for up to four lights, which alone make highlights: select them, then {MENU_PATH}"),
)
SPECULAR = Socket("Specular", "NodeSocketFloat", "Weight k_s of the highlight, without Fresnel", 0.06, 0.0, 1.0, subtype="FACTOR")
EXPONENT = Socket(
    "Exponent", "NodeSocketFloat", "Blinn-Phong exponent n: the higher, the smaller the highlight", 30.0, 0.0, 10000.0
)


def build(graph: Graph) -> dict[str, Value]:
    normal, _ = graph.normal()
    mu = graph.clamp(graph.dot(normal, graph.geometry("Incoming")), 0.0, 1.0)
    closures = {BALANCED: lobe(graph, normal, mu), CHOSEN_LIGHTS: under_lights(graph, normal, mu)}
    return {"BSDF": graph.menu(graph.input(QUALITY), "SHADER", [(name, text, closures[name]) for name, text in QUALITIES])}


def lobe(graph: Graph, normal: Value, mu: Value) -> Value:
    """Return the base and a microfacet lobe near the highlight."""
    n = graph.maximum(graph.input(EXPONENT), 0.0)
    alpha2 = 2.0 / (n + 2.0)
    mu2 = mu * mu
    masking = graph.in_eevee()
    same_height = mu * graph.sqrt(mu2 + masking * alpha2 * (1.0 - mu2))
    weight = graph.input(SPECULAR) * ((n + 8.0) / (n + 2.0)) * same_height
    base = graph.diffuse(graph.input(COLOR), normal)
    both = graph.add_shader(base, graph.beckmann(weight, alpha2**0.25, normal))
    return graph.switch(graph.is_known(graph.input(SPECULAR), 0.0), {0: both, 1: base})


def under_lights(graph: Graph, normal: Value, mu: Value) -> Value:
    """Return a Lambert closure in the color that gives it the model's radiance under the chosen lights, in either engine.

    A diffuse bounce gets the mean of the highlight over all light directions; else high exponents cause fireflies. Cycles, too,
    blurs its lobes there ("Filter Glossy").
    """
    n = graph.clamp(graph.input(EXPONENT), 0.0, 10000.0)
    weight = graph.clamp(graph.input(SPECULAR), 0.0, 1.0) * graph.math("GREATER_THAN", mu, 0.0) * (n + 8.0)

    def under(l: Value) -> tuple[Value, Value]:
        lit = graph.group(ONE_LIGHT, Exponent=n, N=normal, L=l)
        return lit["Power"], lit["N.L"]

    # h of shaders/directional_albedo.glsl, blinn_phong_albedo
    t = mu * graph.sqrt(n)
    below = graph.math("POWER", math.e, -1.0 * t * (0.5 * math.log(2.0) * t + (1.0 - mu) * (BELOW[0] + BELOW[1] * t)))
    albedo = 8.0 / ((n + 2.0) * (n + 4.0)) * (t * t + 2.0 * (1.0 - mu * mu) - (1.0 - 2.0 * mu * mu) * below)
    color = graph.clamp(graph.input(COLOR), 0.0, 1.0)

    def with_highlight(mean: Number) -> Value:
        highlight = graph.mix(graph.is_diffuse_ray(), mean, albedo)
        return graph.diffuse(color + highlight * (weight * 0.125), normal)

    return weighted_mean(graph, under, albedo, with_highlight)


def build_one_light(graph: Graph) -> dict[str, Value]:
    """Return N.L and (N.H)^n as (1 - |N x H|^2)^(n / 2), which is accurate near 1, where an exponent of 10000 needs it."""
    n, l = graph.input(N), graph.input(L)
    h = l + graph.geometry("Incoming")
    across = graph.vector_math("CROSS_PRODUCT", n, h)
    sine2 = graph.dot(across, across) / graph.maximum(graph.dot(h, h), LEAST)
    power = graph.maximum(1.0 - sine2, 0.0) ** (graph.input(EXPONENT) * 0.5)
    return {"Power": power, "N.L": graph.clamp(graph.dot(n, l), 0.0, 1.0)}


ONE_LIGHT = Group(
    "gain_specular",
    ".True Diffuse Standard Specular, One Light",
    "Standard Specular, One Light",
    1,
    "The highlight of one light",
    (EXPONENT, N, L),
    build_one_light,
)
SPECULAR_GROUP = Group(
    key="specular",
    name="Standard Specular",
    label="Standard Specular",
    version=4,
    description="Standard specular: a highlight of fixed weight over a Lambert base, as games used to shade",
    inputs=(QUALITY, COLOR, SPECULAR, EXPONENT, NORMAL),
    build=build,
)
