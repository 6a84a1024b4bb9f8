# SPDX-License-Identifier: GPL-3.0-or-later
"""One inner node group for each reflectance model: its closures by quality, made of the lobes of `closures/lobes.py`."""

from collections.abc import Callable

from ..blender.osl import compiles_osl
from ..closures.lobe import CYCLES, GRAZING, MAPPED_BASE, MAPPED_FADE, MAPPED_FUJII, PAIR, SIGNED, SINGLE
from ..closures.lobe_table import TABLE
from ..closures.quality import CHOSEN_LIGHTS, EEVEE_LOBES, NUMBERS
from ..models.fujii import K1, FujiiTerms
from ..models.registry import CyclesClosures, ReflectanceModel
from ..models.terms import Expansion, SingleLightTerms
from .chosen_lights import L, weighted_mean
from .graph import COLOR, Graph, Group, Number, Operand, Socket, Value
from .lobe_nodes import LOBE_PAIR, SIGNED_LOBES, SIGNED_LOBES_BOTH, SINGLE_LOBE, away_lobe, single_scattering
from .model_nodes import N, Surface, parameters

CHOSEN = NUMBERS[CHOSEN_LIGHTS]
QUALITY = Socket("Quality", "NodeSocketFloat", "Number of the quality", 0.0)
MAPPED = Socket("Mapped", "NodeSocketFloat", "0 where N is known to be the mesh's own normal", 1.0)
OSL = Socket("OSL", "NodeSocketShader", "The closure in Open Shading Language")

type Weights = Callable[[str], list[Number]]  # of a set's lobes


def build_model(graph: Graph, model: ReflectanceModel) -> dict[str, Value]:
    """Return the closure of `model` in the chosen quality. One of Lambert's shape is the same in every quality and engine."""
    surface = Surface(graph, model)
    expansion, color = surface.terms.expansion(), surface.view.color
    chosen = for_chosen_lights(surface, model)
    lambert = graph.diffuse(color * expansion.facing, surface.n)

    def or_osl(closure: Value) -> Value:
        """Return the OSL shader's closure instead of one of Cycles where the scene uses OSL and that is nearer to the model."""
        is_exact = model.cycles is CyclesClosures.DIFFUSE or not (model.functions or model.parameter)  # Cycles' own, Lambert
        is_nearer = model.osl is not None and not is_exact
        return graph.switch(graph.uses_osl(), {0: closure, 1: graph.input(OSL)}) if is_nearer and compiles_osl() else closure

    if not expansion.functions:
        every = or_osl(lambert)
        return {"BSDF": graph.switch(graph.equals(graph.input(QUALITY), CHOSEN), {0: every, 1: chosen}) if chosen else every}

    family = model.functions[0].name

    def weights(lobe_set: str) -> list[Number]:
        """Return the weight of each lobe: the sum over the functions."""
        table = TABLE[lobe_set][family].weights
        sums: list[Number] = []
        for lobe in zip(*(table[name] for name in expansion.functions), strict=True):
            total: Number = 0.0
            for factor, weight in zip(expansion.functions.values(), lobe, strict=True):
                value = surface.weight(weight)
                if value != 0.0:
                    total = factor * value + total if isinstance(factor, Value) else value * factor + total
            sums.append(total)
        return sums

    frame = {"N": surface.n, "Tangent": surface.tangent}
    in_cycles = or_osl(cycles_closures(surface, model, expansion, weights))
    tints = {name: color * weight for name, weight in expansion.functions.items()}

    def tinted(lobe_set: str) -> list[Number]:
        """Return the color of each lobe of a set that `expansion.facing` goes with the first of."""
        colors: list[Number] = []
        for index in range(len(next(iter(TABLE[lobe_set][family].weights.values())))):
            total: Number = color * expansion.facing if index == 0 else 0.0
            for name, tint in tints.items():
                value = surface.weight(TABLE[lobe_set][family].weights[name][index])
                total = graph.multiply_add(tint, value, total) if isinstance(total, Value) else tint * value
            colors.append(total)
        return colors

    facing, toward = tinted(SINGLE)
    single = graph.group(SINGLE_LOBE, **frame, Facing=facing, Toward=toward)["BSDF"]
    facing, toward = tinted(PAIR)
    up = TABLE[PAIR][family].lobes[1]
    pair = graph.group(LOBE_PAIR, **frame, Facing=facing, Toward=toward, Up=up.up_0 + surface.view.mu * up.up_1)["BSDF"]
    lobes = {PAIR: pair, SINGLE: single, SIGNED: signed_lobes(surface, model, expansion, weights(SIGNED))}
    in_eevee = graph.in_eevee()
    by_quality = {
        NUMBERS[quality]: graph.switch(in_eevee, {0: in_cycles, 1: lobes[lobe_set]}) for quality, lobe_set in EEVEE_LOBES.items()
    }
    if chosen:
        by_quality[CHOSEN] = chosen
    rough = graph.switch(graph.input(QUALITY), by_quality)
    if not model.is_rough:
        return {"BSDF": rough}
    return {"BSDF": graph.switch(graph.is_known(surface.terms.value, 0.0), {0: rough, 1: lambert})}


