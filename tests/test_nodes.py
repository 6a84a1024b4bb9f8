# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups: built once, as described, and equal to the formulas of their lobes when rendered."""

import math
from pathlib import Path

import bpy

import mpmath
import pytest
from mathutils import Vector

from true_diffuse.addon.blender import engines
from true_diffuse.addon.closures.lobe import CYCLES, PAIR, SIGNED, SINGLE
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import (
    MODELS,
    Lambert,
    OrenNayar,
    Specular,
    directional_albedo,
)
from true_diffuse.addon.nodes import GROUPS, ROUGH_DIFFUSE, SPECULAR_GROUP, chosen_lights
from true_diffuse.addon.nodes.rough_diffuse import ROUGH
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scenes.sphere import COLOR, sphere_under_sun
from true_diffuse.scripts.studies import furnace, hard_inputs, sheet
from true_diffuse.scripts.studies.lit_sphere import between_engines, sky, three_lights
from true_diffuse.scripts.studies.rough import SPECULAR

pytestmark = pytest.mark.usefixtures("empty_file")

# Against the model of its own lobes a group is off by: in Cycles, the pixel filter's 0.01 pixels where the light ends abruptly;
# in EEVEE, colors of 10 bits with a shared exponent (0.2 % of the value for these) and normals of 2 x 16 bits.
OWN_ERROR = {"cycles": 0.002, "eevee": 0.004}
# Where the light comes from behind, a sphere's lit part is a narrow rim: the same deviations are a larger fraction of its radiance.
RIM = 2.0
BLACK = (0.0, 0.0, 0.0, 1.0)
FORMULAS = {model.label: model.reference({"Roughness": 1.0, "IOR": 1.5}) for model in MODELS.values()}
every_formula = pytest.mark.parametrize("name", FORMULAS)


def rough(model: str, quality: str = "Balanced", roughness: float = 1.0) -> bpy.types.Material:
    return materials.create(f"{model} {quality}", ROUGH_DIFFUSE, Model=model, Quality=quality, Color=COLOR, Roughness=roughness)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_group_is_built_once(group) -> None:
    first, count = group.ensure(), len(bpy.data.node_groups)
    assert group.ensure() == first and len(bpy.data.node_groups) == count


def test_group_leaves_the_users_tree_of_the_same_name_alone() -> None:
    theirs = bpy.data.node_groups.new(SPECULAR_GROUP.name, "ShaderNodeTree")
    ours = SPECULAR_GROUP.ensure()
    assert ours != theirs and len(theirs.nodes) == 0
    assert SPECULAR_GROUP.ensure() == ours


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_group_explains_its_sockets(group) -> None:
    tree = group.ensure()
    assert tree.description and not tree.description.endswith(".")
    items = {item.name: item for item in tree.interface.items_tree if item.item_type == "SOCKET" and item.in_out == "INPUT"}
    assert list(items) == [socket.name for socket in group.inputs]
    for socket in group.inputs:
        assert items[socket.name].description and not items[socket.name].description.endswith(".")
        if socket.kind == "NodeSocketMenu":
            assert items[socket.name].default_value == socket.default
        if socket.minimum is not None:
            assert items[socket.name].min_value == pytest.approx(socket.minimum, rel=1e-7)  # kept in 32-bit floats
        if socket.maximum is not None:
            assert items[socket.name].max_value == pytest.approx(socket.maximum, rel=1e-7)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_group_nodes_do_not_overlap(group) -> None:
    group.ensure()
    for tree in bpy.data.node_groups:
        places = [tuple(node.location) for node in tree.nodes]
        assert len(set(places)) == len(places)


def test_engine_switch_reads_the_engine_of_the_scene() -> None:
    ROUGH_DIFFUSE.ensure()
    drivers = [curve.driver for tree in bpy.data.node_groups if tree.animation_data for curve in tree.animation_data.drivers]
    assert drivers and all(driver.is_simple_expression for driver in drivers)  # so that no script permission is asked
    identifiers = bpy.types.RenderSettings.bl_rna.properties["engine"].enum_items.keys()
    assert identifiers[0] == engines.EEVEE.identifier


