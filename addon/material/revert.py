# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns our nodes back into Blender's own.

A converted node becomes what it was (`original.py`), with links, keyframes and drivers; inputs that the artist has changed since
keep the new value where the old node has an input for it. Other nodes of ours become the nearest node of Blender's, and a line says
so.
`to_principled` leaves no other closure of ours than Principled BSDFs, for targets that read nothing else.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import bpy

from ..blender import fcurves
from ..blender.id_properties import GROUP_ID, THICKNESS_CHANGED, THICKNESS_OF
from ..models import by_label
from ..nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SUBSURFACE
from ..nodes.graph import key_and_version
from ..nodes.principled import DISTRIBUTION, DISTRIBUTIONS, METHOD, METHODS, PRINCIPLED_SOCKETS, SCALE
from .convert import LAYOUT, MILLIMETERS
from .materials import THICK_LABEL, Setting, locked_reason
from .original import TO_MILLIMETERS, Original, OriginalInput, original_of, value_of
from .upgrade import current_name, current_value

DIFFUSE_BSDF, PRINCIPLED_BSDF = "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfPrincipled"
DIFFUSE_ROUGHNESS = {DIFFUSE_BSDF: "Roughness", PRINCIPLED_BSDF: "Diffuse Roughness"}  # by node: the input that it is
LEVEL_OF_F0 = 12.5  # Specular IOR Level over the reflectance at normal incidence, at the usual index of refraction of 1.5
# Of Principled BSDFs for the other groups: by input the group's, and what the group's is multiplied with
SUBSURFACE_INPUTS = {
    "Base Color": ("Color", 1.0),
    "Diffuse Roughness": ("Roughness", 1.0),
    "Normal": ("Normal", 1.0),
    "Subsurface Weight": ("Subsurface", 1.0),
    "Subsurface Radius": ("Subsurface Radius", 1.0),
    "Roughness": ("Specular Roughness", 1.0),
    "IOR": ("IOR", 1.0),
    "Specular IOR Level": ("Specular", 0.5),
}


@dataclass
class Report:
    """The result of a reversal: names of materials, notes on what was lost or could not be turned back, groups that were copied."""

    reverted: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    copies: list[bpy.types.ShaderNodeTree] = field(default_factory=list)


def revert_materials(materials: Iterable[bpy.types.Material], meter: float) -> Report:
    """Turn all nodes of ours in `materials` back, also those inside the artist's groups; returns the report.

    `meter` is the scene's unit in meters (unit_settings.scale_length).
    """
    report = Report()
    for material in dict.fromkeys(materials):
        _revert(material, meter, report, _revert_node)
    return report


def revert_material(material: bpy.types.Material) -> Report:
    """Turn all nodes of ours in `material` back, as `revert_materials` does, for the current scene."""
    return revert_materials([material], bpy.context.scene.unit_settings.scale_length)


def to_principled(material: bpy.types.Material) -> Report:
    """Replace every node of ours in `material`, which is a temporary copy, by a Principled BSDF, for the current scene.

    Groups of the artist that hold nodes of ours become copies, which the report lists: nothing else in the file changes.
    """
    report = Report()
    _copy_groups(material.node_tree, report.copies)
    _revert(material, bpy.context.scene.unit_settings.scale_length, report, _make_principled)
    return report


type Reverter = Callable[[bpy.types.Node, float], Iterator[str]]


def _revert(material: bpy.types.Material, meter: float, report: Report, reverter: Reverter) -> None:
    found = nodes_of(material)
    reason = locked_reason(material)
    if reason:
        report.lines += [f"{material.name} {reason}"] if found else []
        return
    done = False
    for tree, node in found:
        inside = "" if tree == material.node_tree else f"in the group {tree.name}, "
        if not tree.is_editable or tree.library or tree.override_library:
            report.lines.append(f"{material.name}: the group {tree.name} is linked from another file and is left alone")
            continue
        name = node.label or node.name
        report.lines += [f"{material.name}: {inside}{name} {line}" for line in reverter(node, meter)]
        done = True
    if done:
        report.reverted.append(material.name)
        _restore_thickness(material)


