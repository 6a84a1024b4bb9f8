# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts Blender's Diffuse, Principled and Subsurface Scattering BSDFs to True Diffuse groups that look the same in Cycles.

- Diffuse BSDF: Rough Diffuse with the model Cycles Diffuse, which is the node's own in Cycles, or Lambert at Roughness 0.
- Principled BSDF: Principled Rough Diffuse, which has all its inputs, with the same models.
- Subsurface Scattering: Subsurface without a coat. Color and radius of the medium follow from the closure's inputs by inverting
  closures/subsurface_fit.py. Cycles' random walks reflect up to a fifth less than their Color; the group's Color is the reflected
  one (see ENTRY). EEVEE interprets the inputs in another way, the same for all methods, which is not reproduced.

A node keeps its name, place, links, keyframes and drivers, and remembers what it was made of: `revert.py` turns it back. Nodes
inside the artist's own groups are converted in place, so that all users of the group follow. A linked Color of Subsurface
Scattering stays as it is, and lengths are those of a color of 0.5.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import bpy

from ..blender import fcurves
from ..closures.quality import BALANCED
from ..closures.subsurface_fit import closure_inputs
from ..models import MODELS
from ..nodes import PRINCIPLED, ROUGH_DIFFUSE, SUBSURFACE, Group
from ..nodes.graph import GROUP_ID
from ..nodes.principled import DISTRIBUTION, DISTRIBUTIONS, METHOD, METHODS, PRINCIPLED_SOCKETS, SCALE
from .materials import Setting, add_group, locked_reason, materials_of, set_inputs, set_thickness
from .original import TO_MILLIMETERS, Original, OriginalInput, value_of
from .read import linked_output

MILLIMETERS = 1000.0  # in a meter
UNKNOWN_COLOR = 0.5
# A random walk that enters at normal incidence reflects the fits' color, one that enters from all directions its Color. Through a
# boundary of Roughness r it is between, by the fraction ENTRY[0] + ENTRY[1] r, measured on spheres of colors 0.1 to 0.8, to 2 %.
ENTRY = (0.17, 0.53)
ROUGH_BOUNDARY = {"RANDOM_WALK", "RANDOM_WALK_LEGACY"}
LAYOUT = ("parent", "location", "width", "label", "select", "hide", "mute", "use_custom_color", "color")
PROPERTIES = ("distribution", "subsurface_method", "falloff")
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
    """The group that replaces a node, with values and links by input."""

    group: Group
    values: dict[str, Setting] = field(default_factory=dict)
    links: dict[str, bpy.types.NodeLink] = field(default_factory=dict)
    taken: dict[str, str] = field(default_factory=dict)
    """By input of the node: the group's input that stands for it."""
    factors: dict[str, float | tuple[float, ...]] = field(default_factory=dict)
    """What multiplies the value, or what is linked, by input of the group."""
    losses: list[str] = field(default_factory=list)

    def take(self, socket: bpy.types.NodeSocket, name: str) -> None:
        """Give the group's input `name` the link and the value of `socket`."""
        self.taken[socket.name] = name
        for link in socket.links:
            self.links[name] = link
        value = value_of(socket)
        if value is not None:
            self.values[name] = value

    def scale(self, name: str, factor: float | tuple[float, ...]) -> None:
        """Multiply what the group's input `name` got."""
        self.factors[name] = factor
        self.values[name] = times(self.values[name], factor)


def times(value: Setting, factor: float | tuple[float, ...]) -> Setting:
    """Return a number or vector times `factor`; raises TypeError for the entry of a menu, and for a number times a vector."""
    if isinstance(value, tuple):
        factors = factor if isinstance(factor, tuple) else (factor,) * len(value)
        return tuple(a * b for a, b in zip(value, factors, strict=True))
    if isinstance(value, str) or isinstance(factor, tuple):
        raise TypeError(f"{value} cannot be multiplied by {factor}")
    return value * factor


def is_used(socket: bpy.types.NodeSocket) -> bool:
    """Return whether a weight or roughness is linked, animated or above 0."""
    return linked_output(socket) is not None or socket.default_value > 0.0 or is_animated(socket)


def is_animated(socket: bpy.types.NodeSocket) -> bool:
    """Return whether keyframes or a driver change the value of `socket`."""
    return any(fcurves.input_of(curve) == _index(socket) for curve in fcurves.of_node(socket.id_data, socket.node))