def test_menus_list_all_models_and_qualities() -> None:
    tree = ROUGH.ensure()
    switches = [node for node in tree.nodes if node.bl_idname == "GeometryNodeMenuSwitch"]
    entries = {tuple(item.name for item in node.enum_items) for node in switches}
    assert entries == {tuple(FORMULAS), ("Balanced", "Fast", "Precise", "Exact for Chosen Lights")}
    assert all(item.description for node in switches for item in node.enum_items)


def test_menu_of_standard_specular_lists_its_qualities() -> None:
    (switch,) = (node for node in SPECULAR_GROUP.ensure().nodes if node.bl_idname == "GeometryNodeMenuSwitch")
    assert [item.name for item in switch.enum_items] == ["Balanced", "Exact for Chosen Lights"] and all(
        item.description for item in switch.enum_items
    )
    assert (
        materials.create("New", SPECULAR_GROUP).node_tree.nodes[SPECULAR_GROUP.name].inputs["Quality"].default_value == "Balanced"
    )


def test_osl_shader_has_the_sockets_of_the_group(tmp_path: Path) -> None:
    tree = ROUGH_DIFFUSE.ensure()
    script = next(node for node in ROUGH.ensure().nodes if node.bl_idname == "ShaderNodeScript")
    bytecode = tmp_path / "rough_diffuse.oso"
    bytecode.write_text(script.bytecode)
    render.openimageio()  # the query needs it loaded first
    import oslquery

    shader = {parameter.name: parameter for parameter in oslquery.OSLQuery(str(bytecode)).parameters}
    group = {item.name: item for item in tree.interface.items_tree if item.item_type == "SOCKET" and item.in_out == "INPUT"}
    assert set(shader) - {"BSDF"} == set(group) - {"Quality"}  # a quality is for rendering without OSL
    for name in ("Roughness", "IOR"):
        limits = {item.name: item.value for item in shader[name].metadata}
        ours = (group[name].default_value, group[name].min_value, group[name].max_value)
        highest = limits["slidermax" if name == "Roughness" else "max"]  # what is typed may exceed a slider's
        assert (shader[name].value, limits["min"], highest) == pytest.approx(ours, rel=1e-6)  # both in 32-bit floats
    assert tuple(shader["Color"].value) == pytest.approx(tuple(group["Color"].default_value)[:3], rel=1e-6)
    options = next(item.value for item in shader["Model"].metadata if item.name == "options")
    assert [option.split(":")[0] for option in options.split("|")] == list(FORMULAS)
    assert list(FORMULAS)[shader["Model"].value] == group["Model"].default_value


@pytest.mark.render
@pytest.mark.parametrize("degrees", [0.0, 120.0])
@every_formula
def test_lobes_render_as_their_formula(engine: engines.Engine, degrees: float, name: str) -> None:
    lobes = Rendered(FORMULAS[name], CYCLES if engine is engines.CYCLES else PAIR)
    (result,) = sphere_under_sun(64).measure(rough(name), [lobes], engine, 4, degrees)[1]
    assert result.rms < OWN_ERROR[engine.key] * (RIM if degrees > 90.0 else 1.0)


@pytest.mark.render
def test_sigma_above_the_slider_renders_as_its_formula() -> None:
    (result,) = sphere_under_sun(64).measure(
        rough("Oren-Nayar", roughness=1.3), [Rendered(OrenNayar(1.3), CYCLES)], engines.CYCLES, 4, 0.0
    )[1]
    assert result.rms < OWN_ERROR["cycles"]


@pytest.mark.render
@pytest.mark.parametrize(("quality", "lobe_set"), [("Fast", SINGLE), ("Precise", SIGNED)])
# Fujii's lobes serve EON and Cycles Diffuse too; a single lobe has one direction for all channels, so only those without a color of
# their own can equal it
@pytest.mark.parametrize("name", ["Oren-Nayar", "Fujii"])
@pytest.mark.usefixtures("driver")
def test_other_qualities_of_eevee_render_as_their_formula(quality: str, lobe_set: str, name: str) -> None:
    lobes = Rendered(FORMULAS[name], lobe_set)
    (result,) = sphere_under_sun(64).measure(rough(name, quality), [lobes], engines.EEVEE, 4, 60.0)[1]
    assert result.rms < OWN_ERROR["eevee"]


