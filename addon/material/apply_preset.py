# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives a material a preset in place, and makes materials of presets.

Which node gets the preset: the node of ours that the surface comes from; else the nearest Diffuse, Principled or Subsurface
Scattering BSDF, also behind a mix or inside the artist's group; else a new node becomes the surface. What the node becomes:

- A node of the preset's own group gets the values. Links and animation stay.
- Principled Rough Diffuse stays that, so that an artist's layers stay at hand. It gets the preset's color, roughness and subsurface
  scattering, and no other layer.
- Another node becomes one of the preset's group, with the links and the animation that have a place there (PLACES). A Principled
  BSDF with others, as of Metallic, Alpha or Emission, becomes Principled Rough Diffuse instead, where all have one.

All values are the preset's afterwards, also those that it does not name, which are the group's defaults; only Quality, Method and
the normals stay. An input that something decides keeps that, and a note says so.
"""

import math
from collections.abc import Iterator, Mapping

import bpy

from ..blender import fcurves
from ..closures.quality import BALANCED, CHOSEN_LIGHTS
from ..nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group
from ..nodes.graph import key_and_version
from .convert import CONVERTIBLE, ConversionError, Plan, check_animation, principled, replace, times
from .links import Place, upstream
from .materials import Setting, add_group, create, set_inputs, set_thickness, show
from .original import TO_MILLIMETERS
from .presets import PRESETS, Preset
from .read import group_node, linked_output
from .read_closures import TARGETS
from .revert import SUBSURFACE_INPUTS

KEPT = {"Quality", "Method"}  # how a group is computed, not what it looks like
PRINCIPLED_BSDF = "BSDF_PRINCIPLED"
# By the node's type, or its group's key: its inputs, and those of the same meaning in Rough Diffuse and in Subsurface
_NORMAL = {"Normal": "Normal"}
_COLOR = {"Color": "Color", **_NORMAL}
_ROUGH = {**_COLOR, "Roughness": "Roughness"}
_OF_PRINCIPLED = {"Base Color": "Color", "Diffuse Roughness": "Roughness", **_NORMAL}
_SUBSURFACE_OF_PRINCIPLED = {"Subsurface Weight": "Subsurface", "Roughness": "Specular Roughness", "IOR": "IOR"}
PLACES: Mapping[tuple[str, str], Mapping[str, str]] = {
    ("BSDF_DIFFUSE", ROUGH_DIFFUSE.key): _ROUGH,
    ("BSDF_DIFFUSE", SUBSURFACE.key): _ROUGH,
    ("SUBSURFACE_SCATTERING", ROUGH_DIFFUSE.key): _COLOR,
    ("SUBSURFACE_SCATTERING", SUBSURFACE.key): _COLOR,
    (PRINCIPLED_BSDF, ROUGH_DIFFUSE.key): _OF_PRINCIPLED,
    (PRINCIPLED_BSDF, SUBSURFACE.key): {**_OF_PRINCIPLED, **_SUBSURFACE_OF_PRINCIPLED},
    (ROUGH_DIFFUSE.key, SUBSURFACE.key): _ROUGH,
    (SUBSURFACE.key, ROUGH_DIFFUSE.key): _ROUGH,
    (SPECULAR_GROUP.key, ROUGH_DIFFUSE.key): _COLOR,
    (SPECULAR_GROUP.key, SUBSURFACE.key): _COLOR,
}


def create_material(preset: Preset) -> bpy.types.Material:
    """Return a new material of `preset`, named after it."""
    material = create(preset.name, preset.group, **preset.inputs)
    _set_display(material, preset)
    return material


def preset_of(node: bpy.types.Node) -> Preset | None:
    """Return the preset whose values the `node` of ours has; None where there is none, or a link decides one of them."""
    key = key_and_version(node)[0]
    return next((preset for preset in PRESETS.values() if key in (preset.group.key, PRINCIPLED.key) and _has(node, preset)), None)


def apply(material: bpy.types.Material, node: bpy.types.Node | None, preset: Preset, meter: float) -> list[str]:
    """Give the `node` of ours in `material`, or where that is None the material's surface, `preset`; returns notes.

    `meter` is the scene's unit in meters (unit_settings.scale_length). The notes say what the preset does not decide, and what was
    lost. Raises ConversionError, and changes nothing, where the animation of an input has no place in the new node, or where the
    node is in a group of another file.
    """
    others: list[bpy.types.Node] = []
    if node is None:
        node, *others = [*_closures(material), None]
        if node is not None and (node.id_data.override_library or not node.id_data.is_editable):
            raise ConversionError(f"is made by the group {node.id_data.name}, which is linked from another file")
    notes = [f"{other.label or other.name} stays as it is" for other in others if other]
    if node is None:
        node, replaced = _new_surface(material, preset)
        notes += [f"{name} is no longer the surface" for name in replaced]
    elif key_and_version(node)[0] in (preset.group.key, PRINCIPLED.key):
        set_inputs(node, _values(preset, _group(node)))
    else:
        node = _replaced(node, preset, meter, notes)
    notes += _decided(node, preset)
    if node.id_data != material.node_tree:
        notes.append(f"the group {node.id_data.name} was changed inside, for all that use it")
    set_thickness(material)
    surface = group_node(material)
    if surface and surface[0] == node:
        _set_display(material, preset, linked_output(node.inputs[_names(preset, _group(node))["Color"]]) is not None)
    return notes


def _closures(material: bpy.types.Material) -> list[bpy.types.Node]:
    """Return the convertible nodes that the surface of `material` comes from, each once, the nearest to an output first."""
    nodes = [place.node for output in _outputs(material) for place in upstream(Place(output.inputs["Surface"]))]
    return [node for node in dict.fromkeys(nodes) if node.type in CONVERTIBLE and not node.mute]


def _outputs(material: bpy.types.Material) -> list[bpy.types.Node]:
    """Return the output nodes of `material` that some engine uses, each once."""
    return list(dict.fromkeys(filter(None, map(material.node_tree.get_output_node, TARGETS))))


def _new_surface(material: bpy.types.Material, preset: Preset) -> tuple[bpy.types.Node, list[str]]:
    """Make a new node the surface of `material`; returns it and the names of the nodes that were."""
    tree = material.node_tree
    node = add_group(tree, preset.group)
    outputs = _outputs(material)
    if not outputs:
        show(material, node, preset.inputs)
        return node, []
    set_inputs(node, preset.inputs)
    node.location = (outputs[0].location.x - 300.0, outputs[0].location.y)
    replaced = [link.from_node for output in outputs for link in output.inputs["Surface"].links]
    for output in outputs:
        tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    for other in replaced:
        other.location.x -= 300.0
    return node, list(dict.fromkeys(other.label or other.name for other in replaced))


def _replaced(node: bpy.types.Node, preset: Preset, meter: float, notes: list[str]) -> bpy.types.Node:
    """Return the node of `preset` that takes the place of `node`; adds to `notes` which links were lost."""
    kind = key_and_version(node)[0] or node.type
    places = PLACES[kind, preset.group.key]
    homeless = [socket.name for index, socket in enumerate(node.inputs) if socket.name not in places and _is_decided(socket, index)]
    if homeless and kind == PRINCIPLED_BSDF:
        plan = principled(node, meter, BALANCED)
        group = PRINCIPLED
    else:
        plan, group = Plan(preset.group), preset.group
        for name, place in places.items():
            if name in node.inputs and place in {socket.name for socket in group.inputs}:
                plan.take(node.inputs[name], place)
        quality = node.inputs.get("Quality")
        if quality and "Quality" in {socket.name for socket in group.inputs} and quality.default_value in (BALANCED, CHOSEN_LIGHTS):
            plan.values["Quality"] = quality.default_value
        notes += [f"what went into {name} is lost: {group.label} has no such input" for name in homeless]
    plan.values.update(_values(preset, group))
    check_animation(node, plan)
    return replace(node.id_data, node, plan)


def _is_decided(socket: bpy.types.NodeSocket, index: int) -> bool:
    """Return whether a link, keyframes or a driver decide the value of the input of that `index` in its node."""
    curves = fcurves.of_node(socket.id_data, socket.node)
    return linked_output(socket) is not None or any(fcurves.input_of(curve) == index for curve in curves)


def _decided(node: bpy.types.Node, preset: Preset) -> Iterator[str]:
    """Yield a note for each input whose value is not the preset's, since something else decides it."""
    values = _values(preset, _group(node))
    for index, socket in enumerate(node.inputs):
        if socket.name not in values or not _is_decided(socket, index):
            continue
        source = linked_output(socket)
        if source and source.node.label == TO_MILLIMETERS:
            source = linked_output(source.node.inputs[0])
        yield f"{socket.name} stays {f'linked to {source.node.label or source.node.name}' if source else 'animated'}"