def _index(socket: bpy.types.NodeSocket) -> int:
    return next(index for index, other in enumerate(socket.node.inputs) if other == socket)


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
    """Return the replacement of a Principled BSDF."""
    plan = Plan(PRINCIPLED, {"Quality": quality})
    plan.values[DISTRIBUTION.name] = DISTRIBUTIONS[node.distribution][0]
    plan.values[METHOD.name] = METHODS[node.subsurface_method][0]
    own = {socket.name for socket in PRINCIPLED_SOCKETS}
    for socket in node.inputs:
        if socket.name in own:
            plan.take(socket, socket.name)
    plan.scale(SCALE.name, MILLIMETERS * meter)
    _rough(plan, node.inputs["Diffuse Roughness"], "Diffuse Roughness")
    return plan


def _rough(plan: Plan, roughness: bpy.types.NodeSocket, name: str = "Roughness") -> None:
    """Give `plan` the model of a diffuse closure in Cycles, whose roughness is its input `name`."""
    plan.take(roughness, name)
    plan.values["Model"] = MODELS["cycles_diffuse" if is_used(roughness) else "lambert"].label


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
    plan.values["Method"] = METHODS[falloff][0]
    plan.take(color, "Color")
    if linked_output(color):
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
    plan.take(scale, "Scale")
    if not linked_output(scale):
        factor *= scale.default_value
        plan.values["Scale"] = 1.0
        if scale.default_value > 0.0:
            plan.factors["Scale"] = 1.0 / scale.default_value
    plan.take(radius, "Subsurface Radius")
    plan.scale("Subsurface Radius", tuple(factor / closure_inputs(falloff, value).radius for value in medium))


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
    """Convert the active nodes of `materials`, and those inside groups of the artist, for which `condition` is true.

    `meter` is the scene's unit in meters (unit_settings.scale_length), `quality` that of rough diffuse reflection. Returns the
    report.
    """
    report = Report()
    for material in dict.fromkeys(materials):
        trees = {
            tree: [node for node in nodes if node.type in CONVERTIBLE and condition(node)] for tree, nodes in trees_of(material)
        }
        reason = locked_reason(material)
        if reason:
            report.lines += [f"{material.name} {reason}"] if any(trees.values()) else []
            continue
        total, lines = 0, []
        for tree, nodes in trees.items():
            count, notes = _convert_inside(tree, nodes, meter, quality, tree != material.node_tree)
            total += count
            lines += notes
        report.lines += [f"{material.name}: {line}" for line in lines]
        if total:
            report.converted.append(material.name)
            set_thickness(material)
    return report


def _convert_inside(
    tree: bpy.types.ShaderNodeTree, nodes: list[bpy.types.Node], meter: float, quality: str, is_group: bool
) -> tuple[int, list[str]]:
    """Convert `nodes` of a material's own tree or of a group in it; returns what `convert_nodes` does."""
    if not nodes or not is_group:
        return convert_nodes(tree, nodes, meter, quality)
    if tree.library or tree.override_library or not tree.is_editable:
        return 0, [f"the group {tree.name} is linked from another file, and what is inside is left alone"]
    count, lines = convert_nodes(tree, nodes, meter, quality)
    lines = [f"in the group {tree.name}, {line}" for line in lines]
    if count:
        lines.append(f"the group {tree.name} was changed inside, for all that use it")
    return count, lines


def trees_of(material: bpy.types.Material) -> Iterator[tuple[bpy.types.ShaderNodeTree, list[bpy.types.Node]]]:
    """Yield the tree of `material` and those of the artist's groups in it, at any depth, each once, with their active nodes."""
    pending, seen = [material.node_tree], set()
    while pending:
        tree = pending.pop(0)
        if tree in seen:
            continue
        seen.add(tree)
        nodes = active_nodes(tree)
        yield tree, nodes
        inner = (node.node_tree for node in nodes if node.type == "GROUP")
        pending += [group for group in inner if group and GROUP_ID not in group]


def convert_nodes(
    tree: bpy.types.ShaderNodeTree, nodes: Iterable[bpy.types.Node], meter: float, quality: str = BALANCED
) -> tuple[int, list[str]]:
    """Convert `nodes` of `tree`; returns the number of converted nodes, and notes on the others and on what was lost."""
    count, lines = 0, []
    for node in list(nodes):
        name = node.label or node.name
        try:
            plan = PLANS[node.type](node, meter, quality)
            check_animation(node, plan)
            group = plan.group.ensure()
            if group == tree or group.contains_tree(tree):
                raise ConversionError("is a part of the group that would replace it")
        except ConversionError as reason:
            lines.append(f"{name} {reason} and is left alone")
            continue
        replace(tree, node, plan)
        count += 1
        lines += [f"{name} lost: {loss}" for loss in plan.losses]
    return count, lines


