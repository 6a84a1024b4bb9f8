# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts Blender's Diffuse, Principled and Subsurface Scattering BSDFs to True Diffuse groups that look the same in Cycles.

- Diffuse BSDF: Rough Diffuse with the model Cycles Diffuse, which is the node's own in Cycles, or Lambert at Roughness 0.
- Principled BSDF: Subsurface, or Rough Diffuse where it has neither highlight nor subsurface scattering. Its Specular IOR Level L
  scales the reflectance at normal incidence, F0, by 2 L; the group gets the index of refraction with that reflectance, and its full
  coat. A node that would look grossly different without its metal, glass, clear coat, emission or transparency is left alone.
- Subsurface Scattering: Subsurface without a coat. Color and radius of the medium follow from the closure's inputs by inverting
  closures/subsurface_fit.py. Cycles' random walks reflect up to a fifth less than their Color; the group's Color is the reflected
  one (see ENTRY). EEVEE interprets the inputs in another way, the same for all methods, which is not reproduced.

Textures and other nodes stay linked. A linked Color stays as it is, and lengths are those of a color of 0.5.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import bpy

from ..blender import fcurves
from ..closures.quality import BALANCED
from ..closures.subsurface_fit import closure_inputs
from ..models import MODELS
from ..nodes import ROUGH_DIFFUSE, SUBSURFACE, Group
from ..nodes.graph import GROUP_ID
from .materials import Setting, add_group, locked_reason, materials_of, set_inputs, set_thickness
from .read import linked_output

MILLIMETERS = 1000.0  # in a meter
UNKNOWN_COLOR = 0.5
# A random walk that enters at normal incidence reflects the fits' color, one that enters from all directions its Color. Through a
# boundary of Roughness r it is between, by the fraction ENTRY[0] + ENTRY[1] r, measured on spheres of colors 0.1 to 0.8, to 2 %.
ENTRY = (0.17, 0.53)
HIGHEST_IOR = 3.0  # of the group's coat
# The group's Method by Principled's subsurface_method and Subsurface Scattering's falloff
METHODS = {
    "BURLEY": "Christensen-Burley",
    "RANDOM_WALK": "Random Walk",
    "RANDOM_WALK_SKIN": "Random Walk (Skin)",
    "RANDOM_WALK_LEGACY": "Random Walk (Legacy)",
}
ROUGH_BOUNDARY = {"RANDOM_WALK", "RANDOM_WALK_LEGACY"}
GROSS = {"Metallic": "metal", "Transmission Weight": "transmission", "Coat Weight": "a clear coat"}
MINOR = {"Sheen Weight": "sheen", "Anisotropic": "anisotropy", "Thin Film Thickness": "thin film"}
CONVERTIBLE = {"BSDF_DIFFUSE", "BSDF_PRINCIPLED", "SUBSURFACE_SCATTERING"}


class ConversionError(Exception):
    """A node cannot be converted; the message says why, in a few words."""


@dataclass
class Report:
    """The result of a conversion: names of materials, messages on changed settings, notes on what stayed or was lost."""

    converted: list[str] = field(default_factory=list)
    settings: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)


@dataclass
class Plan:
    """The group that replaces a node, with values and linked outputs by input."""

    group: Group
    values: dict[str, Setting] = field(default_factory=dict)
    sources: dict[str, bpy.types.NodeSocket] = field(default_factory=dict)
    factors: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Vectors that multiply a linked output."""
    losses: list[str] = field(default_factory=list)

    def take(self, socket: bpy.types.NodeSocket, name: str) -> None:
        """Give the group's input `name` the link of `socket`, or else its value."""
        source = linked_output(socket)
        if source:
            self.sources[name] = source
        elif socket.type == "RGBA":
            self.values[name] = tuple(socket.default_value)
        elif name != "Normal":
            self.values[name] = socket.default_value


def is_used(socket: bpy.types.NodeSocket) -> bool:
    """Return whether a weight or roughness is linked or above 0."""
    return linked_output(socket) is not None or socket.default_value > 0.0


