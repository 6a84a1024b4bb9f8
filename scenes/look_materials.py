# SPDX-License-Identifier: GPL-3.0-or-later
"""A character's own materials with the reflectance model of a look, all else as it is: color, textures, normals, metal, alpha.

Standard specular is Lambert's model under Blinn-Phong's highlight in place of the specular layer. Its weight is that layer's
reflectance at normal incidence, 0.04 for a Principled BSDF as it comes; its exponent is that of Beckmann's lobe of equal roughness,
2 / alpha^2 - 2 with alpha = roughness^2: 30 at the default of 0.5. Metal and glass have none; they are as in all looks.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import bpy

from ..addon.material import convert, materials
from ..addon.material.closure_nodes import TreeGraph, closures, own_copy, trees
from ..addon.models import MODELS, Specular
from ..addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group
from ..addon.nodes.graph import Number, key_and_version

CHANGED_INSIDE = "was changed inside, for all that use it"  # of convert's notes
DEFAULT_ALBEDO = 0.8  # of faces without a material, in Cycles
LAMBERT = MODELS["lambert"].label
# By key of a group or type of a node: what turns off all layers above its diffuse reflection, and its light
DIFFUSE_ALONE: Mapping[str, Mapping[str, float]] = {
    SUBSURFACE.key: {"Specular": 0.0},
    PRINCIPLED.key: {"Specular IOR Level": 0.0, "Coat Weight": 0.0, "Sheen Weight": 0.0, "Emission Strength": 0.0},
    "BSDF_PRINCIPLED": {"Emission Strength": 0.0},
    "EMISSION": {"Strength": 0.0},
}
COLOR = {ROUGH_DIFFUSE.key: "Color", SUBSURFACE.key: "Color", PRINCIPLED.key: "Base Color"}
# Inputs that make more of a surface than diffuse reflection under a specular layer
NOT_PLAIN: Mapping[str, tuple[str, ...]] = {
    ROUGH_DIFFUSE.key: (),
    SUBSURFACE.key: ("Subsurface",),
    PRINCIPLED.key: ("Metallic", "Transmission Weight", "Subsurface Weight", "Coat Weight", "Sheen Weight"),
}
ROUGHNESS = {ROUGH_DIFFUSE.key: "Roughness", SUBSURFACE.key: "Roughness", PRINCIPLED.key: "Diffuse Roughness"}
# Lengths, in the unit of the character's own scene or in millimeters, of Blender's closures and our groups
LENGTHS = {"BSDF_PRINCIPLED": "Subsurface Scale", "SUBSURFACE_SCATTERING": "Scale", SUBSURFACE.key: "Scale"}
LENGTHS |= {PRINCIPLED.key: "Subsurface Scale"}

type Materials = Mapping[bpy.types.Material | None, bpy.types.Material]
"""Materials in place of a character's own; None stands for an empty slot."""


@dataclass(frozen=True)
class LookMaterials:
    """A character's materials in one look: `shown` in pictures, and `measured` without specular layer, coat, sheen and light."""

    shown: Materials
    measured: Materials


def converted(sources: Iterable[bpy.types.Material | None], scale: float, say: Callable[[str], None]) -> Materials:
    """Return copies of a character's materials in which our groups have taken the place of Blender's diffuse closures.

    `scale` is its length in meters, given that in its own scene's units: by so much lengths below the surface grow. `say` is told
    in a line what got lost.
    """
    result = {}
    for source in sources:
        name = source.name if source else "No Material"
        copy = own_copy(source, name) if source else _default(name)
        copy.use_fake_user = False
        for tree in trees(copy):
            _scale_lengths(tree, scale)
        for line in dict.fromkeys(convert.convert_materials([copy], 1.0).lines):
            if not line.endswith(CHANGED_INSIDE):  # which was said of the artist's groups; here it is a copy
                say(f"{name}: {line.removeprefix(f'{copy.name}: ')}")
        result[source] = copy
    return result