def active_nodes(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.Node]:
    """Return the nodes of `tree` that are linked to an output, without muted nodes and those inside groups."""
    nodes: dict[str, bpy.types.Node] = {}
    waiting = [node for node in tree.nodes if node.type in {"OUTPUT_MATERIAL", "GROUP_OUTPUT"}]
    while waiting:
        node = waiting.pop()
        if node.name in nodes:
            continue
        nodes[node.name] = node
        waiting += [source.node for source in map(linked_output, node.inputs) if source]
    return [node for node in nodes.values() if not node.mute]


def check_animation(node: bpy.types.Node, plan: Plan) -> None:
    """Raise ConversionError where keyframes or drivers change, or drivers read, what has no place in the group of `plan`."""

    def lacks(curve: "bpy.types.FCurve | fcurves.Reader") -> str:
        index = fcurves.input_of(curve)
        name = node.inputs[index].name if index is not None else curve.data_path.rpartition(".")[2]
        # what was worked out from a value would have to follow it
        is_there = name in plan.taken and (node.type != "SUBSURFACE_SCATTERING" or name == "Normal")
        return "" if is_there else name

    for curve in fcurves.of_node(node.id_data, node):
        if lacks(curve):
            raise ConversionError(f"is animated ({lacks(curve)})")
    for reader in fcurves.readers_of(node.id_data, node):
        if lacks(reader):
            raise ConversionError(f"drives something by its {lacks(reader)}")


def replace(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, plan: Plan) -> bpy.types.Node:
    """Replace `node` by the node that `plan` describes, which gets its name, links and animation; returns that.

    One in place of a node of Blender's remembers it, for `revert.py`.
    """
    new = add_group(tree, plan.group)
    set_inputs(new, plan.values)
    for name in LAYOUT:
        setattr(new, name, getattr(node, name))
    curves, readers = fcurves.of_node(tree, node), fcurves.readers_of(tree, node)
    moves = [(item, node.inputs[fcurves.input_of(item)]) for item in (*curves, *readers)]
    entrances = {item: _entrance(new, plan, plan.taken[socket.name], socket) for item, socket in moves}
    for curve in curves:
        curve.data_path = "none"  # Blender deletes the curves of a node along with it
    for name, link in plan.links.items():
        source, is_muted = link.from_socket, link.is_muted
        tree.links.new(source, _entrance(new, plan, name, link.to_socket)).is_muted = is_muted
    for socket in node.inputs:
        if socket.name in plan.taken:
            new.inputs[plan.taken[socket.name]].hide = socket.hide
    if node.type in CONVERTIBLE:
        _original(node, new, plan).keep(new)
    for target, is_muted in [(link.to_socket, link.is_muted) for link in node.outputs[0].links]:
        tree.links.new(new.outputs["BSDF"], target).is_muted = is_muted
    if tree.nodes.active == node:
        tree.nodes.active = new
    name = node.name
    tree.nodes.remove(node)
    new.name = name
    for curve in curves:
        curve.data_path = entrances[curve].path_from_id("default_value")
    for reader in readers:
        reader.follow(entrances[reader])
    return new


def _entrance(new: bpy.types.Node, plan: Plan, name: str, old: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return where to connect what went into the socket `old`: the input `name`, or a node before it that multiplies."""
    target, factor = new.inputs[name], plan.factors.get(name)
    if factor is None:
        return target
    if target.is_linked:
        return target.links[0].from_node.inputs[0]
    tree = new.id_data
    times = tree.nodes.new("ShaderNodeVectorMath" if isinstance(factor, tuple) else "ShaderNodeMath")
    times.operation, times.label = "MULTIPLY", TO_MILLIMETERS
    times.parent, times.location, times.select = new.parent, (new.location.x - 180.0, new.location.y - 260.0), False
    times.inputs[0].default_value, times.inputs[1].default_value = old.default_value, factor
    tree.links.new(times.outputs[0], target)
    return times.inputs[0]


def _original(node: bpy.types.Node, new: bpy.types.Node, plan: Plan) -> Original:
    """Return what `revert.py` has to know of `node`, which `new` replaces."""
    inputs = {}
    for socket in node.inputs:
        name = plan.taken.get(socket.name)
        made = value_of(new.inputs[name]) if name else None
        inputs[socket.name] = OriginalInput(value_of(socket), name, made, plan.factors.get(name or "", 1.0))
    properties = {name: getattr(node, name) for name in PROPERTIES if hasattr(node, name)}
    return Original(node.bl_idname, properties, inputs)


def differs(node: bpy.types.Node) -> bool:
    """Return whether EEVEE and Cycles shade a convertible node differently."""
    if node.type == "BSDF_DIFFUSE":
        return is_used(node.inputs["Roughness"])
    if node.type == "BSDF_PRINCIPLED":
        return is_used(node.inputs["Diffuse Roughness"])
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