def diffuse(node: bpy.types.Node, _meter: float, quality: str) -> Plan:
    """Return the replacement of a Diffuse BSDF."""
    plan = Plan(ROUGH_DIFFUSE, {"Quality": quality})
    plan.take(node.inputs["Color"], "Color")
    _rough(plan, node.inputs["Roughness"])
    plan.take(node.inputs["Normal"], "Normal")
    return plan


def subsurface(node: bpy.types.Node, meter: float, _quality: str) -> Plan:
    """Return the replacement of a Subsurface Scattering BSDF."""
    plan = Plan(SUBSURFACE, {"Specular": 0.0})
    lengths = node.inputs["Radius"], node.inputs["Scale"]
    _medium(plan, node.falloff, node.inputs["Color"], *lengths, node.inputs.get("Roughness"), meter)
    plan.take(node.inputs["Normal"], "Normal")
    if node.falloff != "BURLEY" and is_used(node.inputs["Anisotropy"]):
        plan.losses.append("anisotropy of the scattering")
    return plan


def principled(node: bpy.types.Node, meter: float, quality: str) -> Plan:
    """Return the replacement of a Principled BSDF; raises ConversionError where it would look grossly different."""
    inputs = node.inputs
    gross = [feature for name, feature in GROSS.items() if is_used(inputs[name])]
    if linked_output(inputs["Alpha"]) or inputs["Alpha"].default_value < 1.0:
        gross.append("transparency")
    color = inputs["Emission Color"]
    if is_used(inputs["Emission Strength"]) and (linked_output(color) or any(value > 0.0 for value in color.default_value[:3])):
        gross.append("emission")
    if is_used(inputs["Thin Wall"]) and is_used(inputs["Subsurface Weight"]):
        gross.append("thin walls that light passes")
    if gross:
        raise ConversionError(f"has {' and '.join(gross)}")
    scatters, has_coat = is_used(inputs["Subsurface Weight"]), is_used(inputs["Specular IOR Level"])
    plan = Plan(SUBSURFACE if scatters or has_coat else ROUGH_DIFFUSE)
    if plan.group is ROUGH_DIFFUSE:
        plan.values["Quality"] = quality
        plan.take(inputs["Base Color"], "Color")
    else:
        plan.take(inputs["Subsurface Weight"], "Subsurface")
        _highlight(plan, node)
        if scatters:
            lengths = inputs["Subsurface Radius"], inputs["Subsurface Scale"]
            _medium(plan, node.subsurface_method, inputs["Base Color"], *lengths, inputs["Roughness"], meter)
        else:
            plan.take(inputs["Base Color"], "Color")
    _rough(plan, inputs["Diffuse Roughness"])
    plan.take(inputs["Normal"], "Normal")
    plan.losses += [feature for name, feature in MINOR.items() if is_used(inputs[name])]
    if scatters and node.subsurface_method != "BURLEY" and is_used(inputs["Subsurface Anisotropy"]):
        plan.losses.append("anisotropy of the scattering")
    return plan


def _rough(plan: Plan, roughness: bpy.types.NodeSocket) -> None:
    if is_used(roughness):
        plan.values["Model"] = MODELS["cycles_diffuse"].label
        plan.take(roughness, "Roughness")
    else:
        plan.values["Model"] = MODELS["lambert"].label


def _highlight(plan: Plan, node: bpy.types.Node) -> None:
    """Give `plan` a coat like the specular layer of a Principled BSDF."""
    level, ior, tint = (node.inputs[name] for name in ("Specular IOR Level", "IOR", "Specular Tint"))
    plan.take(node.inputs["Roughness"], "Specular Roughness")
    if linked_output(tint) or any(value != 1.0 for value in tint.default_value[:3]):
        plan.losses.append("tint of the highlight")
    if linked_output(level):
        plan.take(level, "Specular")
        plan.take(ior, "IOR")
        plan.losses.append("Specular IOR Level, which is linked, now weighs the highlight")
    elif linked_output(ior):
        plan.values["Specular"] = min(1.0, 2.0 * level.default_value)
        plan.take(ior, "IOR")
    else:
        plan.values["Specular"] = float(level.default_value > 0.0)
        plan.values["IOR"] = coat_ior(ior.default_value, level.default_value)


