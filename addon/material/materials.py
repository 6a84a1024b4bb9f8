# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials made of True Diffuse groups."""

from collections.abc import Mapping

import bpy

from ..blender.id_properties import THICKNESS_CHANGED
from ..nodes import PRINCIPLED, SUBSURFACE, Group
from ..nodes.graph import key_and_version
from ..nodes.subsurface import THICKNESS

type Setting = float | str | tuple[float, ...]
THICK = 100.0  # m; EEVEE reduces it where shadows show less, down to a thousandth
THICK_LABEL = "Thick: Keeps Light Out"
TRANSMITTING = {"SUBSURFACE_SCATTERING", "BSDF_TRANSLUCENT", "BSDF_REFRACTION", "BSDF_GLASS"}


def create(name: str, group: Group, **inputs: Setting) -> bpy.types.Material:
    """Return a new material whose surface is `group`, its sockets set to `inputs` (by socket name; the rest at their defaults)."""
    material = _blank(name)
    show(material, add_group(material.node_tree, group), inputs)
    set_thickness(material)
    return material


def create_plain(name: str) -> tuple[bpy.types.Material, bpy.types.Node]:
    """Return a new material of Blender's own Diffuse BSDF, and that node."""
    material = _blank(name)
    node = material.node_tree.nodes.new("ShaderNodeBsdfDiffuse")
    show(material, node)
    return material, node


def add_group(tree: bpy.types.ShaderNodeTree, group: Group) -> bpy.types.Node:
    """Return a new node in `tree` that holds `group`."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group.ensure()
    node.name = group.name
    node.width = node.node_tree.default_group_node_width
    node.show_options = False  # the selector of the group, as of nodes from the Asset Browser
    return node


def set_inputs(node: bpy.types.Node, inputs: Mapping[str, Setting]) -> None:
    """Set `node`'s sockets by name."""
    for socket, value in inputs.items():
        node.inputs[socket].default_value = value


def set_thickness(material: bpy.types.Material) -> None:
    """Set the thickness that EEVEE takes `material` for, unless it is linked: THICK where no light passes, else from shadows.

    What the group Subsurface says of its medium is the most that shadows are asked for.

    The Subsurface closure of Rough Diffuse scatters nothing, but EEVEE keeps its radius in steps of 2 mm, dithered. Then light from
    behind comes through meshes that are less than two steps across. For the group Subsurface EEVEE's own thickness, the object's
    size, would let no light through an ear.
    """
    tree = material.node_tree
    output = tree.get_output_node("EEVEE")
    if output is None:
        return
    if any(map(_transmits, tree.nodes)):
        for node in [node for node in tree.nodes if node.label == THICK_LABEL]:
            tree.nodes.remove(node)
        media = [node for node in tree.nodes if key_and_version(node)[0] == SUBSURFACE.key]
        if media and not material.use_thickness_from_shadow:
            material.use_thickness_from_shadow = material[THICKNESS_CHANGED] = True
        limit = next((node.outputs[THICKNESS] for node in media if THICKNESS in node.outputs), None)
        if limit and not output.inputs["Thickness"].is_linked:
            tree.links.new(limit, output.inputs["Thickness"])
    elif not output.inputs["Thickness"].is_linked:
        thick = tree.nodes.new("ShaderNodeValue")
        # small, between the output and the node of its surface
        thick.label, thick.width, thick.hide = THICK_LABEL, 180.0, True
        thick.location = output.location.x - thick.width - 9.0, output.location.y - 105.0
        thick.outputs[0].default_value, thick.select = THICK, False
        tree.links.new(thick.outputs[0], output.inputs["Thickness"])


def _transmits(node: bpy.types.Node) -> bool:
    """Return whether `node` may let light through, so that its appearance depends on the thickness."""
    key, _ = key_and_version(node)
    if node.type == "BSDF_PRINCIPLED" or key == PRINCIPLED.key:
        weights = (node.inputs["Transmission Weight"], node.inputs["Subsurface Weight"])
        return any(weight.is_linked or weight.default_value > 0.0 for weight in weights)
    if node.type == "GROUP":
        return key in ("", SUBSURFACE.key)
    return node.type in TRANSMITTING


def _blank(name: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.node_tree.nodes.clear()
    return material


def show(material: bpy.types.Material, node: bpy.types.Node, inputs: Mapping[str, Setting] | None = None) -> None:
    """Make the BSDF of `node` the surface of `material`, and set the node's sockets to `inputs`."""
    set_inputs(node, inputs or {})
    tree = material.node_tree
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (450.0, 0.0)
    tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])


def locked_reason(material: bpy.types.Material) -> str:
    """Return why the nodes of `material` cannot be changed, empty where they can; library overrides do not keep changes."""
    if material.override_library is not None:
        return "is a library override"
    return "" if material.is_editable and material.node_tree.is_editable else "is linked from another file"


def materials_of(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """Return the distinct materials of `scene`'s objects, with those of the collections that it instances."""
    objects: dict[bpy.types.Object, None] = {}
    waiting = list(reversed(scene.objects))
    while waiting:
        item = waiting.pop()
        if item not in objects:
            objects[item] = None
            waiting += item.instance_collection.all_objects if item.instance_collection else ()
    slots = (slot for item in objects for slot in item.material_slots)
    return list(dict.fromkeys(slot.material for slot in slots if slot.material))


def paint(material: bpy.types.Material, socket: bpy.types.NodeSocket, attribute: str, albedo: float) -> None:
    """Link to the color `socket` of `material` the mesh's color `attribute` (linear, in [0, 1]) times `albedo`."""
    tree = material.node_tree
    source = tree.nodes.new("ShaderNodeAttribute")
    source.attribute_name = attribute
    source.location = (-500.0, 0.0)
    factor = tree.nodes.new("ShaderNodeVectorMath")
    factor.operation = "SCALE"
    factor.inputs["Scale"].default_value = albedo
    factor.location = (-250.0, 0.0)
    tree.links.new(source.outputs["Color"], factor.inputs["Vector"])
    tree.links.new(factor.outputs["Vector"], socket)
