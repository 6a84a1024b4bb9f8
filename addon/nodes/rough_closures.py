# SPDX-License-Identifier: GPL-3.0-or-later
"""One inner node group for each rough diffuse model: its closures by mode, made of the lobes of `closures/lobes.py`."""

from collections.abc import Callable
from typing import NamedTuple

from ..closures.lobe import CYCLES, GRAZING, PAIR, SIGNED, SINGLE
from ..closures.lobe_table import TABLE
from ..closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from ..models.fujii import K1
from .chosen_lights import L, weighted_mean
from .graph import COLOR, Graph, Group, Number, Socket, Value
from .rough_models import IOR, ROUGHNESS, Kind, Lamp, N, Surface, Terms, cycles_diffuse, eon, fujii, oren_nayar
from .schemes import AWAY_LOBE, LOBE_PAIR, ONCE, SIGNED_LOBES, SIGNED_LOBES_UNDER, SINGLE_LOBE


class Modes(NamedTuple):
    """A model's closure by mode."""

    lobes: Value
    single: Value
    signed: Value
    lamps: Value


def modes(surface: Surface, terms: Terms, kind: Kind) -> Modes:
    """Return the closures of one model. A model of Lambert's shape is one closure in every mode and engine."""
    graph, color = surface.graph, surface.color
    family = next((name for name, factor in terms.functions.items() if not graph.negligible(factor)), None)
    if family is None:
        shown = graph.diffuse(color * terms.facing, surface.n)
        smooth = bool(terms.functions)  # a rough model at roughness 0: Lambert under a lamp, too
        return Modes(shown, shown, shown, shown if smooth else lamps(surface, kind) or shown)

    def weights(scheme: str) -> list[Number]:
        """Return the weight of each lobe: the sum over the functions."""
        table = TABLE[scheme][family].weights
        sums: list[Number] = []
        for lobe in zip(*(table[name] for name in terms.functions), strict=True):
            total: Number = 0.0
            for factor, weight in zip(terms.functions.values(), lobe, strict=True):
                value = surface.weight(weight)
                if value != 0.0:
                    total = factor * value + total if isinstance(factor, Value) else value * factor + total
            sums.append(total)
        return sums

    frame = {"N": surface.n, "Tangent": surface.tangent}
    in_cycles = cycles(surface, terms, kind, weights)
    z, x = weights(SINGLE)
    single = graph.group(SINGLE_LOBE, **frame, Facing=color * (terms.facing + z), Toward=color * x)["BSDF"]
    z, bent = weights(PAIR)
    up = TABLE[PAIR][family].lobes[1]
    pair = graph.group(
        LOBE_PAIR, **frame, Facing=color * (terms.facing + z), Toward=color * bent, Up=up.up_0 + surface.mu * up.up_1
    )["BSDF"]
    signed = signed_lobes(surface, terms, weights(SIGNED), frame)
    in_eevee = graph.in_eevee()
    lobes, single, signed = (graph.mix_shader(in_eevee, in_cycles, shader) for shader in (pair, single, signed))
    return Modes(lobes, single, signed, lamps(surface, kind) or lobes)


def lamps(surface: Surface, kind: Kind) -> Value | None:
    """Return a Lambert closure in the color that gives it the model's radiance under the chosen lamps, in either engine.

    So the engine's shadows and bounces stay. The color's factor is the `weighted_mean` of the model over Lambert; light from
    elsewhere counts with the directional albedo. None where the model has no such form.
    """
    if kind.one_lamp is None:
        return None
    graph, gain_of, albedo = surface.graph, *kind.one_lamp
    group = _group("gain", f"{kind.name}, One Lamp", kind, (COLOR, ROUGHNESS, IOR, N, L), lambda inner: build_gain(inner, gain_of))
    inputs = {"Color": surface.color, "Roughness": surface.sigma, "IOR": surface.ior, "N": surface.n}

    def under(l: Value) -> tuple[Value, Value]:
        gain = graph.group(group, **inputs, L=l)
        return gain["Gain"], gain["N.L"]

    return graph.diffuse(surface.color * weighted_mean(graph, under, albedo(surface)), surface.n)


def signed_lobes(surface: Surface, terms: Terms, weights: list[Number], frame: dict[str, Value]) -> Value:
    """Return the signed lobes of a model, in EEVEE."""
    graph, color = surface.graph, surface.color
    family = next(iter(terms.functions))
    facing, toward, away, near, far, *under = (color * weight for weight in weights)
    _, _, _, near_lobe, far_lobe, *under_lobe = TABLE[SIGNED][family].lobes
    base = terms.facing
    negative = [weight * -1.0 if name == "interreflection" else weight for name, weight in terms.functions.items()]
    if family in ("fujii", "oren_nayar_1994"):  # closures.lobes.floor says why
        floor = sum(negative[1:], negative[0]) * surface.sine
        base = base - floor
        facing = facing + color * floor * (graph.maximum(surface.mu, GRAZING) * (1.0 / far_lobe.steep))
    more = {"Under": under[0], "Under_Up": under_lobe[0].up_0} if under else {}
    return graph.group(
        SIGNED_LOBES_UNDER if under else SIGNED_LOBES,
        **frame,
        **{"N.V": surface.mu},
        Base=color * base,
        Facing=facing,
        Toward=toward,
        Away=away,
        Near=near,
        Far=far,
        Near_Steep=-near_lobe.steep,
        Far_Steep=far_lobe.steep,
        Side=far_lobe.side,
        **more,
    )["BSDF"]


