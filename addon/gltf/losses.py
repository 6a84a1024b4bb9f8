# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a material is not in its glTF file, besides what feeds the inputs that are written (`inputs.py`)."""

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING

import bpy

from ..blender import fcurves
from ..material.links import Place, source, upstream
from ..material.read import shown
from ..material.revert import is_ours
from ..material.surface import Loss
from ..material.upgrade import current_name
from .inputs import COLORS, CONSTANTS, NORMALS, NUMBERS, OWN_VALUE
from .stand_in import Replaced, StandIn

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import Material

# Inputs whose layer is lost where the exporter has not written its extension
LAYERS: Mapping[str, str] = {
    "Subsurface Weight": "",
    "Transmission Weight": "KHR_materials_transmission",
    "Coat Weight": "KHR_materials_clearcoat",
    "Sheen Weight": "KHR_materials_sheen",
    "Anisotropic": "KHR_materials_anisotropy",
    "Thin Film Thickness": "KHR_materials_iridescence",
}
# Inputs that glTF fixes: their values there, and the weight without which they do not count
FIXED: Mapping[str, tuple[tuple[float, ...], str]] = {
    "Coat IOR": ((1.5,), "Coat Weight"),
    "Coat Tint": ((1.0, 1.0, 1.0), "Coat Weight"),
}
# Inputs of ours with a place in glTF, or whose layer is said to be lost
PLACED = COLORS | NUMBERS | NORMALS | CONSTANTS | LAYERS.keys() | FIXED.keys()
PLACED |= {"Diffuse Roughness", "Color", "Specular", "Specular Roughness", "Anisotropic Rotation", "Tangent", "Thin Film IOR"}
PLACED |= {"Subsurface", "Subsurface Radius", "Subsurface Scale", "Subsurface IOR", "Subsurface Anisotropy", "Scale"}


def is_used(socket: bpy.types.NodeSocket) -> bool:
    """Return whether a weight is linked or above 0."""
    return socket.is_linked or socket.default_value > 0.0


def of_layers(gltf_material: "Material", replaced: Replaced) -> Iterator[Loss]:
    """Yield a loss for each layer that a material has and glTF has not."""
    inputs = replaced.principled.inputs
    for name, extension in LAYERS.items():
        if is_used(inputs[name]) and extension not in gltf_material.extensions:
            yield Loss(name, replaced.label, "the layer", "what lies below is written")
    for name, (neutral, weight) in FIXED.items():
        value = inputs[name].default_value
        own = tuple(value)[:3] if inputs[name].type == "RGBA" else (value,)
        if is_used(inputs[weight]) and (
            inputs[name].is_linked or any(abs(a - b) > 1e-6 for a, b in zip(own, neutral, strict=True))
        ):
            yield Loss(name, replaced.label, "another value than glTF's", f"{neutral[0]:g} is meant")


def of_node(replaced: Replaced, moving: Collection[str]) -> Iterator[Loss]:
    """Yield a loss for each link without a place in glTF, and for each animated input but those that are `moving` there, too."""
    node = replaced.node
    for socket in node.inputs:
        if socket.is_linked and current_name(socket.name) not in PLACED:
            yield Loss(socket.name, replaced.label, "the link", OWN_VALUE)
    animated = {fcurves.input_of(curve) for curve in fcurves.of_node(node.id_data, node)}
    frame = bpy.context.scene.frame_current
    names = [node.inputs[index].name for index in sorted(index for index in animated if index is not None)]
    for name in names:
        if name not in moving:
            yield Loss(name, replaced.label, "animation", f"the value at frame {frame} is written")


def of_animation(material: bpy.types.Material, moving: Collection[str]) -> Iterator[Loss]:
    """Yield a loss for each node beside or behind our groups that is keyed or driven, but by the paths `moving`."""
    target, frame = shown(material), bpy.context.scene.frame_current
    end = material.node_tree.get_output_node(target) if target else None
    for place in upstream(Place(end.inputs["Surface"])) if end else ():
        own = [] if is_ours(place.node) else [place.socket]
        fed = [source(inner).socket for inner in place.inputs()]
        groups = [socket for socket in fed if not socket.is_output and not is_ours(socket.node)]
        for socket in own + groups:
            curves = fcurves.of_node(socket.id_data, socket.node)
            paths = {curve.data_path for curve in curves if _is_of(curve, socket)}
            if any(f"node_tree.{path}" not in moving or socket.id_data != material.node_tree for path in paths):
                yield Loss("", socket.node.label or socket.node.name, "animation", f"the value at frame {frame} is written")


def _is_of(curve: bpy.types.FCurve, socket: bpy.types.NodeSocket) -> bool:
    """Return whether a curve of a node changes an input, or, of an output, what the node itself says."""
    index = fcurves.input_of(curve)
    return index is None if socket.is_output else index is not None and socket.node.inputs[index] == socket


def of_output(gltf_material: "Material", stand_in: StandIn, written: bpy.types.Node | None) -> Iterator[Loss]:
    """Yield a loss where the node `written`, a Principled BSDF, is not all of a material; None where there is none."""
    end = output(stand_in)
    place = closure(Place(end.inputs["Surface"]))
    if written is None and place.node.bl_idname != "ShaderNodeEmission":
        what = f"the node {place.node.bl_label}" if place.socket.is_output else "a surface that nothing gives"
        yield Loss("", place.label, what, "glTF's default is written")
    elif written and place.node != written:
        yield Loss("", place.label, f"the node {place.node.bl_label}", f"{written.label or written.name} alone is written")
    if end.inputs["Displacement"].is_linked:
        yield Loss("", end.name, "displacement", "the mesh is written as it is")
    if end.inputs["Volume"].is_linked and "KHR_materials_volume" not in gltf_material.extensions:
        yield Loss("", end.name, "the volume", "the surface alone is written")


def output(stand_in: StandIn) -> bpy.types.Node:
    """Return the material output that the exporter reads."""
    nodes = stand_in.material.node_tree.nodes
    return next(node for node in nodes if node.type == "OUTPUT_MATERIAL" and node.is_active_output)


def emissions(place: Place) -> list[Place]:
    """Return the emissions beside the closure of an input."""
    origin = source(place)
    if origin.socket.is_output and origin.node.bl_idname == "ShaderNodeAddShader":
        return [*emissions(origin.input(0)), *emissions(origin.input(1))]
    return [origin] if origin.node.bl_idname == "ShaderNodeEmission" else []


def closure(place: Place) -> Place:
    """Return where a closure comes from, below sums with an emission, which the exporter writes."""
    origin = source(place)
    if origin.socket.is_output and origin.node.bl_idname == "ShaderNodeAddShader":
        terms = [closure(origin.input(index)) for index in (0, 1)]
        others = [term for term in terms if term.node.bl_idname != "ShaderNodeEmission"]
        if len(others) == 1:
            return others[0]
    return origin
