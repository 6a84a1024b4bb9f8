# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a Blender material into a `Surface`: the group that makes its surface, the values of its sockets, and what is linked."""

import re
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import bpy

from ..models.color import LUMINANCE
from ..nodes import GROUPS, Group
from ..nodes.graph import key_and_version
from .links import Place, upstream
from .read_closures import ClosureReader, material_surface
from .surface import Attribute, GroupSurface, Image, Loss, Rgb, Setting, Source, Surface, rgb
from .upgrade import current_name, current_value

# By the Extension of an image node
WRAPS = {"REPEAT": "periodic", "EXTEND": "clamp", "CLIP": "black", "MIRROR": "mirror"}
DEFAULT_UV, DEFAULT_COLOR = "st", "displayColor"  # names in USD of the active UV map and color attribute


class Names(NamedTuple):
    """How a target names images, and attributes and UV maps. `image` raises UnsupportedInput where it has no file."""

    image: Callable[[bpy.types.Image], str]
    attribute: Callable[[str], str]


class UnsupportedInput(Exception):
    """A link to more than an image, a color attribute or a constant times a constant; the message describes its source."""


def group_nodes(material: bpy.types.Material) -> Iterator[tuple[bpy.types.Node, Group, int]]:
    """Yield the nodes of our groups that the surface of `material` comes from in any engine, each with its group and version.

    The nearest to the output is first; those behind mixes, sums and the artist's own groups follow.
    """
    groups = {group.key: group for group in GROUPS}
    tree = material.node_tree
    outputs = [tree.get_output_node(target) for target in ("ALL", "EEVEE", "CYCLES")] if tree else []
    for output in dict.fromkeys(filter(None, outputs)):
        for place in upstream(Place(output.inputs["Surface"])):
            key, version = key_and_version(place.node)
            if key in groups and not place.node.mute:
                yield place.node, groups[key], int(version) if version.isdecimal() else groups[key].version


def group_node(material: bpy.types.Material) -> tuple[bpy.types.Node, Group, int] | None:
    """Return the first of `group_nodes`; None where there is none."""
    return next(group_nodes(material), None)


def read(node: bpy.types.Node, group: Group, version: int, names: Names) -> GroupSurface:
    """Return the surface that `node`, of a `version` of `group`, describes, with the names and entries of this version.

    Inputs that an older version lacks have their defaults.
    """
    inputs: dict[str, Setting] = {socket.name: 0.0 if socket.default is None else socket.default for socket in group.inputs}
    linked: dict[str, Source] = {}
    unreadable: dict[str, str] = {}
    for socket in node.inputs:
        name = current_name(socket.name)
        try:
            value, source = _value_and_source(socket, names)
            if source:
                linked[name] = source
        except UnsupportedInput as error:
            value, unreadable[name] = plain(socket.default_value), str(error)
        inputs[name] = current_value(name, value)
    return GroupSurface(group.key, inputs, version, linked, unreadable)


def linked_output(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output linked to `socket`, None where there is none; muted and invalid links do not count."""
    return next((link.from_socket for link in socket.links if link.is_valid and not link.is_muted), None)


def source_socket(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output linked to `socket`, through reroutes; None where there is none."""
    output = linked_output(socket)
    while output is not None and output.node.type == "REROUTE":
        output = linked_output(output.node.inputs[0])
    return output


def read_input(socket: bpy.types.NodeSocket, names: Names) -> tuple[Setting, Source | None]:
    """Return a socket's value, which is that of a constant linked to it if any, and the image or attribute linked to it."""
    try:
        return _value_and_source(socket, names)
    except UnsupportedInput:
        return plain(socket.default_value), None


def _value_and_source(socket: bpy.types.NodeSocket, names: Names) -> tuple[Setting, Source | None]:
    """Return what `read_input` does; raises UnsupportedInput where the link has another source."""
    own = plain(socket.default_value)
    if all(link.is_muted for link in socket.links):
        return own, None
    source = _source(socket, names)
    return (own, source) if isinstance(source, (Image, Attribute)) else (_converted(source, own), None)


def read_number(socket: bpy.types.NodeSocket, names: Names) -> float:
    """Return the value of a number socket as `read_input` does; raises TypeError where it is of another type."""
    value, _ = read_input(socket, names)
    if not isinstance(value, (int, float)):
        raise TypeError(f"{socket.name} is {value!r}, not a number")
    return float(value)


def read_color(socket: bpy.types.NodeSocket, names: Names) -> tuple[Rgb, Source | None]:
    """Return the color, and the image or attribute, of a color socket as `read_input` does."""
    value, source = read_input(socket, names)
    return rgb(value), source


def plain(value: Setting | Sequence[float]) -> Setting:
    """Return a socket's value with each 32-bit float as the shortest decimal number that rounds to it."""
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float)):
        return _shortest(value)
    return tuple(_shortest(component) for component in value)


