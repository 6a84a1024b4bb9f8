# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials made of True Diffuse groups."""

from collections.abc import Iterator, Mapping

import bpy

from ..blender.id_properties import THICKNESS_CHANGED, THICKNESS_OF
from ..nodes import PRINCIPLED, SUBSURFACE, Group
from ..nodes.graph import key_and_version
from ..nodes.subsurface import THICKNESS
from .links import Place, source

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
    """Set the thickness that EEVEE takes `material` for by its surface, unless the artist has linked it, or removed our link.

    It is THICK where a group of ours is and no light passes. Where the group Subsurface is, it is from shadows, and what the group
    says of its medium is the most that these are asked for. A group that is inside another one of the artist's has no output for
    that in the material's own tree.

    The Subsurface closure of Rough Diffuse scatters nothing, but EEVEE keeps its radius in steps of 2 mm, dithered. Then light from
    behind comes through meshes that are less than two steps across. For the group Subsurface EEVEE's own thickness, the object's
    size, would let no light through an ear.
    """
    tree = material.node_tree
    output = tree.get_output_node("EEVEE") if tree else None
    if output is None:
        return
    socket = output.inputs["Thickness"]
    # `socket.links` would sort, which takes as long as all the rest
    now = next((link.from_node for link in tree.links if link.to_socket == socket), None) if socket.is_linked else None
    is_thick = now is not None and now.label == THICK_LABEL
    is_medium = now is not None and not is_thick and key_and_version(now)[0] == SUBSURFACE.key
    if now is not None and not (is_thick or is_medium):
        return
    limits: dict[str, bpy.types.NodeSocket] = {}  # by the names of nodes
    ours, transmits = [], False
    for key, node, groups in closures_of(output):
        transmits = transmits or _transmits(key, node)
        if key:
            ours.append((groups or (node,))[0].name)
        if key == SUBSURFACE.key and not groups and THICKNESS in node.outputs:
            limits[node.name] = node.outputs[THICKNESS]
    if is_thick and transmits:
        tree.nodes.remove(now)
        material.pop(THICKNESS_OF, None)
        now, is_thick = None, False
    name = now.name if now else ""
    if limits:
        fits, names = is_medium and name in limits, list(limits)
    elif ours and not transmits:
        fits, names = is_thick, ours
    else:
        return
    decided = material.get(THICKNESS_OF)
    if fits or (now is None and decided in names):
        if decided is None:  # by a version that did not say so
            material[THICKNESS_OF] = name if limits else names[0]
        return
    material[THICKNESS_OF] = names[0]
    if limits and not material.use_thickness_from_shadow:
        material.use_thickness_from_shadow = material[THICKNESS_CHANGED] = True
    tree.links.new(limits[names[0]] if limits else _add_thick(tree, output).outputs[0], socket)


def closures_of(output: bpy.types.Node) -> Iterator[tuple[str, bpy.types.Node, tuple[bpy.types.Node, ...]]]:
    """Yield the nodes that the surface of a material's `output` is made of, through groups of the artist, too.

    Each comes with the key of our group that it is, empty if it is none, and the groups that hold it, from the outside in.
    """
    seen: set[tuple[bpy.types.Node, tuple[bpy.types.Node, ...]]] = set()
    waiting = [Place(output.inputs["Surface"])]
    while waiting:
        place = source(waiting.pop())
        node = place.node
        if place.socket.is_output and (node, place.groups) not in seen:
            seen.add((node, place.groups))
            key, _ = key_and_version(node)
            yield key, node, place.groups
            if not key:
                waiting += [inside for inside in reversed(place.inputs()) if inside.socket.type == "SHADER"]


def _add_thick(tree: bpy.types.ShaderNodeTree, output: bpy.types.Node) -> bpy.types.Node:
    """Return a new node of THICK, small, between the output and the node of its surface."""
    thick = tree.nodes.new("ShaderNodeValue")
    thick.label, thick.width, thick.hide = THICK_LABEL, 180.0, True
    thick.location = output.location.x - thick.width - 9.0, output.location.y - 105.0
    thick.outputs[0].default_value, thick.select = THICK, False
    return thick


def _transmits(key: str, node: bpy.types.Node) -> bool:
    """Return whether `node`, our group of that `key` or none, may let light through, so that its look depends on the thickness."""
    if node.type == "BSDF_PRINCIPLED" or key == PRINCIPLED.key:
        weights = (node.inputs["Transmission Weight"], node.inputs["Subsurface Weight"])
        return any(weight.is_linked or weight.default_value > 0.0 for weight in weights)
    return key == SUBSURFACE.key or node.type in TRANSMITTING


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
