# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group Principled Rough Diffuse: Blender's Principled BSDF whose diffuse reflection follows a rough diffuse model.

Sockets have the names, order and panels of the Principled BSDF; its menus Distribution and Subsurface Method, which are properties
of that node, are inputs here. Where the model is the Principled's own (Lambert; in Cycles also Cycles Diffuse) the surface is a
Principled BSDF and nothing else. For the other models let q = (1 - Metallic) (1 - Transmission) (1 - Subsurface) be the fraction
of the diffuse reflection. The surface is

    q [Principled with black Base Color, no metal, transmission and subsurface + rough diffuse times T] + (1 - q) [Principled, rest]

T is what the layers above leave: `closures/principled_layers.py`. The rest is a Principled of Metallic m / (1 - q), Transmission
t / (t + (1 - t) s) and, of what remains, Subsurface in full: so every layer has the weight that it has in one Principled.
"""

from collections.abc import Mapping
from dataclasses import replace

from ..closures.principled_layers import (
    CYCLES,
    EEVEE,
    Interface,
    Layers,
    Table,
    coat_depth,
    level_f0,
    sheen_albedo,
    specular_albedo,
)
from ..models.registry import MODELS, CyclesClosures, ReflectanceModel
from .graph import NORMAL, Graph, Group, Number, Operand, Socket, Value
from .model_nodes import ROUGHNESS_MEANING, N
from .rough_diffuse import MODEL, QUALITY, ROUGH

FLOAT, COLOR_SOCKET, VECTOR = "NodeSocketFloat", "NodeSocketColor", "NodeSocketVector"
WHITE = (1.0, 1.0, 1.0, 1.0)
BLACK = (0.0, 0.0, 0.0, 1.0)
UNKNOWN = (0.0, 0.0, 0.0)
TINY = 1e-6
MILLIMETER = 0.001  # m


def _factor(name: str, description: str, default: float = 0.0, panel: str = "") -> Socket:
    return Socket(name, FLOAT, description, default, 0.0, 1.0, subtype="FACTOR", panel=panel)


def _color(name: str, description: str, default: tuple[float, ...] = WHITE, panel: str = "") -> Socket:
    return Socket(name, COLOR_SOCKET, description, default, panel=panel)


def _direction(name: str, description: str, panel: str = "") -> Socket:
    return Socket(name, VECTOR, description, UNKNOWN, hide_value=True, panel=panel)


DISTRIBUTION = Socket(
    "Distribution", "NodeSocketMenu", "Microfacet distribution of the specular layers", "Multiscatter GGX", panel="Specular"
)
METHOD = Socket(
    "Subsurface Method", "NodeSocketMenu", "How Cycles scatters light below the surface", "Random Walk", panel="Subsurface"
)
DISTRIBUTIONS = {
    "GGX": ("GGX", "Microfacets that reflect light once: rough metal turns darker"),
    "MULTI_GGX": ("Multiscatter GGX", "Microfacets that keep all light"),
}
"""By the node's property: the menu's entry and what it is."""
METHODS = {
    "BURLEY": ("Christensen-Burley", "Spreads light as on a flat surface: less noise, too bright where it is thin"),
    "RANDOM_WALK": ("Random Walk", "Walks below the surface, with the radius as given"),
    "RANDOM_WALK_SKIN": ("Random Walk (Skin)", "Walks below the surface, with a radius that suits color textures"),
    "RANDOM_WALK_LEGACY": ("Random Walk (Legacy)", "As Random Walk, by way of Blender's older fit"),
}
LACKED_BY = {"Subsurface IOR": METHODS.keys() - {"RANDOM_WALK_SKIN"}, "Subsurface Anisotropy": {"BURLEY"}}
"""By input of Blender's node: the methods with which the node has no such input."""
KEEPS_ALL = Socket("Keeps All", FLOAT, "1 where the specular layer's distribution keeps all light", 1.0)
BASE_COLOR = _color("Base Color", "Color of the diffuse, subsurface, metal and transmission layers", (0.8, 0.8, 0.8, 1.0))
METALLIC = _factor("Metallic", "Weight of metal, between a dielectric and a metal of the base color")
ROUGHNESS = _factor("Roughness", "Microfacet roughness of specular reflection and transmission", 0.5)
IOR = Socket("IOR", FLOAT, "Index of refraction of specular reflection, transmission and Wolff's dielectric", 1.5, 1.0, 1000.0)
ALPHA = _factor("Alpha", "Opacity: the rest of the light passes straight through", 1.0)
THIN_WALL = Socket("Thin Wall", "NodeSocketBool", "The surface is a thin wall without an inside", False)
DIFFUSE_ROUGHNESS = _factor("Diffuse Roughness", f"Roughness of the diffuse reflection. {ROUGHNESS_MEANING}", 0.0, "Diffuse")
SUBSURFACE_WEIGHT = _factor("Subsurface Weight", "Fraction of the diffuse light that scatters below the surface", 0.0, "Subsurface")
RADIUS = Socket(
    "Subsurface Radius",
    VECTOR,
    "How far light scatters below the surface for red, green and blue, times the scale",
    (1.0, 0.2, 0.1),
    0.0,
    100.0,
    panel="Subsurface",
)
SCALE = Socket("Subsurface Scale", FLOAT, "Scale of the subsurface radius, in millimeters", 5.0, 0.0, 10000.0, panel="Subsurface")
LEVEL = _factor("Specular IOR Level", "Reflectance of the specular layer: 0.5 is that of IOR, 0 none, 1 twice", 0.5, "Specular")
TINT = _color("Specular Tint", "Color of specular reflection, of metal at the rim only", panel="Specular")
TRANSMISSION = _factor("Transmission Weight", "Weight of transmission", 0.0, "Transmission")
COAT_WEIGHT = _factor("Coat Weight", "Weight of the clear coat above all but the sheen", 0.0, "Coat")
COAT_ROUGHNESS = _factor("Coat Roughness", "Roughness of the coat", 0.03, "Coat")
COAT_IOR = Socket("Coat IOR", FLOAT, "Index of refraction of the coat", 1.5, 1.0, 4.0, panel="Coat")
COAT_TINT = _color("Coat Tint", "Color that the coat lets through along the normal", panel="Coat")
COAT_NORMAL = _direction("Coat Normal", "Normal of the coat; the surface's own where nothing is connected", "Coat")
SHEEN_WEIGHT = _factor("Sheen Weight", "Weight of the sheen: dust and fibers on top", 0.0, "Sheen")
SHEEN_ROUGHNESS = _factor("Sheen Roughness", "Roughness of the sheen", 0.5, "Sheen")
SHEEN_TINT = _color("Sheen Tint", "Color of the sheen", panel="Sheen")
COAT_AND_SHEEN = (
    COAT_WEIGHT,
    COAT_ROUGHNESS,
    COAT_IOR,
    COAT_TINT,
    COAT_NORMAL,
    SHEEN_WEIGHT,
    SHEEN_ROUGHNESS,
    SHEEN_TINT,
)
PRINCIPLED_SOCKETS: tuple[Socket, ...] = (
    BASE_COLOR,
    METALLIC,
    ROUGHNESS,
    IOR,
    ALPHA,
    THIN_WALL,
    NORMAL,
    DIFFUSE_ROUGHNESS,
    SUBSURFACE_WEIGHT,
    RADIUS,
    SCALE,
    Socket(
        "Subsurface IOR",
        FLOAT,
        "Index of refraction by which light enters; used by Random Walk (Skin)",
        1.4,
        1.01,
        3.8,
        subtype="FACTOR",
        panel="Subsurface",
    ),
    _factor("Subsurface Anisotropy", "Directionality of the scattering; not used by Christensen-Burley", 0.0, "Subsurface"),
    LEVEL,
    TINT,
    _factor("Anisotropic", "Elongation of highlights along the tangent", 0.0, "Specular"),
    _factor("Anisotropic Rotation", "Turns the direction of elongation; 1 is a full turn", 0.0, "Specular"),
    _direction("Tangent", "Direction of elongation", "Specular"),
    TRANSMISSION,
    *COAT_AND_SHEEN,
    _color("Emission Color", "Color of the emitted light", panel="Emission"),
    Socket("Emission Strength", FLOAT, "Strength of the emitted light", 0.0, 0.0, 1e6, panel="Emission"),
    Socket(
        "Thin Film Thickness",
        FLOAT,
        "Thickness of the film in nanometers",
        0.0,
        0.0,
        100000.0,
        subtype="WAVELENGTH",
        panel="Thin Film",
    ),
    Socket("Thin Film IOR", FLOAT, "Index of refraction of the film", 1.33, 1.0, 1000.0, panel="Thin Film"),
)
"""Blender's own, in its order; lengths in millimeters."""


