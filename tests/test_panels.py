# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts and buttons of the panels, drawn into a layout that records them; plots; and the operators of the buttons."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import bpy

import pytest

from support import Layout, specialize
from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.material import apply_preset, materials
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.material.summary import material_summary, stated_error
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, chosen_lights
from true_diffuse.addon.operators import exports as exports_operator
from true_diffuse.addon.operators import steps
from true_diffuse.addon.operators import tolerance as tolerance_operator
from true_diffuse.addon.operators.measure import TRUE_DIFFUSE_OT_measure
from true_diffuse.addon.probe import exports, measurement
from true_diffuse.addon.probe.environment import environment
from true_diffuse.addon.ui import menus, panels, plots
from true_diffuse.scripts.studies import furnace, sheet

GALLERY = menus.TRUE_DIFFUSE_PT_gallery.__name__


@pytest.fixture(autouse=True)
def in_eevee(request: pytest.FixtureRequest) -> None:
    request.getfixturevalue("registered")
    bpy.context.scene.render.engine = EEVEE.identifier


def drawn(material: bpy.types.Material | None) -> Layout:
    """What the Material panel draws for `material`."""
    layout = Layout()
    with bpy.context.temp_override(material=material):
        panels.TRUE_DIFFUSE_PT_material.draw(SimpleNamespace(layout=layout, bl_label="True Diffuse"), bpy.context)
    return layout


def clay(**inputs: materials.Setting) -> bpy.types.Material:
    return materials.create("Clay", ROUGH_DIFFUSE, **inputs)


@pytest.mark.parametrize("group", [ROUGH_DIFFUSE, SUBSURFACE, SPECULAR_GROUP], ids=lambda group: group.key)
@pytest.mark.parametrize("engine", ["BLENDER_EEVEE", "CYCLES", "BLENDER_WORKBENCH"])
def test_panel_shows_presets_a_plot_and_the_buttons_but_not_the_inputs(group, engine: str) -> None:
    """Blender's panel Surface, right below, has the inputs."""
    bpy.context.scene.render.engine = engine
    layout = drawn(materials.create("Material", group))
    assert not {socket.name for socket in group.inputs} & set(layout.texts)
    assert f"{GALLERY} Presets" in layout.offered and "plot" in layout.offered
    for name in ("measure", "pick_settings"):
        assert any(entry.startswith(f"true_diffuse.{name}") for entry in layout.offered)


def test_lengths_say_their_unit_in_the_tooltip() -> None:
    lengths = {(SUBSURFACE.key, "Subsurface Radius"), (PRINCIPLED.key, "Subsurface Scale")}
    told = {(group.key, socket.name) for group in GROUPS for socket in group.inputs if "in millimeters" in socket.description}
    assert told == lengths


def test_sections_are_closed_above_surface_and_open_in_the_sidebar() -> None:
    material = clay()
    assert drawn(material).closed == [f"true_diffuse_{key}" for key in ("plot", "accuracy", "carried", "error")]
    sidebar = Layout()
    with bpy.context.temp_override(material=material):
        panels.TRUE_DIFFUSE_PT_node.draw(SimpleNamespace(layout=sidebar), bpy.context)
    assert "plot" in sidebar.offered and sidebar.closed == []


def test_panel_names_the_preset_that_the_material_has() -> None:
    material = apply_preset.create_material(PRESETS["clay"])
    assert f"{GALLERY} Clay" in drawn(material).offered
    material.node_tree.nodes["Rough Diffuse"].inputs["Roughness"].default_value += 0.1
    assert f"{GALLERY} Presets" in drawn(material).offered


def test_panel_without_a_group_of_ours_offers_presets_and_the_conversion() -> None:
    offered = [
        f"{GALLERY} Presets" if entry.endswith("Presets") else entry for entry in drawn(materials.create_plain("A")[0]).offered
    ]
    assert f"{GALLERY} Presets" in offered and "true_diffuse.convert" in offered
    nothing = drawn(None)
    assert f"{GALLERY} Presets" in nothing.offered and "true_diffuse.convert" not in nothing.offered


def test_panel_is_for_materials_of_surfaces() -> None:
    bpy.ops.mesh.primitive_cube_add()
    assert panels.TRUE_DIFFUSE_PT_material.poll(bpy.context)
    stroke = bpy.data.materials.new("Stroke")
    bpy.data.materials.create_gpencil_data(stroke)
    with bpy.context.temp_override(material=stroke):
        assert not panels.TRUE_DIFFUSE_PT_material.poll(bpy.context)