def _has(node: bpy.types.Node, preset: Preset) -> bool:
    """Return whether the unlinked inputs of the `node` of ours are those of `preset`, to the precision of Blender's floats."""
    for name, value in _values(preset, _group(node)).items():
        socket = node.inputs.get(name)
        if socket is None or socket.is_linked:
            return False
        actual = socket.default_value
        pairs = zip(actual, value, strict=True) if isinstance(value, tuple) else [(actual, value)]
        if not all(a == b if isinstance(b, str) else math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-9) for a, b in pairs):
            return False
    return True


def _group(node: bpy.types.Node) -> Group:
    """Return the group that a `node` of ours holds."""
    return next(group for group in GROUPS if group.key == key_and_version(node)[0])


def _names(preset: Preset, group: Group) -> Mapping[str, str]:
    """Return by the preset's inputs what `group`, its own or Principled Rough Diffuse, calls them."""
    if group is preset.group:
        return {name: name for name in preset.inputs}
    if preset.group is SUBSURFACE:
        return {own: name for name, (own, _) in SUBSURFACE_INPUTS.items()}
    return {own: name for name, own in _OF_PRINCIPLED.items()}


def _values(preset: Preset, group: Group) -> dict[str, Setting]:
    """Return the values of all inputs of `group` with which it is `preset`, except KEPT; it is the preset's or PRINCIPLED."""
    values: dict[str, Setting] = {
        socket.name: socket.default
        for socket in group.inputs
        if socket.default is not None and not socket.hide_value and socket.name not in KEPT
    }
    is_own, names = group is preset.group, _names(preset, group)
    if not is_own:
        values |= {"Subsurface Scale": 1.0, "Specular IOR Level": 0.0}
    for own, value in preset.inputs.items():
        values[names[own]] = value if is_own else times(value, SUBSURFACE_INPUTS[names[own]][1])
    return values


def _set_display(material: bpy.types.Material, preset: Preset, is_color_linked: bool = False) -> None:
    """Make the viewport's Solid view show `material` as `preset`; the color of one whose color is linked stays."""
    if not is_color_linked:
        material.diffuse_color = preset.inputs["Color"]
    material.roughness = preset.inputs["Specular Roughness"] if preset.inputs.get("Specular") else 1.0
    material.metallic = 0.0
