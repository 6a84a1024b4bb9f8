# SPDX-License-Identifier: GPL-3.0-or-later
"""A summary of a material: the group of its surface, the group's values, and the difference of its lobes from the formula.

The stated error compares formulas, over all lights and views; `probe/measurement.py` measures what an engine renders.
"""

import functools
import math
from dataclasses import dataclass, field, replace

import bpy

from ..blender.engines import CYCLES, EEVEE, ENGINES, REALTIME, Engine, uses_osl
from ..blender.id_properties import SPECIALIZED_FOR
from ..closures import lobe_error
from ..closures.lobe import CYCLES as CYCLES_LOBES
from ..closures.lobe import PAIR, SIGNED, SINGLE
from ..closures.lobes import Rendered
from ..closures.quality import CHOSEN_LIGHTS, EEVEE_LOBES
from ..models import Model, ReflectanceModel, Specular, by_label
from ..models.registry import CyclesClosures, Osl
from ..nodes import GROUPS, PRINCIPLED, SPECULAR_GROUP, SUBSURFACE, chosen_lights
from ..nodes.graph import COLOR, key_and_version
from ..nodes.model_nodes import ROUGHNESS, SOCKETS
from ..nodes.principled import BASE_COLOR, DIFFUSE_ROUGHNESS, METALLIC, SUBSURFACE_WEIGHT, TRANSMISSION
from .read import group_node, plain
from .surface import GroupInputs, Setting

BRIGHTEST_IN_EEVEE = 8.0  # the highest color of a closure that EEVEE's format of 10 bits and an exponent of 2 holds
PRINCIPLED_NAMES = {ROUGHNESS.name: DIFFUSE_ROUGHNESS.name, COLOR.name: BASE_COLOR.name}  # of what the models' formulas take
VARYING_IN_REALTIME = {"Color"}  # sockets whose textures and attributes Realtime draws
MAPPED_ORDER = 2  # within 4 % of the error of mapped normals, in 40 ms
OSL_MAPPED = 0.07  # of the rough models at a roughness of 1, in scripts/studies/mapped_normal.py
ORDER = 6  # of the quadrature: two digits of the error, in 25 ms at most, as a panel is drawn while a slider moves


@dataclass(frozen=True)
class MaterialSummary(GroupInputs):
    """The group node of a material's surface: its inputs, and the names of those that are linked."""

    linked: frozenset[str]
    has_osl: bool
    """Whether the group was built by a Blender that compiles OSL, and so switches to it."""
    lights: tuple[bpy.types.Object, ...] = field(default=(), compare=False)
    """The chosen lights that the closures follow, if they do."""

    @property
    def label(self) -> str:
        """The name of the model."""
        return SPECULAR_GROUP.label if self.group == SPECULAR_GROUP.key else str(self.inputs["Model"])

    @property
    def mode(self) -> str:
        """The entry of Quality or, of Subsurface, of Method."""
        return str(self.inputs.get("Quality") or self.inputs.get("Method") or "")

    @property
    def model(self) -> Model:
        """The formula of the surface; of Subsurface that of the light that does not enter."""
        if self.group == SPECULAR_GROUP.key:
            return Specular(self.number("Specular"), self.number("Exponent"))
        return self.reflectance.reference(self.shape_inputs)

    @property
    def shape_inputs(self) -> dict[str, Setting]:
        """The inputs that a model is a function of, by the models' own names."""
        return {name: self.inputs[self.socket(name)] for name in SOCKETS if self.socket(name) in self.inputs}

    def socket(self, parameter: str) -> str:
        """Return the group's input for a `parameter` of the models, or for their Color."""
        return PRINCIPLED_NAMES.get(parameter, parameter) if self.group == PRINCIPLED.key else parameter

    @property
    def rough_fraction(self) -> float:
        """The fraction of the light that rough diffuse reflection gets under the layers above it; links do not count."""
        if self.group == SUBSURFACE.key:
            return 1.0 - self.number("Subsurface")
        if self.group == PRINCIPLED.key:
            return math.prod(1.0 - self.number(socket.name) for socket in (METALLIC, TRANSMISSION, SUBSURFACE_WEIGHT))
        return 1.0

    @property
    def reflectance(self) -> ReflectanceModel:
        """The chosen model; ValueError for Standard Specular, which has none to choose, and for an entry that is not registered."""
        return by_label(self.inputs.get("Model"))

    def lobe_set(self, engine: Engine) -> str | None:
        """Return the set of lobes (`closures/lobes.py`) that the nodes use in `engine`; None where they use other closures."""
        if self.group == SPECULAR_GROUP.key or self.follows_lights or engine is REALTIME:
            return None
        if engine is CYCLES:
            return CYCLES_LOBES
        return SINGLE if self.group == SUBSURFACE.key else EEVEE_LOBES[self.mode]

    @property
    def follows_lights(self) -> bool:
        """Whether the closures follow the chosen lights."""
        return self.mode == CHOSEN_LIGHTS and ("Model" not in self.inputs or self.reflectance.has_single_light)

    @property
    def is_cut_off(self) -> bool:
        """Whether a highlight that follows the chosen lights is brighter than EEVEE holds; over black where Color is linked."""
        if self.group != SPECULAR_GROUP.key:
            return False
        model = Specular(self.number("Specular"), self.number("Exponent"))
        base = 0.0 if "Color" in self.linked else min(max(self.rgb("Color")), 1.0)
        return base + model.height > BRIGHTEST_IN_EEVEE

    def variant(self, engine: Engine, osl: bool) -> str:
        """Return "OSL" where `engine` runs the OSL shader, else the Quality or the Method; empty where there is no choice."""
        if engine is REALTIME:
            return ""
        if self.group == SUBSURFACE.key:
            return "" if engine is EEVEE else self.mode
        return "OSL" if osl and self.has_osl and not self.follows_lights else self.mode