@pytest.mark.parametrize("own", [False, True])
def test_gallery_shows_every_preset_and_marks_the_current(own: bool) -> None:
    bpy.ops.mesh.primitive_cube_add()
    material = apply_preset.create_material(PRESETS["clay"]) if own else None
    bpy.context.object.active_material = material
    area = bpy.context.window.screen.areas[0]
    area.ui_type = "PROPERTIES"
    layout = Layout()
    with bpy.context.temp_override(area=area, material=material):
        menus.TRUE_DIFFUSE_PT_gallery.draw(SimpleNamespace(layout=layout), bpy.context)
    assert [text for text in layout.texts if text] == ["Matte", "Skin", "Translucent"]
    operator = "true_diffuse.apply_preset" if own else "true_diffuse.assign_preset"
    names = [f"{operator} {preset.name}" for preset in PRESETS.values()]
    offered = [entry for entry in layout.offered if entry.removesuffix(" chosen") in names]
    assert sorted(entry.removesuffix(" chosen") for entry in offered) == sorted(names)
    assert [entry for entry in offered if entry.endswith(" chosen")] == ([f"{operator} Clay chosen"] if own else [])
    assert layout.offered.count(operator) == len(PRESETS) - own  # the buttons behind the pictures


def test_panel_says_that_a_material_is_linked_from_another_file(tmp_path: Path) -> None:
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {clay(Roughness=0.2)})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.materials = ["Clay"]
    layout = drawn(bpy.data.materials["Clay"])
    assert "Linked from another file" in layout.texts and f"{GALLERY} Presets" in layout.offered
    with bpy.context.temp_override(material=bpy.data.materials["Clay"]):
        assert not bpy.ops.true_diffuse.apply_preset.poll() and bpy.ops.true_diffuse.measure.poll()


def test_overridden_material_is_not_edited(tmp_path: Path) -> None:
    """Blender drops what is changed in the nodes of an override when the file is opened again."""
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {clay()})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.materials = ["Clay"]
    mine = bpy.data.materials["Clay"].override_create()
    assert any("Library override" in text for text in drawn(mine).texts)
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(mine)
    assert not bpy.ops.true_diffuse.apply_preset.poll() and bpy.ops.true_diffuse.measure.poll()
    area = bpy.context.window.screen.areas[0]
    area.ui_type = "ShaderNodeTree"
    with bpy.context.temp_override(area=area, region=area.regions[-1]):
        assert not bpy.ops.true_diffuse.add_group.poll() and not bpy.ops.true_diffuse.convert_nodes.poll()


def test_panel_shows_a_group_that_the_user_gave_another_socket() -> None:
    material = clay()
    material.node_tree.nodes["Rough Diffuse"].node_tree.interface.new_socket("Coat", in_out="INPUT", socket_type="NodeSocketShader")
    assert "plot" in drawn(material).offered


def test_panel_offers_the_upgrade_of_a_material_that_an_earlier_version_optimized() -> None:
    material = clay()
    specialize(material.node_tree.nodes["Rough Diffuse"])
    offered = drawn(material).offered
    assert "true_diffuse.upgrade" in offered and not any("measure" in entry for entry in offered)


@pytest.mark.parametrize("kind", [None, "NodeSocketColor"])
def test_panel_refuses_a_group_of_another_version(kind: str | None) -> None:
    material = clay()
    tree = material.node_tree.nodes["Rough Diffuse"].node_tree
    tree.interface.remove(tree.interface.items_tree["Roughness"])
    if kind:
        tree.interface.new_socket("Roughness", in_out="INPUT", socket_type=kind)
    layout = drawn(material)
    assert any("Another version" in text for text in layout.texts) and "true_diffuse.upgrade" in layout.offered
    with bpy.context.temp_override(material=material):
        assert not bpy.ops.true_diffuse.apply_preset.poll()


def stated(material: bpy.types.Material) -> str:
    return stated_error(material_summary(material), bpy.context.scene)