def in_model(given: Materials, label: str, sigma: float) -> LookMaterials:
    """Return `converted` materials with the reflectance model of that label, `sigma` its roughness."""

    def apply(tree: bpy.types.ShaderNodeTree) -> None:
        for node in closures(tree):
            key = key_and_version(node)[0]
            if key == SPECULAR_GROUP.key:
                node = _replace(tree, node, ROUGH_DIFFUSE, {"Color": "Color", "Normal": "Normal"})
                key = ROUGH_DIFFUSE.key
            if key in ROUGHNESS:
                _set(tree, node, ROUGHNESS[key], sigma)
                _set(tree, node, "Model", label)

    shown = _changed(given, label, apply)
    return LookMaterials(shown, _changed(shown, f"{label}, measured", diffuse_alone))


def under_highlight(given: Materials, say: Callable[[str], None]) -> LookMaterials:
    """Return `converted` materials as standard specular; `say` is told in a line what the highlight lacks of a specular layer."""
    for material in given.values():
        for node in (node for tree in trees(material) for node in closures(tree)):
            if key_and_version(node)[0] == PRINCIPLED.key and (lacking := _lacking(node)):
                say(f"{material.name}: standard specular has a highlight without {' and '.join(lacking)}")

    def apply(tree: bpy.types.ShaderNodeTree) -> None:
        for node in closures(tree):
            key = key_and_version(node)[0]
            if key in ROUGHNESS:
                _add_highlight(tree, node, key)

    shown = _changed(given, SPECULAR_GROUP.label, apply)
    return LookMaterials(shown, _changed(shown, f"{SPECULAR_GROUP.label}, measured", diffuse_alone))


def diffuse_alone(tree: bpy.types.ShaderNodeTree) -> None:
    """Turn off what is above the diffuse reflection in all of our groups in `tree`, and all light, which Cycles' surfaces cast."""
    for node in closures(tree):
        for name, value in DIFFUSE_ALONE.get(key_and_version(node)[0] or node.type, {}).items():
            _set(tree, node, name, value)


def highlight(graph: TreeGraph, node: bpy.types.Node, key: str) -> tuple[Number, Number]:
    """Return the weight k_s and the exponent n of the highlight that stands for the specular layer of a group's node."""
    default = Specular()
    if key == ROUGH_DIFFUSE.key:
        return default.specular, default.exponent
    ratio = graph.number(node.inputs["IOR"])
    root = (ratio - 1.0) / (ratio + 1.0)
    if key == SUBSURFACE.key:
        weight = graph.times(graph.number(node.inputs["Specular"]), root * root)
        return weight, _exponent(graph, graph.number(node.inputs["Specular Roughness"]))
    weight = graph.times(graph.number(node.inputs["Specular IOR Level"]), root * root * 2.0)
    for name in ("Metallic", "Transmission Weight"):
        weight = graph.less(weight, graph.number(node.inputs[name]))
    weight = graph.times(weight, graph.number(node.inputs["Alpha"]))
    return weight, _exponent(graph, graph.number(node.inputs["Roughness"]))


def _lacking(node: bpy.types.Node) -> list[str]:
    """Return what the specular layer of a Principled Rough Diffuse has that Blinn-Phong's highlight has not."""
    tint = node.inputs["Specular Tint"]
    lacking = ["tint"] if tint.is_linked or any(value != 1.0 for value in tint.default_value[:3]) else []
    for name, what in (("Anisotropic", "anisotropy"), ("Thin Film Thickness", "thin film")):
        lacking += [what] if node.inputs[name].is_linked or node.inputs[name].default_value else []
    return lacking


def _exponent(graph: TreeGraph, roughness: Number) -> Number:
    """Return n = 2 / alpha^2 - 2 with alpha = roughness^2, at most 10000."""
    if isinstance(roughness, float):
        return min(2.0 / max(roughness, 0.1) ** 4 - 2.0, 10000.0)
    return graph.minimum(2.0 / graph.maximum(roughness, 0.1) ** 4.0 - 2.0, 10000.0)