def build_native(graph: Graph) -> dict[str, Value]:
    """Return Blender's Principled BSDF with the menus as inputs, and whether its distribution keeps all light."""
    values: dict[int | str, Operand] = {socket.name: graph.input(socket) for socket in PRINCIPLED_SOCKETS}
    values[SCALE.name] = graph.input(SCALE) * (graph.meter() * MILLIMETER)
    by_method = {}
    for method_number, method in enumerate(METHODS):
        has = {name: value for name, value in values.items() if method not in LACKED_BY.get(name, ())}
        nodes = [graph.node("ShaderNodeBsdfPrincipled", has, distribution=each, subsurface_method=method) for each in DISTRIBUTIONS]
        by_method[method_number] = dict(enumerate(nodes))

    def number(socket: Socket, entries: Mapping[str, tuple[str, str]]) -> Value:
        cases = [(entry, text, float(index)) for index, (entry, text) in enumerate(entries.values())]
        return graph.menu(graph.input(socket), "FLOAT", cases)

    distribution = number(DISTRIBUTION, DISTRIBUTIONS)
    bsdf = graph.switch(number(METHOD, METHODS), {key: graph.switch(distribution, nodes) for key, nodes in by_method.items()})
    return {"BSDF": bsdf, KEEPS_ALL.name: graph.equals(distribution, float(tuple(DISTRIBUTIONS).index("MULTI_GGX")))}