@pytest.mark.parametrize(
    ("engine", "quality", "percent", "digits"),
    [
        (EEVEE, "Fast", 5.1, 0.05),
        (EEVEE, "Balanced", 3.3, 0.05),
        (EEVEE, "Precise", 0.44, 0.04),
        (CYCLES, "Fast", 0.59, 0.01),
        (CYCLES, "Balanced", 0.59, 0.01),
        (CYCLES, "Precise", 0.59, 0.01),
    ],
)
def test_stated_error_is_that_of_the_studies(engine: Engine, quality: str, percent: float, digits: float) -> None:
    """The lobe errors of equation (1) at sigma 0.33 in %, to the two digits that the panel gives."""
    bpy.context.scene.render.engine = engine.identifier
    message = stated(clay(Quality=quality, Roughness=0.33))
    found = re.fullmatch(rf"Differs (\S+) % \(RMS\) from the Oren-Nayar formula in {engine.label}", message)
    assert found and float(found[1]) == pytest.approx(percent, abs=digits)


def test_stated_error_of_what_cycles_has_is_none() -> None:
    bpy.context.scene.render.engine = CYCLES.identifier
    assert stated(clay(Model="Lambert")) == "Equal to the Lambert formula in Cycles"
    half, full = (materials.create("Skin", SUBSURFACE, Subsurface=weight, Model="Fujii") for weight in (0.5, 1.0))
    assert (stated(half), stated(full)) == ("Rough part: equal to the Fujii formula in Cycles", "")


def test_stated_error_for_chosen_lights_is_none() -> None:
    bpy.context.scene.render.engine = CYCLES.identifier
    quality = "Exact for Chosen Lights"
    chosen_lights.choose([light("Key")])
    for material in (clay(Quality=quality), shiny(quality, 1.0), shiny(quality, 9.0)):
        assert stated(material) == "Exact for the chosen lights"
    assert stated(shiny("Balanced", 1.0)) == ""


def test_quality_for_chosen_lights_without_one_is_not_called_exact() -> None:
    quality = "Exact for Chosen Lights"
    for material, message, caption in (
        (clay(Quality=quality), "No light is chosen: plain diffuse, not Oren-Nayar", "Plain diffuse, not Oren-Nayar"),
        (shiny(quality, 1.0), "No light is chosen: no highlight", "No highlight"),
    ):
        layout = drawn(material)
        assert stated(material) == message and {"No light is chosen", caption} <= set(layout.texts)
        assert "true_diffuse.use_selected_lights" in layout.offered
    assert stated(clay(Quality=quality, Model="Lambert")).startswith("Equal to the Lambert formula")  # it follows none
    chosen = light("Key")
    chosen_lights.choose([chosen])
    assert "No light" not in " ".join(drawn(material).texts)
    bpy.data.objects.remove(chosen)
    bpy.context.view_layer.update()
    assert stated(material) == message


@pytest.mark.parametrize("change", ["type", "data"])
def test_chosen_light_of_another_type_or_data_is_followed(change: str) -> None:
    """As in the Light tab: a point light becomes a sun, or the object gets the data of another light."""

    def followed() -> tuple[int, set[str], set[bpy.types.ID]]:
        tree = chosen_lights.LIGHTS.ensure()
        variables = [variable for curve in tree.animation_data.drivers for variable in curve.driver.variables]
        return len(tree.nodes), {variable.type for variable in variables}, {variable.targets[0].id for variable in variables}

    item = light("Key")
    bpy.context.view_layer.update()
    chosen_lights.choose([item])
    before = followed()
    if change == "type":
        item.data.type = "SUN"
    else:
        item.data = bpy.data.lights.new("Other", "SUN")
    bpy.context.view_layer.update()
    now = followed()
    chosen_lights.choose([item])
    assert now == followed() != before and chosen_lights.chosen() == [item]
    item.data.energy = 5.0
    nodes = chosen_lights.LIGHTS.ensure().nodes[:]
    bpy.context.view_layer.update()
    assert chosen_lights.LIGHTS.ensure().nodes[:] == nodes  # not made anew where only a value changes


def test_panel_says_of_chosen_lights_that_they_are_hidden_or_elsewhere() -> None:
    lights, material = [light(f"Light {k}") for k in range(3)], clay(Quality="Exact for Chosen Lights")
    chosen_lights.choose(lights)
    lights[0].hide_render = True
    lights[1].hide_set(True)
    bpy.context.scene.collection.objects.unlink(lights[2])
    texts = drawn(material).texts
    assert {"Light 0 is hidden in renders", "Light 1 is hidden in the viewport", "Light 2 is not in this scene"} <= set(texts)