@pytest.mark.render
@pytest.mark.parametrize("quality", ["Fast", "Precise"])
def test_qualities_are_the_same_in_cycles(quality: str) -> None:
    lobes = Rendered(OrenNayar(1.0), CYCLES)
    (result,) = sphere_under_sun(32).measure(rough("Oren-Nayar", quality), [lobes], engines.CYCLES, 4, 60.0)[1]
    assert result.rms < OWN_ERROR["cycles"]


@pytest.mark.render
@pytest.mark.parametrize("name", ["Oren-Nayar", "EON", "Oren-Nayar 1994"])
def test_sigma_zero_renders_as_lambert(engine: engines.Engine, name: str) -> None:
    (result,) = sphere_under_sun(64).measure(rough(name, roughness=0.0), [Lambert()], engine, 4, 60.0)[1]
    assert result.rms < OWN_ERROR[engine.key]


@pytest.mark.render
def test_open_shading_language_takes_over_where_the_scene_has_it_on() -> None:
    sphere = sphere_under_sun(64)
    material = rough("Oren-Nayar")
    (nodes,) = sphere.measure(material, [OrenNayar(1.0)], engines.CYCLES, 4, 120.0)[1]
    sphere.scene.cycles.shading_system = True
    (osl,) = sphere.measure(material, [OrenNayar(1.0)], engines.CYCLES, 4, 120.0)[1]
    assert osl.rms < 0.1 * nodes.rms  # 0.4 % against 5 %


@pytest.mark.render
@every_formula
@pytest.mark.parametrize("quality", ["Balanced", "Fast", "Precise", "Exact for Chosen Lights"])
def test_no_model_is_black_in_any_quality_with_open_shading_language(name: str, quality: str) -> None:
    sphere = sphere_under_sun(32)
    sphere.scene.cycles.shading_system = True
    chosen_lights.choose([sphere.sun])
    (result,) = sphere.measure(rough(name, quality), [FORMULAS[name]], engines.CYCLES, 1, 30.0)[1]
    assert result.rms < 0.05  # pits' ramps; black would be 1


@pytest.mark.render
@pytest.mark.parametrize(("device", "expected"), [("CPU", 1.0), ("GPU", 0.0)])
def test_open_shading_language_is_left_to_the_processor(device: str, expected: float) -> None:
    sphere = sphere_under_sun(8)  # drivers run in what a scene uses
    sphere.sphere.data.materials[0] = rough("Oren-Nayar", "Balanced")
    scene = sphere.scene
    scene.render.engine, scene.cycles.shading_system, scene.cycles.device = "CYCLES", True, device
    bpy.context.view_layer.update()
    tree = bpy.data.node_groups[".True Diffuse Oren-Nayar"].evaluated_get(bpy.context.evaluated_depsgraph_get())
    (osl,) = (node for node in tree.nodes if node.label == "Uses OSL")
    assert osl.outputs[0].default_value == expected


def test_group_is_not_taken_for_the_users_copy() -> None:
    ours = ROUGH_DIFFUSE.ensure()
    copy = ours.copy()
    copy.name = "A Copy"
    assert ROUGH_DIFFUSE.ensure() == ours


def test_chosen_lights_reach_appended_groups() -> None:
    sphere = sphere_under_sun(8)
    beside = chosen_lights.LIGHTS.ensure().copy()  # as appending another file leaves it
    chosen_lights.choose([sphere.sun])
    for tree in (chosen_lights.LIGHTS.ensure(), beside):
        followed = {target.id for curve in tree.animation_data.drivers for v in curve.driver.variables for target in v.targets}
        assert followed == {sphere.sun, sphere.sun.data}