def nodes_of(material: bpy.types.Material) -> list[tuple[bpy.types.ShaderNodeTree, bpy.types.Node]]:
    """Return the nodes of ours in `material` and in the artist's groups in it, each with its tree."""
    trees = _trees(material.node_tree) if material.node_tree else []
    return [(tree, node) for tree in trees for node in tree.nodes if is_ours(node)]


def is_ours(node: bpy.types.Node) -> bool:
    """Return whether `node` holds one of our groups, in whichever version."""
    return key_and_version(node)[0] in {group.key for group in GROUPS}


def _trees(tree: bpy.types.ShaderNodeTree) -> list[bpy.types.ShaderNodeTree]:
    """Return `tree` and the artist's groups in it, at any depth, each once."""
    trees = [tree]
    for outer in trees:
        inner = (node.node_tree for node in outer.nodes if node.type == "GROUP" and node.node_tree)
        trees += [group for group in dict.fromkeys(inner) if GROUP_ID not in group and group not in trees]
    return trees


def _copy_groups(tree: bpy.types.ShaderNodeTree, copies: list[bpy.types.ShaderNodeTree]) -> None:
    """Give `tree` copies of the artist's groups that hold nodes of ours, and these, in turn."""
    made: dict[bpy.types.ShaderNodeTree, bpy.types.ShaderNodeTree] = {}
    for node in tree.nodes:
        group = node.node_tree if node.type == "GROUP" else None
        if group and GROUP_ID not in group and any(is_ours(inner) for each in _trees(group) for inner in each.nodes):
            if group not in made:
                made[group] = group.copy()
                copies.append(made[group])
                _copy_groups(made[group], copies)
            node.node_tree = made[group]


def _revert_node(node: bpy.types.Node, meter: float) -> Iterator[str]:
    original = original_of(node)
    if original is None:
        original = _nearest(node, meter, False)
        yield f"was none of Blender's nodes before: it is a {bpy.types.Node.bl_rna_get_subclass(original.kind).bl_rna.name} now"
    yield from _restore(node, original)


def _make_principled(node: bpy.types.Node, meter: float) -> Iterator[str]:
    yield from _restore(node, _as_principled(node, meter), is_read=False)  # drivers read the material that the copy is of


def _as_principled(node: bpy.types.Node, meter: float) -> Original:
    original = original_of(node)
    return original if original and original.kind == PRINCIPLED_BSDF else _nearest(node, meter, True)


def taken_as_is(node: bpy.types.Node) -> dict[str, str]:
    """Return the names of the inputs of a node of ours, in this version, that `to_principled` gives a Principled BSDF as they are.

    They are by the names of that one's inputs.
    """
    original = _as_principled(node, 1.0)
    return {name: given.socket for name, given in original.inputs.items() if given.socket and given.factor == 1.0}


def _inputs(node: bpy.types.Node) -> dict[str, bpy.types.NodeSocket]:
    """Return the sockets of a node of ours by their names in this version."""
    return {current_name(socket.name): socket for socket in node.inputs}


def _entry(sockets: Mapping[str, bpy.types.NodeSocket], menu: str) -> str:
    return str(current_value(menu, sockets[menu].default_value))


