# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group Rough Diffuse: one rough diffuse model of many, by the mode of the artist's choice, in either engine.

No node sees the light, so a model becomes lobes (`rough_models.py`); where the scene renders with Cycles' Open Shading Language,
shaders/rough_diffuse.osl takes their place. Menus select before anything is compiled: what is not chosen costs nothing.
"""

from ..blender.osl import compiles_osl
from ..closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from .chosen_lights import MENU_PATH
from .graph import COLOR, NORMAL, Graph, Group, Operand, Socket, Value
from .rough_closures import model_group
from .rough_models import IOR, KINDS, ROUGHNESS, cycles_diffuse, pits, wolff

SHADER = "rough_diffuse"
MODEL = Socket("Model", "NodeSocketMenu", "Reflectance model", "Oren-Nayar")
QUALITY = Socket("Quality", "NodeSocketMenu", "Speed or accuracy in EEVEE; Cycles is accurate in all", BALANCED)
QUALITIES = (
    (BALANCED, "Close to the model under every light, without noise of its own"),
    (FAST, "EEVEE: the fastest and least accurate. Cycles: the same as Balanced"),
    (
        PRECISE,
        "EEVEE: the most accurate under every light, but several times slower, and slow to start. Cycles: the same as Balanced",
    ),
    (CHOSEN_LIGHTS, f"Exact for up to four lights: select them, then {MENU_PATH}. Lambert and Pitted: the same as Balanced"),
)


def build(graph: Graph) -> dict[str, Value]:
    n = graph.normal()
    color, roughness, ior = graph.input(COLOR), graph.input(ROUGHNESS), graph.input(IOR)
    cases = []
    for index, kind in enumerate(KINDS):
        closures = graph.group(model_group(kind), Color=color, Roughness=roughness, IOR=ior, N=n)
        items: dict[str, tuple[str, Operand]] = {name: ("SHADER", closures[name]) for name, _ in QUALITIES}
        items |= {"Index": ("FLOAT", float(index)), "Lobes Only": ("FLOAT", float(kind.one_lamp is None))}
        cases.append((kind.name, kind.description, graph.bundle(items)))
    chosen = graph.menu(graph.input(MODEL), "BUNDLE", cases)
    parts = graph.unbundle(chosen, {name: kind for name, (kind, _) in items.items()})
    shown = {name: parts[name] for name, _ in QUALITIES}
    if compiles_osl():
        inputs = {"Model": parts["Index"], "Roughness": roughness, "IOR": ior, "Normal": n}
        osl = graph.script(SHADER, Color=color, **inputs)
        here = graph.uses_osl() if _gains(graph, parts["Index"], roughness) else 0.0
        # what has no form for a lamp is made of lobes there, too
        lobes_only = here * parts["Lobes Only"]
        shown = {
            name: graph.mix_shader(lobes_only if name == CHOSEN_LIGHTS else here, shader, osl) for name, shader in shown.items()
        }
    return {"BSDF": graph.menu(graph.input(QUALITY), "SHADER", [(name, text, shown[name]) for name, text in QUALITIES])}


def _gains(graph: Graph, index: Operand, roughness: Operand) -> bool:
    """Return whether the OSL shader may be nearer to the model of that place in the menu than Cycles' own closures are."""
    known = graph.known(index)
    if not isinstance(known, float):
        return True
    kind = KINDS[int(known)]
    exact = kind.name == "Lambert" or kind.terms is cycles_diffuse
    return not exact and (kind.terms in (wolff, pits) or not graph.negligible(roughness))


ROUGH_DIFFUSE = Group(
    key="rough_diffuse",
    name="Rough Diffuse",
    label="Rough Diffuse",
    version=2,
    description="Rough diffuse reflection: chalk, clay, plaster, felt, dusty skin",
    inputs=(MODEL, QUALITY, COLOR, ROUGHNESS, IOR, NORMAL),
    build=build,
)