@pytest.mark.parametrize("chosen", [True, False])
def test_panel_names_the_lights_that_a_linked_material_follows(tmp_path: Path, chosen: bool) -> None:
    path = tmp_path / "library.blend"
    chosen_lights.choose([light("Theirs")] if chosen else [])
    bpy.data.libraries.write(str(path), {clay(Quality="Exact for Chosen Lights")})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    chosen_lights.choose([light("Mine")])
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.materials = ["Clay"]
    layout = drawn(bpy.data.materials["Clay"])
    texts = " ".join(layout.texts)
    assert ("Theirs" in texts, "No light is chosen" in texts) == (chosen, not chosen)
    assert "Mine" not in texts and "Chosen in library.blend" in texts
    assert not any("toggle_light" in offered for offered in layout.offered)


def test_panel_shows_the_lights_of_an_appended_material_whose_group_of_lights_was_edited(tmp_path: Path) -> None:
    """The edited group stays in the file, but the groups around it are the file's own, and with them the lights."""
    path = tmp_path / "theirs.blend"
    theirs = light("Theirs")
    material = clay(Quality="Exact for Chosen Lights")
    chosen_lights.choose([theirs])
    chosen_lights.LIGHTS.ensure().nodes.new("ShaderNodeValue")
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(material)
    collection = bpy.data.collections.new("All")
    bpy.context.scene.collection.children.link(collection)
    for item in (theirs, bpy.data.objects.new("Object", mesh)):
        collection.objects.link(item)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    own, mine = clay(Quality="Exact for Chosen Lights"), light("Mine")
    own.name = "Own"
    chosen_lights.choose([mine])
    assert bpy.ops.wm.append(directory=str(path / "Collection"), filename="All") == {"FINISHED"}
    assert len(chosen_lights.LIGHTS.trees()) == 2
    for shown in (own, bpy.data.materials["Clay"]):
        assert material_summary(shown).lights == (mine,)
        assert {"true_diffuse.toggle_light Mine chosen", "true_diffuse.toggle_light Theirs"} <= set(drawn(shown).offered)
    assert bpy.ops.true_diffuse.toggle_light(light="Mine") == {"FINISHED"}
    assert not any(material_summary(shown).lights for shown in (own, bpy.data.materials["Clay"]))


def varying() -> bpy.types.Material:
    material = clay(Roughness=0.33)
    materials.paint(material, material.node_tree.nodes["Rough Diffuse"].inputs["Roughness"], "paint", 1.0)
    return material


@pytest.mark.parametrize("engine", [CYCLES, REALTIME], ids=lambda engine: engine.key)
def test_error_of_what_varies_over_the_surface_is_not_stated(engine: Engine) -> None:
    bpy.context.scene.render.engine = engine.identifier  # Realtime draws the socket's own value
    assert stated(varying()) == ""


def test_stated_error_with_osl_is_none_where_its_closures_are_exact() -> None:
    bpy.context.scene.render.engine, bpy.context.scene.cycles.shading_system = CYCLES.identifier, True
    assert stated(clay(Model="EON")) == "Exact with OSL" and stated(clay(Model="Wolff")) == ""
    assert stated(materials.create("Skin", SUBSURFACE, Subsurface=0.5, Model="EON")) == "Rough part: exact with OSL"


def test_stated_error_in_realtime_is_none() -> None:
    bpy.context.scene.render.engine = REALTIME.identifier
    for inputs in ({"Quality": "Fast"}, {"Quality": "Exact for Chosen Lights"}, {"Model": "Pitted (Koenderink)"}):
        assert stated(clay(**inputs)) == "Exact under every light"
    assert stated(materials.create("Skin", SUBSURFACE, Subsurface=0.5, Model="EON")) == "Rough part: exact under every light"


def shiny(quality: str, height: float) -> bpy.types.Material:
    """Return a Standard Specular of a black base, whose highlight is `height` times as bright as white."""
    return materials.create(
        "Shiny", SPECULAR_GROUP, Quality=quality, Color=(0.0, 0.0, 0.0, 1.0), Specular=1.0, Exponent=8.0 * height - 8.0
    )


