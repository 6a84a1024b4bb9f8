# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that emit, in place of each closure, what its sockets get there: so a render holds the inputs of a material by pixel.

Mixes and sums of closures stay, so that a pixel has the mean of what is mixed there. Values are those that Cycles gives the nodes,
whatever feeds them.
"""

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import bpy

from ..material.closure_nodes import TreeGraph, closures, own_copy, trees
from ..nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from ..nodes.graph import Number, Value, key_and_version

ALBEDO, NORMAL, FACE_NORMAL, DIFFUSE, HIGHLIGHT = "albedo", "normal", "face normal", "diffuse", "highlight"
"""What a probe emits as red, green and blue: the albedo; N, and the normal of the face, both encoded; the fraction of the surface
that reflects diffusely, and the sum of what it emits itself; weight k_s and exponent n of Blinn-Phong's highlight.
"""


@dataclass(frozen=True)
class Base:
    """Names of sockets: the `color` of diffuse reflection, weights of what is there `instead`, and of what `passes` no light."""

    color: str
    instead: tuple[str, ...] = ()
    opacity: str = ""
    emission: tuple[str, str] | None = None


BASES: Mapping[str, Base] = {
    ROUGH_DIFFUSE.key: Base("Color"),
    SPECULAR_GROUP.key: Base("Color"),
    SUBSURFACE.key: Base("Color", ("Subsurface",)),
    PRINCIPLED.key: Base(
        "Base Color",
        ("Metallic", "Transmission Weight", "Subsurface Weight"),
        "Alpha",
        ("Emission Color", "Emission Strength"),
    ),
}


def probe(material: bpy.types.Material, channel: str) -> bpy.types.Material:
    """Return a copy of `material` that emits `channel` in place of our groups' closures, and nothing in place of others."""
    return emitting(material, channel, CHANNELS[channel])


def emitting(material: bpy.types.Material, name: str, channel: "Channel") -> bpy.types.Material:
    """Return a copy of `material`, called after the channel's `name`, that emits `channel` in place of each closure."""
    copy = own_copy(material, f"{material.name} ({name})")
    copy.cycles.emission_sampling = "NONE"
    for tree in trees(copy):
        graph = TreeGraph(tree)
        for node in closures(tree):
            shader = next(output for output in node.outputs if output.type == "SHADER")
            graph.redirect(shader, graph.emission(channel(graph, node, copy)))
    for node in copy.node_tree.nodes:
        if node.type == "OUTPUT_MATERIAL":
            for link in list(node.inputs["Volume"].links):
                copy.node_tree.links.remove(link)
    return copy


type Channel = Callable[[TreeGraph, bpy.types.Node, bpy.types.Material], Value]


def base_of(node: bpy.types.Node) -> Base | None:
    """Return what the sockets of a group's node mean; None for a closure that is none of our groups."""
    return BASES.get(key_and_version(node)[0])


def _fraction(graph: TreeGraph, node: bpy.types.Node, material: bpy.types.Material) -> Number:
    """Return the fraction of a closure that is diffuse reflection."""
    base = base_of(node)
    if base is None:
        return 0.0
    fraction: Number = 1.0
    for name in base.instead:
        fraction = graph.less(fraction, graph.number(node.inputs[name]))
    if base.opacity:
        fraction = graph.times(fraction, graph.number(node.inputs[base.opacity]))
    if material.use_backface_culling:  # Cycles shows what EEVEE leaves out
        fraction = graph.less(fraction, graph.geometry("Backfacing"))
    return fraction


def _albedo(graph: TreeGraph, node: bpy.types.Node, material: bpy.types.Material) -> Value:
    base = base_of(node)
    if base is None:
        return graph.vector(0.0, 0.0, 0.0)
    color = graph.clamp(graph.color(node.inputs[base.color]), 0.0, 1.0)
    return graph.scale(color, _fraction(graph, node, material))


def _normal(graph: TreeGraph, node: bpy.types.Node, material: bpy.types.Material) -> Value:
    if base_of(node) is None:
        return graph.vector(0.0, 0.0, 0.0)
    normal = graph.normalize(graph.linked(node.inputs["Normal"]) or graph.geometry("Normal"))
    return _encoded(graph, normal, _fraction(graph, node, material))


def _face_normal(graph: TreeGraph, node: bpy.types.Node, material: bpy.types.Material) -> Value:
    return _encoded(graph, graph.geometry("True Normal"), _fraction(graph, node, material))


def _encoded(graph: TreeGraph, normal: Value, fraction: Number) -> Value:
    """Return a normal as light, which is never negative; see `decoded`."""
    return graph.scale(normal * 0.5 + (0.5, 0.5, 0.5), fraction)


def decoded(rgb: array[float]) -> array[float]:
    """Return the normals of pixels that emit them."""
    return array("f", (2.0 * value - 1.0 for value in rgb))


def _diffuse(graph: TreeGraph, node: bpy.types.Node, material: bpy.types.Material) -> Value:
    base = base_of(node)
    names = ("Color", "Strength") if node.type == "EMISSION" else base.emission if base else None
    light: Number = 0.0
    if names:
        color, strength = names
        light = graph.dot(graph.color(node.inputs[color]), graph.vector(1.0, 1.0, 1.0))
        light = graph.times(light, graph.number(node.inputs[strength]))
    return graph.vector(_fraction(graph, node, material), light, 0.0)


def _highlight(graph: TreeGraph, node: bpy.types.Node, _material: bpy.types.Material) -> Value:
    if key_and_version(node)[0] != SPECULAR_GROUP.key:
        return graph.vector(0.0, 0.0, 0.0)
    return graph.vector(graph.number(node.inputs["Specular"]), graph.number(node.inputs["Exponent"]), 0.0)


CHANNELS: Mapping[str, Channel] = {
    ALBEDO: _albedo,
    NORMAL: _normal,
    FACE_NORMAL: _face_normal,
    DIFFUSE: _diffuse,
    HIGHLIGHT: _highlight,
}
