# SPDX-License-Identifier: GPL-3.0-or-later
"""What the materials of the open file have, read from Blender's nodes by a walk of its own, so that it can judge ours.

`read` gives a material's channels and its features; each feature lies on a channel.
"""

import array
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache

import bpy

from true_diffuse.scripts.census.values import (
    DEFAULT_UV_MAP,
    MISSING,
    PLACES,
    ImageUse,
    Place,
    Value,
    constant,
    moved,
    product,
    union,
)

type Stack = tuple[bpy.types.Node, ...]  # the group nodes around a place, outermost first

PROCEDURAL = {"TEX_NOISE", "TEX_VORONOI", "TEX_WAVE", "TEX_CHECKER", "TEX_GRADIENT", "TEX_MAGIC", "TEX_WHITE_NOISE", "TEX_BRICK"}
PROCEDURAL |= {"TEX_GABOR", "TEX_MUSGRAVE"}
OCCLUSION_GROUP = "glTF Material Output"
BLACK = 1e-6
# What each closure has on each channel; a number stands for itself. Principled's weights are in `_principled`.
CLOSURES: Mapping[str, Mapping[str, str | float]] = {
    "BSDF_DIFFUSE": {"base color": "Color", "normal": "Normal"},
    "BSDF_GLOSSY": {"base color": "Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_ANISOTROPIC": {"base color": "Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_METALLIC": {"base color": "Base Color", "roughness": "Roughness", "metallic": 1.0, "normal": "Normal"},
    "BSDF_GLASS": {"base color": "Color", "roughness": "Roughness", "transmission": 1.0, "normal": "Normal"},
    "BSDF_REFRACTION": {"base color": "Color", "roughness": "Roughness", "transmission": 1.0, "normal": "Normal"},
    "BSDF_TRANSLUCENT": {"base color": "Color", "transmission": 1.0, "normal": "Normal"},
    "BSDF_TRANSPARENT": {"alpha": 0.0},
    "BSDF_SHEEN": {"sheen": 1.0, "normal": "Normal"},
    "BSDF_TOON": {"base color": "Color", "normal": "Normal"},
    "BSDF_HAIR": {"base color": "Color"},
    "BSDF_HAIR_PRINCIPLED": {"base color": "Color"},
    "SUBSURFACE_SCATTERING": {"base color": "Color", "subsurface": 1.0, "normal": "Normal"},
    "EMISSION": {"emission": "Color"},
    "BACKGROUND": {"emission": "Color"},
    "EEVEE_SPECULAR": {"base color": "Base Color", "roughness": "Roughness", "emission": "Emissive Color", "normal": "Normal"},
    "HOLDOUT": {},
}


@dataclass(frozen=True)
class Feature:
    """A row of the table, and the channel by which it is judged."""

    row: str
    channel: str


@dataclass
class MaterialFacts:
    """What a material has; channels that it does not use are not in `channels`."""

    channels: dict[str, Value] = field(default_factory=dict)
    same_as: dict[str, list[Value]] = field(default_factory=dict)
    """What is as good as what a channel has: constants in place of images that are black or white everywhere."""
    features: list[Feature] = field(default_factory=list)
    closures: list[str] = field(default_factory=list)


@dataclass
class _Closures:
    """The closures of a surface, and how they are put together."""

    found: list[tuple[bpy.types.Node, Stack]] = field(default_factory=list)
    is_mixed: bool = False
    alpha: Value | None = None
    """Where a Transparent BSDF is mixed with the rest."""


def read(material: bpy.types.Material) -> MaterialFacts | None:
    """Return what a material has in Cycles, or in EEVEE where it has a surface there alone; None where it has none.

    Where EEVEE has an output of its own, what is there is as good.
    """
    tree = material.node_tree
    outputs = [tree.get_output_node(engine) for engine in ("CYCLES", "EEVEE")] if tree else []
    outputs = [output for output in outputs if output is not None and output.inputs["Surface"].is_linked]
    if not outputs:
        return None
    facts = _facts(material, outputs[0])
    if outputs[-1] != outputs[0]:
        for channel, what in _facts(material, outputs[-1]).channels.items():
            facts.same_as.setdefault(channel, []).append(what)
    if sum(node.type == "OUTPUT_MATERIAL" and node.inputs["Surface"].is_linked for node in tree.nodes) > 1:
        facts.features.append(Feature("Several outputs", "surface"))
    return facts


def _facts(material: bpy.types.Material, output: bpy.types.Node) -> MaterialFacts:
    """Return what the surface of one output has."""
    closures = _Closures()
    _collect(output.inputs["Surface"], (), closures)
    facts = MaterialFacts(closures=[node.type for node, _ in closures.found])
    parts = [_channels(node, stack) for node, stack in closures.found]
    for channel in dict.fromkeys(name for part in parts for name in part):
        values = [part[channel] for part in parts if channel in part]
        facts.channels[channel] = values[0] if len(closures.found) == 1 else union(values, "MIX_SHADER")
    if closures.alpha is not None:
        facts.channels["alpha"] = closures.alpha
    if occlusion := _occlusion(material.node_tree):
        facts.channels["occlusion"] = occlusion
    if material.use_backface_culling:
        facts.channels["culling"] = constant(1.0)
    metallic, alpha = facts.channels.get("metallic"), facts.channels.get("alpha")
    if metallic is not None and metallic.is_product and _largest(metallic) <= 0.0:
        facts.same_as["metallic"] = [constant(0.0)]
    if alpha is not None and alpha.is_product and _smallest(alpha) >= 1.0:
        facts.same_as["alpha"] = [constant(1.0)]
    facts.features = list(_features(facts.channels))
    if closures.is_mixed:
        facts.features.append(Feature("Mix or Add Shader", "surface"))
    if any(stack for _, stack in closures.found):
        facts.features.append(Feature("Group around a closure", "surface"))
    return facts


def _collect(socket: bpy.types.NodeSocket, stack: Stack, closures: _Closures) -> None:
    """Add the closures that feed a shader socket."""
    output, _, stack = _source(socket, stack)
    if output is None:
        return
    node = output.node
    if node.type == "MIX_SHADER":
        one, other = node.inputs[1], node.inputs[2]
        first, second = (_source(item, stack)[0] for item in (one, other))
        factor = value(node.inputs[0], stack)
        if factor.is_constant and factor.factor[0] in (0.0, 1.0):
            _collect(other if factor.factor[0] else one, stack, closures)
            return
        closures.is_mixed = True
        for clear, solid, alpha in ((first, other, factor), (second, one, _inverse(factor))):
            if clear is not None and clear.node.type == "BSDF_TRANSPARENT":
                closures.alpha = alpha
                _collect(solid, stack, closures)
                return
        _collect(one, stack, closures)
        _collect(other, stack, closures)
    elif node.type == "ADD_SHADER":
        closures.is_mixed = True
        for item in node.inputs:
            _collect(item, stack, closures)
    elif (node, stack) not in closures.found:
        closures.found.append((node, stack))


def _inverse(value: Value) -> Value:
    return constant(1.0 - value.factor[0]) if value.is_constant else value.but("MATH")


def _channels(node: bpy.types.Node, stack: Stack) -> dict[str, Value]:
    """Return what a closure has on each channel, as far as it uses it."""
    if node.type == "BSDF_PRINCIPLED":
        return _principled(node, stack)
    found: dict[str, Value] = {}
    for channel, socket in CLOSURES.get(node.type, {}).items():
        if isinstance(socket, float):
            found[channel] = constant(socket)
        elif socket in node.inputs:
            found[channel] = value(node.inputs[socket], stack)
    if "Strength" in node.inputs and "emission" in found:
        found["emission"] = product((found["emission"], value(node.inputs["Strength"], stack)))
    return {channel: what for channel, what in found.items() if channel != "normal" or not what.is_constant}


def _principled(node: bpy.types.Node, stack: Stack) -> dict[str, Value]:
    def get(name: str) -> Value:
        return value(node.inputs[name], stack)

    found = {"base color": get("Base Color"), "roughness": get("Roughness")}
    normal, alpha = get("Normal"), get("Alpha")
    if node.inputs["Normal"].is_linked and (normal.images or normal.attributes or normal.operations - {"NORMAL_MAP", "BUMP"}):
        found["normal"] = normal
    if not alpha.is_constant or alpha.factor[0] < 1.0:
        found["alpha"] = alpha
    emission = product((get("Emission Color"), get("Emission Strength")))
    weights = {
        "metallic": "Metallic",
        "coat": "Coat Weight",
        "sheen": "Sheen Weight",
        "transmission": "Transmission Weight",
        "anisotropy": "Anisotropic",
        "thin film": "Thin Film Thickness",
        "subsurface": "Subsurface Weight",
    }
    found |= {channel: get(name) for channel, name in weights.items()} | {"emission": emission}
    level, tint = get("Specular IOR Level"), get("Specular Tint")
    if level != constant(0.5) or tint != constant(1.0):
        found["specular"] = product((level, tint))
    optional = (*weights, "emission")
    return {key: what for key, what in found.items() if key not in optional or not _is_black(what)}


def _is_black(value: Value) -> bool:
    return (value.is_product and max(value.factor) <= BLACK) and (value.is_constant or not value.images)


def _occlusion(tree: bpy.types.NodeTree) -> Value | None:
    """Return what feeds the occlusion of the node group that Blender's glTF importer adds."""
    for node in tree.nodes:
        if node.type == "GROUP" and node.node_tree and node.node_tree.name.startswith(OCCLUSION_GROUP):
            socket = node.inputs.get("Occlusion")
            if socket and socket.is_linked:  # through a Mix node for the strength, which glTF has as a factor
                return replace(value(socket, ()), factor=(1.0, 1.0, 1.0), operations=frozenset())
    return None


def _source(socket: bpy.types.NodeSocket, stack: Stack) -> tuple[bpy.types.NodeSocket | None, bpy.types.NodeSocket, Stack]:
    """Return the output that feeds a socket, through groups, reroutes and muted nodes; or None and the socket with the value."""
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return None, socket, stack
        output, node = link.from_socket, link.from_node
        inner = None
        if node.type == "REROUTE":
            inner = node.inputs[0]
        elif node.mute:
            inner = next((item.from_socket for item in node.internal_links if item.to_socket == output), None)
            if inner is None:
                return None, output, stack
        elif node.type == "GROUP" and node.node_tree:
            result = next((item for item in node.node_tree.nodes if item.type == "GROUP_OUTPUT" and item.is_active_output), None)
            inner = _by_identifier(result.inputs, output.identifier) if result else None
            if inner is None:
                return None, output, stack
            stack = (*stack, node)
        elif node.type == "GROUP_INPUT" and stack:
            inner = _by_identifier(stack[-1].inputs, output.identifier)
            if inner is None:
                return None, output, stack
            stack = stack[:-1]
        if inner is None:
            return output, socket, stack
        socket = inner


def _by_identifier(sockets: bpy.types.bpy_prop_collection, identifier: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def value(socket: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Return what feeds a socket."""
    output, own, stack = _source(socket, stack)
    if output is None:
        default = getattr(own, "default_value", 0.0)
        return constant(default) if not isinstance(default, str) else Value()
    node = output.node
    match node.type:
        case "TEX_IMAGE":
            return _image(node, output, stack)
        case "VERTEX_COLOR":
            return Value(attributes=frozenset({node.layer_name}), operations=_alpha_of(output))
        case "ATTRIBUTE" if node.attribute_type == "GEOMETRY":
            return Value(attributes=frozenset({node.attribute_name}), operations=_alpha_of(output))
        case "RGB" | "VALUE":
            return constant(output.default_value)
        case "LIGHT_PATH" if output.name == "Is Camera Ray":  # what is looked at, as in the nodes for glTF's unlit materials
            return constant(1.0)
        case "MIX" | "MIX_RGB":
            return _mix(node, stack)
        case "MATH" if node.operation == "MULTIPLY":
            return product(value(item, stack) for item in node.inputs[:2])
        case "VECT_MATH" if node.operation == "MULTIPLY":
            return product(value(item, stack) for item in node.inputs[:2])
        case "VECT_MATH" if node.operation == "SCALE":
            return product((value(node.inputs[0], stack), value(node.inputs["Scale"], stack)))
        case "SEPARATE_COLOR" | "SEPRGB" | "SEPXYZ" if getattr(node, "mode", "RGB") == "RGB":
            return value(node.inputs[0], stack).channel("rgb"[list(node.outputs).index(output)])
        case "NORMAL_MAP":
            strength = value(node.inputs["Strength"], stack)
            return union((value(node.inputs["Color"], stack), strength), "NORMAL_MAP")
        case "GAMMA" if value(node.inputs["Gamma"], stack) == constant(1.0):
            return value(node.inputs["Color"], stack)
    inputs = [value(item, stack) for item in node.inputs if item.enabled and item.type != "SHADER"]
    return union(inputs, node.type)


def _alpha_of(output: bpy.types.NodeSocket) -> frozenset[str]:
    return frozenset({"ALPHA"}) if output.name == "Alpha" else frozenset()


def _mix(node: bpy.types.Node, stack: Stack) -> Value:
    if node.type == "MIX_RGB":
        factor, one, other = node.inputs[:3]
    else:
        enabled = [socket for socket in node.inputs if socket.enabled]
        factor, one, other = enabled[0], enabled[1], enabled[2]
    amount, first, second = (value(socket, stack) for socket in (factor, one, other))
    is_color = node.type == "MIX_RGB" or node.data_type == "RGBA"
    blend = node.blend_type if is_color else "MIX"
    if amount == constant(0.0):
        return first
    if amount == constant(1.0) and blend in ("MULTIPLY", "MIX"):
        return product((first, second)) if blend == "MULTIPLY" else second
    return union((amount, first, second), "MIX")


def _image(node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    if node.image is None:
        return Value(operations=frozenset({MISSING}))
    uv_map, places = _placement(node.inputs["Vector"], stack)
    channel = "a" if output.name == "Alpha" else "rgb"
    operations = frozenset() if places else frozenset({"COORDINATES"})
    return Value(images=frozenset({ImageUse(node.image.name, channel, uv_map, places)}), operations=operations)


def _placement(socket: bpy.types.NodeSocket, stack: Stack) -> tuple[str, tuple[Place, ...] | None]:
    """Return the UV map that an image reads and where; None in place of the latter for other coordinates than UV's."""
    output, own, stack = _source(socket, stack)
    if output is None:
        return DEFAULT_UV_MAP, PLACES if own.node.type == "TEX_IMAGE" else None
    node = output.node
    if node.type == "TEX_COORD" and output.name == "UV":
        return DEFAULT_UV_MAP, PLACES
    if node.type == "UVMAP":
        return node.uv_map, PLACES
    if node.type == "ATTRIBUTE":
        return node.attribute_name, PLACES
    if node.type == "MAPPING":
        uv_map, places = _placement(node.inputs["Vector"], stack)
        given = [value(node.inputs[name], stack) for name in ("Location", "Rotation", "Scale") if name in node.inputs]
        if not all(item.is_constant for item in given):
            return uv_map, None
        location, rotation, scale = (
            value(node.inputs[name], stack).factor if name in node.inputs else (0.0, 0.0, 0.0)
            for name in ("Location", "Rotation", "Scale")
        )
        sine, cosine = math.sin(rotation[2]), math.cos(rotation[2])

        def point(u: float, v: float) -> Place:
            u, v = u * scale[0], v * scale[1]
            return cosine * u - sine * v + location[0], sine * u + cosine * v + location[1]

        def texture(u: float, v: float) -> Place:
            u, v = u - location[0], v - location[1]
            u, v = cosine * u + sine * v, -sine * u + cosine * v
            return u / (scale[0] or 1.0), v / (scale[1] or 1.0)

        if node.vector_type == "NORMAL" or any(abs(angle) > 1e-6 for angle in rotation[:2]):
            return uv_map, None
        if node.vector_type == "VECTOR":
            location = (0.0, 0.0, 0.0)
        return uv_map, moved(texture if node.vector_type == "TEXTURE" else point, places)
    return DEFAULT_UV_MAP, None


def _features(channels: Mapping[str, Value]) -> Iterator[Feature]:
    """Yield the features that lie on the channels."""
    color = channels.get("base color")
    if color is not None:
        yield Feature(f"Base color: {_color_kind(color)}", "base color")
    for channel, what in channels.items():
        if channel in ("base color",):
            continue
        for row in _rows(channel, what):
            yield Feature(row, channel)
    for channel, what in channels.items():
        if what.operations & PROCEDURAL:
            yield Feature("Procedural texture", channel)
        if MISSING in what.operations:
            yield Feature("Image node without an image", channel)
        if any(use.places != PLACES for use in what.images) and channel != "base color":
            yield Feature("Mapping of another image", channel)
    maps = {use.uv_map for what in channels.values() for use in what.images}
    if len(maps) > 1:
        for channel, what in channels.items():
            if any(use.uv_map != DEFAULT_UV_MAP for use in what.images):
                yield Feature("Several UV maps", channel)


def _color_kind(color: Value) -> str:
    if color.is_constant:
        return "plain"
    if color.operations & PROCEDURAL:
        return "procedural"
    if any(use.places != PLACES for use in color.images):
        return "image through Mapping"
    if color.images and color.is_product and color.factor == (1.0, 1.0, 1.0) and not color.attributes:
        return "image alone"
    if color.images:
        return "image times a color, or mixed" if color.is_product else "image through other nodes"
    if color.attributes and color.is_product:
        return "vertex color, unnamed" if "" in color.attributes else "vertex color, named"
    return "other nodes"


def _rows(channel: str, what: Value) -> Iterator[str]:
    match channel:
        case "roughness":
            if not what.is_constant:
                yield "Roughness map"
        case "normal":
            if "NORMAL_MAP" in what.operations:
                yield "Normal map"
            if "BUMP" in what.operations:
                yield "Bump"
            if not what.operations & {"NORMAL_MAP", "BUMP"}:
                yield "Normal by other nodes"
        case "metallic":
            if what.is_constant:
                yield "Metallic: 1" if what.factor[0] >= 1.0 else "Metallic: below 1"
            else:
                yield "Metallic: texture with metal" if _largest(what) > 0.0 else "Metallic: texture that is 0 everywhere"
        case "alpha":
            if what.is_constant:
                yield "Alpha: value"
            elif what.images and what.is_product and _smallest(what) >= 1.0:
                yield "Alpha: image that is 1 everywhere"
            else:
                yield "Alpha: image with holes or blended"
        case "emission":
            yield "Emission: value" if what.is_constant else "Emission: image or other nodes"
        case "occlusion":
            yield "Occlusion map"
        case "culling":
            yield "Backface Culling"
        case "specular":
            yield "Specular level or tint"
        case _:
            yield channel.capitalize()


def _largest(what: Value) -> float:
    return max(what.factor) * max((limits(use.image, use.channel)[1] for use in what.images), default=1.0)


def _smallest(what: Value) -> float:
    return min(what.factor) * min((limits(use.image, use.channel)[0] for use in what.images), default=0.0)


@cache
def limits(name: str, channel: str) -> tuple[float, float]:
    """Return the smallest and largest value of a channel of an image, 0 and 1 where it has no pixels."""
    image = bpy.data.images[name]
    if not image.size[0]:
        return 0.0, 1.0
    pixels = array.array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(pixels)
    count = image.channels
    if channel == "a" and (count < 4 or image.alpha_mode == "NONE"):
        return 1.0, 1.0
    indices = range(min(3, count)) if channel == "rgb" else (min("rgba".index(channel), count - 1),)
    strided = [pixels[index::count] for index in indices]
    return min(map(min, strided)), max(map(max, strided))