def coat_ior(ior: float, level: float) -> float:
    """Return the index of refraction, in [1, HIGHEST_IOR], whose F0 is that of `ior` times twice `level`."""
    f0 = min(((ior - 1.0) / (ior + 1.0)) ** 2 * 2.0 * level, 0.99)
    root = math.sqrt(f0)
    return min((1.0 + root) / (1.0 - root), HIGHEST_IOR)


def _medium(
    plan: Plan,
    falloff: str,
    color: bpy.types.NodeSocket,
    radius: bpy.types.NodeSocket,
    scale: bpy.types.NodeSocket,
    roughness: bpy.types.NodeSocket | None,
    meter: float,
) -> None:
    """Give `plan` the method, color and mean free path of a closure of Cycles; `meter` is the scene's unit in meters.

    `roughness` is that of the boundary through which light enters the random walks except Skin.
    """
    plan.values["Method"] = METHODS[falloff]
    if linked_output(color):
        plan.take(color, "Color")
        medium = [UNKNOWN_COLOR] * 3
        if falloff != "BURLEY":
            plan.losses.append("linked Color is reflected in full now, which Cycles' walk was up to a fifth darker than")
    else:
        given = color.default_value[:3]
        medium = [medium_color(falloff, value) for value in given]
        fraction = 0.0
        if falloff in ROUGH_BOUNDARY and roughness is not None:
            fraction = ENTRY[0] + ENTRY[1] * (0.5 if linked_output(roughness) else roughness.default_value)
        smooth = (value - closure_inputs(falloff, value).rest for value in medium)
        plan.values["Color"] = (*(a + (b - a) * fraction for a, b in zip(smooth, given, strict=True)), 1.0)
    factor = MILLIMETERS * meter
    if linked_output(scale):
        plan.take(scale, "Scale")
    else:
        factor *= scale.default_value
    factors = tuple(factor / closure_inputs(falloff, value).radius for value in medium)
    plan.take(radius, "Subsurface Radius")
    if "Subsurface Radius" in plan.sources:
        plan.factors["Subsurface Radius"] = factors
    else:
        plan.values["Subsurface Radius"] = tuple(a * b for a, b in zip(radius.default_value, factors, strict=True))


def medium_color(falloff: str, color: float) -> float:
    """Return the color, in [0, 1], of the medium for which the closure's color is `color`; the latter grows with the former."""
    steps = 1 << 52
    return bisect_left(range(steps), color, key=lambda step: closure_inputs(falloff, step / steps).color) / steps


PLANS: Mapping[str, Callable[[bpy.types.Node, float, str], Plan]] = {
    "BSDF_DIFFUSE": diffuse,
    "BSDF_PRINCIPLED": principled,
    "SUBSURFACE_SCATTERING": subsurface,
}


def convert_materials(
    materials: Iterable[bpy.types.Material],
    meter: float,
    quality: str = BALANCED,
    condition: Callable[[bpy.types.Node], bool] = lambda _node: True,
) -> Report:
    """Convert the active nodes of `materials` for which `condition` is true; returns the report.

    `meter` is the scene's unit in meters (unit_settings.scale_length), `quality` that of Rough Diffuse.
    """
    report = Report()
    for material in dict.fromkeys(materials):
        nodes = [node for node in active_nodes(material.node_tree) if node.type in CONVERTIBLE and condition(node)]
        reason = locked_reason(material)
        if reason:
            report.lines += [f"{material.name} {reason}"] if nodes else []
            continue
        count, lines = convert_nodes(material.node_tree, nodes, meter, quality)
        report.lines += [f"{material.name}: {line}" for line in (*lines, *_inner(material.node_tree))]
        if count:
            report.converted.append(material.name)
            set_thickness(material)
    return report