def cycles(surface: Surface, terms: Terms, kind: Kind, weights: Callable[[str], list[Number]]) -> Value:
    """Return the closures of a rough model in Cycles without OSL."""
    graph, color = surface.graph, surface.color
    if kind.terms is cycles_diffuse:
        return graph.diffuse(color, surface.n, surface.r)
    if kind.terms is eon:
        return graph.group(EON_CHANNELS, N=surface.n, Color=color, Roughness=surface.r, Average=surface.fujii_average)["BSDF"]
    if kind.terms is fujii:
        return graph.group(ONCE, N=surface.n, Color=color, Roughness=surface.r)["BSDF"]
    z, function, away = weights(CYCLES)
    base = terms.facing + z
    if kind.terms is oren_nayar:
        weight = base + K1 * function
        once = graph.group(ONCE, N=surface.n, Color=color * weight, Roughness=function / base)["BSDF"]
        return graph.add_shader(once, graph.group(AWAY_LOBE, N=surface.n, Tangent=surface.tangent, Away=color * away)["BSDF"])
    # A roughness of 1 and the rest to Lambert: so each channel can have a share of its own.
    rough = graph.minimum(function, base)
    once = graph.group(ONCE, N=surface.n, Color=color * rough * (1.0 + K1), Roughness=1.0)["BSDF"]
    return graph.add_shader(once, graph.diffuse(color * (base - rough), surface.n))


def build_eon_channels(graph: Graph) -> dict[str, Value]:
    """EON out of Cycles' Diffuse closure, whose multiple scattering lacks a factor 1 / rho.

    A color a > rho inside, times rho / a: with k = 1 - <E> and q = rho / (1 - rho k), a^2 + q k a = q gives EON's share. One
    closure a channel, since a closure has one factor.
    """
    n, color, roughness, average = map(graph.input, EON_CHANNELS.inputs)
    k = 1.0 - average
    closures = []
    for channel, rho in enumerate(graph.separate(color)):
        q = rho / (1.0 - rho * k)
        qk = q * k
        a = graph.maximum(0.5 * (graph.sqrt(qk * qk + 4.0 * q) - qk), 1e-6)
        only = tuple(float(i == channel) for i in range(3))
        closures.append(graph.mix_shader(rho / a, None, graph.diffuse(graph.scale(only, a), n, roughness)))
    return {"BSDF": graph.add_shader(*closures)}


EON_CHANNELS = Group(
    "eon_channels",
    ".True Diffuse EON Channels",
    "EON",
    1,
    "Cycles: EON, one closure for each channel",
    (
        Socket("N", "NodeSocketVector", "Shading normal", (0.0, 0.0, 0.0)),
        Socket("Color", "NodeSocketVector", "Albedo rho", (0.0, 0.0, 0.0)),
        Socket("Roughness", "NodeSocketFloat", "Roughness, 0 to 1", 0.0),
        Socket("Average", "NodeSocketFloat", "Average albedo <E> of Fujii's model at rho = 1", 1.0),
    ),
    build_eon_channels,
)


def build_model(graph: Graph, kind: Kind) -> dict[str, Value]:
    surface = Surface(graph)
    closures = modes(surface, kind.terms(surface), kind)
    return {BALANCED: closures.lobes, FAST: closures.single, PRECISE: closures.signed, CHOSEN_LIGHTS: closures.lamps}


def build_gain(graph: Graph, gain: Callable[[Lamp], Value]) -> dict[str, Value]:
    lamp = Lamp(Surface(graph), graph.input(L))
    return {"Gain": gain(lamp), "N.L": lamp.mu}


def model_group(kind: Kind) -> Group:
    """Return the inner group of a model."""
    return _group("model", kind.name, kind, (COLOR, ROUGHNESS, IOR, N), lambda graph: build_model(graph, kind))


def _group(prefix: str, label: str, kind: Kind, inputs: tuple[Socket, ...], build: Callable[[Graph], dict[str, Value]]) -> Group:
    key = kind.name.lower().replace(" ", "_").replace("-", "_")
    return Group(f"{prefix}_{key}", f".True Diffuse {label}", label, 2, kind.description, inputs, build)
