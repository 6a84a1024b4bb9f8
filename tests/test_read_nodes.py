# SPDX-License-Identifier: GPL-3.0-or-later
"""Input nodes read into expressions have Cycles' own values, in every setting.

Each setting is a material of an Emission node, each of its samples one face of one pixel. Random inputs come from attributes of the
faces, of which the expression reads the same.
"""

import itertools
import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material.expression import (
    Apply,
    Attribute,
    Bump,
    Constant,
    Coordinate,
    Expression,
    Image,
    ImageTexture,
    NormalMap,
    UvMap,
    apply,
    evaluate,
    triple,
    walk,
)
from true_diffuse.addon.material.links import Place
from true_diffuse.addon.material.operations import Triple, Value
from true_diffuse.addon.material.read_nodes import FOLDED, NodeReader, UnsupportedInput
from true_diffuse.addon.measure import render

SAMPLES = 16  # faces of a setting; the first ones have the EDGES as values
WIDTH = 64  # faces in a row
EDGES = (0.0, 1.0, 0.5, -1.0, 2.0)
BACKS = (9, 14)  # faces that are seen from behind
VECTORS, NUMBERS = (
    ("a", "b", "c", "d", "e", "f", "n"),
    ("p", "q", "r", "s", "t", "u", "v", "w", "x"),
)  # names of attributes; n is a unit vector
# 32-bit floats: a node's chain of operations loses a few of its 2^-24, functions such as powers and hues some more
TOLERANCE = 1e-4


type Tree = bpy.types.ShaderNodeTree
type Socket = bpy.types.NodeSocket


@dataclass
class Setting:
    """Nodes in one setting; `build` makes them and returns the output that is looked at."""

    name: str
    build: Callable[[Tree], Socket]


def node(
    name: str,
    kind: str,
    properties: dict[str, Any] | None = None,
    output: str = "",
    change: Callable[[bpy.types.Node], object] = lambda _node: None,
) -> Iterator[Setting]:
    """Yield a node twice: with all inputs linked to attributes, and with constants in them.

    `output` is the identifier of the output, else it is the first; `change` is done to the node before its inputs are linked.
    """

    def build(tree: Tree, is_linked: bool) -> Socket:
        made = tree.nodes.new(kind)
        for key, value in (properties or {}).items():
            setattr(made, key, value)
        change(made)
        names = {True: iter(NUMBERS), False: iter(VECTORS)}
        for socket in made.inputs:
            if not socket.enabled:
                continue
            attribute = next(names[socket.type == "VALUE"]) if socket.name != "Normal" else "n"
            if is_linked:
                tree.links.new(from_attribute(tree, attribute), socket)
            elif not (socket.hide_value and socket.name == "Normal"):
                value = FACE_VALUES[SAMPLES - 1 if socket.name == "Steps" else 8][attribute]  # positive steps
                socket.default_value = (*value, 1.0)[: len(socket.default_value)] if isinstance(value, tuple) else value
        outputs = [socket for socket in made.outputs if socket.enabled and output in ("", socket.identifier)]
        return outputs[0]

    yield Setting(name, partial(build, is_linked=True))
    yield Setting(f"{name} constant", partial(build, is_linked=False))


def from_attribute(tree: Tree, name: str, output: str = "") -> Socket:
    """Return an output of a new Attribute node, by default Factor or Vector."""
    source = tree.nodes.new("ShaderNodeAttribute")
    source.attribute_name = name
    return next(socket for socket in source.outputs if socket.identifier == (output or ("Fac" if name in NUMBERS else "Vector")))


def _sample(index: int, dice: random.Random) -> dict[str, Value]:
    """Return values of all attributes, multiples of 1/64, which 32-bit floats add without rounding."""

    def number() -> float:
        return round(dice.uniform(-2.0, 2.0) * 64.0) / 64.0

    values = {name: number() for name in NUMBERS} | {name: (number(), number(), number()) for name in VECTORS}
    if index == 0:
        return dict.fromkeys(NUMBERS, 0.0) | dict.fromkeys(VECTORS, (0.0, 0.0, 0.0))
    if index == 1:  # zeros but for the first input
        return {name: value if name in "ap" else 0.0 if name in NUMBERS else (0.0,) * 3 for name, value in values.items()}
    if index < 2 + len(EDGES):
        edge = EDGES[index - 2]
        return {
            name: dice.choice((edge, value)) if name in NUMBERS else (value[0], edge, value[2]) for name, value in values.items()
        }
    if index < SAMPLES - 3:
        return values
    # within the range of colors
    return {name: value * 0.25 + 0.5 if name in NUMBERS else tuple(x * 0.25 + 0.5 for x in value) for name, value in values.items()}


DICE = random.Random(5)
FACE_VALUES = [_sample(index, DICE) for index in range(SAMPLES)]
FACE_VALUES = [{**values, "n": (math.sin(values["x"]), 0.0, math.cos(values["x"]))} for values in FACE_VALUES]


def entries(kind: str, name: str) -> list[str]:
    """The entries of a menu of a node."""
    return [entry.identifier for entry in getattr(bpy.types, kind).bl_rna.properties[name].enum_items]