@pytest.mark.render
@pytest.mark.usefixtures("driver")
def test_stated_limit_of_highlights_is_eevees() -> None:
    flat = sheet.sheet((1.0,), [sheet.USUAL], furnace.CELL)
    chosen_lights.choose([flat.sun])  # of irradiance pi: white is 1
    for height, shown, cut_off in ((7.0, 7.0, ""), (9.0, 8.0, ", cut off at 8 times white")):
        material = shiny("Exact for Chosen Lights", height)
        (cell,) = flat.cells(material, EEVEE, 1, 0.0)  # N = L = V
        assert cell == pytest.approx([shown] * len(cell), rel=0.002)  # 10 bits
        assert stated(material) == f"Exact for the chosen lights{cut_off}"
    bpy.context.scene.render.engine = EEVEE.identifier
    for height, cut_off in ((7.0, ""), (9.0, ", cut off at 8 times white")):  # of any base
        material = shiny("Exact for Chosen Lights", height)
        tree = material.node_tree
        tree.links.new(tree.nodes.new("ShaderNodeTexImage").outputs["Color"], tree.nodes[SPECULAR_GROUP.name].inputs["Color"])
        assert stated(material) == f"Exact for the chosen lights{cut_off}"


def test_measurement_is_shown_until_the_settings_change() -> None:
    material = clay(Roughness=0.33)
    setup = measurement.RenderSetup.of(bpy.context.scene)
    panels.measurements[material.session_uid] = measurement.Measurement(
        material_summary(material), setup, "GPU", 0.027, 0.054, 1.07, 1.0
    )
    assert "2.7 % from Oren-Nayar (worst 5.4 %)" in drawn(material).texts
    assert "1.07 times Lambert's time (1070 ms)" in drawn(material).texts
    assert "Outdated: other settings" not in drawn(material).texts
    material.node_tree.nodes["Rough Diffuse"].inputs["Roughness"].default_value = 0.4
    assert "Outdated: other settings" in drawn(material).texts


def light(name: str) -> bpy.types.Object:
    item = bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT"))
    bpy.context.scene.collection.objects.link(item)
    return item


@pytest.fixture
def among_addons() -> Iterator[None]:
    """The extension where Blender's glTF exporter looks for those that take part."""
    addon = bpy.context.preferences.addons.new()
    addon.module = "true_diffuse"
    yield
    bpy.context.preferences.addons.remove(addon)


@pytest.mark.usefixtures("among_addons")
def test_panel_lists_what_targets_do_not_carry_until_the_material_changes() -> None:
    material = clay()
    tree, node = material.node_tree, group_node(material)[0]
    assert "Realtime: all is carried" in drawn(material).texts and "true_diffuse.check_exports" in drawn(material).offered
    wire = tree.nodes.new("ShaderNodeWireframe")  # a node that no target has
    tree.links.new(wire.outputs[0], node.inputs["Color"])
    assert "Realtime: 1 not carried" in drawn(material).texts
    before = {name: len(getattr(bpy.data, name)) for name in ("scenes", "objects", "meshes", "materials")}
    with bpy.context.temp_override(material=material):
        assert bpy.ops.true_diffuse.check_exports() == {"FINISHED"}
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    texts = drawn(material).texts
    assert {"USD: 1 not carried", "glTF: 1 not carried"} <= set(texts) and "Wireframe" in " ".join(texts)
    tree.links.remove(node.inputs["Color"].links[0])
    assert "Outdated: the material has changed" in drawn(material).texts
    with bpy.context.temp_override(material=material):
        bpy.ops.true_diffuse.check_exports()
    assert {"USD: all is carried", "glTF: all is carried"} <= set(drawn(material).texts)


def test_panel_says_that_blender_lacks_an_exporter(monkeypatch: pytest.MonkeyPatch) -> None:
    material = clay()
    monkeypatch.setitem(
        exports_operator.answers, material.session_uid, exports.CarriedBy({"USD": None}, exports.fingerprint(material))
    )
    assert "USD: no exporter in this Blender" in drawn(material).texts


def test_exports_cannot_be_checked_without_an_exporter(monkeypatch: pytest.MonkeyPatch) -> None:
    with bpy.context.temp_override(material=clay()):
        assert bpy.ops.true_diffuse.check_exports.poll()
        monkeypatch.setattr(exports, "exporters", dict)
        assert not bpy.ops.true_diffuse.check_exports.poll()


