# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group Subsurface: skin, wax, marble, milk. A coat over a mix of rough diffuse reflection and subsurface scattering.

Lengths are in millimetres, in scenes of any unit scale. The formulas that turn color and mean free path into what each engine's
closure takes are in closures/subsurface_fit.py, the coat's in closures/coat.py. Every layer is a Mix Shader, so what is reflected,
scattered on the surface and scattered below adds up to no more than the light that falls on it.
"""

import math
from dataclasses import replace

from ..closures.coat import squared_cosine
from ..closures.quality import FAST
from ..closures.subsurface_fit import (
    EEVEE_DECAY,
    HALF_STEP,
    LAMBERT_BELOW,
    SCREEN,
    SKIN_IOR,
    WIDTH,
    ClosureInputs,
    eevee_profile,
    random_walks,
    rational,
    through_radius,
)
from ..closures.subsurface_fit import IOR as ENTRY_IOR
from ..models.burley import DIFFUSE_MAP, EDGE_WIDTH_25_75
from ..models.medium import LONGEST, SHORTEST
from ..models.wolff import transmittance
from .graph import COLOR, NORMAL, Graph, Group, Socket, Value
from .lobe_nodes import BLACK
from .model_nodes import ROUGHNESS
from .rough_diffuse import MODEL, ROUGH

METHOD = Socket(
    "Method",
    "NodeSocketMenu",
    "How Cycles scatters light below the surface; EEVEE has one method",
    "Random Walk",
    panel="Subsurface",
)
WEIGHT = Socket(
    "Subsurface",
    "NodeSocketFloat",
    "Fraction of the light that enters; the rest is reflected by the rough surface",
    1.0,
    0.0,
    1.0,
    subtype="FACTOR",
    panel="Subsurface",
)
MEAN_FREE_PATH = Socket(
    "Subsurface Radius",
    "NodeSocketVector",
    "Mean free path of light below the surface for red, green and blue, in millimeters: mean distance light travels between "
    "scattering events",
    (1.3, 0.95, 0.67),  # Skin 1 of Jensen and others (2001)
    0.0,
    panel="Subsurface",
)
SCALE = Socket("Scale", "NodeSocketFloat", "Scales the subsurface radius", 1.0, 0.0, panel="Subsurface")
SPECULAR = Socket(
    "Specular",
    "NodeSocketFloat",
    "Weight of the specular coat: oily or wet skin, polish",
    1.0,
    0.0,
    1.0,
    subtype="FACTOR",
    panel="Specular",
)
SPECULAR_ROUGHNESS = Socket(
    "Specular Roughness", "NodeSocketFloat", "Roughness of the coat", 0.4, 0.0, 1.0, subtype="FACTOR", panel="Specular"
)
IOR = Socket("IOR", "NodeSocketFloat", "Index of refraction of the coat, and of Wolff's dielectric", 1.4, 1.0, 3.0)
DIFFUSE = tuple(replace(socket, panel="Diffuse") for socket in (MODEL, ROUGHNESS))
THICKNESS = "Thickness"  # the output to link to the Material Output's
BRIGHTEST = 1e-6
RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
# Of what EEVEE is asked about light from behind: a radius, in thicknesses, and the share of that light that comes through then
PROBE = 2.5
PROBED = eevee_profile(1.0 / PROBE)
TYPICAL = 1.0 / 3.0  # depth in thicknesses at which light through matter is held against that from the front


class Medium:
    """The medium's inputs inside their ranges, channels as vectors, and what the closures share."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.color = graph.clamp(graph.input(COLOR), 0.0, 1.0)
        self.n, self.mapped = graph.normal()
        # not a millimetre: a driver leaves what changes by some 1e-6 as it was
        self.scale = graph.clamp(graph.input(SCALE), 0.0, LONGEST) * (graph.meter() * 0.001)
        length = graph.clamp(graph.input(MEAN_FREE_PATH), 0.0, LONGEST)
        self.enters = graph.clamp((length * (self.scale * (1.0 / LAMBERT_BELOW)) - 1.0) * 1000.0, 0.0, 1.0)
        self.length = length * self.enters

    def closure(self, falloff: str, color: Value, radius: Value, ior: float | None = None) -> Value:
        """Return a Subsurface closure; `radius` in mean free paths."""
        return self.graph.subsurface(falloff, color, self.length * radius, self.scale, self.n, ior)

    def edge(self) -> Value:
        """Return the width of a shadow's edge, over that of Burley's profile with d = 1 / (4 pi)."""
        return rational([4.0 * math.pi / EDGE_WIDTH_25_75 * c for c in WIDTH[:3]] + list(WIDTH[3:]), 3, self.color, self.graph)


def eevee(medium: Medium) -> tuple[Value, Value]:
    """Return EEVEE's closure, and the thickness from which on no light comes through [Blender's units]."""
    graph, color = medium.graph, medium.color
    a = color * (1.0 / graph.maximum(graph.largest(color), BRIGHTEST))
    middle, steep, lowest = DIFFUSE_MAP
    off = a - lowest
    radius = medium.length * medium.edge() * (middle - a + off * off * steep) * (medium.scale * SCREEN)
    through = medium.length * medium.scale * through_radius(color, graph)
    thickness = graph.largest(through)
    radius = radius + (through - radius) * from_behind(medium, through, thickness)
    return graph.subsurface("BURLEY", color, radius + graph.minimum(radius, HALF_STEP), 1.0, medium.n), thickness