def arithmetic() -> Iterator[Setting]:
    """Yield every node of arithmetic and colors in every setting."""
    for operation, clamp in itertools.product(entries("ShaderNodeMath", "operation"), (False, True)):
        yield from node(
            f"math {operation}{' clamp' if clamp else ''}", "ShaderNodeMath", {"operation": operation, "use_clamp": clamp}
        )
    for operation in entries("ShaderNodeVectorMath", "operation"):
        yield from node(f"vector math {operation}", "ShaderNodeVectorMath", {"operation": operation})
    for kind in entries("ShaderNodeClamp", "clamp_type"):
        yield from node(f"clamp {kind}", "ShaderNodeClamp", {"clamp_type": kind})
    kinds = itertools.product(("FLOAT", "FLOAT_VECTOR"), entries("ShaderNodeMapRange", "interpolation_type"), (False, True))
    for data, kind, clamp in kinds:
        properties = {"data_type": data, "interpolation_type": kind, "clamp": clamp}
        yield from node(f"map range {data} {kind}{' clamp' if clamp else ''}", "ShaderNodeMapRange", properties)
    for kind in entries("ShaderNodeMapping", "vector_type"):
        yield from node(f"mapping {kind}", "ShaderNodeMapping", {"vector_type": kind})
    for kind, invert in itertools.product(entries("ShaderNodeVectorRotate", "rotation_type"), (False, True)):
        properties = {"rotation_type": kind, "invert": invert}
        yield from node(f"vector rotate {kind}{' invert' if invert else ''}", "ShaderNodeVectorRotate", properties)
    for axis in "XYZ":
        yield from node(f"separate xyz {axis}", "ShaderNodeSeparateXYZ", output=axis)
    yield from node("combine xyz", "ShaderNodeCombineXYZ")
    for data, uniform, clamp in (
        ("FLOAT", "UNIFORM", False),
        ("FLOAT", "UNIFORM", True),
        ("VECTOR", "UNIFORM", False),
        ("VECTOR", "UNIFORM", True),
        ("VECTOR", "NON_UNIFORM", False),
        ("VECTOR", "NON_UNIFORM", True),
    ):
        properties = {"data_type": data, "factor_mode": uniform, "clamp_factor": clamp}
        yield from node(f"mix {data} {uniform}{' clamp' if clamp else ''}", "ShaderNodeMix", properties)
    for mode, factor, result in itertools.product(entries("ShaderNodeMix", "blend_type"), (False, True), (False, True)):
        properties = {"data_type": "RGBA", "blend_type": mode, "clamp_factor": factor, "clamp_result": result}
        words = f"{' clamp factor' if factor else ''}{' clamp result' if result else ''}"
        yield from node(f"mix {mode}{words}", "ShaderNodeMix", properties)
    for mode, clamp in itertools.product(entries("ShaderNodeMixRGB", "blend_type"), (False, True)):
        yield from node(f"mix rgb {mode}{' clamp' if clamp else ''}", "ShaderNodeMixRGB", {"blend_type": mode, "use_clamp": clamp})
    for mode in ("RGB", "HSV", "HSL"):
        for channel in ("Red", "Green", "Blue"):
            yield from node(f"separate color {mode} {channel}", "ShaderNodeSeparateColor", {"mode": mode}, channel)
        yield from node(f"combine color {mode}", "ShaderNodeCombineColor", {"mode": mode})
    for kind in ("Gamma", "BrightContrast", "HueSaturation", "Invert", "RGBToBW"):
        yield from node(kind, f"ShaderNode{kind}")
    yield from node("normal dot", "ShaderNodeNormal", output="Dot", change=_turn)
    yield from node("normal direction", "ShaderNodeNormal", output="Normal", change=_turn)


def _turn(made: bpy.types.Node) -> None:
    made.outputs["Normal"].default_value = (0.2, -0.5, 0.8)


