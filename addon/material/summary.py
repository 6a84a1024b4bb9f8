# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material claims to be: which group of ours makes its surface, with what values, and how far its lobes are from that.

The stated error is that of the formulas, over all lights and views; what an engine makes of them, `probe/measurement.py` measures.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass

import bpy

from ..blender.engines import CYCLES, EEVEE, ENGINES, REALTIME, Engine, uses_osl
from ..blender.id_properties import SPECIALIZED_FOR
from ..closures.lobe import CYCLES as CYCLES_LOBES
from ..closures.lobe import SINGLE
from ..closures.lobe_error import lobe_error
from ..closures.lobes import Rendered
from ..closures.quality import CHOSEN_LIGHTS, EEVEE_LOBES
from ..models import Model, ReflectanceModel, Specular, by_label
from ..models.registry import Osl
from ..nodes import GROUPS, SPECULAR_GROUP, SUBSURFACE
from ..nodes.graph import stamp_of
from .read import group_node, plain
from .surface import Setting

EEVEE_MOST = 8.0  # the most that EEVEE keeps of a closure's color, in 10 bits and an exponent of 2
DRAWN = {"Color"}  # sockets of which Realtime draws what feeds them
ORDER = 6  # of the quadrature: two digits of the error, in 25 ms at most, as a panel is drawn while a slider moves


@dataclass(frozen=True)
class Claim:
    """A group node's sockets by name: values, and those that something else feeds. `group` is its key."""

    group: str
    inputs: Mapping[str, Setting]
    fed: frozenset[str]
    has_osl: bool
    """Whether the group was made by a Blender that compiles OSL, and so switches to it."""

    def number(self, name: str) -> float:
        """Return a socket's number."""
        value = self.inputs[name]
        if not isinstance(value, (int, float)):
            raise TypeError(f"{name} is {value!r}, not a number")
        return float(value)

    def rgb(self, name: str) -> tuple[float, float, float]:
        """Return a socket's red, green and blue, or its vector."""
        value = self.inputs[name]
        if not isinstance(value, tuple):
            raise TypeError(f"{name} is {value!r}, not a color")
        return value[0], value[1], value[2]

    @property
    def label(self) -> str:
        """What is claimed, in words."""
        return "Standard Specular" if self.group == SPECULAR_GROUP.key else str(self.inputs["Model"])

    @property
    def mode(self) -> str:
        """How it is made: the Mode, of Subsurface the Method; empty where there is no choice."""
        return str(self.inputs.get("Quality") or self.inputs.get("Method") or "")

    @property
    def model(self) -> Model:
        """The model of the surface; of Subsurface that of the part that does not enter."""
        if self.group == SPECULAR_GROUP.key:
            return Specular(self.number("Specular"), self.number("Exponent"))
        return self.reflectance.reference(self.inputs)

    @property
    def reflectance(self) -> ReflectanceModel:
        """The chosen model; ValueError for Standard Specular, which has none to choose, and for an entry that is not registered."""
        return by_label(self.inputs.get("Model"))

    def lobe_set(self, engine: Engine) -> str | None:
        """Return how the nodes make the model of lobes in `engine`, as `closures/lobes.py` names it; None where that is not all."""
        if self.group == SPECULAR_GROUP.key or self.follows_lamps or engine is REALTIME:
            return None
        if engine is CYCLES:
            return CYCLES_LOBES
        return SINGLE if self.group == SUBSURFACE.key else EEVEE_LOBES[self.mode]

    @property
    def follows_lamps(self) -> bool:
        """Whether the chosen lamps decide."""
        return self.mode == CHOSEN_LIGHTS and ("Model" not in self.inputs or self.reflectance.has_single_light)

    @property
    def is_cut_off(self) -> bool:
        """Whether the color of a highlight that follows lamps is above what EEVEE keeps of one, over a black base if one is fed."""
        if self.group != SPECULAR_GROUP.key:
            return False
        model = Specular(self.number("Specular"), self.number("Exponent"))
        base = 0.0 if "Color" in self.fed else min(max(self.rgb("Color")), 1.0)
        return base + model.height > EEVEE_MOST

    def way(self, engine: Engine, osl: bool) -> str:
        """Return what makes it in `engine`, with `osl` or not: OSL or a mode or method; empty where there is but one way."""
        if engine is REALTIME:
            return ""
        if self.group == SUBSURFACE.key:
            return "" if engine is EEVEE else self.mode
        return "OSL" if osl and self.has_osl and not self.follows_lamps else self.mode


