# SPDX-License-Identifier: GPL-3.0-or-later
"""Random materials look the same whether Blender knows the values of their sockets or not: in EEVEE, Cycles and OSL.

Where it knows them, groups leave out what they make needless. It does not know what links bring that may vary.

A picture shows a grid of cells, each a tile and a ball of one random material, so that one process renders many of them.
"""

import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random

import bpy

import bmesh
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from mathutils import Matrix

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.id_properties import GROUP_ID
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group, chosen_lights
from true_diffuse.addon.nodes.graph import Socket
from true_diffuse.addon.nodes.principled import DISTRIBUTIONS, METHODS
from true_diffuse.addon.nodes.rough_diffuse import QUALITY
from true_diffuse.scenes.elements import add, uniform_world
from true_diffuse.scenes.sphere import sphere_under_sun

SIDE, CELL = 4, 12  # cells along a side of the picture, pixels along a side of a cell
FRAME = 2
# The same samples of the same closures: what is left is rounding, 6e-8 in Cycles, which a highlight's slope may multiply by 1000,
# and EEVEE's colors of 10 bits.
TOLERANCE = {engines.CYCLES: 1e-4, engines.EEVEE: 1e-3}
# Rounding may also turn over which closure a sample takes: chances of 1e-7 for each of some 1e4 choices in a cell
TURNED = 2  # pixels of a cell

FACTORS = (0.0, 1.0, 3e-6, 5e-5, 0.02, 0.3, 0.7)
"""Weights: the ends, next to them, where lights are still seen in what is glossy, and between."""
ROUGHNESSES = (0.0, 1.0, 3e-6, 5e-5, 0.1, 0.4)
LENGTHS = ((0.0, 0.0, 0.0), (1.3, 0.95, 0.67), (200.0, 100.0, 50.0), (30.0, 0.0, 1e-4))
COLORS = ((0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0), (0.8, 0.5, 0.2, 1.0), (0.3, 0.0, 3e-6, 1.0), (5e-5, 5e-5, 5e-5, 1.0))
QUICK = (BALANCED, FAST, CHOSEN_LIGHTS)
"""Qualities whose shaders EEVEE compiles within a second."""
CLOSURES = ("ShaderNodeBsdf", "ShaderNodeSubsurface")  # how their identifiers start
MENUS = {
    "Model": [model.label for model in MODELS.values()],
    "Distribution": [entry for entry, _ in DISTRIBUTIONS.values()],
    "Method": [entry for entry, _ in METHODS.values()],
    "Subsurface Method": [entry for entry, _ in METHODS.values()],
}


@dataclass(frozen=True)
class Recipe:
    """One random material, in words that are printed where it fails."""

    group: str
    """The key of the group."""
    inputs: dict[str, materials.Setting]
    sources: dict[str, str]
    """What sockets get: a name of SOURCES, by the name of the socket."""
    wrap: str
    """Where the node is, a name of WRAPS."""
    second: "Recipe | None" = None
    """The material of the ball, where it is not that of the tile."""


# What the materials are made of


def constant(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return a node's output with the socket's own value."""
    if socket.type == "VECTOR":
        node = tree.nodes.new("ShaderNodeCombineXYZ")
        for part, value in zip(node.inputs, socket.default_value, strict=True):
            part.default_value = value
        return node.outputs[0]
    output = tree.nodes.new("ShaderNodeRGB" if socket.type == "RGBA" else "ShaderNodeValue").outputs[0]
    output.default_value = socket.default_value
    return output


def image(tree: bpy.types.ShaderNodeTree, _socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.get("Grid") or bpy.data.images.new("Grid", 8, 8)
    node.image.generated_type = "COLOR_GRID"
    return node.outputs["Color"]


def noise(tree: bpy.types.ShaderNodeTree, _socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    return tree.nodes.new("ShaderNodeTexNoise").outputs["Color"]


def muted(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type, node.mute = "RGBA", True
    inputs = [own for own in node.inputs if own.enabled and own.type == "RGBA"]
    inputs[0].default_value = (0.2, 0.4, 0.6, 1.0)
    tree.links.new(checker(tree, socket), inputs[1])
    return next(output for output in node.outputs if output.enabled)


def checker(tree: bpy.types.ShaderNodeTree, _socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    return tree.nodes.new("ShaderNodeTexChecker").outputs["Fac"]


def tilted(tree: bpy.types.ShaderNodeTree, _socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeCombineXYZ")
    for part, value in zip(node.inputs, (0.4, -0.8, 0.2), strict=True):
        part.default_value = value
    return node.outputs[0]


def normal_map(tree: bpy.types.ShaderNodeTree, _socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return normals that lean by a slope of up to 1.5 along the tangents."""
    waves = tree.nodes.new("ShaderNodeVectorMath")
    waves.operation, waves.inputs[1].default_value = "SCALE", (1.0, 1.0, 1.0)
    waves.inputs["Scale"].default_value = 25.0
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["UV"], waves.inputs[0])
    previous = waves
    for operation, second, third in (
        ("SINE", None, None),
        ("MULTIPLY_ADD", (1.5, 1.5, 0.0), (0.0, 0.0, 1.0)),
        ("NORMALIZE", None, None),
        ("MULTIPLY_ADD", (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)),
    ):
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        for place, value in ((1, second), (2, third)):
            if value:
                node.inputs[place].default_value = value
        tree.links.new(previous.outputs[0], node.inputs[0])
        previous = node
    node = tree.nodes.new("ShaderNodeNormalMap")
    tree.links.new(previous.outputs[0], node.inputs["Color"])
    return node.outputs["Normal"]