def curves_and_ramps() -> Iterator[Setting]:
    """Yield curves of all kinds and color ramps of all interpolations."""

    def bend(made: bpy.types.Node, extend: str, low: float = 0.0, high: float = 1.0) -> None:
        made.mapping.extend = extend
        made.mapping.use_clip = False
        for index, each in enumerate(made.mapping.curves):
            each.points[0].location = (low, 0.1 * index)
            each.points[1].location = (high, 1.0 - 0.2 * index)
            each.points.new(low + 0.3 * (high - low), 0.6 - 0.1 * index)
        made.mapping.update()

    for kind, extend, low in itertools.product(
        ("RGBCurve", "VectorCurve", "FloatCurve"), ("HORIZONTAL", "EXTRAPOLATED"), (0.0, -0.5)
    ):
        yield from node(f"{kind} {extend} {low}", f"ShaderNode{kind}", change=partial(bend, extend=extend, low=low))
    yield from node("RGB curves as they are", "ShaderNodeRGBCurve")
    yield from node("vector curves as they are", "ShaderNodeVectorCurve")
    yield from node("float curve as it is", "ShaderNodeFloatCurve")

    def colors(made: bpy.types.Node, mode: str, interpolation: str, hue: str = "NEAR") -> None:
        ramp = made.color_ramp
        ramp.color_mode, ramp.interpolation, ramp.hue_interpolation = mode, interpolation, hue
        ramp.elements[0].color, ramp.elements[0].position = (0.8, 0.1, 0.2, 0.3), 0.13
        ramp.elements.new(0.4).color = (0.1, 0.7, 0.3, 1.0)
        ramp.elements[-1].color, ramp.elements[-1].position = (0.1, 0.2, 1.5, 0.5), 0.9

    for mode, interpolation in (
        *(("RGB", entry) for entry in ("LINEAR", "EASE", "CARDINAL", "B_SPLINE", "CONSTANT")),
        *((mode, hue) for mode in ("HSV", "HSL") for hue in ("NEAR", "FAR", "CW", "CCW")),
    ):
        change = partial(colors, mode=mode, interpolation=interpolation)
        if mode != "RGB":
            change = partial(colors, mode=mode, interpolation="LINEAR", hue=interpolation)
        for output in ("Color", "Alpha"):
            yield from node(f"ramp {mode} {interpolation} {output}", "ShaderNodeValToRGB", output=output, change=change)
    yield from node("ramp as it is", "ShaderNodeValToRGB")


def spectra() -> Iterator[Setting]:
    """Yield Blackbody and Wavelength of constants across their ranges."""

    def build(tree: Tree, kind: str, value: float) -> Socket:
        made = tree.nodes.new(kind)
        made.inputs[0].default_value = value
        return made.outputs[0]

    for kelvin in (300.0, 800.0, 900.0, 1000.0, 1300.0, 1700.0, 2500.0, 5000.0, 6500.0, 11999.0, 12000.0, 20000.0):
        yield Setting(f"blackbody {kelvin}", partial(build, kind="ShaderNodeBlackbody", value=kelvin))
    for nanometers in (379.0, *(380.0 + 7.3 * i for i in range(55)), 780.0, 800.0):
        yield Setting(f"wavelength {nanometers}", partial(build, kind="ShaderNodeWavelength", value=nanometers))


def angles() -> Iterator[Setting]:
    """Yield the nodes that depend on the angle of view."""
    for kind, output in (("Fresnel", "Fac"), ("LayerWeight", "Fresnel"), ("LayerWeight", "Facing")):
        yield from node(f"{kind} {output}", f"ShaderNode{kind}", output=output)


def sources() -> Iterator[Setting]:
    """Yield attributes, coordinates and geometry."""
    for name, output in itertools.product(("a", "p", "colors", "missing", ""), ("Color", "Vector", "Fac", "Alpha")):
        if (name, output) == ("missing", "Alpha"):  # 1, whereas that of Color Attribute is 0
            continue
        yield Setting(f"attribute {name} {output}", partial(from_attribute, name=name, output=output))

    def output_of(tree: Tree, kind: str, output: str, **properties: object) -> Socket:
        made = tree.nodes.new(kind)
        for key, value in properties.items():
            setattr(made, key, value)
        return next(socket for socket in made.outputs if socket.identifier == output)

    for name, output in itertools.product(("colors", "missing", ""), ("Color", "Alpha")):
        yield Setting(
            f"color attribute {name} {output}", partial(output_of, kind="ShaderNodeVertexColor", output=output, layer_name=name)
        )
    for name in ("first", "second", ""):
        yield Setting(f"UV map {name}", partial(output_of, kind="ShaderNodeUVMap", output="UV", uv_map=name))
    for output in ("Generated", "UV", "Object"):
        yield Setting(f"coordinate {output}", partial(output_of, kind="ShaderNodeTexCoord", output=output))
    for output in ("Position", "Normal", "True Normal", "Incoming", "Backfacing"):
        yield Setting(f"geometry {output}", partial(output_of, kind="ShaderNodeNewGeometry", output=output))


KINDS = ("Float", "Int", "Bool", "Vector", "Color")