def test_measure_is_greyed_where_it_cannot_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def reason() -> str:
        with bpy.context.temp_override(material=material):
            assert bpy.ops.true_diffuse.measure.poll() == (TRUE_DIFFUSE_OT_measure.obstacle(bpy.context) == "")
            return TRUE_DIFFUSE_OT_measure.obstacle(bpy.context)

    material = None
    assert reason() == "There is no material"
    material = materials.create_plain("Plain")[0]
    assert reason() == "No True Diffuse group makes this material's surface"
    material = clay()
    assert reason() == ""
    old = clay()
    specialize(group_node(old)[0])
    material, measurable = old, material
    assert "is of another version: Upgrade Groups" in reason()
    material = measurable
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    assert "only EEVEE, Cycles and Realtime" in reason()
    bpy.context.scene.render.engine = CYCLES.identifier
    work = steps.Work("Measuring Wax", 4.0, iter(()))
    work.operator = TRUE_DIFFUSE_OT_measure
    monkeypatch.setattr(steps, "running", [work])
    assert reason() == "Measuring Wax: wait until it is done, or press Esc to cancel it"
    monkeypatch.setattr(panels, "running", [work])
    assert "0 %, Esc cancels" in drawn(material).texts
    monkeypatch.setattr(steps, "running", [])

    def missing() -> None:
        raise ImportError

    monkeypatch.setattr(measurement.render, "openimageio", missing)
    assert "lacks OpenImageIO" in reason()


def test_panel_reads_a_material_once_between_its_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []
    monkeypatch.setattr(exports, "realtime_losses", lambda material, _scene: read.append(material.name) or [])
    material = clay()
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(material)
    item = bpy.data.objects.new("Mesh", mesh)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    drawn(material), drawn(material)
    item.location.x = 1.0
    bpy.context.view_layer.update()
    drawn(material)
    assert read == ["Clay"]
    group_node(material)[0].inputs["Roughness"].default_value = 0.7
    bpy.context.view_layer.update()
    drawn(material), drawn(material)
    assert read == ["Clay", "Clay"]
    bpy.context.scene.collection.objects.unlink(item)
    bpy.context.view_layer.update()
    drawn(material), drawn(material)  # of a material outside of the scene Blender does not tell
    assert read == ["Clay"] * 4


def test_fingerprint_visits_what_inputs_share_once() -> None:
    """A chain of 60 nodes that each take the one before twice has 2^60 paths."""
    material = clay()
    tree = material.node_tree
    last = tree.nodes.new("ShaderNodeTexNoise").outputs["Color"]
    for _ in range(60):
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "MULTIPLY"
        tree.links.new(last, node.inputs[0])
        tree.links.new(last, node.inputs[1])
        last = node.outputs["Vector"]
    tree.links.new(last, group_node(material)[0].inputs["Color"])
    before = exports.fingerprint(material)
    assert exports.fingerprint(material) == before
    node.operation = "ADD"
    assert exports.fingerprint(material) != before


def test_lights_are_chosen_from_a_list() -> None:
    lights, material = [light(f"Light {k}") for k in range(5)], clay(Quality="Exact for Chosen Lights")
    assert "true_diffuse.toggle_light Light 1" in drawn(material).offered
    for name in ("Light 1", "Light 3", "Light 0"):
        assert bpy.ops.true_diffuse.toggle_light(light=name) == {"FINISHED"}
    assert chosen_lights.chosen() == [lights[1], lights[3], lights[0]]
    assert "true_diffuse.toggle_light Light 3 chosen" in drawn(material).offered
    assert bpy.ops.true_diffuse.toggle_light(light="Light 3") == {"FINISHED"}
    assert chosen_lights.chosen() == [lights[1], lights[0]]
    bpy.ops.true_diffuse.toggle_light(light="Light 3")
    bpy.ops.true_diffuse.toggle_light(light="Light 2")
    with pytest.raises(RuntimeError, match="At most 4 lights"):
        bpy.ops.true_diffuse.toggle_light(light="Light 4")
    with pytest.raises(RuntimeError, match="no light Sun"):
        bpy.ops.true_diffuse.toggle_light(light="Sun")
    assert len(chosen_lights.chosen()) == 4


def test_deleted_lights_are_not_chosen_any_more() -> None:
    first, second = light("First"), light("Second")
    bpy.context.view_layer.update()
    chosen_lights.choose([first, second])
    nodes = len(chosen_lights.LIGHTS.ensure().nodes)
    bpy.data.objects.remove(first)
    bpy.context.view_layer.update()
    assert chosen_lights.chosen() == [second] and len(chosen_lights.LIGHTS.ensure().nodes) < nodes


