# SPDX-License-Identifier: GPL-3.0-or-later
"""Optimized materials: constant folding, the same picture, and the restored group after every change that matters."""

import math
from array import array
from collections.abc import Callable
from pathlib import Path

import bpy

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from true_diffuse.addon import usd
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.id_properties import SPECIALIZED_FOR
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group, chosen_lights
from true_diffuse.addon.optimize import arithmetic
from true_diffuse.addon.optimize.materials import optimize_materials, remove_unused, restore_materials
from true_diffuse.scenes.sphere import SphereUnderSun, sphere_under_sun

pytestmark = pytest.mark.usefixtures("empty_file")
FILE = "file of materials.blend"

numbers = st.floats(-1e3, 1e3).map(lambda x: round(x, 6))
vectors = st.tuples(numbers, numbers, numbers)


in_blender = pytest.mark.usefixtures("registered")


def node_of(material: bpy.types.Material) -> bpy.types.Node:
    return next(node for node in material.node_tree.nodes if node.type == "GROUP")


def shown(group: Group, **inputs: materials.Setting) -> tuple[SphereUnderSun, bpy.types.Node]:
    """Return a small sphere of a new material, and the material's node."""
    sphere = sphere_under_sun(16)
    material = materials.create("Shown", group, **inputs)
    sphere.sphere.data.materials[0] = material
    return sphere, node_of(material)


def is_optimized(node: bpy.types.Node) -> bool:
    return SPECIALIZED_FOR in node.node_tree


def closures(node: bpy.types.Node) -> list[str]:
    """Return the types of the closures that the engine of the scene gets of a node's material, sorted."""
    inlined = bpy.types.InlineShaderNodes.from_material(evaluated(node))
    names = (inner.bl_idname.removeprefix("ShaderNode") for inner in inlined.node_tree.nodes)
    return sorted(name for name in names if name.startswith(("Bsdf", "Sub", "Script", "Emission")))


def evaluated(node: bpy.types.Node) -> bpy.types.Material:
    """Return the material of `node` with its drivers set for the scene."""
    (material,) = (material for material in bpy.data.materials if material.node_tree == node.id_data)
    graph = bpy.context.evaluated_depsgraph_get()
    graph.update()
    return material.evaluated_get(graph)


