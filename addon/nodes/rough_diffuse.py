# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group True Diffuse: one rough diffuse model of many, by the mode of the artist's choice, in either engine.

No node sees the light, so a model becomes lobes (`rough_models.py`); where the scene renders with Cycles' Open Shading Language,
shaders/rough_diffuse.osl takes their place. Menus select before anything is compiled: what is not chosen costs nothing.
"""

from .graph import COLOR, NORMAL, Graph, Group, Socket, Value
from .rough_closures import model_group
from .rough_models import IOR, KINDS, ROUGHNESS

SHADER = "rough_diffuse"
MODEL = Socket("Model", "NodeSocketMenu", "Law of reflection", "Oren-Nayar")
MODE = Socket("Mode", "NodeSocketMenu", "How the model is made of what the engine offers", "Lobes")
MODES = (
    ("Lobes", "Every light, shadow and bounce, without noise of its own"),
    ("Single", "EEVEE: a single lobe, the fastest and farthest from the model. Cycles: as Lobes"),
    ("Signed", "EEVEE: the nearest to the model under every light, for some ten times the time. Cycles: as Lobes"),
    ("Lamps", "Exact for up to four lamps, chosen by Choose Lamps; light from elsewhere as if it came from them"),
)


def build(graph: Graph) -> dict[str, Value]:
    n = graph.normal()
    color, roughness, ior = graph.input(COLOR), graph.input(ROUGHNESS), graph.input(IOR)
    cases = []
    for index, kind in enumerate(KINDS):
        closures = graph.group(model_group(kind), Color=color, Roughness=roughness, IOR=ior, N=n)
        items = {name: ("SHADER", closures[name]) for name, _ in MODES}
        cases.append((kind.name, kind.description, graph.bundle({**items, "Index": ("FLOAT", float(index))})))
    chosen = graph.menu(graph.input(MODEL), "BUNDLE", cases)
    parts = graph.unbundle(chosen, {**{name: "SHADER" for name, _ in MODES}, "Index": "FLOAT"})
    here = color * graph.in_cycles(osl=True)
    osl = graph.script(SHADER, Model=parts["Index"], Color=here, Roughness=roughness, IOR=ior, Normal=n)
    cases = [
        (name, description, parts[name] if name == "Lamps" else graph.add_shader(parts[name], *osl)) for name, description in MODES
    ]
    return {"BSDF": graph.menu(graph.input(MODE), "SHADER", cases)}


ROUGH_DIFFUSE = Group(
    key="rough_diffuse",
    name="True Diffuse",
    label="Rough Diffuse",
    version=1,
    description="Rough diffuse reflection: chalk, clay, plaster, felt, dusty skin",
    inputs=(MODEL, MODE, COLOR, ROUGHNESS, IOR, NORMAL),
    build=build,
)