NATIVE = Group(
    "principled_native",
    ".True Diffuse Principled BSDF",
    "Principled BSDF",
    2,
    "Blender's Principled BSDF, its menus as inputs",
    (DISTRIBUTION, METHOD, *PRINCIPLED_SOCKETS),
    build_native,
)
ABOVE = (
    ALPHA,
    N,
    ROUGHNESS,
    IOR,
    LEVEL,
    TINT,
    *COAT_AND_SHEEN,
)


def build_layers(graph: Graph) -> dict[str, Value]:
    """Return what the layers above leave for the diffuse reflection, as a factor and a tint of brightness 1."""
    value = {socket.name: graph.input(socket) for socket in (*ABOVE, KEEPS_ALL)}

    def fraction(socket: Socket) -> Value:
        return graph.clamp(value[socket.name], 0.0, 1.0)

    def brightest(color: Value) -> Value:
        red, green, blue = graph.separate(color)
        return graph.maximum(graph.maximum(red, green), blue)

    n = value[N.name]
    incoming = graph.geometry("Incoming")
    mu = graph.clamp(graph.dot(n, incoming), 0.0, 1.0)
    given = value[COAT_NORMAL.name]
    is_given = graph.math("GREATER_THAN", graph.vector_math("LENGTH", given, output="Value"), 0.0)
    coat_n = graph.mix(is_given, graph.geometry("Normal"), graph.normalize(given))
    coat_mu = graph.clamp(graph.dot(coat_n, incoming), 0.0, 1.0)
    layers = engine_layers(graph)

    coat_weight = graph.maximum(value[COAT_WEIGHT.name], 0.0)
    sheen_n = graph.normalize(graph.mix(graph.minimum(coat_weight, 1.0), n, coat_n))
    sheen_mu = graph.clamp(graph.dot(sheen_n, incoming), 0.0, 1.0)
    sheen = graph.maximum(value[SHEEN_WEIGHT.name], 0.0) * brightest(value[SHEEN_TINT.name])
    below_sheen = graph.maximum(1.0 - sheen * sheen_albedo(layers, sheen_mu, fraction(SHEEN_ROUGHNESS), graph), 0.0)
    left = fraction(ALPHA) * graph.switch(graph.is_known(value[SHEEN_WEIGHT.name], 0.0), {0: below_sheen, 1: 1.0})

    coat_ior = graph.maximum(value[COAT_IOR.name], 1.0)
    coat = specular_albedo(layers, coat_mu, fraction(COAT_ROUGHNESS), Interface(level_f0(coat_ior), 1.0, graph))
    passed = graph.power(graph.maximum(value[COAT_TINT.name], 0.0), coat_depth(coat_mu, coat_ior, graph))
    tint = graph.mix(coat_weight, (1.0, 1.0, 1.0), passed)
    brightness = graph.maximum(brightest(tint), TINY)
    has_no_coat = graph.is_known(value[COAT_WEIGHT.name], 0.0)
    left *= graph.switch(has_no_coat, {0: graph.maximum(1.0 - coat_weight * coat, 0.0) * brightness, 1: 1.0})

    f0 = level_f0(graph.maximum(value[IOR.name], TINY), graph.maximum(value[LEVEL.name], 0.0))
    interface = Interface(f0, graph.maximum(brightest(value[TINT.name]), 0.0), graph)
    keeps_all = graph.maximum(value[KEEPS_ALL.name], graph.in_eevee())
    specular = specular_albedo(layers, mu, fraction(ROUGHNESS), interface, keeps_all)
    left *= graph.maximum(1.0 - specular, 0.0)
    return {"Factor": left, "Tint": graph.switch(has_no_coat, {0: tint / brightness, 1: (1.0, 1.0, 1.0)})}


def engine_layers(graph: Graph) -> Layers:
    """Return the numbers of the engine that renders, as sockets where the engines differ."""
    in_eevee = graph.in_eevee()

    def number(row: int, column: int, cycles: Table, eevee: Table) -> Number:
        a, b = (float(table[row][column]) if row < len(table) and column < len(table[row]) else 0.0 for table in (cycles, eevee))
        return a if a == b else graph.multiply_add(in_eevee, b - a, a)

    def table(cycles: Table, eevee: Table) -> Table:
        rows = range(max(len(cycles), len(eevee)))
        widths = [max(len(table[row]) if row < len(table) else 0 for table in (cycles, eevee)) for row in rows]
        return [[number(row, column, cycles, eevee) for column in range(widths[row])] for row in rows]

    return Layers(*map(table, CYCLES, EEVEE))


