# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what feeds an input of Blender's nodes into an expression, through groups, reroutes and muted nodes.

READERS holds a function for each node; what the nodes compute is in `node_formulas.py`.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import bpy

from ..blender import color_spaces, fcurves
from . import node_formulas as formulas
from . import spectra
from .expression import (
    Attribute,
    Bump,
    Constant,
    Coordinate,
    Expression,
    Image,
    ImageTexture,
    NormalMap,
    SkyTexture,
    UvMap,
    apply,
    as_kind,
    number,
    triple,
)
from .links import Place, is_nothing, is_used, source, trail
from .operations import Value
from .preetham import preetham
from .sky import SMALLEST_SUN, Atmosphere, Sky, SunDisc, placed_sun
from .textures import TEXTURES, operation_name

NUMBERS, TRIPLES = {"VALUE", "INT", "BOOLEAN"}, {"RGBA", "VECTOR"}
OWN_NORMAL = Coordinate("normal")
FLAT = (0.5, 0.5, 1.0)  # the color of a normal map where the normal is the surface's own
INTERVALS = 256  # of the tables that Cycles has of curves and color ramps
WITHOUT_ALPHA = (8, 24, 96)  # bits of a pixel: gray and RGB of bytes, RGB of floats
ANIMATED = "keyed or driven: its value at this frame counts"


class UnsupportedInput(Exception):
    """A node that expressions do not have; `node` is its label, `what` describes it."""

    def __init__(self, node: str, what: str) -> None:
        super().__init__(f"{what} ({node})")
        self.node, self.what = node, what


class NodeReader:
    """Reads expressions of materials that do not change meanwhile.

    Collects the `images` that they name, by full name, and `notes`: labels of nodes with what the user should know of each.
    """

    def __init__(self, ray: str = "Is Camera Ray") -> None:
        """`ray` is the output of the node Light Path that is 1."""
        self.ray = ray
        self.images: dict[str, bpy.types.Image] = {}
        self.notes: list[tuple[str, str]] = []
        self._read: dict[Place, Expression] = {}
        self._folded: dict[tuple[bpy.types.Node, tuple[bpy.types.Node, ...]], bool] = {}

    def expression(self, place: Place) -> Expression:
        """Return what feeds an input, of the input's kind, or its own value. Raises UnsupportedInput.

        Where an input whose value Blender does not show is not linked, that is its own value, for a normal 0: the surface's own.
        """
        passed = trail(place)
        origin = passed[-1]
        for each in (place, origin):
            if each.socket.type not in NUMBERS | TRIPLES:
                raise UnsupportedInput(each.label, f"the socket {each.socket.name}")
        if self.is_implicit(place):
            return self.own(place)
        if not origin.socket.is_output:
            self._note_animation(origin.node, origin.socket)
            value = Constant(plain(origin.socket.default_value))
        elif is_nothing(origin):
            value = Constant((0.0, 0.0, 0.0) if origin.socket.type in TRIPLES else 0.0)
        else:
            value = self._output(origin)
        # Blender converts a constant from each socket to the next, and other values from the first to the last alone
        types = [step.socket.type for step in reversed(passed) if step.socket.type in NUMBERS | TRIPLES]
        is_stepwise = len(set(types)) > 1 and isinstance(value, Constant) and self._is_known(origin)
        for first, second in pairwise(types if is_stepwise else (types[0], types[-1])):
            value = converted(value, first, second)
        return value

    def own(self, place: Place) -> Constant:
        """Return the own value of an input, linked or not."""
        return Constant(plain(place.socket.default_value))

    def is_implicit(self, place: Place) -> bool:
        """Return whether nothing feeds an input whose value Blender does not show: its node then takes a value of its own choice.

        So too where the input is linked to such an input of a group, unless Blender computes the node ahead of rendering.
        """
        origin = source(place)
        if origin.socket.is_output or not (origin.socket.hide_value and place.socket.hide_value):
            return False
        return origin == place or not self._is_folded(place.node, place.groups)

    def inputs(self, output: Place) -> list[Expression]:
        """Return what feeds the inputs that a node shows for its settings, in their order. Raises UnsupportedInput."""
        return [self.expression(place) for place in output.inputs()]

    def normal(self, output: Place) -> Expression:
        """Return what feeds the input Normal of a node, the surface's own normal where nothing does. Raises UnsupportedInput."""
        place = output.input("Normal")
        return OWN_NORMAL if self.is_implicit(place) else self.expression(place)

    def image(self, image: bpy.types.Image) -> Image:
        """Return an image of the file and keep it among `images`."""
        self.images[image.name_full] = image
        space = image.colorspace_settings.name
        return Image(image.name_full, space, color_spaces.is_data(image), image.alpha_mode, image.source, image.is_float)

    def note(self, node: bpy.types.Node, what: str) -> None:
        """Add to the notes what the user should know of a node, once."""
        if (note := (node.label or node.name, what)) not in self.notes:
            self.notes.append(note)

    def _output(self, output: Place) -> Expression:
        if output not in self._read:
            read = READERS.get(output.node.bl_idname)
            if read is None:
                raise unsupported(output)
            self._note_animation(output.node)
            self._read[output] = read(self, output)
        return self._read[output]

    def _is_known(self, origin: Place) -> bool:
        """Return whether Blender computes what `source` returned ahead of rendering, of constants alone."""
        if not origin.socket.is_output:
            return not (origin.socket.hide_value and origin.node.bl_idname in TEXTURES)
        return is_nothing(origin) or origin.node.bl_idname == "ShaderNodeValue" or self._is_folded(origin.node, origin.groups)

    def _is_folded(self, node: bpy.types.Node, groups: tuple[bpy.types.Node, ...]) -> bool:
        """Return whether Blender computes a node ahead of rendering."""
        if (node, groups) not in self._folded:
            places = (Place(socket, groups) for socket in node.inputs if socket.enabled)
            self._folded[node, groups] = node.bl_idname in FOLDED and all(self._is_known(source(place)) for place in places)
        return self._folded[node, groups]

    def _note_animation(self, node: bpy.types.Node, socket: bpy.types.NodeSocket | None = None) -> None:
        """Note that a node's settings, or the value of one of its sockets, are animated."""
        for curve in fcurves.of_node(node.id_data, node):
            index = fcurves.input_of(curve)
            if node.inputs[index] == socket if index is not None else socket is None:
                self.note(node, ANIMATED)