@pytest.mark.render
@pytest.mark.parametrize("degrees", [0.0, 60.0])
@pytest.mark.parametrize("name", [name for name in FORMULAS if name != "Pitted (Koenderink)"])  # rendered with lobes
def test_material_is_exact_under_the_chosen_light(engine: engines.Engine, name: str, degrees: float) -> None:
    sphere = sphere_under_sun(64)
    chosen_lights.choose([sphere.sun])
    (result,) = sphere.measure(rough(name, "Exact for Chosen Lights"), [FORMULAS[name]], engine, 4, degrees)[1]
    assert result.rms < OWN_ERROR[engine.key]


POSITIONS = {"POINT": (3.0, -3.0, 1.0), "SPOT": (-3.0, -4.0, 1.0), "AREA": (0.0, -2.5, 3.0)}


def local_light(kind: str, position: tuple[float, float, float]) -> bpy.types.Object:
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy, data.color, data.shadow_soft_size = 300.0, (1.0, 0.7, 0.4), 0.0
    if kind == "AREA":
        data.size = 0.01  # next to a point, which is what it counts as
    elif kind == "SPOT":
        data.spot_size, data.spot_blend = math.radians(40.0), 0.5
    item = bpy.data.objects.new(kind.title(), data)
    item.matrix_world = Vector(position).to_track_quat("Z", "Y").to_matrix().to_4x4()
    item.matrix_world.translation = position
    return item


@pytest.mark.render
@pytest.mark.parametrize(("kind", "position"), POSITIONS.items())
def test_chosen_light_of_every_kind_shines_as_its_object(kind: str, position: tuple[float, float, float]) -> None:
    sphere, item = sphere_under_sun(32), local_light(kind, position)
    chosen_lights.choose([item])
    _, rendered = sphere.radiance(rough("Oren-Nayar", "Exact for Chosen Lights"), [item], None, engines.CYCLES, 1, shadows=False)
    _, lambert = sphere.radiance(rough("Lambert"), [item], None, engines.CYCLES, 1, shadows=False)
    surface, model = sphere.surface(), OrenNayar(1.0)
    eye = sphere.scene.camera.matrix_world.translation
    compared = 0
    for pixel, measurable in enumerate(surface.measurable):
        i = 3 * pixel
        if not measurable or lambert[i] < 0.01:
            continue
        p, n = Vector(surface.position[i : i + 3]), tuple(surface.normal[i : i + 3])
        l, v = tuple((item.matrix_world.translation - p).normalized()), tuple((eye - p).normalized())
        if Vector(n).dot(l) < 0.05:
            continue  # the color fades to that for light from elsewhere, and the pixel filter moves N.L by as much as it is
        ratio = model.radiance(n, l, v, 1.0) / Lambert().radiance(n, l, v, 1.0)
        assert rendered[i] == pytest.approx(lambert[i] * ratio, rel=0.01)
        compared += 1
    assert compared > 100


@pytest.mark.render
def test_four_chosen_lights_are_weighted_by_irradiance() -> None:
    sphere = sphere_under_sun(32)
    four = [*(local_light(kind, position) for kind, position in POSITIONS.items()), sphere.sun]
    one_by_one = []
    for item in four:
        chosen_lights.choose([item])
        one_by_one.append(
            sphere.radiance(rough("Oren-Nayar", "Exact for Chosen Lights"), [item], None, engines.CYCLES, 1, shadows=False)[1]
        )
    chosen_lights.choose(four)
    _, together = sphere.radiance(rough("Oren-Nayar", "Exact for Chosen Lights"), four, None, engines.CYCLES, 4096, shadows=False)
    squares = total = 0.0
    for pixel, measurable in enumerate(sphere.surface().measurable):
        for i in range(3 * pixel, 3 * pixel + 3) if measurable else ():
            expected = sum(picture[i] for picture in one_by_one)
            squares += (together[i] - expected) ** 2
            total += expected * expected
    # Cycles picks one of the four lights for each sample, whose value then deviates by its own size or two: over 4096 of them 3 %
    assert math.sqrt(squares / total) < 0.03