def report(folder: Path, **environment_of: object) -> Path:
    """A report of this machine: Balanced is cheap and 3 % off, Precise costly and 0.5 %; both without noise at 4 samples and 64."""
    curves = [
        {
            "scene": "sphere",
            "engine": engine,
            "osl": False,
            "kind": "ours",
            "group": "rough_diffuse",
            "model": "Oren-Nayar",
            "quality": quality,
            "sigma": 0.33,
            "points": [{"samples": samples, "error": floor} for samples in (4, 64)],
            "floor": floor,
            "floor_uncertainty": 0.0,
            "slope": None,
            "noise": None,
            "seconds_fixed": seconds,
            "seconds_per_sample": 0.1,
        }
        for engine, quality, floor, seconds in (
            ("eevee", "Balanced", 0.03, 1.0),
            ("eevee", "Precise", 0.005, 3.0),
            ("eevee", "Exact for Chosen Lights", 0.001, 0.5),
            ("realtime", None, 1e-5, 0.1),
        )
    ]
    path = folder / "report.json"
    path.write_text(json.dumps({"version": 2, "environment": environment([]) | environment_of, "curves": curves}))
    return path


def in_instance(material: bpy.types.Material) -> bpy.types.Material:
    """Show `material` on an object of a collection that the scene instances; returns it."""
    collection = bpy.data.collections.new("Props")
    item = bpy.data.objects.new("Prop", bpy.data.meshes.new("Prop"))
    item.data.materials.append(material)
    collection.objects.link(item)
    instance = bpy.data.objects.new("Props", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    bpy.context.scene.collection.objects.link(instance)
    return material


def test_tolerance_sets_quality_and_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy.ops.mesh.primitive_cube_add()
    scene, material = bpy.context.scene, clay(Roughness=0.33)
    bpy.context.object.data.materials.append(material)
    bpy.context.object.data.materials.append(shiny("Balanced", 1.0))  # whose qualities no report has
    instanced = in_instance(clay(Roughness=0.2))
    monkeypatch.setattr(tolerance_operator, "report_path", lambda: report(tmp_path))
    quality = material.node_tree.nodes["Rough Diffuse"].inputs["Quality"]
    for percent, expected in (
        (4.0, "Balanced"),
        (1.0, "Precise"),
    ):  # never that for chosen lights
        scene.true_diffuse.error, scene.eevee.taa_render_samples = percent, 99
        assert bpy.ops.true_diffuse.pick_settings() == {"FINISHED"}
        assert quality.default_value == expected and scene.eevee.taa_render_samples == 4
        assert instanced.node_tree.nodes["Rough Diffuse"].inputs["Quality"].default_value == expected
    scene.true_diffuse.error, scene.eevee.taa_render_samples = 0.1, 99
    with pytest.raises(RuntimeError, match=r"Clay.*: EEVEE reaches 0\.5 % at best, with Precise and 4 samples"):
        bpy.ops.true_diffuse.pick_settings()
    assert quality.default_value == "Precise" and scene.eevee.taa_render_samples == 99


def test_tolerance_in_realtime_sets_samples_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy.ops.mesh.primitive_cube_add()
    scene, material = bpy.context.scene, clay(Roughness=0.33, Quality="Exact for Chosen Lights")
    bpy.context.object.data.materials.append(material)
    monkeypatch.setattr(tolerance_operator, "report_path", lambda: report(tmp_path))
    scene.render.engine, scene.true_diffuse.error, scene.true_diffuse.samples = REALTIME.identifier, 0.1, 99
    scene.cycles.shading_system = True  # which is Cycles' alone
    assert bpy.ops.true_diffuse.pick_settings() == {"FINISHED"}
    assert (
        scene.true_diffuse.samples == 4
        and material.node_tree.nodes["Rough Diffuse"].inputs["Quality"].default_value == "Exact for Chosen Lights"
    )


def test_tolerance_refuses_where_there_is_nothing_to_go_by(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RuntimeError, match="The scene uses no True Diffuse material"):
        bpy.ops.true_diffuse.pick_settings()
    monkeypatch.setattr(tolerance_operator, "report_path", lambda: report(tmp_path, blender="4.2.0"))
    with pytest.raises(RuntimeError, match=r"Blender 4\.2\.0, this is"):
        bpy.ops.true_diffuse.pick_settings()
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    with pytest.raises(RuntimeError, match="renders with Workbench: only EEVEE, Cycles and Realtime"):
        bpy.ops.true_diffuse.pick_settings()


def test_panel_says_where_the_numbers_come_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy.ops.mesh.primitive_cube_add()
    scene, material = bpy.context.scene, clay(Roughness=0.33)
    bpy.context.object.data.materials.append(material)
    assert "Measures this machine first" in drawn(material).texts
    monkeypatch.setattr(tolerance_operator, "report_path", lambda: report(tmp_path))
    monkeypatch.setattr(panels, "report_path", lambda: report(tmp_path))
    scene.true_diffuse.error = 1.0
    assert bpy.ops.true_diffuse.pick_settings() == {"FINISHED"}
    texts = drawn(material).texts
    assert texts[-3:] == ["0.5 % expected with 4 samples", "EEVEE, Precise", "By the report report.json"]
    scene.true_diffuse.error = 2.0
    assert drawn(material).texts[-4] == "Outdated: other settings"


def test_line_covers_its_length_times_its_width() -> None:
    canvas = plots.Canvas()
    canvas.line([(0.1, 0.2), (0.8, 0.7)], (255, 255, 255), 1.5)
    length = math.hypot(0.7, 0.5) * (plots.SIZE - 1.0 - 2.0 * plots.BORDER)
    covered = sum((value - plots.GROUND[0]) / (255.0 - plots.GROUND[0]) for value in canvas.pixels[0::4])
    # the rounded ends are worth half a disc each; a color is cut to 8 bits
    assert covered == pytest.approx(3.0 * length + math.pi * 1.5**2, rel=0.02)


def test_lambert_is_plotted_as_horizontal_lines() -> None:
    """Its radiance over that at normal incidence is N.L from every view: 1, 0.866 and 0.5."""
    canvas = plots.lobe(material_summary(clay(Model="Lambert")), None)
    for degrees, color in plots.LIGHTS:
        for view in (-60.0, 10.0, 70.0):
            x, y = canvas.pixel(0.5 + view / 180.0, math.cos(math.radians(degrees)) / plots.TOP)
            at = 4 * (round(y) * plots.SIZE + round(x))
            assert max(abs(a - b) for a, b in zip(canvas.pixels[at : at + 3], color, strict=True)) < 60
            above = 4 * (round(y + 6) * plots.SIZE + round(x))
            assert max(canvas.pixels[above : above + 3]) < 130


def test_legend_explains_the_lines_by_their_colors() -> None:
    texts = drawn(clay(Roughness=0.5)).texts
    assert {"Dots: angle of the light", "0°", "30°", "60°", "Oren-Nayar", "Lambert", "Lobes in EEVEE"} <= set(texts)
    assert {"Red", "Green", "Blue"} <= set(drawn(materials.create("Wax", SUBSURFACE)).texts)
    assert drawn(clay(Model="Lambert")).texts.count("Lambert") == 1
    for mark, at_left in (("line", True), ("dashes", True), ("dot", False)):
        plots.swatch((10, 200, 30), mark)
        preview = plots._plots[plots._keys["swatch", (10, 200, 30), mark]]
        size = plots.SWATCH
        assert tuple(preview.icon_size) == (size, size)
        middle = preview.icon_pixels[size // 2 * size : (size // 2 + 1) * size]
        row = [tuple((pixel & 0xFFFFFF).to_bytes(3, "little")) for pixel in middle]
        assert (row[4] == (10, 200, 30)) == at_left and (row[size // 2] == (10, 200, 30)) == (mark != "dashes")


def test_profile_goes_as_far_as_nearly_all_light_of_the_widest_channel() -> None:
    lengths = (1.0, 0.5, 0.2)
    summary = material_summary(
        materials.create("Wax", SUBSURFACE, Color=(0.5, 0.5, 0.5, 1.0), **{"Subsurface Radius": lengths, "Scale": 2.0})
    )
    reach = plots.profile_reach(summary)
    # Christensen and Burley (2015), equation (6): d is the mean free path over 1.9 - A + 3.5 (A - 0.8)^2, within 6 % of the walks
    x = reach / (2.0 * lengths[0] / (1.9 - 0.5 + 3.5 * 0.3**2))
    assert 1.0 - 0.25 * math.exp(-x) - 0.75 * math.exp(-x / 3.0) == pytest.approx(plots.FRACTION, abs=0.01)


def test_plots_are_drawn_once_for_what_they_show() -> None:
    calls = []

    def draw() -> plots.Canvas:
        calls.append(1)
        return plots.Canvas()

    for _ in range(3):
        plots.icon("same", draw)
    assert len(calls) == 1
    for key in range(plots.KEPT + 5):
        plots.icon(key, draw)
    assert len(calls) == plots.KEPT + 6 and len(plots._plots) == plots.KEPT
    plots.icon("same", draw)  # the oldest went
    assert len(calls) == plots.KEPT + 7