def link_source(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket:
    """Link a socket to a new node whose output has the socket's value; returns the output."""
    socket, tree = node.inputs[name], node.id_data
    if socket.type == "VECTOR":
        source = tree.nodes.new("ShaderNodeCombineXYZ")
        for part, value in zip(source.inputs, socket.default_value, strict=True):
            part.default_value = value
    else:
        source = tree.nodes.new("ShaderNodeRGB" if socket.type == "RGBA" else "ShaderNodeValue")
        source.outputs[0].default_value = socket.default_value
    tree.links.new(source.outputs[0], socket)
    return source.outputs[0]


# Arithmetic


BINARY: dict[str, Callable[[mpmath.mpf, float], object]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0,
    "MAXIMUM": lambda a, b: b if b > a else a,
    "MINIMUM": lambda a, b: b if b < a else a,
    "GREATER_THAN": lambda a, b: int(a > b),
    "LESS_THAN": lambda a, b: int(a < b),
}
UNARY: dict[str, Callable[[mpmath.mpf], object]] = {
    "SQRT": lambda a: mpmath.sqrt(max(a, 0)),
    "ARCCOSINE": lambda a: mpmath.acos(min(max(a, -1), 1)),
    "COSINE": mpmath.cos,
    "ABSOLUTE": abs,
}


@pytest.mark.parametrize("operation", BINARY)
@given(a=numbers, b=numbers)
def test_binary_operations_match_mpmath(operation: str, a: float, b: float) -> None:
    expected = float(BINARY[operation](mpmath.mpf(a), b))
    assert arithmetic.scalar(operation, a, b) == pytest.approx(expected, rel=1e-15)


@given(numbers, numbers, numbers)
def test_multiply_add_matches_mpmath(a: float, b: float, c: float) -> None:
    # the product is rounded before the sum: relative to the product, not to what cancellation leaves
    exact = float(mpmath.mpf(a) * b + c)
    assert arithmetic.scalar("MULTIPLY_ADD", a, b, c) == pytest.approx(exact, rel=1e-15, abs=2e-16 * abs(a * b))


@pytest.mark.parametrize("operation", UNARY)
@given(a=numbers)
def test_unary_operations_match_mpmath(operation: str, a: float) -> None:
    assert arithmetic.scalar(operation, a) == pytest.approx(float(UNARY[operation](mpmath.mpf(a))), rel=1e-14, abs=1e-15)


@given(st.floats(1e-3, 1e3), st.floats(-5.0, 5.0))
def test_powers_match_mpmath(base: float, exponent: float) -> None:
    assert arithmetic.scalar("POWER", base, exponent) == pytest.approx(float(mpmath.power(base, exponent)), rel=1e-13)


@given(vectors, vectors, numbers)
def test_vector_operations_match_mpmath(a, b, c: float) -> None:
    assert arithmetic.vector("MULTIPLY", a, c) == tuple(x * c for x in a)
    assert arithmetic.vector("ADD", c, b) == tuple(c + x for x in b)
    exact = mpmath.fdot([mpmath.mpf(x) for x in a], b)
    size = float(mpmath.fdot(map(abs, a), map(abs, b)))
    assert arithmetic.vector("DOT_PRODUCT", a, b) == pytest.approx(float(exact), rel=1e-14, abs=1e-15 * size)
    length = mpmath.sqrt(mpmath.fdot([mpmath.mpf(x) for x in a], a))
    assert arithmetic.vector("LENGTH", a) == pytest.approx(float(length), rel=1e-14)
    normal = arithmetic.vector("NORMALIZE", a)
    assert normal == pytest.approx([float(x / length) if length else 0.0 for x in a], rel=1e-13)
    across = arithmetic.vector("CROSS_PRODUCT", a, b)
    scale = math.hypot(*a) * math.hypot(*b)
    assert sum(x * y for x, y in zip(across, a, strict=True)) == pytest.approx(0.0, abs=1e-14 * scale * math.hypot(*a))
    assert math.hypot(*across) ** 2 + float(exact) ** 2 == pytest.approx(scale**2, rel=1e-12, abs=1e-300)  # Lagrange's identity


@pytest.mark.parametrize(
    ("operation", "operands", "expected"),
    [
        ("DIVIDE", (1.0, 0.0), 0.0),
        ("SQRT", (-1.0,), 0.0),
        ("ARCCOSINE", (2.0,), 0.0),
        ("ARCCOSINE", (-2.0,), math.pi),
        ("POWER", (-1.0, 0.5), 0.0),
        ("POWER", (10.0, 400.0), math.inf),
        ("MAXIMUM", (1.0, math.nan), 1.0),
        ("MINIMUM", (math.nan, 3.0), 3.0),
    ],
)
def test_arithmetic_of_undefined_operands(operation: str, operands: tuple[float, ...], expected: float) -> None:
    assert arithmetic.scalar(operation, *operands) == expected


def test_zero_vector_stays_zero_when_normalized() -> None:
    assert arithmetic.vector("NORMALIZE", (0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)


def test_unknown_operation_raises() -> None:
    with pytest.raises(KeyError):
        arithmetic.scalar("SNAP", 1.0, 2.0)


# The same picture


def rough(quality: str = "Balanced", **inputs: materials.Setting) -> tuple[Group, dict[str, materials.Setting]]:
    return ROUGH_DIFFUSE, {"Quality": quality, "Color": (0.8, 0.5, 0.2, 1.0)} | inputs


CASES: dict[str, tuple[Group, dict[str, materials.Setting]]] = {
    "sigma 0": rough(Roughness=0.0),
    "linked color": rough(),
    "EON, driven roughness": rough(Model="EON"),
    "one lobe, Wolff": rough("Fast", Model="Wolff", Normal=(-0.5, -3.0, 0.2)),
    "linked normal, of no length": rough(Roughness=0.5),
    "two lights, one dark": rough("Exact for Chosen Lights", Roughness=0.5),
    "specular": (SPECULAR_GROUP, {}),
    "specular, two lights, one dark": (SPECULAR_GROUP, {"Quality": "Exact for Chosen Lights", "Exponent": 5.0, "Specular": 0.5}),
    "no scattering, no coat": (SUBSURFACE, {"Subsurface": 0.0, "Specular": 0.0}),
    "scattering alone": (SUBSURFACE, {"Subsurface": 1.0, "Specular": 0.0, "Subsurface Radius": (100.0, 50.0, 20.0)}),
    "all layers": (SUBSURFACE, {"Subsurface": 0.5, "Subsurface Radius": (100.0, 50.0, 20.0)}),
}


LEANER = {"sigma 0", "no scattering, no coat", "scattering alone"}
"""Those of CASES that have something to leave out."""


def all_cases() -> bpy.types.Scene:
    """Return a scene with a ball of each of CASES, lit by a sun; a second light is dark."""
    sphere = sphere_under_sun(48)
    dark = bpy.data.objects.new("Dark", bpy.data.lights.new("Dark", "POINT"))
    dark.data.energy = 0.0
    sphere.scene.collection.objects.link(dark)
    sphere.sun.rotation_euler = (math.radians(50.0), 0.0, 0.3)
    chosen_lights.choose([sphere.sun, dark])
    for index, (name, (group, inputs)) in enumerate(CASES.items()):
        ball = bpy.data.objects.new(name, sphere.sphere.data)
        ball.scale = (0.25,) * 3
        ball.location = (index % 4 - 1.5) * 0.5, 0.0, (index // 4 - 1) * 0.5
        sphere.scene.collection.objects.link(ball)
        material = materials.create(name, group, **inputs)
        ball.material_slots[0].link, ball.material_slots[0].material = "OBJECT", material
        if name == "linked color":
            materials.paint(material, node_of(material).inputs["Color"], "none", 1.0)
            link_source(node_of(material), "Color")
        elif "normal" in name:
            link_source(node_of(material), "Normal")
        elif "driven" in name:
            driver = node_of(material).inputs["Roughness"].driver_add("default_value").driver
            driver.expression = "0.1 + frame / 10"
    bpy.data.objects.remove(sphere.sphere)
    return sphere.scene


@pytest.mark.render
@pytest.mark.parametrize(("engine", "osl"), [("eevee", False), ("cycles", False), ("cycles", True)], indirect=["engine"])
def test_picture_stays(engine: engines.Engine, osl: bool) -> None:
    if osl and not compiles_osl():
        pytest.skip("this Blender was built without Open Shading Language")
    scene = all_cases()
    scene.cycles.shading_system = osl
    scene.frame_set(2)  # sets the drivers
    _, whole = render.radiance(scene, engine, 4)
    results = {result.owner: result for result in optimize_materials()}
    assert {name for name, result in results.items() if result.left_out} == LEANER
    _, optimized = render.radiance(scene, engine, 4)
    # The same samples of the same closures: what is left is rounding, in Cycles of 32 bits, in EEVEE of colors of 10 bits
    assert error.difference(optimized, whole, range(48 * 48)) < (1e-4 if engine is engines.CYCLES else 1e-3)
    # and a change of one of them would show
    node_of(bpy.data.materials["sigma 0"]).inputs["Color"].default_value = (0.4, 0.5, 0.2, 1.0)
    assert error.difference(render.radiance(scene, engine, 4)[1], whole, range(48 * 48)) > 0.01


@pytest.mark.render
def test_driven_and_keyed_sockets_stay_alive() -> None:
    sphere, node = shown(SUBSURFACE, Model="Fujii", Subsurface=0.0, Specular=0.0)
    socket = node.inputs["Roughness"]
    for frame, value in ((1, 0.0), (2, 1.0)):
        socket.default_value = value
        socket.keyframe_insert("default_value", frame=frame)
    color = node.inputs["Color"].driver_add("default_value", 0).driver
    color.expression = "frame / 2"

    def picture(frame: int) -> array[float]:
        sphere.scene.frame_set(frame)
        return render.radiance(sphere.scene, engines.CYCLES, 1)[1]

    engines.use(sphere.scene, engines.CYCLES, 1)
    first, second = picture(1), picture(2)
    (result,) = optimize_materials()
    assert result.left_out and is_optimized(node)
    assert error.difference(picture(1), first, range(16 * 16)) < 1e-5
    assert error.difference(picture(2), second, range(16 * 16)) < 1e-5
    assert error.difference(first, second, range(16 * 16)) > 0.1


# The optimized tree


LAMBERT = ["BsdfDiffuse"]
PAIR = ["BsdfDiffuse", "BsdfTranslucent", "SubsurfaceScattering"]
COAT = ["BsdfAnisotropic"]


@pytest.mark.parametrize(
    ("engine", "group", "inputs", "before", "after"),
    [
        (engines.EEVEE, ROUGH_DIFFUSE, {}, PAIR, PAIR),
        (engines.CYCLES, ROUGH_DIFFUSE, {"Model": "Fujii"}, LAMBERT, LAMBERT),
        (engines.CYCLES, ROUGH_DIFFUSE, {"Model": "Lambert"}, LAMBERT, LAMBERT),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Quality": "Fast"}, LAMBERT, LAMBERT),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Quality": "Exact for Chosen Lights"}, LAMBERT, LAMBERT),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Roughness": 0.0}, PAIR, LAMBERT),
        (engines.CYCLES, ROUGH_DIFFUSE, {"Roughness": 0.0, "Model": "EON"}, LAMBERT * 3, LAMBERT),
        (engines.EEVEE, ROUGH_DIFFUSE, {"Color": (0.0, 0.0, 0.0, 1.0)}, PAIR, []),
        (engines.CYCLES, SUBSURFACE, {}, [*COAT, *LAMBERT * 3, "SubsurfaceScattering"], [*COAT, *LAMBERT, "SubsurfaceScattering"]),
        (engines.EEVEE, SUBSURFACE, {"Specular": 0.0}, [*COAT, *LAMBERT, "SubsurfaceScattering"], ["SubsurfaceScattering"]),
        (
            engines.EEVEE,
            SUBSURFACE,
            {"Subsurface": 0.0, "Model": "Lambert"},
            [*COAT, *LAMBERT, "SubsurfaceScattering"],
            [*COAT, *LAMBERT],
        ),
        (engines.EEVEE, SPECULAR_GROUP, {"Specular": 0.0}, [*COAT, *LAMBERT], LAMBERT),
        (engines.EEVEE, SPECULAR_GROUP, {"Quality": "Exact for Chosen Lights"}, LAMBERT, LAMBERT),
        (engines.CYCLES, PRINCIPLED, {}, [*LAMBERT * 2, *["BsdfPrincipled"] * 2], [*LAMBERT, "BsdfPrincipled"]),
        (engines.CYCLES, PRINCIPLED, {"Model": "Lambert"}, ["BsdfPrincipled"], ["BsdfPrincipled"]),
    ],
)
def test_engine_gets_only_the_closures_needed(
    engine: engines.Engine, group: Group, inputs: dict[str, materials.Setting], before: list[str], after: list[str]
) -> None:
    sphere, node = shown(group, **inputs)
    engines.use(sphere.scene, engine, 1)
    assert closures(node) == before
    optimize_materials()
    assert closures(node) == after
    assert is_optimized(node) == (before != after)


@pytest.mark.parametrize(
    ("osl", "model", "expected"),
    [
        (True, "Oren-Nayar", ["Script"]),
        (True, "Cycles Diffuse", LAMBERT),  # Cycles has it
        (True, "Lambert", LAMBERT),
        (False, "Fujii", LAMBERT),
    ],
)
def test_osl_is_used_where_the_scene_uses_it_and_closures_are_not_exact(osl: bool, model: str, expected: list[str]) -> None:
    if not compiles_osl():
        pytest.skip("this Blender cannot compile OSL")
    sphere, node = shown(ROUGH_DIFFUSE, Model=model)
    engines.use(sphere.scene, engines.CYCLES, 1)
    sphere.scene.cycles.shading_system = osl
    assert closures(node) == expected


def test_material_serves_scenes_of_several_engines() -> None:
    sphere, _ = shown(ROUGH_DIFFUSE, Roughness=0.3)
    other = sphere.scene.copy()
    other.render.engine = "CYCLES"
    material = bpy.data.materials["Shown"]

    def closures_in(scene: bpy.types.Scene) -> int:
        layer = scene.view_layers[0]
        layer.update()
        inlined = bpy.types.InlineShaderNodes.from_material(material.evaluated_get(layer.depsgraph))
        return sum(inner.bl_idname.startswith(("ShaderNodeBsdf", "ShaderNodeSub")) for inner in inlined.node_tree.nodes)

    assert [closures_in(scene) for scene in (sphere.scene, other, sphere.scene)] == [3, 2, 3]


def test_only_lights_that_are_chosen_count() -> None:
    sphere, node = shown(ROUGH_DIFFUSE, Quality="Exact for Chosen Lights")
    sizes = []
    for lights in ([], [sphere.sun], [sphere.sun] * 2, [sphere.sun] * 4):
        chosen_lights.choose(lights)
        inlined = bpy.types.InlineShaderNodes.from_material(evaluated(node))
        sizes.append(len(inlined.node_tree.nodes))
    none, one, two, four = sizes
    assert none < one < two < four and four - two == 2 * (two - one)


def test_file_with_nothing_to_leave_out_is_untouched() -> None:
    _, _node = shown(SPECULAR_GROUP)
    trees = [(tree.name, tree.as_pointer()) for tree in bpy.data.node_groups]
    (result,) = optimize_materials()
    assert not result.left_out and not result.problem
    assert [(tree.name, tree.as_pointer()) for tree in bpy.data.node_groups] == trees


def test_materials_that_need_the_same_share_a_tree() -> None:
    _sphere, node = shown(ROUGH_DIFFUSE, Roughness=0.0)
    twins = [materials.create("Twin", ROUGH_DIFFUSE, Roughness=0.0, Color=(0.1 * k, 0.2, 0.3, 1.0)) for k in range(1, 4)]
    optimize_materials()
    assert is_optimized(node) and {node_of(twin).node_tree for twin in twins} == {node.node_tree}
    late = materials.create("Late", ROUGH_DIFFUSE, Roughness=0.0)
    optimize_materials()
    assert node_of(late).node_tree == node.node_tree


# Changes that restore the group


def set_socket(node: bpy.types.Node) -> None:
    node.inputs["Roughness"].default_value = 0.7


def set_menu(node: bpy.types.Node) -> None:
    node.inputs["Model"].default_value = "EON"


def link_socket(node: bpy.types.Node) -> None:
    link_source(node, "Roughness")


def key_socket(node: bpy.types.Node) -> None:
    node.inputs["Roughness"].keyframe_insert("default_value", frame=1)


def drive_socket(node: bpy.types.Node) -> None:
    node.inputs["Roughness"].driver_add("default_value").driver.expression = "0.5"


def key_further_socket(node: bpy.types.Node) -> None:
    node.inputs["IOR"].keyframe_insert("default_value", frame=1)  # makes the action, of which alone the next key is told
    bpy.context.view_layer.update()
    assert is_optimized(node)
    key_socket(node)


@in_blender
@pytest.mark.parametrize("change", [set_socket, set_menu, link_socket, drive_socket, key_socket, key_further_socket])
def test_change_restores(change: Callable[[bpy.types.Node], None]) -> None:
    sphere, node = shown(ROUGH_DIFFUSE, Roughness=0.0)
    optimize_materials()
    sphere.scene.view_layers[0].update()
    assert is_optimized(node)
    change(node)
    sphere.scene.view_layers[0].update()
    assert not is_optimized(node)


@in_blender
def test_change_of_what_is_still_needed_restores_nothing() -> None:
    sphere, node = shown(ROUGH_DIFFUSE, Roughness=0.0)
    optimize_materials()
    node.inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    link_source(node, "Normal")
    sphere.scene.render.engine = "CYCLES"
    sphere.scene.view_layers[0].update()
    assert not is_optimized(node)  # the normal was the surface's own
    optimize_materials()
    node.inputs["Color"].default_value = (0.9, 0.2, 0.3, 1.0)
    sphere.scene.render.engine = "BLENDER_EEVEE"
    sphere.scene.view_layers[0].update()
    assert is_optimized(node)


@pytest.mark.render
@in_blender
def test_script_that_changes_a_socket_and_renders_gets_the_right_picture() -> None:
    sphere, node = shown(ROUGH_DIFFUSE, Model="EON", Roughness=1.0)
    _, whole = render.radiance(sphere.scene, engines.CYCLES, 1)
    node.inputs["Roughness"].default_value = 0.0
    optimize_materials()
    assert is_optimized(node)
    node.inputs["Roughness"].default_value = 1.0
    _, changed = render.radiance(sphere.scene, engines.CYCLES, 1)
    assert changed == whole


def test_settings_stay() -> None:
    inputs = {"Model": "EON", "Quality": "Fast", "Color": (0.25, 0.5, 0.75, 1.0), "Roughness": 0.0, "IOR": 2.0}
    _, node = shown(ROUGH_DIFFUSE, **inputs)
    source = link_source(node, "Normal")
    whole = node.node_tree

    def settings() -> dict[str, object]:
        values = ((socket.name, socket.default_value) for socket in node.inputs if socket.name in inputs)
        return {name: value if isinstance(value, (str, float)) else tuple(value) for name, value in values}

    optimize_materials()
    assert settings() == inputs and node.inputs["Normal"].links[0].from_socket == source
    node.inputs["Model"].default_value = "Wolff"  # the menu still knows all entries
    node.inputs["Model"].default_value = "EON"
    assert restore_materials() == 1
    assert settings() == inputs and node.inputs["Normal"].links[0].from_socket == source and node.node_tree == whole


@in_blender
def test_operators_are_undone_and_redone() -> None:
    shown(ROUGH_DIFFUSE, Roughness=0.0)
    assert not bpy.ops.true_diffuse.restore.poll()
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.true_diffuse.optimize() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="after")

    def optimized() -> bool:  # undo makes new pointers
        return is_optimized(node_of(bpy.data.materials["Shown"]))

    assert optimized()
    bpy.ops.ed.undo()
    assert not optimized()
    bpy.ops.ed.redo()
    assert optimized()
    assert bpy.ops.true_diffuse.restore() == {"FINISHED"} and not optimized()