def convert_nodes(
    tree: bpy.types.ShaderNodeTree, nodes: Iterable[bpy.types.Node], meter: float, quality: str = BALANCED
) -> tuple[int, list[str]]:
    """Convert `nodes` of `tree`; returns the number of converted nodes, and notes on the others and on what was lost."""
    count, lines = 0, []
    for node in list(nodes):
        name = node.label or node.name
        try:
            if fcurves.of_node(tree, node):
                raise ConversionError("is animated")
            plan = PLANS[node.type](node, meter, quality)
            group = plan.group.ensure()
            if group == tree or group.contains_tree(tree):
                raise ConversionError("is a part of the group that would replace it")
        except ConversionError as reason:
            lines.append(f"{name} {reason} and is left alone")
            continue
        _replace(tree, node, plan)
        count += 1
        lines += [f"{name} lost: {loss}" for loss in plan.losses]
    return count, lines


def active_nodes(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.Node]:
    """Return the nodes of `tree` that are linked to an output, without muted nodes and those inside groups."""
    nodes: dict[str, bpy.types.Node] = {}
    waiting = [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]
    while waiting:
        node = waiting.pop()
        if node.name in nodes:
            continue
        nodes[node.name] = node
        waiting += [source.node for source in map(linked_output, node.inputs) if source]
    return [node for node in nodes.values() if not node.mute]


def _inner(tree: bpy.types.ShaderNodeTree) -> Iterator[str]:
    """Yield a note for each of the user's groups that contains convertible nodes."""
    for node in active_nodes(tree):
        inner = node.node_tree if node.type == "GROUP" else None
        if inner and GROUP_ID not in inner and any(node.type in CONVERTIBLE for node in inner.nodes):
            yield f"what is inside the group {inner.name} is left alone"


def _replace(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, plan: Plan) -> None:
    """Replace `node` by the node that `plan` describes."""
    new = add_group(tree, plan.group)
    set_inputs(new, plan.values)
    new.parent, new.location, new.label, new.select = node.parent, node.location, node.label, node.select
    for name, source in plan.sources.items():
        factors = plan.factors.get(name)
        if factors:
            times = tree.nodes.new("ShaderNodeVectorMath")
            times.operation, times.label = "MULTIPLY", "To Millimeters"
            times.parent, times.location, times.select = node.parent, (node.location.x - 180.0, node.location.y - 260.0), False
            tree.links.new(source, times.inputs[0])
            times.inputs[1].default_value = factors
            source = times.outputs[0]
        tree.links.new(source, new.inputs[name])
    for target, is_muted in [(link.to_socket, link.is_muted) for link in node.outputs[0].links]:
        tree.links.new(new.outputs["BSDF"], target).is_muted = is_muted
    if tree.nodes.active == node:
        tree.nodes.active = new
    tree.nodes.remove(node)


def differs(node: bpy.types.Node) -> bool:
    """Return whether EEVEE and Cycles shade a convertible node differently."""
    if node.type == "BSDF_DIFFUSE":
        return is_used(node.inputs["Roughness"])
    if node.type == "BSDF_PRINCIPLED":
        return is_used(node.inputs["Diffuse Roughness"]) or is_used(node.inputs["Subsurface Weight"])
    return True


def match_engines(scene: bpy.types.Scene, quality: str) -> Report:
    """Make EEVEE render `scene` like Cycles, by its materials and render settings; returns what was done."""
    report = convert_materials(materials_of(scene), scene.unit_settings.scale_length, quality, differs)
    eevee, render = scene.eevee, scene.render
    settings = (
        (eevee, "light_threshold", 0.0, "Light Threshold is 0, as Cycles cuts off no light"),
        (eevee, "use_shadows", True, "Shadows are on"),
        (render, "filter_size", scene.cycles.filter_width, "Filter Size is that of Cycles"),
        (render, "use_high_quality_normals", True, "High Quality Normals are on"),
    )
    for owner, name, value, message in settings:
        if getattr(owner, name) != value:
            setattr(owner, name, value)
            report.settings.append(message)
    return report