def bump(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeBump")
    node.inputs["Distance"].default_value = 0.3
    tree.links.new(noise(tree, socket), node.inputs["Height"])
    return node.outputs["Normal"]


def muted_bump(tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    output = bump(tree, socket)
    output.node.mute = True
    return output


def drive(_tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> None:
    curves = socket.driver_add("default_value")
    for curve in curves if isinstance(curves, list) else [curves]:
        curve.driver.expression = "frame / 5"


def key(_tree: bpy.types.ShaderNodeTree, socket: bpy.types.NodeSocket) -> None:
    socket.keyframe_insert("default_value", frame=1)
    value = socket.default_value
    socket.default_value = True if isinstance(value, bool) else 0.5 if isinstance(value, float) else [0.5 for _ in value]
    socket.keyframe_insert("default_value", frame=3)


type Source = Callable[[bpy.types.ShaderNodeTree, bpy.types.NodeSocket], bpy.types.NodeSocket | None]
NORMALS: dict[str, Source] = {
    "tilted": tilted,
    "normal map": normal_map,
    "bump": bump,
    "muted bump": muted_bump,
}
SOURCES: dict[str, Source] = {
    "constant": constant,
    "image": image,
    "noise": noise,
    "checker": checker,
    "muted": muted,
    "driver": drive,
    "keys": key,
}


def fill(tree: bpy.types.ShaderNodeTree, recipe: Recipe) -> bpy.types.Node:
    """Return a new node in `tree` that holds the recipe's group, with all that feeds it."""
    node = materials.add_group(tree, next(group for group in GROUPS if group.key == recipe.group))
    materials.set_inputs(node, recipe.inputs)
    for name, source in recipe.sources.items():
        output = (NORMALS | SOURCES)[source](tree, node.inputs[name])
        if output:
            tree.links.new(output, node.inputs[name])
    return node


def alone(tree: bpy.types.ShaderNodeTree, recipe: Recipe) -> bpy.types.NodeSocket:
    return fill(tree, recipe).outputs["BSDF"]


def muted_node(tree: bpy.types.ShaderNodeTree, recipe: Recipe) -> bpy.types.NodeSocket:
    node = fill(tree, recipe)
    node.mute = True
    return node.outputs["BSDF"]


def mixed(tree: bpy.types.ShaderNodeTree, recipe: Recipe) -> bpy.types.NodeSocket:
    """Return a mix of the group and a Diffuse BSDF, by a texture."""
    node = tree.nodes.new("ShaderNodeMixShader")
    for socket, output in zip(
        node.inputs,
        (checker(tree, node.inputs[0]), alone(tree, recipe), tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0]),
        strict=True,
    ):
        tree.links.new(output, socket)
    return node.outputs[0]


def added_twice(tree: bpy.types.ShaderNodeTree, recipe: Recipe) -> bpy.types.NodeSocket:
    """Return the sum of a muted mix and another node of the same group, of its defaults."""
    node = tree.nodes.new("ShaderNodeAddShader")
    mix = mixed(tree, recipe)
    mix.node.mute = True
    tree.links.new(mix, node.inputs[0])
    tree.links.new(alone(tree, Recipe(recipe.group, {}, {}, "alone")), node.inputs[1])
    return node.outputs[0]


def nested(tree: bpy.types.ShaderNodeTree, recipe: Recipe, depth: int = 2) -> bpy.types.NodeSocket:
    """Return the output of the artist's group, in which another one holds ours."""
    own = bpy.data.node_groups.new(f"Own {depth}", "ShaderNodeTree")
    own.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner = nested(own, recipe, depth - 1) if depth > 1 else alone(own, recipe)
    own.links.new(inner, own.nodes.new("NodeGroupOutput").inputs["Result"])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = own
    return node.outputs[0]


def linked_menu(tree: bpy.types.ShaderNodeTree, recipe: Recipe) -> bpy.types.NodeSocket:
    """Return the output of the artist's group, whose own menu, color and number choose ours."""
    own = bpy.data.node_groups.new("Own, with a menu", "ShaderNodeTree")
    own.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner = fill(own, recipe)
    outside = own.nodes.new("NodeGroupInput")
    kinds = {"MENU": "NodeSocketMenu", "RGBA": "NodeSocketColor", "VALUE": "NodeSocketFloat"}
    passed = [socket for socket in inner.inputs if socket.type in kinds and not socket.is_linked][:3]
    for socket in passed:
        own.interface.new_socket(socket.name, in_out="INPUT", socket_type=kinds[socket.type])
        own.links.new(outside.outputs[socket.name], socket)
    own.links.new(inner.outputs["BSDF"], own.nodes.new("NodeGroupOutput").inputs["Result"])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = own
    for socket in passed:
        node.inputs[socket.name].default_value = socket.default_value
    return node.outputs[0]


WRAPS: dict[str, Callable[[bpy.types.ShaderNodeTree, Recipe], bpy.types.NodeSocket]] = {
    "alone": alone,
    "muted": muted_node,
    "mixed": mixed,
    "added twice": added_twice,
    "nested": nested,
    "linked menu": linked_menu,
}


def material_of(name: str, recipe: Recipe) -> bpy.types.Material:
    """Return a new material made by a recipe."""
    made = bpy.data.materials.new(name)
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(WRAPS[recipe.wrap](tree, recipe), output.inputs["Surface"])
    materials.set_thickness(made)
    # else what Cycles knows of its emission decides which lamps it samples, in the whole picture
    made.cycles.emission_sampling = "NONE"
    return made


# Recipes


def value(socket: Socket, choose: Random) -> materials.Setting:
    """Return a random value of an unlinked socket."""
    if socket.kind == "NodeSocketColor":
        return choose.choice(COLORS)
    if socket.kind == "NodeSocketVector":
        return choose.choice(LENGTHS)
    if "Roughness" in socket.name:
        return choose.choice(ROUGHNESSES)
    if socket.subtype == "FACTOR" and (socket.minimum, socket.maximum) == (0.0, 1.0):
        return choose.choice(FACTORS)
    return choose.uniform(socket.minimum or 0.0, min(socket.maximum or 10.0, 30.0))


def source(socket: Socket, choose: Random) -> str:
    """Return what feeds a linked socket."""
    if socket.name == "Normal":
        return choose.choice(list(NORMALS))
    return "tilted" if socket.hide_value else choose.choice(list(SOURCES))


def drawn_order(group: Group) -> list[Socket]:
    """Return the sockets of `group` in the order in which their values are drawn, whatever the node shows first.

    Other draws make materials of many layers with glass or scattering, in which a closure of weight 0 changes what random numbers
    the others take: their pictures differ by noise, which TOLERANCE does not hold.
    """
    sockets = {socket.name: socket for socket in group.inputs}
    subsurface = ("Method", "Model", "Color", "Roughness")
    first = {PRINCIPLED: ("Distribution", "Subsurface Method"), SUBSURFACE: subsurface}.get(group, ())
    last = ("IOR", "Normal") if group is SUBSURFACE else ()
    between = [name for name in sockets if name not in (*first, *last)]
    if group is PRINCIPLED:
        between.remove("Quality")
        between.insert(between.index("Diffuse Roughness") + 1, "Quality")
    return [sockets[name] for name in (*first, *between, *last)]


def recipe(choose: Random, qualities: Sequence[str], is_second: bool = False) -> Recipe:
    """Return a random material in one of the `qualities`."""
    group: Group = choose.choice((ROUGH_DIFFUSE, SUBSURFACE, PRINCIPLED, SPECULAR_GROUP))
    inputs, fed = {}, {}
    for socket in drawn_order(group):
        if socket.kind == "NodeSocketMenu":
            own = (BALANCED, CHOSEN_LIGHTS) if group is SPECULAR_GROUP else qualities
            inputs[socket.name] = choose.choice(own if socket.name == QUALITY.name else MENUS[socket.name])
        elif choose.random() < (0.4 if socket.name in ("Normal", "Color", "Base Color", "Roughness") else 0.1):
            fed[socket.name] = source(socket, choose)
        elif socket.kind != "NodeSocketBool" and not socket.hide_value and choose.random() < 0.5:
            inputs[socket.name] = value(socket, choose)
    second = recipe(choose, qualities, True) if not is_second and choose.random() < 0.25 else None
    return Recipe(group.key, inputs, fed, choose.choice(list(WRAPS)), second)


# Pictures


def build(made: list[Recipe]) -> bpy.types.Scene:
    """Return a scene with a cell for each recipe: a tile that leans towards the sun, and a ball in front of it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    stage = sphere_under_sun(SIDE * CELL)
    scene, sun = stage.scene, stage.sun
    bpy.data.objects.remove(stage.sphere)
    sun.rotation_euler = math.radians(60.0), 0.0, math.radians(30.0)
    point = add(scene, "Point", bpy.data.lights.new("Point", "POINT"))
    point.location, point.data.energy = (3.0, -3.0, 3.0), 300.0
    dark = add(scene, "Dark", bpy.data.lights.new("Dark", "POINT"))
    dark.data.energy = 0.0
    chosen_lights.choose([sun, dark, point])
    scene.world = uniform_world("Sky", (0.2, 0.3, 0.4))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", float(SIDE)
    scene.eevee.use_raytracing = False
    mesh = cell_mesh()
    for index, own in enumerate(made):
        item = add(scene, f"Cell {index}", mesh)
        item.location = index % SIDE - 0.5 * (SIDE - 1), 0.0, 0.5 * (SIDE - 1) - index // SIDE
        both = (own, own.second or own)
        for place, (slot, shown) in enumerate(zip(item.material_slots, both, strict=True)):
            slot.link = "OBJECT"
            reused = place and not own.second
            slot.material = item.material_slots[0].material if reused else material_of(f"Cell {index}, {place}", shown)
    scene.frame_set(FRAME)
    return scene


def cell_mesh() -> bpy.types.Mesh:
    """Return a tile with a ball in front of it, both with UV and each with a slot."""
    shape = bmesh.new()
    shape.loops.layers.uv.new("UVMap")
    lean = Matrix.Rotation(math.radians(70.0), 4, "X")
    bmesh.ops.create_grid(shape, size=0.45, matrix=lean, calc_uvs=True)
    tile = set(shape.faces)
    ball = Matrix.Translation((0.1, -0.4, 0.1))
    bmesh.ops.create_uvsphere(shape, u_segments=16, v_segments=8, radius=0.25, matrix=ball, calc_uvs=True)
    for face in shape.faces:
        face.smooth = face.material_index = face not in tile
    mesh = bpy.data.meshes.new("Cell")
    shape.to_mesh(mesh)
    shape.free()
    for name in ("Tile", "Ball"):
        mesh.materials.append(bpy.data.materials.new(name))
    return mesh


def cell(picture: array[float], index: int) -> array[float]:
    """Return the pixels of a cell, red, green and blue each."""
    width, top, left = 3 * SIDE * CELL, index // SIDE * CELL, 3 * CELL * (index % SIDE)
    rows = (picture[row * width + left : row * width + left + 3 * CELL] for row in range(top, top + CELL))
    return array("f", [value for row in rows for value in row])


def change(before: array[float], after: array[float]) -> float:
    """Return the RMS change of a cell's pixels, without the TURNED ones that change most, over the RMS of `before`."""
    squares = [(b - a) ** 2 for a, b in zip(before, after, strict=True)]
    pixels = sorted(map(sum, zip(squares[0::3], squares[1::3], squares[2::3], strict=True)))
    return math.sqrt(sum(pixels[:-TURNED]) / sum(value * value for value in before))


def changed(scene: bpy.types.Scene, engine: engines.Engine, samples: int, alter: Callable[[], object]) -> list[int]:
    """Return the cells that look otherwise after a call of `alter`."""
    _, before = render.radiance(scene, engine, samples)
    assert sum(value > 0.01 for value in before) > 0.5 * len(before), "most of the picture is black"
    alter()
    _, after = render.radiance(scene, engine, samples)
    cells = range(sum(item.name.startswith("Cell") for item in scene.objects))
    return [index for index in cells if not change(cell(before, index), cell(after, index)) <= TOLERANCE[engine]]


def check(seeds: list[int], engine: engines.Engine, samples: int, osl: bool = False, qualities: Sequence[str] = QUICK) -> None:
    """Assert that no cell changes when the values of the recipes of `seeds` are hidden, and that shaders get more closures then."""
    made = [recipe(Random(seed), qualities) for seed in seeds]
    scene = build(made)
    scene.cycles.shading_system = osl
    engines.use(scene, engine, samples)
    lean = closures()
    wrong = changed(scene, engine, samples, hide_values)
    assert not wrong, {seeds[index]: made[index] for index in wrong}
    whole = closures()
    assert osl or any(whole[name] > lean[name] for name in lean)  # with OSL most are one Script


def hide_values() -> None:
    """Link to each socket for a number its value plus an attribute that no mesh has, which is 0, but not known to be.

    Not to Anisotropic: with OSL Blender's own Principled BSDF of metal is black at a constant 3e-6, but not at a linked one (5.2).
    """
    own = [tree for tree in bpy.data.node_groups if GROUP_ID not in tree]
    for tree in [*own, *(material.node_tree for material in bpy.data.materials)]:
        animated = tree.animation_data
        drivers = [curve.data_path for curve in animated.drivers] if animated else []
        keys = [curve.data_path for curve in fcurves_of(animated.action)] if animated and animated.action else []
        missing = tree.nodes.new("ShaderNodeAttribute")
        missing.attribute_name = "none"
        for socket in [socket for node in tree.nodes if node.type == "GROUP" for socket in node.inputs]:
            if socket.type != "VALUE" or socket.is_linked or socket.name == "Anisotropic":
                continue
            if socket.path_from_id("default_value") in (*drivers, *keys):
                continue
            total = tree.nodes.new("ShaderNodeMath")
            total.inputs[0].default_value = socket.default_value
            tree.links.new(missing.outputs["Fac"], total.inputs[1])
            tree.links.new(total.outputs[0], socket)


def fcurves_of(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    return [curve for layer in action.layers for strip in layer.strips for bag in strip.channelbags for curve in bag.fcurves]


def closures() -> dict[str, int]:
    """Return the number of closures that each cell's material has when Blender makes a shader of it for the scene's engine."""
    graph = bpy.context.evaluated_depsgraph_get()
    graph.update()
    sizes = {}
    for material in (material for material in bpy.data.materials if material.name.startswith("Cell")):
        inlined = bpy.types.InlineShaderNodes.from_material(material.evaluated_get(graph))
        sizes[material.name] = sum(node.bl_idname.startswith(CLOSURES) for node in inlined.node_tree.nodes)
    return sizes


def pictures(examples: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator of a test that takes a seed for each cell, for so many pictures.

    A failure names its cells, so none is shrunk.
    """
    seeds = st.lists(st.integers(0, 2**32 - 1), min_size=SIDE**2, max_size=SIDE**2, unique=True)
    ignored = [HealthCheck.function_scoped_fixture]  # that fixture only skips
    run = settings(max_examples=examples, derandomize=True, phases=(Phase.generate,), suppress_health_check=ignored)
    return lambda test: run(given(seeds=seeds)(test))


needs_osl = pytest.mark.skipif(not compiles_osl(), reason="this Blender was built without Open Shading Language")


@pytest.mark.render
@pytest.mark.parametrize("osl", [False, pytest.param(True, marks=needs_osl)])
@pictures(1)
def test_random_materials_stay_in_cycles(osl: bool, seeds: list[int]) -> None:
    check(seeds, engines.CYCLES, 4, osl)


@pytest.mark.render
@pytest.mark.usefixtures("driver")
@pictures(1)
def test_random_materials_stay_in_eevee(seeds: list[int]) -> None:
    check(seeds, engines.EEVEE, 2)


@pytest.mark.render
def test_change_of_one_closure_shows() -> None:
    recipes = [Recipe(SUBSURFACE.key, {"Subsurface": 0.3}, {"Normal": "bump"}, wrap) for wrap in ("alone", "mixed", "nested")]
    scene = build(recipes)
    (node,) = (node for node in bpy.data.materials["Cell 1, 0"].node_tree.nodes if node.type == "GROUP")

    def darken() -> None:
        node.inputs["Color"].default_value[0] *= 0.99

    assert changed(scene, engines.CYCLES, 4, darken)[0] == 1


@pytest.mark.slow
@pictures(20)
def test_many_random_materials_stay_in_cycles(seeds: list[int]) -> None:
    check(seeds, engines.CYCLES, 4, compiles_osl() and seeds[0] % 2 == 1, qualities=(*QUICK, PRECISE))


@pytest.mark.slow
@pytest.mark.usefixtures("driver")
@pictures(5)
def test_many_random_materials_stay_in_eevee(seeds: list[int]) -> None:
    check(seeds, engines.EEVEE, 2, qualities=(*QUICK, PRECISE))