def _nearest(node: bpy.types.Node, meter: float, principled: bool) -> Original:
    """Return the node of Blender's that is nearest to `node`: where `principled`, of all a Principled BSDF."""
    key, sockets = key_and_version(node)[0], _inputs(node)

    def taken(name: str, factor: float = 1.0) -> OriginalInput:
        return OriginalInput(None, name, None, factor)

    inputs: dict[str, OriginalInput] = {}
    properties: dict[str, str] = {}
    scale = taken("Scale", MILLIMETERS * meter)
    if key == PRINCIPLED.key:
        inputs = {socket.name: taken(socket.name) for socket in PRINCIPLED_SOCKETS}
        inputs[SCALE.name] = taken(SCALE.name, MILLIMETERS * meter)
        properties["distribution"] = _property(DISTRIBUTIONS, _entry(sockets, DISTRIBUTION.name))
        properties["subsurface_method"] = _property(METHODS, _entry(sockets, METHOD.name))
    elif key == SUBSURFACE.key:
        inputs = {name: taken(own, 1.0 / factor) for name, (own, factor) in SUBSURFACE_INPUTS.items()}
        inputs[SCALE.name] = scale
        properties["subsurface_method"] = _property(METHODS, _entry(sockets, "Method"))
    elif key == ROUGH_DIFFUSE.key and not principled:
        return Original(DIFFUSE_BSDF, {}, {name: taken(name) for name in ("Color", "Roughness", "Normal")})
    elif key == ROUGH_DIFFUSE.key:
        inputs = {"Base Color": taken("Color"), "Diffuse Roughness": taken("Roughness"), "Normal": taken("Normal")}
        inputs["Specular IOR Level"] = OriginalInput(0.0)
    else:
        exponent = sockets["Exponent"].default_value
        inputs = {"Base Color": taken("Color"), "Normal": taken("Normal")}
        inputs["Specular IOR Level"] = taken("Specular", 1.0 / LEVEL_OF_F0)
        inputs["Roughness"] = OriginalInput((2.0 / (max(exponent, 0.0) + 2.0)) ** 0.25)  # alpha^2 = 2 / (n + 2)
    return Original(PRINCIPLED_BSDF, properties, inputs)


def _property(entries: Mapping[str, tuple[str, str]], entry: str) -> str:
    return next(identifier for identifier, (label, _) in entries.items() if label == entry)


def _restore(node: bpy.types.Node, original: Original, is_read: bool = True) -> Iterator[str]:
    """Replace `node` by the `original`, with its links, animation and changed values; yields what is lost.

    `is_read` says whether drivers may read its inputs.
    """
    tree, sockets = node.id_data, _inputs(node)
    new = tree.nodes.new(original.kind)
    for name, value in original.properties.items():
        setattr(new, name, value)
    for name in LAYOUT:
        setattr(new, name, getattr(node, name))
    yield from _model_lost(sockets, original)
    targets = {socket.name: socket for socket in new.inputs}
    is_smooth = "Model" in sockets and not by_label(_entry(sockets, "Model")).is_rough
    entrances: dict[bpy.types.FCurve, bpy.types.NodeSocket] = {}
    helped: dict[bpy.types.Node, bpy.types.NodeSocket] = {}  # by each node "To Millimeters": what it was made for
    curves = [(curve, fcurves.input_of(curve)) for curve in fcurves.of_node(tree, node)]
    animated = [(curve, node.inputs[index]) for curve, index in curves if index is not None]
    placed = set()
    for name, given in original.inputs.items():
        target = targets[name]
        if given.socket is None:
            _set(target, given.value)
            continue
        own = sockets[given.socket]
        placed.add(own)
        value = value_of(own)
        _set(target, given.value if value is not None and value == given.made else _divided(value, given.factor))
        target.hide = own.hide
        if is_smooth and name == DIFFUSE_ROUGHNESS.get(original.kind) and not _is_muted(own):
            _set(target, 0.0)
            continue
        entrances |= {curve: target for curve, socket in animated if socket == own}
        for link in own.links:
            source, is_muted, helper = link.from_socket, link.is_muted, link.from_node
            if helper.label == TO_MILLIMETERS and given.factor != 1.0:
                helped[helper] = target
                _set(target, value_of(helper.inputs[0]))
                entrances |= dict.fromkeys(fcurves.of_node(tree, helper), target)
                if not helper.inputs[0].links:
                    continue
                source, is_muted = helper.inputs[0].links[0].from_socket, helper.inputs[0].links[0].is_muted
            elif given.factor != 1.0:
                source = _from_millimeters(new, source, given.factor)
            tree.links.new(source, target).is_muted = is_muted
    for socket in sockets.values():
        if socket not in placed and (socket.is_linked or any(own == socket for _, own in animated)):
            yield f"lost what went into {socket.name}"
    for curve in entrances:
        curve.data_path = "none"  # Blender deletes the curves of a node along with it
    found = fcurves.readers_of(tree, node) if is_read else []
    readers = {reader: node.inputs[fcurves.input_of(reader)] for reader in found}
    followed = {
        reader: targets[name]
        for reader, socket in readers.items()
        for name, given in original.inputs.items()
        if given.socket and sockets[given.socket] == socket
    }
    for helper, target in helped.items() if is_read else ():
        followed |= dict.fromkeys(fcurves.readers_of(tree, helper), target)
    for target, is_muted in [(link.to_socket, link.is_muted) for link in node.outputs["BSDF"].links]:
        tree.links.new(new.outputs[0], target).is_muted = is_muted
    if tree.nodes.active == node:
        tree.nodes.active = new
    name = node.name
    for old in (node, *helped):
        tree.nodes.remove(old)
    new.name = name
    for curve, socket in entrances.items():
        curve.data_path = socket.path_from_id("default_value")
    for reader, socket in followed.items():
        reader.follow(socket)