def material_summary(material: bpy.types.Material | None) -> MaterialSummary | None:
    """Return the summary of `material`; None where its surface is no True Diffuse group."""
    surface = group_node(material) if material else None
    return node_summary(surface[0]) if surface else None


def node_summary(node: bpy.types.Node) -> MaterialSummary | None:
    """Return the summary of `node`; None where it holds no group of this version."""
    group = next((group for group in GROUPS if group.key == key_and_version(node)[0]), None)
    if group is None or SPECIALIZED_FOR in node.node_tree:
        return None
    sockets = [node.inputs.get(socket.name) for socket in group.inputs]
    if not all(
        socket and socket.bl_idname.startswith(expected.kind) for socket, expected in zip(sockets, group.inputs, strict=True)
    ):
        return None  # an older version of the group, or one that somebody edited
    inputs = {socket.name: plain(socket.default_value) for socket in sockets}
    linked = frozenset(socket.name for socket in sockets if socket.is_linked)
    inner = (node.node_tree for node in node.node_tree.nodes if node.type == "GROUP")
    trees = [node.node_tree, *inner]  # Subsurface holds Rough Diffuse
    has_osl = any(inner.type == "SCRIPT" for tree in trees for inner in tree.nodes)
    summary = MaterialSummary(group.key, inputs, linked, has_osl)
    if not summary.follows_lights:
        return summary
    return replace(summary, lights=tuple(chosen_lights.lights_of(chosen_lights.tree_inside(node.node_tree))))


def engine_of(scene: bpy.types.Scene) -> Engine | None:
    """Return the engine that `scene` renders with; None where it is none of ENGINES."""
    return next((engine for engine in ENGINES.values() if engine.identifier == scene.render.engine), None)