def unsupported(output: Place) -> UnsupportedInput:
    """Return the exception for an output of a node that expressions do not have."""
    return UnsupportedInput(output.label, f"the output {output.socket.name} of the node {output.node.bl_label}")


def converted(value: Expression, first: str, second: str) -> Expression:
    """Return `value`, of a socket of the type `first`, as one of the type `second` gets it."""
    if second in TRIPLES:
        return as_kind(value, "triple")
    value = as_kind(value, "number", is_color=first == "RGBA")
    if second == "BOOLEAN" and isinstance(value, Constant):
        return apply("greater_than", value, 0.0)
    return apply("truncate", value) if second in ("INT", "BOOLEAN") and first in {"VALUE", *TRIPLES} else value


def plain(value: float | Sequence[float]) -> Value:
    """Return a socket's number, or first three components, with each 32-bit float as the shortest decimal that rounds to it."""
    if isinstance(value, (int, float)):
        return shortest(value)
    x, y, z = (*(shortest(component) for component in value[:3]), 0.0)[:3]
    return x, y, z


def shortest(value: float) -> float:
    """Return the shortest decimal number that rounds to the 32-bit float `value`."""
    single = struct.pack("f", value)
    for digits in range(6, 9):
        short = float(f"{value:.{digits}g}")
        if struct.pack("f", short) == single:
            return short
    return float(f"{value:.9g}")


# --- sources


def _value(_reader: NodeReader, output: Place) -> Expression:
    return Constant(plain(output.socket.default_value))