def _add_highlight(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, key: str) -> None:
    """Make the node of a group Lambert's model under Blinn-Phong's highlight in place of its specular layer."""
    graph = TreeGraph(tree)
    weight, exponent = highlight(graph, node, key)
    if _is_plain(graph, node, key):
        new = _replace(tree, node, SPECULAR_GROUP, {COLOR[key]: "Color", "Normal": "Normal"})
        _set(tree, new, "Specular", weight)
        _set(tree, new, "Exponent", exponent)
        return
    _set(tree, node, "Model", LAMBERT)
    _set(tree, node, "Specular" if key == SUBSURFACE.key else "Specular IOR Level", 0.0)
    if weight == 0.0:
        return
    above = materials.add_group(tree, SPECULAR_GROUP)
    above.parent, above.location = node.parent, (node.location.x, node.location.y - 300.0)
    above.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    graph.link(weight, above.inputs["Specular"])
    graph.link(exponent, above.inputs["Exponent"])
    if normal := graph.linked(node.inputs["Normal"]):
        graph.link(normal, above.inputs["Normal"])
    both = graph.node("ShaderNodeAddShader", {})
    graph.redirect(node.outputs["BSDF"], both)
    tree.links.new(node.outputs["BSDF"], both.socket.node.inputs[0])
    tree.links.new(above.outputs["BSDF"], both.socket.node.inputs[1])


def _is_plain(graph: TreeGraph, node: bpy.types.Node, key: str) -> bool:
    """Return whether a group's node is known to be no more than diffuse reflection and a specular layer."""
    if any(graph.number(node.inputs[name]) != 0.0 for name in NOT_PLAIN[key]):
        return False
    if key != PRINCIPLED.key:
        return True
    color = node.inputs["Emission Color"]
    is_dark = graph.number(node.inputs["Emission Strength"]) == 0.0
    is_dark |= not graph.linked(color) and not any(color.default_value[:3])
    return is_dark and graph.number(node.inputs["Alpha"]) == 1.0


def _changed(given: Materials, name: str, apply: Callable[[bpy.types.ShaderNodeTree], None]) -> Materials:
    """Return copies of `given` materials, called after what changes them, with `apply` done to all of their trees."""
    result = {}
    for source, material in given.items():
        result[source] = own_copy(material, f"{source.name if source else material.name} ({name})")
        for tree in trees(result[source]):
            apply(tree)
    return result


def _default(name: str) -> bpy.types.Material:
    material, node = materials.create_plain(name)
    node.inputs["Color"].default_value = (DEFAULT_ALBEDO, DEFAULT_ALBEDO, DEFAULT_ALBEDO, 1.0)
    return material


def _scale_lengths(tree: bpy.types.ShaderNodeTree, scale: float) -> None:
    for node in closures(tree):
        name = LENGTHS.get(key_and_version(node)[0] or node.type)
        if name and scale != 1.0:
            graph = TreeGraph(tree)
            graph.link(graph.times(graph.number(node.inputs[name]), scale), node.inputs[name])


def _set(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, name: str, value: Number | str) -> None:
    """Give the input `name` of `node` a value, in place of what is linked to it."""
    socket = node.inputs[name]
    for link in list(socket.links):
        tree.links.remove(link)
    TreeGraph(tree).link(value, socket)


def _replace(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node, group: Group, kept: Mapping[str, str]) -> bpy.types.Node:
    """Replace `node` by a node of `group`, whose inputs take those that are `kept`, by their names before; return it."""
    graph = TreeGraph(tree)
    new = materials.add_group(tree, group)
    new.parent, new.location, new.label = node.parent, node.location, node.label
    for old, name in kept.items():
        source = graph.linked(node.inputs[old])
        if source:
            graph.link(source, new.inputs[name])
        elif name != "Normal":  # which has no value of its own
            new.inputs[name].default_value = node.inputs[old].default_value
    for link in list(node.outputs["BSDF"].links):
        tree.links.new(new.outputs["BSDF"], link.to_socket).is_muted = link.is_muted
    tree.nodes.remove(node)
    return new
