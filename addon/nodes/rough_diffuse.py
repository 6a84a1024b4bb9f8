# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group Rough Diffuse: a choice of rough diffuse models and qualities, in either engine.

No node sees the light, so a model becomes lobes (`model_groups.py`); where the scene renders with Cycles' Open Shading Language,
shaders/rough_diffuse.osl takes their place. Menus are resolved before shaders are compiled: other entries cost nothing.
"""

from ..blender.osl import compiles_osl
from ..closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from ..models.registry import DEFAULT, MODELS, CyclesClosures, by_number
from .chosen_lights import MENU_PATH
from .graph import COLOR, NORMAL, Graph, Group, Operand, Socket, Value
from .model_groups import model_group
from .model_nodes import ROUGHNESS, SOCKETS, parameters

SHADER = "rough_diffuse"
NUMBER, LOBES_ONLY, HAS_OSL = "Number", "Lobes Only", "Has OSL"  # properties of the chosen model
MODEL = Socket("Model", "NodeSocketMenu", "Reflectance model", MODELS[DEFAULT].label)
QUALITY = Socket("Quality", "NodeSocketMenu", "Speed or accuracy in EEVEE; Cycles is accurate in all", BALANCED)
QUALITIES = (
    (BALANCED, "Close to the model under every light, without noise of its own"),
    (FAST, "EEVEE: the fastest and least accurate. Cycles: the same as Balanced"),
    (
        PRECISE,
        "EEVEE: the most accurate under every light, but several times slower, and slow to start. Cycles: the same as Balanced",
    ),
    (
        CHOSEN_LIGHTS,
        f"Exact for up to four lights: select them, then {MENU_PATH}. "
        f"{', '.join(model.label for model in MODELS.values() if not model.has_single_light)}: the same as {BALANCED}",
    ),
)


def build(graph: Graph) -> dict[str, Value]:
    n = graph.normal()
    color = graph.input(COLOR)
    values = {name: graph.input(socket) for name, socket in SOCKETS.items()}
    cases = []
    items: dict[str, tuple[str, Operand]] = {}
    for model in MODELS.values():
        own = {socket.name: values[socket.name] for socket in parameters(model)}
        group = graph.group(model_group(model), Color=color, N=n, **own)
        items = {name: ("SHADER", group[name]) for name, _ in QUALITIES}
        items |= {NUMBER: ("FLOAT", float(model.number)), LOBES_ONLY: ("FLOAT", float(not model.has_single_light))}
        if any(other.osl is None for other in MODELS.values()):
            items[HAS_OSL] = ("FLOAT", float(model.osl is not None))
        cases.append((model.label, model.description, graph.bundle(items)))
    chosen = graph.menu(graph.input(MODEL), "BUNDLE", cases)
    properties = graph.unbundle(chosen, {name: kind for name, (kind, _) in items.items()})
    closures = {name: properties[name] for name, _ in QUALITIES}
    if compiles_osl():
        osl = graph.script(SHADER, Model=properties[NUMBER], Color=color, Normal=n, **values)
        in_osl = graph.uses_osl() if _gains(graph, properties[NUMBER], values[ROUGHNESS.name]) else 0.0
        if HAS_OSL in properties:
            in_osl = properties[HAS_OSL] * in_osl
        # a model without a formula for one light uses lobes there, too
        weights = dict.fromkeys(closures, in_osl) | {CHOSEN_LIGHTS: in_osl * properties[LOBES_ONLY]}
        closures = {name: graph.mix_shader(weights[name], shader, osl) for name, shader in closures.items()}
    return {"BSDF": graph.menu(graph.input(QUALITY), "SHADER", [(name, text, closures[name]) for name, text in QUALITIES])}


def _gains(graph: Graph, number: Operand, roughness: Operand) -> bool:
    """Return whether the OSL shader may be nearer to the model of that number than Cycles' own closures are."""
    known = graph.known(number)
    if not isinstance(known, float):
        return True
    model = by_number(int(known))
    if model.osl is None or model.cycles is CyclesClosures.DIFFUSE:
        return False
    return not (model.is_rough and graph.negligible(roughness))


ROUGH_DIFFUSE = Group(
    key="rough_diffuse",
    name="Rough Diffuse",
    label="Rough Diffuse",
    version=2,
    description="Rough diffuse reflection: chalk, clay, plaster, felt, dusty skin",
    inputs=(MODEL, QUALITY, COLOR, *SOCKETS.values(), NORMAL),
    build=build,
)