def _is_muted(socket: bpy.types.NodeSocket) -> bool:
    return any(link.is_muted for link in socket.links)


def _model_lost(sockets: Mapping[str, bpy.types.NodeSocket], original: Original) -> Iterator[str]:
    """Yield a note where the model is not one that Blender's nodes have, and is seen."""
    scatters_all = "Subsurface" in sockets and sockets["Subsurface"].default_value >= 1.0
    if "Model" in sockets and original.kind in DIFFUSE_ROUGHNESS and not scatters_all:
        label = _entry(sockets, "Model")
        if by_label(label).id not in {"lambert", "cycles_diffuse"}:
            yield f"lost its model, {label}: {bpy.types.Node.bl_rna_get_subclass(original.kind).bl_rna.name} has its own"


def _set(socket: bpy.types.NodeSocket, value: Setting | None) -> None:
    if value is None:
        return
    if socket.type == "BOOLEAN":
        value = bool(value)
    elif socket.type in {"VECTOR", "RGBA"} and isinstance(value, tuple):
        value = value[: len(socket.default_value)]
    socket.default_value = value


def _divided(value: Setting | None, factor: float | tuple[float, ...]) -> Setting | None:
    if value is None or factor == 1.0 or isinstance(value, str):
        return value
    if isinstance(value, tuple):
        factors = factor if isinstance(factor, tuple) else (factor,) * len(value)
        return tuple(a / b if b else 0.0 for a, b in zip(value, factors, strict=True))
    if isinstance(factor, tuple):
        raise TypeError(f"{value} is no vector")
    return value / factor if factor else 0.0


def _from_millimeters(new: bpy.types.Node, source: bpy.types.NodeSocket, factor: float | tuple[float, ...]) -> bpy.types.NodeSocket:
    """Return what is linked, `source`, over `factor`, from a new node before `new`."""
    tree = new.id_data
    over = tree.nodes.new("ShaderNodeVectorMath" if isinstance(factor, tuple) else "ShaderNodeMath")
    over.operation, over.label = "DIVIDE", "To the Node's Unit"
    over.parent, over.location, over.select = new.parent, (new.location.x - 180.0, new.location.y - 260.0), False
    tree.links.new(source, over.inputs[0])
    over.inputs[1].default_value = factor
    return over.outputs[0]


def _restore_thickness(material: bpy.types.Material) -> None:
    """Take back what `materials.set_thickness` did, unless nodes of ours are left."""
    if nodes_of(material):
        return
    for node in [node for node in material.node_tree.nodes if node.label == THICK_LABEL]:
        material.node_tree.nodes.remove(node)
    material.pop(THICKNESS_OF, None)
    if material.pop(THICKNESS_CHANGED, False):
        material.use_thickness_from_shadow = False