def for_chosen_lights(surface: Surface, model: ReflectanceModel) -> Value | None:
    """Return a Lambert closure in the color that gives it the model's radiance under the chosen lights, in either engine.

    So the engine's shadows and bounces stay. The color's factor is the weighted mean of the model over Lambert; light from
    elsewhere counts with the directional albedo. None where the model has no such form.
    """
    if not isinstance(surface.terms, SingleLightTerms):
        return None
    graph = surface.graph
    group = _group("gain", f"{model.label}, One Light", model, (L,), build_single_light)

    def single_light(l: Value) -> tuple[Value, Value]:
        outputs = graph.group(group, **surface.inputs, L=l)
        return outputs["Gain"], outputs["N.L"]

    def lambert(factor: Number) -> Value:
        return graph.diffuse(surface.view.color * factor, surface.n)

    return weighted_mean(graph, single_light, surface.terms.directional_albedo(), lambert)


def build_single_light(graph: Graph, model: ReflectanceModel) -> dict[str, Value]:
    """Return `model` over Lambert under one light, and N.L; TypeError where it has no such form."""
    surface = Surface(graph, model)
    if not isinstance(surface.terms, SingleLightTerms):
        raise TypeError(f"{model.label} has no form for one light")
    light = surface.light(graph.input(L))
    return {"Gain": surface.terms.single_light(light), "N.L": light.mu}


def signed_lobes(surface: Surface, model: ReflectanceModel, expansion: Expansion, weights: list[Number]) -> Value:
    """Return the signed lobes of a model, in EEVEE: see `closures.lobes.shares`."""
    graph, color = surface.graph, surface.view.color
    toward, *away = TABLE[SIGNED][model.functions[0].name].lobes
    slope = 1.0 / graph.maximum(surface.view.mu, GRAZING)
    crease = -toward.steep * slope
    around, toward_weight, under, *away_weights = weights
    base = expansion.facing + around
    more: dict[str, Operand] = {}
    if away:
        (lobe,), (away_weight, away_under) = away, away_weights
        rest = graph.maximum(base - away_weight * -lobe.up_0, 0.0)
        more = {
            "Reserve": color * (base - rest),
            "Away": color * away_weight,
            "Away_Under": color * (away_under * -lobe.up_0),
            "Away_Crease": -lobe.up_0,
            "Away_Side": lobe.side,
        }
        base = rest
    return graph.group(
        SIGNED_LOBES_BOTH if away else SIGNED_LOBES,
        N=surface.n,
        Tangent=surface.tangent,
        Base=color * base,
        Toward=color * toward_weight,
        Under=color * (under * crease),
        Crease=crease,
        Side=toward.side,
        **more,
    )["BSDF"]


def cycles_closures(surface: Surface, model: ReflectanceModel, expansion: Expansion, weights: Weights) -> Value:
    """Return the closures of a model with functions of the light in Cycles without OSL, as `model.cycles` says."""
    graph, color, n = surface.graph, surface.view.color, surface.n
    if model.cycles is not CyclesClosures.LOBES:
        if not isinstance(surface.terms, FujiiTerms):
            raise TypeError(f"{model.label} is not made of Fujii's model, as Cycles' Diffuse closure is")
        roughness = surface.terms.value
        if model.cycles is CyclesClosures.DIFFUSE:
            return graph.diffuse(color, n, roughness)
        if model.cycles is CyclesClosures.SINGLE_SCATTERING:
            return single_scattering(graph, n, color, 1.0, roughness)
        average = surface.terms.average
        return graph.group(EON_CHANNELS, N=n, Color=color, Roughness=roughness, Average=average)["BSDF"]
    z, function, away = weights(CYCLES)
    base = expansion.facing + z
    if away != 0.0:

        def lobes(base: Number, function: Number, away: Number, mapped: bool) -> Value:
            once = single_scattering(graph, n, color, base + K1 * function, function / base)
            return graph.add_shader(once, away_lobe(graph, surface.tangent, n, color * away, mapped))

        share = 1.0 / graph.multiply_add(graph.dot(n, graph.geometry("Normal")), -MAPPED_FADE, 1.0 + MAPPED_FADE)
        rest = 1.0 - share  # of the lobe away from the viewer, see closures.lobe.mapped_share
        fujii = function * (1.0 - rest * surface.view.mu * MAPPED_FUJII)
        mapped = lobes(base + away * (rest * MAPPED_BASE), fujii, away * share, True)
        return graph.switch(graph.is_known(graph.input(MAPPED), 0.0), {0: mapped, 1: lobes(base, function, away, False)})
    # A roughness of 1 and the rest to Lambert: so each channel can have a fraction of its own.
    rough = graph.minimum(function, base)
    once = single_scattering(graph, n, color, rough * (1.0 + K1), 1.0)
    return graph.add_shader(once, graph.diffuse(color * (base - rough), n))


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


def model_group(model: ReflectanceModel) -> Group:
    """Return the inner group of a model."""
    return _group("model", model.label, model, (MAPPED, QUALITY, OSL), build_model)


def _group(
    prefix: str,
    label: str,
    model: ReflectanceModel,
    more: tuple[Socket, ...],
    build: Callable[[Graph, ReflectanceModel], dict[str, Value]],
) -> Group:
    return Group(
        f"{prefix}_{model.id}",
        f".True Diffuse {label}",
        label,
        5,
        model.description,
        (COLOR, *parameters(model), N, *more),
        lambda graph: build(graph, model),
    )