def _shortest(value: float) -> float:
    single = struct.pack("f", value)
    for digits in range(6, 9):
        short = float(f"{value:.{digits}g}")
        if struct.pack("f", short) == single:
            return short
    return float(f"{value:.9g}")


def _converted(value: Setting, shape: Setting) -> Setting:
    """Return the value of a constant linked to a socket whose own value is `shape`, converted between types as Blender does."""
    if isinstance(value, str) or isinstance(shape, str):
        raise UnsupportedInput("an entry of a menu")
    numbers = value if isinstance(value, tuple) else (float(value),) * 3
    if isinstance(shape, tuple):
        return (*numbers, 1.0)[: len(shape)]
    weights = LUMINANCE if len(numbers) == 4 else (1.0 / 3.0,) * 3
    return sum(weight * number for weight, number in zip(weights, numbers, strict=False))


def _source(socket: bpy.types.NodeSocket, names: Names) -> Source | Setting:
    """Return the image, attribute or constant linked to `socket`. Raises UnsupportedInput where the link has another source."""
    output = source_socket(socket)
    if output is None:
        raise UnsupportedInput("a broken link")
    node = output.node
    if node.mute:
        raise UnsupportedInput(f"the muted node {node.bl_label}")
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
    raise UnsupportedInput(f"the output {output.name} of the node {node.bl_label}")


def _scaled(source: Source | Setting, factor: float) -> Source | Setting:
    match source:
        case Image():
            return Image(source.file, source.is_color, source.primvar, source.wrap, source.factor * factor)
        case Attribute():
            return Attribute(source.primvar, source.factor * factor)
        case tuple():
            return tuple(component * factor for component in source)
        case str():
            raise UnsupportedInput("an entry of a menu")
    return source * factor


def _image(node: bpy.types.Node, names: Names) -> Image:
    image = node.image
    if image is None:
        raise UnsupportedInput("an image node without an image")
    if image.source not in {"FILE", "GENERATED"}:
        raise UnsupportedInput(f"the image {image.name} (a {image.source.lower()})")
    is_data = image.colorspace_settings.name in {"Non-Color", "Linear Rec.709"} or image.is_float
    return Image(names.image(image), not is_data, _uv_map(node, names), WRAPS[node.extension])


def _uv_map(node: bpy.types.Node, names: Names) -> str:
    coordinate = source_socket(node.inputs["Vector"])
    if coordinate is None or (coordinate.node.bl_idname == "ShaderNodeTexCoord" and coordinate.name == "UV"):
        return DEFAULT_UV
    if coordinate.node.bl_idname == "ShaderNodeUVMap":
        return names.attribute(coordinate.node.uv_map) if coordinate.node.uv_map else DEFAULT_UV
    raise UnsupportedInput(f"an image mapped by the output {coordinate.name} of the node {coordinate.node.bl_label}")


def identifier(name: str) -> str:
    """Return `name` as Blender's USD exporter writes it: an identifier of letters, digits and underscores."""
    name = re.sub(r"\W", "_", name)
    return f"_{name}" if not name or name[0].isdigit() else name


@dataclass
class Reading:
    """A material read into a surface."""

    surface: Surface
    losses: list[Loss] = field(default_factory=list)
    """What the surface does not hold."""
    notes: list[str] = field(default_factory=list)
    """What a file that is written once cannot follow: animated values."""
    images: dict[str, bpy.types.Image] = field(default_factory=dict)
    """The images that expressions name."""
    places: dict[str, Place] = field(default_factory=dict)
    """For each parameter that one input alone gives, that input."""


def read_surface(material: bpy.types.Material, unit: float = 1.0, target: str = "ALL") -> Reading:
    """Return the surface that `material` has at its output for `target`: ALL, EEVEE or CYCLES.

    `unit` is the scene's unit in meters (unit_settings.scale_length). What cannot be read is in the losses, with what takes its
    place; nothing is left out unsaid.
    """
    reader = ClosureReader(unit)
    surface = material_surface(material, target, reader)
    losses = list(dict.fromkeys(reader.losses))
    notes = [f"{what} ({node})" for node, what in reader.nodes.notes]
    return Reading(surface, losses, notes, reader.nodes.images, reader.places)
