# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads from a Blender material which of our groups is its surface, with what values, and what feeds them."""

import re
import struct
from collections.abc import Callable, Sequence
from typing import NamedTuple

import bpy

from ..models.color import LUMINANCE
from ..nodes import GROUPS, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group
from ..nodes.graph import stamp_of
from .surface import Attribute, Image, Rgb, Setting, Source, Surface, rgb

WRAPS = {"REPEAT": "periodic", "EXTEND": "clamp", "CLIP": "black", "MIRROR": "mirror"}
DEFAULT_UV, DEFAULT_COLOR = "st", "displayColor"  # what Blender calls the UV map and the color attribute in use, in USD
# Sockets whose textures and attributes are carried; those of other sockets leave the socket's own value.
CARRIED = {
    ROUGH_DIFFUSE.key: ("Color", "Roughness"),
    SUBSURFACE.key: ("Color", "Roughness", "Subsurface", "Subsurface Radius", "Specular", "Specular Roughness"),
    SPECULAR_GROUP.key: ("Color",),
}
NUMBERS = {"Roughness", "Subsurface", "Specular", "Specular Roughness"}


class Names(NamedTuple):
    """How images and attributes are called where they go. `image` raises Lost where its file is missing."""

    image: Callable[[bpy.types.Image], str]
    attribute: Callable[[str], str]


class Lost(Exception):
    """Something of a material that USD cannot hold; the message says what."""


def group_node(material: bpy.types.Material) -> tuple[bpy.types.Node, Group, int] | None:
    """Return the node of one of our groups that is the surface of `material`, for any engine, with the group and its version."""
    tree = material.node_tree
    if tree is None:
        return None
    for target in ("ALL", "EEVEE", "CYCLES"):
        output = tree.get_output_node(target)
        source = feeding(output.inputs["Surface"]) if output else None
        node = source.node if source else None
        if node and not node.mute:
            key, version = stamp_of(node)
            group = next((group for group in GROUPS if group.key == key), None)
            if group:
                return node, group, int(version) if version.isdecimal() else group.version
    return None


def read(node: bpy.types.Node, group: Group, version: int, names: Names) -> tuple[Surface, list[str]]:
    """Return what the group node says, and what of it USD cannot hold, in words."""
    inputs: dict[str, Setting] = {socket.name: _default(socket.default) for socket in group.inputs}
    fed: dict[str, Source] = {}
    lost = []
    for socket in node.inputs:
        inputs[socket.name] = plain(socket.default_value)
        if feeding(socket) is None:
            if socket.is_linked:
                lost.append(f"{socket.name}: the link to it is broken")
            continue
        try:
            source = _source(socket, names)
            if not isinstance(source, (Image, Attribute)):
                inputs[socket.name] = _fitting(source, inputs[socket.name])
            elif socket.name not in CARRIED[group.key] or (socket.name in NUMBERS and isinstance(source, Attribute)):
                raise Lost("what feeds it")
            else:
                fed[socket.name] = source
        except Lost as error:
            lost.append(f"{socket.name}: {error} cannot be carried, its own value is written instead")
    return Surface(group.key, version, inputs, fed), lost


def feeding(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output that feeds `socket`, past reroutes; None where nothing does."""
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None or link.from_node.type != "REROUTE":
            return link.from_socket if link else None
        socket = link.from_node.inputs[0]


def read_input(socket: bpy.types.NodeSocket, names: Names) -> tuple[Setting, Source | None]:
    """Return a socket's value, its own or that of the constant which feeds it, and the image or attribute that takes its place."""
    own = plain(socket.default_value)
    if not socket.is_linked:
        return own, None
    try:
        source = _source(socket, names)
        if isinstance(source, (Image, Attribute)):
            return own, source
        return _fitting(source, own), None
    except Lost:
        return own, None


def read_number(socket: bpy.types.NodeSocket, names: Names) -> float:
    """Return a number's socket's value, or that of the constant which feeds it."""
    value, _ = read_input(socket, names)
    if not isinstance(value, (int, float)):
        raise TypeError(f"{socket.name} is {value!r}, not a number")
    return float(value)


def read_color(socket: bpy.types.NodeSocket, names: Names) -> tuple[Rgb, Source | None]:
    """Return what read_input does of a color socket."""
    value, source = read_input(socket, names)
    return rgb(value), source


def plain(value: Setting | Sequence[float]) -> Setting:
    """Return a socket's value as plain numbers, each the shortest decimal that is the same 32-bit float."""
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float)):
        return _shortest(value)
    return tuple(_shortest(component) for component in value)


