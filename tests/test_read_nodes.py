# SPDX-License-Identifier: GPL-3.0-or-later
"""Input nodes read into expressions have Cycles' own values, in every setting.

Each setting is a material of an Emission node, each of its samples one face of one pixel. Random inputs come from attributes of the
faces, of which the expression reads the same.
"""

import itertools
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material.expression import (
    Attribute,
    Expression,
    Value,
    evaluate,
    triple,
)
from true_diffuse.addon.material.links import Place
from true_diffuse.addon.material.read_nodes import NodeReader
from true_diffuse.addon.measure import render

SAMPLES = 16  # faces of a setting; the first ones have the EDGES as values
WIDTH = 64  # faces in a row
EDGES = (0.0, 1.0, 0.5, -1.0, 2.0)
VECTORS, NUMBERS = ("a", "b", "c", "d", "e", "f"), ("p", "q", "r", "s", "t", "u", "v", "w", "x")  # names of attributes
# 32-bit floats: a node's chain of operations loses a few of its 2^-24, functions such as powers and hues some more
TOLERANCE = 1e-4


@dataclass
class Setting:
    """A node in one setting. `linked` inputs come from attributes, others have the values of the first sample of these."""

    name: str
    kind: str
    properties: dict[str, Any] = field(default_factory=dict)
    output: str = ""
    is_linked: bool = True
    change: Callable[[bpy.types.Node], object] = lambda _node: None
    """Done to the node before its inputs are linked."""

    def build(self, tree: bpy.types.ShaderNodeTree) -> bpy.types.NodeSocket:
        node = tree.nodes.new(self.kind)
        for name, value in self.properties.items():
            setattr(node, name, value)
        self.change(node)
        names = {"VALUE": iter(NUMBERS), "triple": iter(VECTORS)}
        for socket in node.inputs:
            if not socket.enabled or (socket.name == "Normal" and socket.hide_value):
                continue
            name = next(names["VALUE" if socket.type == "VALUE" else "triple"])
            if self.is_linked:
                source = tree.nodes.new("ShaderNodeAttribute")
                source.attribute_name = name
                tree.links.new(source.outputs["Fac" if socket.type == "VALUE" else "Vector"], socket)
            else:
                value = FACE_VALUES[3][name]
                socket.default_value = (*value, 1.0)[: len(socket.default_value)] if isinstance(value, tuple) else value
        if self.output:
            return next(socket for socket in node.outputs if socket.identifier == self.output)
        return next(socket for socket in node.outputs if socket.enabled)


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


def entries(kind: str, name: str) -> list[str]:
    """The entries of a menu of a node."""
    return [entry.identifier for entry in getattr(bpy.types, kind).bl_rna.properties[name].enum_items]