def _image_texture(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    if node.image is None:
        raise UnsupportedInput(output.label, "an image node without an image")
    _assert_unmapped(output)
    if output.socket.identifier == "Alpha" and is_opaque(node.image):
        return formulas.ONE
    vector = output.input("Vector")
    return ImageTexture(
        reader.image(node.image),
        UvMap() if reader.is_implicit(vector) else reader.expression(vector),
        "alpha" if output.socket.identifier == "Alpha" else "color",
        node.extension,
        node.interpolation,
        node.projection,
        shortest(node.projection_blend) if node.projection == "BOX" else 0.0,
        is_used(node.outputs["Alpha"]),
        **_played(node),
    )


def _environment_texture(reader: NodeReader, output: Place) -> Expression:
    node, vector = output.node, output.input("Vector")
    if node.image is None:
        raise UnsupportedInput(output.label, "an image node without an image")
    _assert_unmapped(output)
    direction = Coordinate("position") if reader.is_implicit(vector) else reader.expression(vector)
    place = formulas.equirectangular if node.projection == "EQUIRECTANGULAR" else formulas.mirror_ball
    return ImageTexture(reader.image(node.image), place(direction), interpolation=node.interpolation, **_played(node))


def _played(node: bpy.types.Node) -> dict[str, Any]:
    """Return the fields of ImageTexture that say which frame of a sequence or movie shows."""
    if node.image.source not in ("SEQUENCE", "MOVIE"):
        return {}
    user = node.image_user
    return {"frame": (user.frame_start, user.frame_duration, user.frame_offset), "is_cyclic": user.use_cyclic}


def is_opaque(image: bpy.types.Image) -> bool:
    """Return whether an image is known to have the alpha 1 everywhere, as its file has no such channel or it does not count."""
    has_one_file = image.source in ("FILE", "GENERATED")
    return image.alpha_mode == "NONE" or (has_one_file and image.depth in WITHOUT_ALPHA)


def _assert_unmapped(output: Place) -> None:
    """Raise UnsupportedInput where a texture node has a mapping of its own, which files before Blender 2.8 may have."""
    own = getattr(output.node, "texture_mapping", None)
    if own is None:
        return
    changed = (tuple(own.translation), tuple(own.rotation), tuple(own.scale), own.mapping_x + own.mapping_y + own.mapping_z)
    if changed != ((0.0,) * 3, (0.0,) * 3, (1.0,) * 3, "XYZ"):
        raise UnsupportedInput(output.label, "the texture mapping in the sidebar")


def _uv_map(_reader: NodeReader, output: Place) -> Expression:
    if output.node.from_instancer:
        raise UnsupportedInput(output.label, "the UV map of an instancer")
    return UvMap(output.node.uv_map)


TEXTURE_COORDINATES: Mapping[str, Expression] = {
    "Generated": Coordinate("generated"),
    "Normal": Coordinate("object_normal"),
    "UV": UvMap(),
    "Camera": Coordinate("camera"),
    "Window": Coordinate("window"),
    "Reflection": Coordinate("reflection"),
}
GEOMETRY = ("Position", "Normal", "Tangent", "True Normal", "Incoming", "Backfacing")


def _texture_coordinate(_reader: NodeReader, output: Place) -> Expression:
    name, node = output.socket.identifier, output.node
    if node.from_instancer and name in ("Generated", "UV"):
        raise UnsupportedInput(output.label, f"the {name} coordinates of an instancer")
    if name == "Object":
        return Coordinate("object", node.object.name_full if node.object else "")
    return TEXTURE_COORDINATES[name]


def _geometry(_reader: NodeReader, output: Place) -> Expression:
    name = output.socket.identifier
    if name not in GEOMETRY:
        raise unsupported(output)
    return Coordinate(name.lower().replace(" ", "_"))


def _light_path(reader: NodeReader, output: Place) -> Expression:
    """Read what the camera sees: a surface has one appearance for all rays."""
    name = output.socket.name
    if name in ("Ray Length", "Is Singular Ray"):
        raise unsupported(output)
    reader.note(output.node, "other than the camera's rays see what the camera does")
    return Constant(float(name == reader.ray))


def _color_attribute(_reader: NodeReader, output: Place) -> Expression:
    return Attribute(output.node.layer_name, "alpha" if output.socket.identifier == "Alpha" else "color")


def _attribute(_reader: NodeReader, output: Place) -> Expression:
    node, name = output.node, output.socket.identifier
    kind = {"Color": "color", "Vector": "vector", "Fac": "factor", "Alpha": "alpha"}[name]
    attribute = Attribute(node.attribute_name, kind, node.attribute_type)
    if not node.attribute_name:
        return Constant((0.0, 0.0, 0.0) if attribute.kind == "triple" else float(kind == "alpha"))
    return attribute


def _texture(reader: NodeReader, output: Place) -> Expression:
    """Read a texture that is computed."""
    node = output.node
    texture = TEXTURES[node.bl_idname]
    _assert_unmapped(output)
    places = {socket.identifier: Place(socket, output.groups) for socket in node.inputs}
    arguments = []
    for name in texture.arguments:
        place = places.get(name)
        if place is None:
            arguments.append(Constant(plain(getattr(node, name))))
        elif not place.socket.enabled:
            arguments.append(reader.own(place))
        elif name == "Vector" and reader.is_implicit(place) and node.bl_idname != "ShaderNodeTexWhiteNoise":
            arguments.append(Coordinate("generated"))
        else:
            arguments.append(reader.expression(place))
    choices = {menu: getattr(node, menu) for menu in texture.menus}
    return apply(operation_name(texture, choices, output.socket.identifier), *arguments, label=output.label)


def _sky_texture(reader: NodeReader, output: Place) -> Expression:
    node, vector = output.node, output.input(0)  # which a sky with a sun takes from nobody
    _assert_unmapped(output)
    if node.sky_type == "HOSEK_WILKIE":
        raise UnsupportedInput(output.label, "the sky type Hosek/Wilkie")
    is_linked = vector.socket.enabled and not reader.is_implicit(vector)
    direction = reader.expression(vector) if is_linked else Coordinate("generated")
    if node.sky_type == "PREETHAM":
        return preetham(direction, triple(plain(node.sun_direction)), shortest(node.turbidity), output.label)
    elevation, rotation = placed_sun(node.sun_elevation, node.sun_rotation)
    densities = (shortest(value) for value in (node.air_density, node.aerosol_density, node.ozone_density))
    air = Atmosphere(node.sky_type == "MULTIPLE_SCATTERING", elevation, shortest(node.altitude), *densities)
    disc = SunDisc(max(node.sun_size, SMALLEST_SUN), shortest(node.sun_intensity)) if node.sun_disc else None
    return SkyTexture(Sky(air, rotation, disc), direction, output.label)


# --- arithmetic


def _math(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    return formulas.math(node.operation, reader.inputs(output), node.use_clamp, output.label)


def _vector_math(reader: NodeReader, output: Place) -> Expression:
    return formulas.math(output.node.operation, reader.inputs(output), False, output.label)


def _clamp(reader: NodeReader, output: Place) -> Expression:
    return formulas.clamp(output.node.clamp_type, *reader.inputs(output), output.label)


def _map_range(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    return formulas.map_range(node.interpolation_type, node.clamp, reader.inputs(output), output.label)


def _mapping(reader: NodeReader, output: Place) -> Expression:
    vector, *location, rotation, scale = reader.inputs(output)  # directions have no location
    place = location[0] if location else formulas.ZERO
    return formulas.mapping(output.node.vector_type, vector, place, rotation, scale, output.label)


def _vector_rotate(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    vector, center, *axis, turn = reader.inputs(output)
    return formulas.vector_rotate(node.rotation_type, node.invert, vector, center, turn, axis[0] if axis else None, output.label)


def _separate_vector(reader: NodeReader, output: Place) -> Expression:
    return formulas.separate_color("RGB", *reader.inputs(output), "XYZ".index(output.socket.identifier), output.label)


def _combine_vector(reader: NodeReader, output: Place) -> Expression:
    return formulas.combine_color("RGB", reader.inputs(output), output.label)


def _mix(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    factor, first, second = reader.inputs(output)
    if node.data_type == "RGBA":
        return formulas.blend(node.blend_type, factor, first, second, node.clamp_factor, node.clamp_result, output.label)
    return formulas.mix(factor, first, second, node.clamp_factor, output.label)


def _mix_rgb(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    return formulas.blend(node.blend_type, *reader.inputs(output), True, node.use_clamp, output.label)


# --- colors


def _separate_color(reader: NodeReader, output: Place) -> Expression:
    index = ("Red", "Green", "Blue").index(output.socket.identifier)
    return formulas.separate_color(output.node.mode, *reader.inputs(output), index, output.label)


def _combine_color(reader: NodeReader, output: Place) -> Expression:
    return formulas.combine_color(output.node.mode, reader.inputs(output), output.label)


def _gamma(reader: NodeReader, output: Place) -> Expression:
    return apply("gamma", *reader.inputs(output), label=output.label)


def _brightness_contrast(reader: NodeReader, output: Place) -> Expression:
    return formulas.brightness_contrast(*reader.inputs(output), output.label)


def _hue_saturation(reader: NodeReader, output: Place) -> Expression:
    return formulas.hue_saturation(*reader.inputs(output), output.label)


def _invert(reader: NodeReader, output: Place) -> Expression:
    return formulas.invert(*reader.inputs(output), output.label)


def _luminance(reader: NodeReader, output: Place) -> Expression:
    return apply("luminance", *reader.inputs(output), label=output.label)


def _spectrum(reader: NodeReader, output: Place) -> Expression:
    """Read Blackbody and Wavelength where their input is a constant."""
    place = output.input(0)
    value = reader.expression(place)
    if not isinstance(value, Constant):
        raise UnsupportedInput(output.label, f"the linked {place.socket.name} of the node {output.node.bl_label}")
    color = spectra.blackbody if output.node.bl_idname == "ShaderNodeBlackbody" else spectra.wavelength
    return Constant(color(number(value.value)))


def _color_ramp(reader: NodeReader, output: Place) -> Expression:
    ramp, (factor,) = output.node.color_ramp, reader.inputs(output)
    if isinstance(factor, Constant):
        components = [Constant(value) for value in ramp.evaluate(number(factor.value))]
    else:
        samples = [ramp.evaluate(i / INTERVALS) for i in range(INTERVALS + 1)]
        components = [
            formulas.table(values, factor, is_stepped=ramp.interpolation == "CONSTANT", label=output.label)
            for values in zip(*samples, strict=True)
        ]
    return components[3] if output.socket.identifier == "Alpha" else apply("combine", *components[:3], label=output.label)


def _color_curves(reader: NodeReader, output: Place) -> Expression:
    """Read RGB Curves and Vector Curves, of which the first have a fourth curve that comes before the others."""
    mapping = output.node.mapping
    factor, color = reader.inputs(output)
    components = [apply(axis, color) for axis in "xyz"]
    curves = _curves(mapping, components, mapping.curves[3] if len(mapping.curves) == 4 else None, output.label)
    return apply("mix", color, apply("combine", *curves, label=output.label), factor, label=output.label)


def _float_curve(reader: NodeReader, output: Place) -> Expression:
    factor, value = reader.inputs(output)
    (curve,) = _curves(output.node.mapping, [value], None, output.label)
    return apply("mix", value, curve, factor, label=output.label)


def _curves(
    mapping: bpy.types.CurveMapping, arguments: Sequence[Expression], first: bpy.types.CurveMap | None, label: str
) -> list[Expression]:
    """Return the curves of a mapping of one argument each, after the curve `first`, as Cycles has them: as tables."""
    mapping.initialize()
    low = min(curve.points[0].location[0] for curve in mapping.curves)
    high = max(curve.points[-1].location[0] for curve in mapping.curves)

    def value(curve: bpy.types.CurveMap, x: float) -> float:
        return mapping.evaluate(curve, mapping.evaluate(first, x) if first else x)

    made = []
    for curve, argument in zip(mapping.curves, arguments, strict=False):
        if isinstance(argument, Constant):  # of which Blender takes the curve itself, and clips that of a number
            result = value(curve, number(argument.value))
            if mapping.use_clip and len(arguments) == 1:
                result = min(max(result, mapping.clip_min_y), mapping.clip_max_y)
            made.append(Constant(result))
        else:
            values = [value(curve, low + (high - low) * i / INTERVALS) for i in range(INTERVALS + 1)]
            made.append(formulas.table(values, argument, low, high, is_extended=mapping.extend == "EXTRAPOLATED", label=label))
    return made


# --- normals and the angle of view


def _normal_map(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    strength, color = reader.inputs(output)
    is_flat = node.space == "TANGENT" and isinstance(color, Constant) and color.value == FLAT
    if is_flat or strength == formulas.ZERO:
        return OWN_NORMAL
    return NormalMap(color, strength, node.space, node.uv_map, node.convention)


def _bump(reader: NodeReader, output: Place) -> Expression:
    node = output.node
    strength, distance, height = (reader.expression(output.input(name)) for name in ("Strength", "Distance", "Height"))
    normal = reader.normal(output)
    if isinstance(height, Constant) or formulas.ZERO in (strength, distance):
        return normal
    width = reader.expression(output.input("Filter Width"))
    if not isinstance(width, Constant) or isinstance(width.value, tuple):
        raise UnsupportedInput(output.label, "the linked Filter Width of the node Bump")
    return Bump(height, strength, distance, width.value, node.invert, None if normal == OWN_NORMAL else normal)


def _normal(reader: NodeReader, output: Place) -> Expression:
    direction = Constant(plain(output.node.outputs["Normal"].default_value))
    if output.socket.identifier == "Normal":
        return apply("normalize", direction)
    return formulas.normal_dot(direction, *reader.inputs(output), output.label)


def _fresnel(reader: NodeReader, output: Place) -> Expression:
    return formulas.fresnel(reader.expression(output.input("IOR")), reader.normal(output), output.label)


def _layer_weight(reader: NodeReader, output: Place) -> Expression:
    formula = formulas.facing if output.socket.identifier == "Facing" else formulas.layer_weight_fresnel
    return formula(reader.expression(output.input("Blend")), reader.normal(output), output.label)


type Reader = Callable[[NodeReader, Place], Expression]
FOLDED: Mapping[str, Reader] = {  # what Blender computes ahead of rendering where all inputs are constants
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeVectorRotate": _vector_rotate,
    "ShaderNodeSeparateXYZ": _separate_vector,
    "ShaderNodeCombineXYZ": _combine_vector,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeCombineColor": _combine_color,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeValToRGB": _color_ramp,
    "ShaderNodeRGBCurve": _color_curves,
    "ShaderNodeVectorCurve": _color_curves,
    "ShaderNodeFloatCurve": _float_curve,
    **dict.fromkeys(TEXTURES, _texture),
}
OTHERS: Mapping[str, Reader] = {
    "ShaderNodeValue": _value,
    "ShaderNodeRGB": _value,
    "ShaderNodeTexImage": _image_texture,
    "ShaderNodeTexSky": _sky_texture,
    "ShaderNodeTexEnvironment": _environment_texture,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeTexCoord": _texture_coordinate,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeVertexColor": _color_attribute,
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeSeparateColor": _separate_color,
    "ShaderNodeBrightContrast": _brightness_contrast,
    "ShaderNodeHueSaturation": _hue_saturation,
    "ShaderNodeInvert": _invert,
    "ShaderNodeRGBToBW": _luminance,
    "ShaderNodeBlackbody": _spectrum,
    "ShaderNodeWavelength": _spectrum,
    "ShaderNodeNormal": _normal,
    "ShaderNodeNormalMap": _normal_map,
    "ShaderNodeBump": _bump,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
}
READERS = {**FOLDED, **OTHERS}