def _default(value: float | tuple[float, ...] | str | None) -> Setting:
    return 0.0 if value is None else value


def _shortest(value: float) -> float:
    single = struct.pack("f", value)
    for digits in range(6, 9):
        short = float(f"{value:.{digits}g}")
        if struct.pack("f", short) == single:
            return short
    return float(f"{value:.9g}")


def _fitting(value: Setting, shape: Setting) -> Setting:
    """Return a constant that feeds a socket of another `shape` as Blender converts it."""
    if isinstance(value, str) or isinstance(shape, str):
        raise Lost("a menu's link")
    numbers = value if isinstance(value, tuple) else (float(value),) * 3
    if isinstance(shape, tuple):
        return (*numbers, 1.0)[: len(shape)]
    weights = LUMINANCE if len(numbers) == 4 else (1.0 / 3.0,) * 3
    return sum(weight * number for weight, number in zip(weights, numbers, strict=False))


def _source(socket: bpy.types.NodeSocket, names: Names) -> Source | Setting:
    """Return what feeds `socket`. Raises Lost where that is more than an image, an attribute or a constant, times a number."""
    output = feeding(socket)
    if output is None:
        raise Lost("a broken link")
    node = output.node
    if node.mute:
        raise Lost(f"the muted node {node.bl_label}")
    match node.bl_idname, output.name:
        case "ShaderNodeValue" | "ShaderNodeRGB", _:
            return plain(output.default_value)
        case "ShaderNodeTexImage", "Color":
            return _image(node, names)
        case "ShaderNodeAttribute", "Color" if node.attribute_type == "GEOMETRY":
            return Attribute(names.attribute(node.attribute_name))
        case "ShaderNodeVertexColor", "Color":
            return Attribute(names.attribute(node.layer_name) if node.layer_name else DEFAULT_COLOR)
        case "ShaderNodeVectorMath", _ if node.operation == "SCALE" and not node.inputs["Scale"].is_linked:
            return _scaled(_source(node.inputs[0], names), _shortest(node.inputs["Scale"].default_value))
    raise Lost(f"{output.name} of the node {node.bl_label}")


def _scaled(source: Source | Setting, factor: float) -> Source | Setting:
    match source:
        case Image():
            return Image(source.file, source.is_color, source.primvar, source.wrap, source.factor * factor)
        case Attribute():
            return Attribute(source.primvar, source.factor * factor)
        case tuple():
            return tuple(component * factor for component in source)
        case str():
            raise Lost("a menu's link")
    return source * factor


def _image(node: bpy.types.Node, names: Names) -> Image:
    image = node.image
    if image is None:
        raise Lost("an image node without an image")
    if image.source not in {"FILE", "GENERATED"}:
        raise Lost(f"the image {image.name}, a {image.source.lower()},")
    is_data = image.colorspace_settings.name in {"Non-Color", "Linear Rec.709"} or image.is_float
    return Image(names.image(image), not is_data, _uv_map(node, names), WRAPS[node.extension])


def _uv_map(node: bpy.types.Node, names: Names) -> str:
    coordinate = feeding(node.inputs["Vector"])
    if coordinate is None or (coordinate.node.bl_idname == "ShaderNodeTexCoord" and coordinate.name == "UV"):
        return DEFAULT_UV
    if coordinate.node.bl_idname == "ShaderNodeUVMap":
        return names.attribute(coordinate.node.uv_map) if coordinate.node.uv_map else DEFAULT_UV
    raise Lost(f"an image placed by {coordinate.name} of the node {coordinate.node.bl_label}")


def identifier(name: str) -> str:
    """Return the name that Blender gives in USD to what is called `name`."""
    name = re.sub(r"\W", "_", name)
    return f"_{name}" if not name or name[0].isdigit() else name