def test_only_lights_can_be_chosen() -> None:
    sphere = sphere_under_sun(8)
    with pytest.raises(ValueError, match="not a light"):
        chosen_lights.choose([sphere.sphere])
    with pytest.raises(ValueError, match="at most 4"):
        chosen_lights.choose([sphere.sun] * 5)


@pytest.mark.slow
@pytest.mark.render
@pytest.mark.usefixtures("driver")
def test_signed_lobes_equal_cycles_under_lights_and_sky() -> None:
    sphere = sphere_under_sun(48)
    world = sky((0.35, 0.3, 0.25), (0.4, 0.6, 1.0), 0.5)
    _, difference = between_engines(sphere, rough("Oren-Nayar", "Precise", 0.33), three_lights(), world, 16)
    assert difference < 0.02  # of which the engines' own, seen with Lambert, is 1.1 %


@pytest.mark.render
def test_specular_in_cycles_is_near_blinn_phong() -> None:
    sphere = sphere_under_sun(64)
    material = materials.create("Specular", SPECULAR_GROUP, Color=COLOR)
    result, lambert = sphere.measure(material, [Specular(), Lambert()], engines.CYCLES, 4, 0.0)[1]
    assert result.rms < 0.01 < lambert.rms  # Beckmann's lobe, seen and lit from the same side


def specular(weight: float, exponent: float) -> bpy.types.Material:
    return materials.create(
        "Specular", SPECULAR_GROUP, Quality="Exact for Chosen Lights", Color=COLOR, Specular=weight, Exponent=exponent
    )


@pytest.mark.render
@pytest.mark.parametrize(("weight", "exponent"), [(0.06, 30.0), (0.5, 5.0), (0.05, 1000.0)])
@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_highlight_is_exact_under_the_chosen_light(engine: engines.Engine, weight: float, exponent: float, degrees: float) -> None:
    sphere = sphere_under_sun(64)
    chosen_lights.choose([sphere.sun])
    (result,) = sphere.measure(specular(weight, exponent), [Specular(weight, exponent)], engine, 4, degrees)[1]
    assert result.rms < OWN_ERROR[engine.key]


@pytest.mark.render
def test_narrowest_highlight_keeps_its_digits() -> None:
    """A normal turned by an angle from N = L = V: the highlight falls by its cosine to the power of 10000."""
    flat = sheet.sheet((1.0,), [sheet.USUAL], furnace.CELL)
    chosen_lights.choose([flat.sun])
    material = materials.create(
        "Narrow", SPECULAR_GROUP, Quality="Exact for Chosen Lights", Color=BLACK, Specular=1.0, Exponent=10000.0
    )
    material.cycles.use_bump_map_correction = False  # else Cycles shadows what the true surface would hide
    normal = material.node_tree.nodes[SPECULAR_GROUP.name].inputs["Normal"]
    for angle in (0.0, 1e-4, 1e-3, 0.005, 0.01, 0.02, 0.03):
        normal.default_value = math.sin(angle), 0.0, math.cos(angle)
        x, _, z = map(mpmath.mpf, normal.default_value)  # in 32 bits
        cosine = z / mpmath.hypot(x, z)
        expected = float(1251 * cosine**10001)
        (cell,) = flat.cells(material, engines.CYCLES, 1, 0.0)
        # 1 - |N x H|^2 in 32 bits is off by 3e-8, and its power of 5000 by 1.5e-4 of its value; N itself turned by 6e-8 makes up to
        # 10000 tan(0.03) times that, 2e-5. The power of N.H in 32 bits would be off by 3e-4 to 6e-4.
        assert cell == pytest.approx([expected] * len(cell), rel=2e-4), angle


@pytest.mark.render
def test_highlight_of_light_from_elsewhere_is_its_directional_albedo() -> None:
    mus = (1.0, 0.5, 0.2)
    bent, white = sheet.sheet(mus, [sheet.USUAL], hard_inputs.CELL), uniform_world()
    chosen_lights.choose([])
    for exponent in (0.0, 5.0, 30.0, 300.0):
        model = Specular(0.5, exponent)
        for cell, mu in zip(bent.cells(specular(0.5, exponent), engines.CYCLES, 64, white), mus, strict=True):
            for channel, rho in enumerate(COLOR[:3]):
                shown = sum(cell[channel::3]) / len(cell[channel::3])
                # fitted to 3.2 % of the highlight; the world's light is sampled without noise by a Lambert closure
                albedo = directional_albedo(model, mu, 0.0, order=64)
                assert shown == pytest.approx(rho + albedo, abs=0.035 * albedo + 1e-3), (exponent, mu)