def claim_of(material: bpy.types.Material | None) -> Claim | None:
    """Return what `material` claims; None where no True Diffuse group makes its surface."""
    found = group_node(material) if material else None
    return claim_of_node(found[0]) if found else None


def claim_of_node(node: bpy.types.Node) -> Claim | None:
    """Return what `node` claims; None where it holds no group of ours, or not as this version makes it."""
    group = next((group for group in GROUPS if group.key == stamp_of(node)[0]), None)
    if group is None:
        return None
    sockets = [node.inputs.get(socket.name) for socket in group.inputs]
    if not all(got and got.bl_idname.startswith(want.kind) for got, want in zip(sockets, group.inputs, strict=True)):
        return None  # an older version of the group, or one that somebody edited
    inputs = {socket.name: plain(socket.default_value) for socket in sockets}
    fed = frozenset(socket.name for socket in sockets if socket.is_linked)
    simplified = SPECIALIZED_FOR in node.node_tree
    whole = next(iter(group.trees()), node.node_tree) if simplified else node.node_tree
    parts = [whole, *(inner.node_tree for inner in whole.nodes if inner.type == "GROUP")]  # Subsurface holds Rough Diffuse
    return Claim(group.key, inputs, fed, any(inner.type == "SCRIPT" for part in parts for inner in part.nodes))


def engine_of(scene: bpy.types.Scene) -> Engine | None:
    """Return the engine that `scene` renders with; None where it is none of ENGINES."""
    return next((engine for engine in ENGINES.values() if engine.identifier == scene.render.engine), None)


def stated_error(claim: Claim, scene: bpy.types.Scene) -> str:
    """Return in words how far what `scene`'s engine makes of `claim` is from the model; empty where no formula says."""
    engine = engine_of(scene)
    if engine is None:
        return ""
    is_below = claim.group == SUBSURFACE.key
    if engine is REALTIME:
        if claim.fed - DRAWN or (is_below and claim.number("Subsurface") >= 1.0):
            return ""
        return "Rough part: exact under every lamp" if is_below else "Exact under every lamp"
    if claim.follows_lamps:
        if engine is EEVEE and claim.fed & {"Specular", "Exponent"}:
            return ""  # the highlight may be cut off somewhere
        cut_off = f", cut off at {EEVEE_MOST:g} times white" if engine is EEVEE and claim.is_cut_off else ""
        return f"Exact for the chosen lamps{cut_off}"
    lobe_set = claim.lobe_set(engine)
    if lobe_set is None or "Model" in claim.fed or (is_below and claim.number("Subsurface") >= 1.0):
        return ""
    part, model = "Rough part: " if is_below else "", claim.reflectance
    if model.osl is not None and claim.has_osl and uses_osl(scene):
        words = "Rough part: exact, by OSL" if is_below else "Exact, by OSL"
        return words if model.osl is Osl.EXACT else ""
    if claim.fed & {"Quality", *([model.parameter.socket] if model.parameter else [])}:
        return ""  # it may differ from place to place
    error = _lobe_error(model, model.shape(claim.inputs), lobe_set)
    return f"{part}{100.0 * error:.2g} % from {claim.label}" if error >= 5e-5 else f"{part}exactly {claim.label}"


@functools.lru_cache(maxsize=256)
def _lobe_error(model: ReflectanceModel, shape: tuple[float, ...], lobe_set: str) -> float:
    formula = model.formula(*shape)
    return lobe_error(Rendered(formula, lobe_set), formula, ORDER)