def stated_error(summary: MaterialSummary, scene: bpy.types.Scene) -> str:
    """Return a message: the error of the closures in `scene`'s engine against the formula. Empty where it is unknown."""
    engine = engine_of(scene)
    if engine is None:
        return ""
    is_part = summary.group in (SUBSURFACE.key, PRINCIPLED.key)
    if engine is REALTIME:
        if summary.linked - VARYING_IN_REALTIME or summary.rough_fraction <= 0.0:
            return ""
        return "Rough part: exact under every light" if is_part else "Exact under every light"
    if summary.follows_lights:
        if not summary.lights:
            return f"No light is chosen: {without_lights(summary)}"
        if engine is EEVEE and summary.linked & {"Specular", "Exponent"}:
            return ""  # the highlight may be cut off somewhere
        cut_off = f", cut off at {BRIGHTEST_IN_EEVEE:g} times white" if engine is EEVEE and summary.is_cut_off else ""
        return f"Exact for the chosen lights{cut_off}"
    lobe_set = summary.lobe_set(engine)
    if lobe_set is None or "Model" in summary.linked or summary.rough_fraction <= 0.0:
        return ""
    model = summary.reflectance
    if model.osl is not None and summary.has_osl and uses_osl(scene):
        message = "Rough part: exact with OSL" if is_part else "Exact with OSL"
        return message if model.osl is Osl.EXACT else ""
    if summary.linked & {"Quality", *([summary.socket(model.parameter.socket)] if model.parameter else [])}:
        return ""  # it may differ from place to place
    error = _lobe_error(model, model.shape(summary.shape_inputs), lobe_set)
    if error < 5e-5:
        message = f"equal to the {model.label} formula in {engine.label}"
    else:
        message = f"differs {100.0 * error:.2g} % (RMS) from the {model.label} formula in {engine.label}"
    return f"Rough part: {message}" if is_part else f"{message[0].upper()}{message[1:]}"


def without_lights(summary: MaterialSummary) -> str:
    """Return a message: what closures that follow the chosen lights are where there is none."""
    return "no highlight" if summary.group == SPECULAR_GROUP.key else f"plain diffuse, not {summary.label}"


def mapped_error(summary: MaterialSummary, material: bpy.types.Material, scene: bpy.types.Scene) -> str:
    """Return a message: what a mapped normal adds to the error in Cycles. Empty without one, in other engines, where unknown."""
    if engine_of(scene) is not CYCLES or summary.group == SPECULAR_GROUP.key or summary.rough_fraction <= 0.0:
        return ""
    if {"Model", "Quality"} & summary.linked:
        return ""
    model = summary.reflectance
    has_lobes = summary.lobe_set(CYCLES) is not None and model.cycles is CyclesClosures.LOBES
    if has_lobes and model.functions and not material.cycles.use_bump_map_correction:
        return f"Bump Map Correction is off in the material's settings: {model.label} needs it"
    if "Normal" not in summary.linked:
        return ""
    beside = "beside Cycles' shadowing of mapped normals"
    if not has_lobes:
        return f"Mapped normals: no more, {beside}"
    if model.osl is not None and summary.has_osl and uses_osl(scene):
        return f"Mapped normals: up to {100.0 * OSL_MAPPED:g} % (RMS) with OSL, {beside}" if model.is_rough else ""
    if model.parameter and summary.socket(model.parameter.socket) in summary.linked:
        return ""  # it may differ from place to place
    error = _mapped_error(model, model.shape(summary.shape_inputs))
    return f"Mapped normals: {100.0 * error:.2g} % (RMS) at 30 degrees, {beside}"


def thickness_message(summary: MaterialSummary, material: bpy.types.Material, scene: bpy.types.Scene) -> str:
    """Return a message: what EEVEE shows as the material has no thickness. Empty where it has one, needs none, or in other engines.

    Materials from other files and nodes inside a group of the artist may lack it: see `materials.set_thickness`.
    """
    output = material.node_tree.get_output_node("EEVEE")
    if engine_of(scene) is not EEVEE or output is None or output.inputs["Thickness"].is_linked or group_node(material) is None:
        return ""
    if summary.group == SUBSURFACE.key:
        return "No light comes through here: Thickness is not linked to the Material Output's"
    if summary.lobe_set(EEVEE) in (PAIR, SIGNED) and summary.rough_fraction == 1.0:
        return "Light from behind may show on thin meshes: the Material Output's Thickness is not linked"
    return ""


@functools.lru_cache(maxsize=256)
def _mapped_error(model: ReflectanceModel, shape: tuple[float, ...]) -> float:
    return lobe_error.mapped_error(model.formula(*shape), MAPPED_ORDER)


@functools.lru_cache(maxsize=256)
def _lobe_error(model: ReflectanceModel, shape: tuple[float, ...], lobe_set: str) -> float:
    formula = model.formula(*shape)
    return lobe_error.lobe_error(Rendered(formula, lobe_set), formula, ORDER)