# Files


def save(folder: Path) -> str:
    path = str(folder / FILE)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    return path


@in_blender
def test_optimized_file_is_loaded_as_it_was(tmp_path: Path) -> None:
    sphere, _ = shown(ROUGH_DIFFUSE, Roughness=0.0, Quality="Exact for Chosen Lights")
    chosen_lights.choose([sphere.sun])
    optimize_materials()
    remove_unused()
    path = save(tmp_path)
    bpy.ops.wm.open_mainfile(filepath=path)
    node = node_of(bpy.data.materials["Shown"])
    assert is_optimized(node)
    restore_materials()
    assert not is_optimized(node) and node.node_tree == ROUGH_DIFFUSE.ensure()
    assert [light.name for light in chosen_lights.chosen()] == ["Sun"]


def test_unused_groups_are_not_saved(tmp_path: Path) -> None:
    _, node = shown(ROUGH_DIFFUSE, Roughness=0.0)
    SUBSURFACE.ensure()
    optimize_materials()
    remove_unused()
    path, name = save(tmp_path), node.node_tree.name
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path) as (source, _):
        assert source.node_groups == [name]


def test_linked_and_overridden_materials_are_left_alone(tmp_path: Path) -> None:
    shown(ROUGH_DIFFUSE, Roughness=0.0)
    path = save(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (source, target):
        target.materials = source.materials
    linked = bpy.data.materials["Shown"]
    overridden = linked.override_create()
    mesh = bpy.data.meshes.new("Mesh")
    for material in (linked, overridden):
        mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Object", mesh))
    results = optimize_materials()
    messages = {result.problem.split(FILE)[0].split("/")[0] for result in results}
    assert messages == {"linked from ", "a library override"}


def test_edited_groups_are_left_alone() -> None:
    _, node = shown(ROUGH_DIFFUSE, Roughness=0.0)
    inner = next(part.node_tree for part in node.node_tree.nodes if part.type == "GROUP" and "Oren-Nayar" in part.node_tree.name)
    next(part for part in inner.nodes if part.type == "MATH").inputs[1].default_value = 0.123
    (result,) = optimize_materials()
    assert "edited" in result.problem and not is_optimized(node)


def test_groups_inside_the_artists_own_are_optimized() -> None:
    sphere, _ = shown(ROUGH_DIFFUSE, Roughness=0.0)
    own = bpy.data.node_groups.new("Own", "ShaderNodeTree")
    for in_out, kind, name in (("INPUT", "NodeSocketColor", "Paint"), ("OUTPUT", "NodeSocketShader", "BSDF")):
        own.interface.new_socket(name, in_out=in_out, socket_type=kind)
    inside = materials.add_group(own, ROUGH_DIFFUSE)
    inside.inputs["Roughness"].default_value = 0.0
    own.links.new(own.nodes.new("NodeGroupInput").outputs["Paint"], inside.inputs["Color"])
    own.links.new(inside.outputs["BSDF"], own.nodes.new("NodeGroupOutput").inputs["BSDF"])
    material, _ = materials.create_plain("Theirs")
    node = material.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = own
    material.node_tree.links.new(node.outputs[0], material.node_tree.get_output_node("ALL").inputs["Surface"])
    sphere.sphere.data.materials[0] = material
    optimize_materials()
    assert is_optimized(inside) and inside.inputs["Color"].is_linked


def test_usd_of_an_optimized_material_is_that_of_its_group(tmp_path: Path) -> None:
    usd.register()
    try:
        shown(SUBSURFACE, Model="EON", Roughness=0.5, Subsurface=0.25, Specular=0.0)
        texts = []
        for prepare in (restore_materials, optimize_materials):
            prepare()
            file = tmp_path / f"{prepare.__name__}.usda"
            bpy.ops.wm.usd_export(filepath=str(file), export_lights=False, export_cameras=False)
            _, start, material = file.read_text().partition('def Material "Shown"')
            texts.append(start + material.partition("\n        }\n")[0])
        assert texts[0] == texts[1] and "trueDiffuse" in texts[0] and "oren_nayar_diffuse_bsdf" in texts[0]
    finally:
        usd.unregister()
