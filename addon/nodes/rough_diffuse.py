# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group Rough Diffuse: a choice of rough diffuse models and qualities, in either engine.

No node sees the light, so a model becomes lobes (`model_groups.py`); where the scene renders with Cycles' Open Shading Language,
shaders/rough_diffuse.osl takes their place. Menus and the engine are resolved before shaders are made (`Graph.switch`), so that
what is not chosen, and what belongs to the other engine, costs nothing.
"""

from ..blender.osl import compiles_osl
from ..closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, NUMBERS, PRECISE
from ..models.registry import DEFAULT, MODELS
from .chosen_lights import MENU_PATH
from .graph import COLOR, NORMAL, Graph, Group, Operand, Socket, Value
from .model_groups import MAPPED, model_group
from .model_nodes import SOCKETS, N, parameters

SHADER = "rough_diffuse"
MODEL = Socket("Model", "NodeSocketMenu", "Reflectance model", MODELS[DEFAULT].label)
QUALITY = Socket("Quality", "NodeSocketMenu", "Speed or accuracy in EEVEE; Cycles is accurate in all", BALANCED)
QUALITIES = {
    BALANCED: "Close to the model under every light, without noise of its own",
    FAST: "EEVEE: the fastest and least accurate. Cycles: the same as Balanced",
    PRECISE: "EEVEE: the most accurate under every light, large ones and skies too, "
    "for one and a half to four times the render time. Cycles: the same as Balanced",
    CHOSEN_LIGHTS: f"Exact for up to four lights: select them, then {MENU_PATH}. "
    f"{', '.join(model.label for model in MODELS.values() if not model.has_single_light)}: the same as {BALANCED}",
}


def build_rough(graph: Graph) -> dict[str, Value]:
    values = {name: graph.input(socket) for name, socket in SOCKETS.items()}
    models = [(model.label, model.description, float(model.number)) for model in MODELS.values()]
    qualities = [(name, text, float(NUMBERS[name])) for name, text in QUALITIES.items()]
    number, quality = graph.menu(graph.input(MODEL), "FLOAT", models), graph.menu(graph.input(QUALITY), "FLOAT", qualities)
    color, n = graph.input(COLOR), graph.input(N)
    shared: dict[str, Operand] = {"Color": color, "N": n, "Mapped": graph.input(MAPPED), "Quality": quality}
    if compiles_osl():
        shared["OSL"] = graph.script(SHADER, Model=number, Color=color, Normal=n, **values)
    closures = {}
    for model in MODELS.values():
        own = {socket.name: values[socket.name] for socket in parameters(model)}
        closures[model.number] = graph.group(model_group(model), **shared, **own)["BSDF"]
    return {"BSDF": graph.switch(number, closures)}


ROUGH = Group(
    "rough",
    ".True Diffuse Rough",
    "Rough",
    3,
    "Rough diffuse reflection around a normal at unit length",
    (MODEL, QUALITY, COLOR, *SOCKETS.values(), N, MAPPED),
    build_rough,
)


def build(graph: Graph) -> dict[str, Value]:
    n, mapped = graph.normal()
    inputs = {socket.name: graph.input(socket) for socket in (MODEL, QUALITY, COLOR, *SOCKETS.values())}
    return graph.group(ROUGH, **inputs, N=n, Mapped=mapped)


ROUGH_DIFFUSE = Group(
    key="rough_diffuse",
    name="Rough Diffuse",
    label="Rough Diffuse",
    version=6,
    description="Rough diffuse reflection: chalk, clay, plaster, felt, dusty skin",
    inputs=(MODEL, QUALITY, COLOR, *SOCKETS.values(), NORMAL),
    build=build,
)