def settings() -> Iterator[Setting]:
    """Every node in every setting, linked."""
    for operation, clamp in itertools.product(entries("ShaderNodeMath", "operation"), (False, True)):
        yield Setting(
            f"math {operation}{' clamp' if clamp else ''}", "ShaderNodeMath", {"operation": operation, "use_clamp": clamp}
        )
    for operation in entries("ShaderNodeVectorMath", "operation"):
        yield Setting(f"vector math {operation}", "ShaderNodeVectorMath", {"operation": operation})
    for kind in entries("ShaderNodeClamp", "clamp_type"):
        yield Setting(f"clamp {kind}", "ShaderNodeClamp", {"clamp_type": kind})
    kinds = itertools.product(("FLOAT", "FLOAT_VECTOR"), entries("ShaderNodeMapRange", "interpolation_type"), (False, True))
    for data, kind, clamp in kinds:
        properties = {"data_type": data, "interpolation_type": kind, "clamp": clamp}
        yield Setting(f"map range {data} {kind}{' clamp' if clamp else ''}", "ShaderNodeMapRange", properties)
    for kind in entries("ShaderNodeMapping", "vector_type"):
        yield Setting(f"mapping {kind}", "ShaderNodeMapping", {"vector_type": kind})
    for kind, invert in itertools.product(entries("ShaderNodeVectorRotate", "rotation_type"), (False, True)):
        properties = {"rotation_type": kind, "invert": invert}
        yield Setting(f"vector rotate {kind}{' invert' if invert else ''}", "ShaderNodeVectorRotate", properties)
    for axis in "XYZ":
        yield Setting(f"separate xyz {axis}", "ShaderNodeSeparateXYZ", output=axis)
    yield Setting("combine xyz", "ShaderNodeCombineXYZ")
    for data, uniform, clamp in (
        ("FLOAT", "UNIFORM", False),
        ("FLOAT", "UNIFORM", True),
        ("VECTOR", "UNIFORM", False),
        ("VECTOR", "UNIFORM", True),
        ("VECTOR", "NON_UNIFORM", False),
        ("VECTOR", "NON_UNIFORM", True),
    ):
        properties = {"data_type": data, "factor_mode": uniform, "clamp_factor": clamp}
        yield Setting(f"mix {data} {uniform}{' clamp' if clamp else ''}", "ShaderNodeMix", properties)
    for mode, factor, result in itertools.product(entries("ShaderNodeMix", "blend_type"), (False, True), (False, True)):
        properties = {"data_type": "RGBA", "blend_type": mode, "clamp_factor": factor, "clamp_result": result}
        words = f"{' clamp factor' if factor else ''}{' clamp result' if result else ''}"
        yield Setting(f"mix {mode}{words}", "ShaderNodeMix", properties)
    for mode, clamp in itertools.product(entries("ShaderNodeMixRGB", "blend_type"), (False, True)):
        yield Setting(f"mix rgb {mode}{' clamp' if clamp else ''}", "ShaderNodeMixRGB", {"blend_type": mode, "use_clamp": clamp})
    for mode in ("RGB", "HSV", "HSL"):
        for channel in ("Red", "Green", "Blue"):
            yield Setting(f"separate color {mode} {channel}", "ShaderNodeSeparateColor", {"mode": mode}, channel)
        yield Setting(f"combine color {mode}", "ShaderNodeCombineColor", {"mode": mode})
    for kind in ("Gamma", "BrightContrast", "HueSaturation", "Invert", "RGBToBW"):
        yield Setting(kind, f"ShaderNode{kind}")
    yield Setting("normal dot", "ShaderNodeNormal", output="Dot", change=lambda node: _turn(node, (0.2, -0.5, 0.8)))
    yield Setting("normal direction", "ShaderNodeNormal", output="Normal", change=lambda node: _turn(node, (0.2, -0.5, 0.8)))


def _turn(node: bpy.types.Node, direction: tuple[float, float, float]) -> None:
    node.outputs["Normal"].default_value = direction


class Face:
    """The point that an expression sees on one face."""

    def __init__(self, values: dict[str, Value]) -> None:
        self.values = values

    def attribute(self, attribute: Attribute) -> Value:
        return self.values[attribute.name]


@dataclass
class Picture:
    """What Cycles and the expressions make of all settings."""

    cycles: dict[str, list[tuple[float, float, float]]] = field(default_factory=dict)
    expressions: dict[str, Expression] = field(default_factory=dict)


def material_of(setting: Setting) -> tuple[bpy.types.Material, Expression]:
    material = bpy.data.materials.new(setting.name)
    tree = material.node_tree
    tree.nodes.clear()
    output, emission = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeEmission")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    tree.links.new(setting.build(tree), emission.inputs["Color"])
    return material, NodeReader().expression(Place(emission.inputs["Color"]))


def draw(made: list[Setting]) -> Picture:
    """Render all settings in one picture."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    picture = Picture()
    rows = max(4, -(-len(made) * SAMPLES // WIDTH))  # Blender renders no smaller picture
    faces = [(i // SAMPLES, i % SAMPLES) for i in range(len(made) * SAMPLES)]
    vertices, corners = [], []
    for index in range(len(faces)):
        x, y = index % WIDTH, index // WIDTH
        vertices += [(x, y, 0.0), (x + 1.0, y, 0.0), (x + 1.0, y + 1.0, 0.0), (x, y + 1.0, 0.0)]
        corners.append(tuple(range(4 * index, 4 * index + 4)))
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
        picture.cycles.setdefault(made[setting].name, []).append(tuple(pixels[start : start + 3]))
    return picture


@pytest.fixture(scope="module")
def picture() -> Picture:
    return draw(SETTINGS)


SETTINGS = list(settings())
SETTINGS += [Setting(f"{s.name} constant", s.kind, s.properties, s.output, False, s.change) for s in SETTINGS]


@pytest.mark.render
@pytest.mark.parametrize("name", [setting.name for setting in SETTINGS])
def test_node_has_the_value_of_cycles(name: str, picture: Picture) -> None:
    wrong = []
    for values, cycles in zip(FACE_VALUES, picture.cycles[name], strict=True):
        value = triple(evaluate(picture.expressions[name], Face(values)))
        if any(abs(x - y) > TOLERANCE * max(1.0, abs(y)) for x, y in zip(value, cycles, strict=True)):
            wrong.append((values, value, cycles))
    assert not wrong