def from_behind(medium: Medium, radius: Value, thickness: Value) -> Value:
    """Return, by channel, the share of light through matter, in transmission of that `radius`, in all that the surface sends out.

    Shader to RGB says how much light comes from lamps behind that shine through `thickness`: Subsurface closures of which one lets
    light through, so the material's thickness has to be that; with EEVEE's own there is none. Lights far behind a surface are not
    in it, nor is the world, which is there in both: a closure around -N has its light alone. Red says how much comes through, as
    it comes farthest in skin, and blue what is lit from the front.
    """
    graph, n = medium.graph, medium.n
    keep_apart = graph.translucent(BLACK)
    probe = graph.subsurface("BURLEY", RED, (1.0, 1.0, 1.0), thickness * PROBE, n)
    lit = graph.shader_to_rgb(graph.add_shader(probe, graph.diffuse(BLUE, n), keep_apart))
    world = graph.add_shader(graph.unscattered(RED, n), graph.diffuse((PROBED, 0.0, 0.0, 1.0), n * -1.0), keep_apart)
    (red, _, front), (other, _, _) = graph.separate(lit), graph.separate(graph.shader_to_rgb(world))
    behind = graph.maximum(red - other, 0.0) * (1.0 / PROBED)
    depth = thickness / graph.maximum(radius, SHORTEST)
    through = graph.power(math.exp(-EEVEE_DECAY * TYPICAL), depth) * behind
    return through / graph.maximum(through + front, BRIGHTEST)


def walk(medium: Medium, falloff: str, inputs: ClosureInputs) -> Value:
    """Return one of Cycles' random walks, with what it loses beside it."""
    color = medium.color + (inputs.color - medium.color) * medium.enters
    closure = medium.closure(falloff, color, inputs.radius, SKIN_IOR if falloff == "RANDOM_WALK_SKIN" else ENTRY_IOR)
    return medium.graph.add_shader(closure, medium.graph.diffuse(inputs.rest * medium.enters, medium.n))


def build(graph: Graph) -> dict[str, Value]:
    medium = Medium(graph)
    walks = {falloff: walk(medium, falloff, inputs) for falloff, inputs in random_walks(medium.color, graph).items()}
    burley = medium.closure("BURLEY", medium.color, medium.edge())
    methods = (
        ("Random Walk", "Walks below the surface: right for any shape, ears and nostrils too", walks["RANDOM_WALK"]),
        ("Christensen-Burley", "Spreads light as on a flat surface: less noise, too bright where it is thin", burley),
        (
            "Random Walk (Skin)",
            "As Random Walk, with more light that enters at a slant: its color moves with the view",
            walks["RANDOM_WALK_SKIN"],
        ),
        ("Random Walk (Legacy)", "As Random Walk, by way of Blender's older fit", walks["RANDOM_WALK_LEGACY"]),
    )
    in_cycles = graph.menu(graph.input(METHOD), "SHADER", methods)
    in_eevee, thickness = eevee(medium)
    scattered = graph.switch(graph.in_eevee(), {0: in_cycles, 1: in_eevee})

    rough = graph.group(
        ROUGH,
        Model=graph.input(MODEL),
        Quality=FAST,  # EEVEE's lobe pair takes the place of its Subsurface closure
        Color=graph.input(COLOR),
        Roughness=graph.input(ROUGHNESS),
        IOR=graph.input(IOR),
        N=medium.n,
        Mapped=medium.mapped,
    )["BSDF"]
    weight, specular = (graph.clamp(graph.input(socket), 0.0, 1.0) for socket in (WEIGHT, SPECULAR))
    base = graph.switch(graph.is_known(weight, 0.0), {0: graph.mix_shader(weight, rough, scattered), 1: rough})
    base = graph.switch(graph.is_known(weight, 1.0), {0: base, 1: scattered})
    shown = graph.switch(graph.is_known(specular, 0.0), {0: coat(graph, medium.n, specular, base), 1: base})
    return {"BSDF": shown, THICKNESS: thickness}


def coat(graph: Graph, n: Value, weight: Value, base: Value) -> Value:
    """Return `base` under a coat of that weight, as `closures.coat.mean_fresnel` has it."""
    roughness = graph.clamp(graph.input(SPECULAR_ROUGHNESS), 0.0, 1.0)
    mu = graph.clamp(graph.dot(n, graph.geometry("Incoming")), 0.0, 1.0)
    cosine = graph.maximum(graph.sqrt(squared_cosine(mu, roughness, graph)), 1e-6)
    fresnel = 1.0 - transmittance(graph, cosine, graph.clamp(graph.input(IOR), 1.0, 3.0))
    return graph.mix_shader(weight * fresnel, base, graph.glossy(roughness, n))


SUBSURFACE = Group(
    key="subsurface",
    name="Subsurface",
    label="Subsurface",
    version=7,
    description="Skin, wax, marble, milk: light enters, scatters and leaves nearby; beside rough diffuse reflection, under a coat",
    inputs=(COLOR, IOR, NORMAL, *DIFFUSE, METHOD, WEIGHT, MEAN_FREE_PATH, SCALE, SPECULAR, SPECULAR_ROUGHNESS),
    build=build,
    open_panel=WEIGHT.panel,
)