@pytest.mark.render
def test_odd_exponents_and_weights_count_as_the_nearest_in_range() -> None:
    pairs = [
        ("Exponent", 1e6, 1e4),
        ("Exponent", math.inf, 1e4),
        ("Exponent", -5.0, 0.0),
        ("Exponent", math.nan, 0.0),
        ("Specular", 7.0, 1.0),
        ("Specular", -1.0, 0.0),
        ("Specular", math.nan, 0.0),
        ("Color", 1.5, 1.0),
    ]
    rows = [{**sheet.USUAL, name: (value,) * 3} for name, odd, usual in pairs for value in (odd, usual)]
    flat = sheet.sheet((1.0,), rows, furnace.CELL)
    chosen_lights.choose([flat.sun])
    cells = flat.cells(sheet.fed(SPECULAR, "Exact for Chosen Lights"), engines.CYCLES, 1, 0.0)
    for pair, odd, usual in zip(pairs, cells[::2], cells[1::2], strict=True):
        assert odd == pytest.approx(usual, rel=1e-5), pair  # the same in 32-bit floats
    assert max(cells[1]) > 100.0 > max(cells[5])  # exponents of 10000 and 0


@pytest.mark.render
def test_highlight_makes_no_fireflies_on_what_it_shines_on() -> None:
    """A floor beside a sphere sees the highlight by its bounces: spread evenly it is at most as bright as white all over."""
    sphere = sphere_under_sun(48)
    floor = bpy.data.objects.new("Floor", bpy.data.meshes.new("Floor"))
    floor.data.from_pydata([(-9, -9, -1), (9, -9, -1), (9, 9, -1), (-9, 9, -1)], [], [(0, 1, 2, 3)])
    floor.data.materials.append(materials.create_plain("Floor")[0])
    sphere.scene.collection.objects.link(floor)
    sphere.sun.matrix_world = Vector((-0.5, -0.75, 0.5)).to_track_quat("Z", "Y").to_matrix().to_4x4()
    chosen_lights.choose([sphere.sun])
    engines.use(sphere.scene, engines.CYCLES, 16)
    sphere.scene.cycles.max_bounces, sphere.scene.cycles.sample_clamp_indirect = 2, 0.0
    shown = []
    for material in (specular(1.0, 10000.0), rough("Lambert")):
        sphere.sphere.data.materials[0] = material
        _, rgb = render.radiance(sphere.scene, engines.CYCLES, 16)
        shown.append(rgb[3 * 48 * 44 :])  # the last rows, below the sphere
    # the sphere sends at most some twice as much as Lambert's; a sample that met the highlight itself would be 26
    assert max(shown[0]) < 2.0 * max(shown[1])


@pytest.mark.render
def test_normal_input_bends_the_surface() -> None:
    sphere = sphere_under_sun(32)
    material = rough("Oren-Nayar", roughness=0.33)
    material.cycles.use_bump_map_correction = False  # else Cycles shadows what the true surface would hide
    nodes = material.node_tree.nodes
    flat = nodes.new("ShaderNodeCombineXYZ")
    flat.inputs["Y"].default_value = -3.0  # any length: towards the camera, in which the whole disk then looks lit head on
    material.node_tree.links.new(flat.outputs[0], nodes[ROUGH_DIFFUSE.name].inputs["Normal"])
    (result,) = sphere.measure(material, [Lambert()], engines.CYCLES, 1, 0.0)[1]
    a = OrenNayar(0.33).a
    assert result.mean_luminance == pytest.approx(a * (0.2126 * 0.8 + 0.7152 * 0.5 + 0.0722 * 0.2), rel=0.01)