def group(tree: Tree, into: str, out_of: str = "Color", is_hidden: bool = False) -> bpy.types.Node:
    """Return a group node that passes on its input, both of a kind of KINDS; a hidden one shows no value."""
    inner = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    first = inner.interface.new_socket("In", in_out="INPUT", socket_type=f"NodeSocket{into}")
    first.hide_value = is_hidden
    inner.interface.new_socket("Out", in_out="OUTPUT", socket_type=f"NodeSocket{out_of}")
    inner.links.new(inner.nodes.new("NodeGroupInput").outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
    made = tree.nodes.new("ShaderNodeGroup")
    made.node_tree = inner
    return made


def links() -> Iterator[Setting]:
    """Yield groups, muted nodes and reroutes on the way, with sockets of all kinds."""

    def value(tree: Tree) -> Socket:
        made = tree.nodes.new("ShaderNodeValue")
        made.outputs[0].default_value = 1.7
        return made.outputs[0]

    def rgb(tree: Tree) -> Socket:
        made = tree.nodes.new("ShaderNodeRGB")
        made.outputs[0].default_value = (0.8, 2.3, 0.1, 0.5)
        return made.outputs[0]

    def through(tree: Tree, origin: Callable[[Tree], Socket], into: str, out_of: str) -> Socket:
        made = group(tree, into, out_of)
        tree.links.new(origin(tree), made.inputs[0])
        return made.outputs[0]

    def own(tree: Tree, into: str, out_of: str) -> Socket:
        made = group(tree, into, out_of)
        values = {"Float": 0.7, "Int": 3, "Bool": True, "Vector": (0.3, -0.5, 2.0), "Color": (0.2, 0.7, 1.5, 1.0)}
        made.inputs[0].default_value = values[into]
        return made.outputs[0]

    origins = {name: partial(from_attribute, name=name) for name in "ap"} | {"value": value, "rgb": rgb}
    origins["colors"] = partial(from_attribute, name="colors", output="Color")
    for into, out_of in itertools.product(KINDS, KINDS):
        for name, origin in origins.items():
            yield Setting(f"{name} as {into} as {out_of}", partial(through, origin=origin, into=into, out_of=out_of))
        yield Setting(f"own {into} as {out_of}", partial(own, into=into, out_of=out_of))

    def muted(tree: Tree, kind: str, origin: Callable[[Tree], Socket], output: int = 0, **properties: object) -> Socket:
        made = tree.nodes.new(kind)
        for key, setting in properties.items():
            setattr(made, key, setting)
        for socket in made.inputs:
            if socket.enabled:
                tree.links.new(origin(tree), socket)
        made.mute = True
        return made.outputs[output]

    for kind in (
        "Value",
        "RGB",
        "VertexColor",
        "TexCoord",
        "Math",
        "VectorMath",
        "ValToRGB",
        "SeparateXYZ",
        "RGBToBW",
        "TexChecker",
    ):
        for name, origin in origins.items():
            yield Setting(f"muted {kind} of {name}", partial(muted, kind=f"ShaderNode{kind}", origin=origin))
    for name, origin in origins.items():
        yield Setting(
            f"muted Mix of {name}",
            partial(muted, kind="ShaderNodeMix", origin=origin, output=2, data_type="RGBA", factor_mode="UNIFORM"),
        )

    def muted_group(tree: Tree) -> Socket:
        made = through(tree, origins["colors"], "Float", "Color")
        made.node.mute = True
        return made

    def muted_link(tree: Tree) -> Socket:
        made = through(tree, origins["a"], "Color", "Color")
        made.node.inputs[0].links[0].is_muted = True
        made.node.inputs[0].default_value = (0.1, 0.2, 0.3, 1.0)
        return made

    def reroutes(tree: Tree) -> Socket:
        output = origins["a"](tree)
        for _ in range(2):
            made = tree.nodes.new("NodeReroute")
            tree.links.new(output, made.inputs[0])
            output = made.outputs[0]
        return output

    def without_tree(tree: Tree) -> Socket:
        made = group(tree, "Color")
        inner = made.node_tree
        inner.nodes.remove(next(each for each in inner.nodes if each.type == "GROUP_OUTPUT"))
        return made.outputs[0]

    def texture(tree: Tree, is_hidden: bool, is_linked: bool = False) -> Socket:
        """Return a texture whose coordinates a group gives, whose own are hidden or not."""
        made = tree.nodes.new("ShaderNodeTexMagic")
        tree.links.new(group(tree, "Vector", "Vector", is_hidden).outputs[0], made.inputs["Vector"])
        if is_linked:
            tree.links.new(from_attribute(tree, "p"), made.inputs["Scale"])
        return made.outputs[0]

    def muted_coordinates(tree: Tree, has_group: bool) -> Socket:
        made = tree.nodes.new("ShaderNodeTexGradient")
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        coordinates.mute = True
        output = coordinates.outputs["Window"]
        if has_group:
            output = through(tree, lambda _tree: coordinates.outputs["Window"], "Vector", "Vector")
            output.node.inputs[0].default_value = (0.3, 0.0, 0.0)
        tree.links.new(output, made.inputs["Vector"])
        return made.outputs[0]

    def facing(tree: Tree, is_hidden: bool) -> Socket:
        made = tree.nodes.new("ShaderNodeLayerWeight")
        tree.links.new(group(tree, "Vector", "Vector", is_hidden).outputs[0], made.inputs["Normal"])
        return made.outputs["Facing"]

    def computed(tree: Tree, kind: str) -> Socket:
        made = tree.nodes.new(kind)
        for socket in made.inputs:
            if socket.enabled and socket.type == "RGBA":
                socket.default_value = (0.8, 0.3, 0.1, 1.0)
            elif socket.enabled and socket.type == "VECTOR":
                socket.default_value = (0.8, 0.3, 0.1)
        color = next((socket for socket in made.outputs if socket.enabled and socket.type != "VALUE"), None)
        return through(tree, lambda _tree: color or made.outputs[0], "Float", "Int" if color is None else "Color")

    for kind in FOLDED:
        yield Setting(f"{kind} ahead of rendering", partial(computed, kind=kind))

    def switched(tree: Tree, data: str, entry: str) -> Socket:
        made = tree.nodes.new("GeometryNodeMenuSwitch")
        made.data_type = data
        made.enum_items.clear()
        for name in ("first", "second"):
            made.enum_items.new(name)
        for name, socket in zip(("a", "p"), list(made.inputs)[1:3], strict=True):
            tree.links.new(from_attribute(tree, name), socket)
        made.inputs[0].default_value = entry
        return made.outputs[0]

    for data, entry in itertools.product(("FLOAT", "VECTOR", "RGBA"), ("first", "second")):
        yield Setting(f"menu switch {data} {entry}", partial(switched, data=data, entry=entry))
    for build in (muted_group, muted_link, reroutes, without_tree):
        yield Setting(build.__name__, build)
    for build, is_hidden in itertools.product((texture, facing), (False, True)):
        yield Setting(f"{build.__name__} of a {'hidden' if is_hidden else 'shown'} value", partial(build, is_hidden=is_hidden))
    yield Setting("texture of a hidden value and an attribute", partial(texture, is_hidden=True, is_linked=True))
    for has_group in (False, True):
        name = f"muted coordinates{' of a group' if has_group else ''}"
        yield Setting(name, partial(muted_coordinates, has_group=has_group))


class Face:
    """The point that an expression sees in the middle of a face."""

    def __init__(self, index: int) -> None:
        self.index, self.values = index % SAMPLES, FACE_VALUES[index % SAMPLES]
        self.position = (index % WIDTH + 0.5, index // WIDTH + 0.5, 0.0)
        self.rows = 0

    def attribute(self, attribute: Attribute) -> Value:
        """Return what each output of an Attribute node gives: of a number three times the same, and alpha 1."""
        if attribute.name in self.values:
            value = self.values[attribute.name]
            components = (*triple(value), 1.0)
        elif attribute.name in ("colors", ""):
            components = color_of(self.index)
        else:
            components = (0.0, 0.0, 0.0, 0.0)
        outputs = {"factor": sum(components[:3]) / 3.0, "alpha": components[3]}
        return outputs.get(attribute.output, components[:3])

    def uv(self, name: str) -> Triple:
        x, y, _ = self.position
        return (x / WIDTH, y / WIDTH, 0.0) if name == "first" else (y / WIDTH, x / WIDTH, 0.0)

    def coordinate(self, coordinate: Coordinate) -> Value:
        x, y, _ = self.position
        names = {"position": self.position, "object": self.position, "generated": (x / WIDTH, y / self.rows, 0.5)}
        directions = dict.fromkeys(("normal", "true_normal", "incoming"), (0.0, 0.0, 1.0))
        return {**names, **directions, "backfacing": float(self.index in BACKS)}[coordinate.name]


def color_of(index: int) -> tuple[float, float, float, float]:
    """The color attribute of a face."""
    return index / 8.0, 1.0 - index / 16.0, 0.25 * index, index / 16.0


@dataclass
class Picture:
    """What Cycles and the expressions make of all settings."""

    cycles: dict[str, list[tuple[int, Triple]]] = field(default_factory=dict)
    """By the names of settings, for each sample the index of its face and the pixel."""
    expressions: dict[str, Expression] = field(default_factory=dict)
    rows: int = 0


def material_of(setting: Setting) -> tuple[bpy.types.Material, Expression]:
    material = bpy.data.materials.new(setting.name)
    tree = material.node_tree
    tree.nodes.clear()
    output, emission = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeEmission")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    tree.links.new(setting.build(tree), emission.inputs["Color"])
    return material, NodeReader().expression(Place(emission.inputs["Color"]))


def add_layers(mesh: bpy.types.Mesh, samples: list[int]) -> None:
    """Add two UV maps, of which the second renders, and two color attributes."""
    for name in ("first", "second"):
        layer = mesh.uv_layers.new(name=name)
        at = [mesh.vertices[index].co for index in (loop.vertex_index for loop in mesh.loops)]
        order = (0, 1) if name == "first" else (1, 0)
        layer.uv.foreach_set("vector", [co[axis] / WIDTH for co in at for axis in order])
    mesh.uv_layers["second"].active_render = True
    for name in ("others", "colors"):
        layer = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        layer.data.foreach_set("color", [x for sample in samples for _ in range(4) for x in color_of(sample)])
    mesh.color_attributes["others"].data.foreach_set("color", [0.5] * 16 * len(samples))
    mesh.color_attributes.render_color_index = mesh.color_attributes.find("colors")


def draw(made: list[Setting]) -> Picture:
    """Render all settings in one picture."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    picture = Picture()
    picture.rows = rows = max(4, -(-len(made) * SAMPLES // WIDTH))  # Blender renders no smaller picture
    faces = [(i // SAMPLES, i % SAMPLES) for i in range(len(made) * SAMPLES)]
    vertices, corners = [], []
    for index in range(len(faces)):
        x, y = index % WIDTH, index // WIDTH
        vertices += [(x, y, 0.0), (x + 1.0, y, 0.0), (x + 1.0, y + 1.0, 0.0), (x, y + 1.0, 0.0)]
        around = range(4 * index, 4 * index + 4)
        corners.append(tuple(reversed(around)) if index % SAMPLES in BACKS else tuple(around))
    mesh = bpy.data.meshes.new("Faces")
    mesh.from_pydata(vertices, [], corners)
    for setting in made:
        material, picture.expressions[setting.name] = material_of(setting)
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", [index for index, _ in faces])
    for name in NUMBERS:
        mesh.attributes.new(name, "FLOAT", "FACE").data.foreach_set("value", [FACE_VALUES[i][name] for _, i in faces])
    for name in VECTORS:
        values = [x for _, i in faces for x in FACE_VALUES[i][name]]
        mesh.attributes.new(name, "FLOAT_VECTOR", "FACE").data.foreach_set("vector", values)
    add_layers(mesh, [i for _, i in faces])
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("Faces", mesh))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", max(WIDTH, rows)
    camera.location = (WIDTH / 2.0, rows / 2.0, 10.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, rows
    engines.use(scene, engines.CYCLES, 1)
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", render.CENTER
    scene.cycles.max_bounces = 0
    _, pixels = render.radiance(scene, engines.CYCLES, 1)
    for index, (setting, _) in enumerate(faces):
        x, y = index % WIDTH, rows - 1 - index // WIDTH
        start = 3 * (y * WIDTH + x)
        picture.cycles.setdefault(made[setting].name, []).append((index, tuple(pixels[start : start + 3])))
    return picture


@pytest.fixture(scope="module")
def picture() -> Picture:
    return draw(SETTINGS)


SETTINGS = [*arithmetic(), *curves_and_ramps(), *spectra(), *angles(), *sources(), *links()]


@pytest.mark.render
@pytest.mark.parametrize("name", [setting.name for setting in SETTINGS])
def test_node_has_the_value_of_cycles(name: str, picture: Picture) -> None:
    wrong = []
    for index, cycles in picture.cycles[name]:
        face = Face(index)
        face.rows = picture.rows
        value = triple(evaluate(picture.expressions[name], face))
        if any(abs(x - y) > TOLERANCE * max(1.0, abs(y)) for x, y in zip(value, cycles, strict=True)):
            wrong.append((face.values, value, cycles))
    assert not wrong


class Stage:
    """A material whose Emission node shows what is read."""

    def __init__(self) -> None:
        self.material = bpy.data.materials.new("Test")
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        output, self.emission = (self.tree.nodes.new(f"ShaderNode{kind}") for kind in ("OutputMaterial", "Emission"))
        self.tree.links.new(self.emission.outputs[0], output.inputs["Surface"])
        self.reader = NodeReader()

    def node(self, kind: str, **properties: object) -> bpy.types.Node:
        made = self.tree.nodes.new(kind)
        for key, value in properties.items():
            setattr(made, key, value)
        return made

    def link(self, output: Socket, node: bpy.types.Node, name: str | int) -> None:
        self.tree.links.new(output, node.inputs[name])

    def read(self, output: Socket) -> Expression:
        self.tree.links.new(output, self.emission.inputs["Color"])
        self.reader = NodeReader()
        return self.reader.expression(Place(self.emission.inputs["Color"]))

    def image(self, source: str = "GENERATED", color_space: str = "sRGB") -> bpy.types.Image:
        image = bpy.data.images.new("picture", 4, 4, is_data=color_space == "Non-Color")
        image.colorspace_settings.name = color_space
        image.source = source
        return image


@pytest.fixture
def stage() -> Stage:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return Stage()


PIXEL = (0.8, 0.4, 0.2, 0.6)  # whole numbers of 255ths
ALPHA_MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")


@pytest.mark.render
def test_alpha_of_an_image_counts_as_in_cycles() -> None:
    cases = list(itertools.product(ALPHA_MODES, ("sRGB", "Non-Color"), (False, True), ("no", "used", "dead")))

    def build(tree: Tree, case: tuple[str, str, bool, str]) -> Socket:
        mode, space, is_float, alpha = case
        image = bpy.data.images.new(str(case), 2, 2, alpha=True, float_buffer=is_float)
        image.colorspace_settings.name, image.alpha_mode = space, mode
        image.pixels.foreach_set(PIXEL * 4)
        image.pack()
        made, small, mix = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Math", "Mix"))
        made.image, small.operation, small.inputs[1].default_value, mix.data_type = image, "MULTIPLY", 1e-9, "RGBA"
        if alpha != "no":
            tree.links.new(made.outputs["Alpha"], small.inputs[0])
        if alpha == "used":
            tree.links.new(small.outputs[0], mix.inputs[0])
        mix.inputs[0].default_value = 1e-9
        tree.links.new(made.outputs["Color"], mix.inputs["A"] if mix.inputs["A"].enabled else mix.inputs[6])
        return mix.outputs[2]

    class Point(Face):
        def image(self, texture: ImageTexture, _coordinates: Triple) -> Value:
            assert texture.coordinates == UvMap()
            picture, alpha = texture.image, PIXEL[3]
            if texture.output == "alpha":
                return alpha
            factor = 1.0
            if not picture.is_data and picture.alpha_mode == "STRAIGHT" and not texture.is_unassociated:
                factor = alpha
            if not picture.is_data and picture.alpha_mode == "PREMUL" and texture.is_unassociated:
                factor = 1.0 / alpha
            red, green, blue = (x * factor for x in PIXEL[:3])
            # of the generated images those of floats are linear
            return (red, green, blue) if picture.is_data or picture.is_float else tuple(map(decoded, (red, green, blue)))

    settings = [Setting(str(case), partial(build, case=case)) for case in cases]
    picture = draw(settings)
    for case in cases:
        value = triple(evaluate(picture.expressions[str(case)], Point(0)))
        # half a step of 8 bits, which after division by the alpha and decoding is so many times more at most
        assert picture.cycles[str(case)][0][1] == pytest.approx(value, abs=0.5 / 255.0 * 2.9 / PIXEL[3]), case


def decoded(x: float) -> float:
    """Return the linear value of a number encoded by sRGB (IEC 61966-2-1)."""
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def test_image_texture_is_read_with_all_its_settings(stage: Stage) -> None:
    image = stage.image("SEQUENCE", "Non-Color")
    node = stage.node("ShaderNodeTexImage", image=image, extension="CLIP", interpolation="Cubic", projection="BOX")
    node.projection_blend = 0.3
    user = node.image_user
    user.frame_start, user.frame_duration, user.frame_offset, user.use_cyclic = 5, 20, 3, True
    coordinates = stage.node("ShaderNodeTexCoord")
    stage.link(coordinates.outputs["Object"], node, "Vector")
    read = stage.read(node.outputs["Color"])
    expected = Image("picture", "Non-Color", True, "STRAIGHT", "SEQUENCE")
    assert read == ImageTexture(expected, Coordinate("object"), "color", "CLIP", "Cubic", "BOX", 0.3, False, (5, 20, 3), True)
    assert stage.reader.images == {"picture": image}
    assert stage.read(node.outputs["Alpha"]) == apply("combine", *[replace(read, output="alpha", is_unassociated=True)] * 3)


@pytest.mark.parametrize(
    "file", [("PNG", "RGB"), ("PNG", "BW"), ("JPEG", "RGB"), ("OPEN_EXR", "RGB"), ("PNG", "RGBA"), ("OPEN_EXR", "RGBA")]
)
def test_alpha_of_a_file_without_it_is_1(stage: Stage, tmp_path: Path, file: tuple[str, str]) -> None:
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_mode = file
    path = str(tmp_path / "picture")
    bpy.data.images.new("made", 4, 4, alpha=True, float_buffer=file[0] == "OPEN_EXR").save_render(path)
    node = stage.node("ShaderNodeTexImage", image=bpy.data.images.load(path))
    read = stage.read(node.outputs["Alpha"])
    assert (read == Constant((1.0, 1.0, 1.0))) == (file[1] != "RGBA")
    node.image.alpha_mode = "NONE"
    assert stage.read(node.outputs["Alpha"]) == Constant((1.0, 1.0, 1.0))


def test_image_of_a_library_has_its_full_name(stage: Stage, tmp_path: Path) -> None:
    image = stage.image()
    bpy.data.libraries.write(str(tmp_path / "other.blend"), {image}, fake_user=True)
    with bpy.data.libraries.load(str(tmp_path / "other.blend"), link=True) as (_, wanted):
        wanted.images = ["picture"]
    node = stage.node("ShaderNodeTexImage", image=wanted.images[0])
    read = stage.read(node.outputs["Color"])
    assert isinstance(read, ImageTexture)
    assert read.image.name == wanted.images[0].name_full != "picture"


def test_mapping_that_changes_nothing_vanishes(stage: Stage) -> None:
    image, mapping = stage.node("ShaderNodeTexImage", image=stage.image()), stage.node("ShaderNodeMapping")
    stage.link(stage.node("ShaderNodeUVMap", uv_map="UVMap").outputs[0], mapping, "Vector")
    stage.link(mapping.outputs[0], image, "Vector")
    for kind in ("POINT", "TEXTURE", "VECTOR"):
        mapping.vector_type = kind
        read = stage.read(image.outputs["Color"])
        assert isinstance(read, ImageTexture)
        assert read.coordinates == UvMap("UVMap")


def test_texture_transform_is_a_scale_a_rotation_and_a_translation(stage: Stage) -> None:
    mapping = stage.node("ShaderNodeMapping")
    stage.link(stage.node("ShaderNodeUVMap").outputs[0], mapping, "Vector")
    mapping.inputs["Scale"].default_value = (2.0, 3.0, 1.0)
    mapping.inputs["Rotation"].default_value = (0.0, 0.0, 0.5)
    mapping.inputs["Location"].default_value = (0.25, 0.75, 0.0)
    scaled = Apply("multiply", (UvMap(), Constant((2.0, 3.0, 1.0))))
    turned = Apply("rotate", (scaled, Constant((0.0, 0.0, 0.5))))
    assert stage.read(mapping.outputs[0]) == Apply("add", (turned, Constant((0.25, 0.75, 0.0))))


def test_tint_is_a_product(stage: Stage) -> None:
    image = stage.node("ShaderNodeTexImage", image=stage.image())
    mix = stage.node("ShaderNodeMix", data_type="RGBA", blend_type="MULTIPLY")
    mix.inputs[0].default_value = 1.0
    stage.link(image.outputs["Color"], mix, 6)
    mix.inputs[7].default_value = (0.5, 0.25, 1.0, 1.0)
    assert stage.read(mix.outputs[2]) == Apply("multiply", (stage.read(image.outputs["Color"]), Constant((0.5, 0.25, 1.0))))


@pytest.mark.parametrize("space", ["TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"])
@pytest.mark.parametrize("convention", ["OPENGL", "DIRECTX"])
def test_normal_map_is_read(stage: Stage, space: str, convention: str) -> None:
    node = stage.node("ShaderNodeNormalMap", space=space, uv_map="UVMap", convention=convention)
    image = stage.node("ShaderNodeTexImage", image=stage.image(color_space="Non-Color"))
    stage.link(image.outputs["Color"], node, "Color")
    stage.link(from_attribute(stage.tree, "p"), node, "Strength")
    read = stage.read(node.outputs[0])
    assert read == NormalMap(stage.read(image.outputs["Color"]), Attribute("p", "factor"), space, "UVMap", convention)


def test_bump_is_read(stage: Stage) -> None:
    node = stage.node("ShaderNodeBump", invert=True)
    stage.link(from_attribute(stage.tree, "p"), node, "Height")
    node.inputs["Strength"].default_value, node.inputs["Distance"].default_value = 0.5, 0.25
    node.inputs["Filter Width"].default_value = 2.0
    height = Attribute("p", "factor")
    expected = Bump(height, Constant(0.5), Constant(0.25), 2.0, True)
    assert stage.read(node.outputs[0]) == expected
    second = stage.node("ShaderNodeBump")
    stage.link(from_attribute(stage.tree, "q"), second, "Height")
    second.inputs["Distance"].default_value = 1.0
    stage.link(node.outputs[0], second, "Normal")
    assert stage.read(second.outputs[0]) == Bump(Attribute("q", "factor"), normal=expected)


def test_normal_that_is_the_surface_own_is_seen_as_such(stage: Stage) -> None:
    own = Coordinate("normal")
    flat = stage.node("ShaderNodeNormalMap")
    assert stage.read(flat.outputs[0]) == own
    weak = stage.node("ShaderNodeNormalMap")
    stage.link(from_attribute(stage.tree, "a"), weak, "Color")
    weak.inputs["Strength"].default_value = 0.0
    assert stage.read(weak.outputs[0]) == own
    bump = stage.node("ShaderNodeBump")
    assert stage.read(bump.outputs[0]) == own
    closure = stage.node("ShaderNodeBsdfDiffuse")
    assert stage.reader.expression(Place(closure.inputs["Normal"])) == Constant((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("kind", "output"),
    [("ObjectInfo", "Random"), ("NewGeometry", "Pointiness"), ("CameraData", "View Z Depth"), ("HairInfo", "Length")],
)
def test_what_cannot_be_read_is_named(stage: Stage, kind: str, output: str) -> None:
    node = stage.node(f"ShaderNode{kind}", label="Mine")
    with pytest.raises(UnsupportedInput) as caught:
        stage.read(node.outputs[output])
    assert caught.value.node == "Mine"
    assert output in caught.value.what and node.bl_label in caught.value.what


def test_image_node_without_image_is_named(stage: Stage) -> None:
    with pytest.raises(UnsupportedInput, match="without an image"):
        stage.read(stage.node("ShaderNodeTexImage").outputs["Color"])


def test_keyed_and_driven_values_are_noted_once_each(stage: Stage) -> None:
    math, value = stage.node("ShaderNodeMath"), stage.node("ShaderNodeValue", label="Shown")
    math.inputs[1].default_value = 2.0
    math.inputs[1].keyframe_insert("default_value", frame=1)
    math.inputs[2].driver_add("default_value")  # which this operation does not use
    stage.link(value.outputs[0], math, 0)
    value.outputs[0].driver_add("default_value")
    assert stage.read(math.outputs[0]) == Constant((2.0, 2.0, 2.0))
    stage.reader.expression(Place(stage.emission.inputs["Color"]))
    assert sorted(node for node, _ in stage.reader.notes) == ["Math", "Shown"]
    assert all("this frame" in what for _, what in stage.reader.notes)


def test_shared_nodes_are_read_once(stage: Stage) -> None:
    output = from_attribute(stage.tree, "p")
    for _ in range(60):  # 2^60 paths
        math = stage.node("ShaderNodeMath", operation="MULTIPLY")
        stage.link(output, math, 0)
        stage.link(output, math, 1)
        output = math.outputs[0]
    assert len(list(walk(stage.read(output)))) == 62  # with the attribute and the triple that the color is