LAYERS = Group(
    "principled_layers",
    ".True Diffuse Layers Above",
    "Layers Above",
    2,
    "What the sheen, coat and specular layers leave for the diffuse reflection below",
    (*ABOVE, KEEPS_ALL),
    build_layers,
)


def build(graph: Graph) -> dict[str, Value]:
    value = {socket.name: graph.input(socket) for socket in PRINCIPLED_SOCKETS}
    menus = {DISTRIBUTION.name: graph.input(DISTRIBUTION), METHOD.name: graph.input(METHOD)}

    def native(changes: dict[str, Operand]) -> dict[str, Value]:
        inputs = menus | value | changes
        return graph.group(NATIVE, **{name.replace(" ", "_"): each for name, each in inputs.items()})

    metal, transmission, scattering = (
        graph.clamp(value[socket.name], 0.0, 1.0) for socket in (METALLIC, TRANSMISSION, SUBSURFACE_WEIGHT)
    )
    below = (1.0 - transmission) * scattering
    other = metal + (1.0 - metal) * (transmission + below)  # 1 - q
    rest = native(
        {
            METALLIC.name: metal / graph.maximum(other, TINY),
            TRANSMISSION.name: transmission / graph.maximum(transmission + below, TINY),
            SUBSURFACE_WEIGHT.name: graph.math("GREATER_THAN", scattering, 0.0),
            DIFFUSE_ROUGHNESS.name: 0.0,
        }
    )
    above = native(
        {
            BASE_COLOR.name: BLACK,
            METALLIC.name: 0.0,
            TRANSMISSION.name: 0.0,
            SUBSURFACE_WEIGHT.name: 0.0,
            DIFFUSE_ROUGHNESS.name: 0.0,
        }
    )
    n, mapped = graph.normal()
    inputs = {socket.name.replace(" ", "_"): value[socket.name] for socket in ABOVE if socket is not N} | {"N": n}
    left = graph.group(LAYERS, **inputs, Keeps_All=above[KEEPS_ALL.name])
    color = value[BASE_COLOR.name] * left["Tint"]

    def layered(model: ReflectanceModel) -> Value:
        rough = graph.group(
            ROUGH,
            Model=model.label,
            Quality=graph.input(QUALITY),
            Color=color,
            Roughness=value[DIFFUSE_ROUGHNESS.name],
            IOR=value[IOR.name],
            N=n,
            Mapped=mapped,
        )["BSDF"]
        diffuse = graph.add_shader(above["BSDF"], graph.mix_shader(left["Factor"], None, rough))
        return graph.switch(graph.is_known(other, 0.0), {0: graph.mix_shader(other, diffuse, rest["BSDF"]), 1: diffuse})

    lambert = native({DIFFUSE_ROUGHNESS.name: 0.0})["BSDF"]

    def surface(model: ReflectanceModel) -> Value:
        if not model.functions and model.parameter is None:  # Lambert
            return lambert
        rough = layered(model)
        if model.cycles is CyclesClosures.DIFFUSE:
            rough = graph.switch(graph.in_eevee(), {0: native({})["BSDF"], 1: rough})
        return graph.switch(graph.is_known(value[DIFFUSE_ROUGHNESS.name], 0.0), {0: rough, 1: lambert}) if model.is_rough else rough

    cases = [(model.label, model.description, surface(model)) for model in MODELS.values()]
    return {"BSDF": graph.menu(graph.input(MODEL), "SHADER", cases)}


def _inputs() -> tuple[Socket, ...]:
    """Return Blender's sockets, with our own first in their panels, and Blender's menus where its node has them: first, too."""
    first = {DIFFUSE_ROUGHNESS: PRINCIPLED_MENUS, SUBSURFACE_WEIGHT: (METHOD,), LEVEL: (DISTRIBUTION,)}
    return tuple(each for socket in PRINCIPLED_SOCKETS for each in (*first.get(socket, ()), socket))


PRINCIPLED_MENUS = tuple(replace(socket, panel=DIFFUSE_ROUGHNESS.panel) for socket in (MODEL, QUALITY))
PRINCIPLED = Group(
    key="principled",
    name="Principled Rough Diffuse",
    label="Principled Rough Diffuse",
    version=5,
    description="Blender's Principled BSDF with a rough diffuse model: metal, coat, sheen, glass, skin, dusty or not",
    inputs=_inputs(),
    build=build,
    open_panel=DIFFUSE_ROUGHNESS.panel,
)
