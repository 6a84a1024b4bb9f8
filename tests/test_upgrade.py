# SPDX-License-Identifier: GPL-3.0-or-later
"""Files made with an older True Diffuse: nodes keep values, links and animation, and a note reports what cannot be kept."""

from dataclasses import replace
from pathlib import Path

import bpy

import pytest

from support import specialize
from true_diffuse.addon.blender.id_properties import GROUP_ID
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.material import materials, upgrade
from true_diffuse.addon.material.read import read_surface
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group, chosen_lights
from true_diffuse.addon.nodes.graph import COLOR, Graph, Socket, Value
from true_diffuse.addon.nodes.rough_diffuse import ROUGH

pytestmark = pytest.mark.usefixtures("empty_file")
GLOSS = Socket("Gloss", "NodeSocketFloat", "What only the older version has", 0.5)
ROUGHNESS = Socket("Roughness", "NodeSocketFloat", "As in the newer version, in another place", 0.1)
MODEL = Socket("Model", "NodeSocketMenu", "With an entry that the newer version lacks", "Ancient")


def build(graph: Graph) -> dict[str, Value]:
    menu = graph.menu(
        graph.input(MODEL), "SHADER", [(name, "", graph.diffuse(graph.input(COLOR), graph.normal()[0])) for name in MODELS]
    )
    return {"BSDF": menu}


MODELS = ("Ancient", "Lambert", "Fujii")
NORMAL = next(socket for socket in ROUGH_DIFFUSE.inputs if socket.name == "Normal")
# the same key, a lower version, other sockets in another order
OLD = Group("rough_diffuse", "Rough Diffuse", "Rough Diffuse", 0, "Older", (GLOSS, ROUGHNESS, NORMAL, MODEL, COLOR), build)


def old_material(**inputs) -> tuple[bpy.types.Material, bpy.types.Node]:
    made = materials.create("Old", OLD, **inputs)
    return made, made.node_tree.nodes[OLD.name]


def test_values_and_links_are_kept_by_name() -> None:
    made, node = old_material(Roughness=0.7, Model="Fujii", Color=(0.1, 0.2, 0.3, 1.0))
    tree = made.node_tree
    node.location, node.label = (3.0, 4.0), "Mine"
    tree.links.new(tree.nodes.new("ShaderNodeTexImage").outputs["Color"], node.inputs["Color"])
    report = upgrade.upgrade()
    assert report.upgraded == ["Old"] and not report.lines
    assert node.node_tree == ROUGH_DIFFUSE.ensure() and node.label == "Mine" and tuple(node.location) == (3.0, 4.0)
    assert node.inputs["Roughness"].default_value == pytest.approx(0.7) and node.inputs["Model"].default_value == "Fujii"
    assert node.inputs["Color"].links[0].from_node.type == "TEX_IMAGE"
    assert tree.get_output_node("EEVEE").inputs["Surface"].links[0].from_node == node
    assert [socket.name for socket in node.inputs if socket.is_linked] == ["Color"]


def test_muted_links_stay_muted() -> None:
    made, node = old_material()
    tree = made.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeValue").outputs[0], node.inputs["Roughness"]).is_muted = True
    node.outputs[0].links[0].is_muted = True
    upgrade.upgrade()
    assert [socket.links[0].is_muted for socket in (node.inputs["Roughness"], node.outputs[0])] == [True, True]


def test_value_of_another_shape_is_reported() -> None:
    three = replace(COLOR, kind="NodeSocketVector", default=(0.1, 0.2, 0.3))
    made = materials.create("Old", replace(OLD, inputs=(*OLD.inputs[:-1], three)), Model="Lambert")
    report = upgrade.upgrade()
    assert report.upgraded == ["Old"] and len(report.lines) == 1 and "Color" in report.lines[0]
    assert made.node_tree.nodes[OLD.name].node_tree == ROUGH_DIFFUSE.ensure()


def test_animation_follows_its_socket() -> None:
    made, node = old_material()
    node.inputs["Roughness"].default_value = 0.2
    node.inputs["Roughness"].keyframe_insert("default_value", frame=1)
    node.inputs["Color"].driver_add("default_value", 0)
    upgrade.upgrade()
    places = {socket.name: f"inputs[{index}]" for index, socket in enumerate(node.inputs)}
    data = made.node_tree.animation_data
    curve = data.action.layers[0].strips[0].channelbags[0].fcurves[0]
    assert places["Roughness"] in curve.data_path and places["Color"] in data.drivers[0].data_path


def test_animation_of_another_material_in_the_same_action_follows_once() -> None:
    """Slots of one action: the paths of one are none of the other's."""
    nodes = [old_material()[1] for _ in range(2)]
    first, second = (node.id_data for node in nodes)
    nodes[0].inputs["Roughness"].keyframe_insert("default_value", frame=1)
    action = first.animation_data.action
    second.animation_data_create().action = action
    second.animation_data.action_slot = action.slots.new("NODETREE", "Second")
    nodes[1].inputs["Roughness"].keyframe_insert("default_value", frame=1)
    upgrade.upgrade()
    place = nodes[0].inputs.find("Roughness")
    bags = action.layers[0].strips[0].channelbags
    assert len(bags) == 2 and all(curve.data_path.count(f"inputs[{place}]") == 1 for bag in bags for curve in bag.fcurves)


@pytest.mark.skipif(not compiles_osl(), reason="this Blender compiles no OSL")
def test_osl_of_an_older_version_is_not_used_again() -> None:
    bpy.data.texts.new("rough_diffuse.osl").write("shader rough_diffuse(output closure color BSDF = 0) {}")
    old_material()
    upgrade.upgrade()
    (node,) = (node for node in ROUGH.ensure().nodes if node.type == "SCRIPT")
    assert "Roughness" in node.inputs and len(bpy.data.texts) == 2


def test_what_has_no_place_any_more_is_said() -> None:
    made, node = old_material(Model="Ancient")
    made.node_tree.links.new(made.node_tree.nodes.new("ShaderNodeValue").outputs[0], node.inputs["Gloss"])
    lines = upgrade.upgrade().lines
    assert len(lines) == 2 and any("Ancient" in line for line in lines) and any("Gloss" in line for line in lines)


def test_material_optimized_by_this_version_s_predecessor_gets_the_whole_group() -> None:
    made = materials.create("Optimized", ROUGH_DIFFUSE, Model="Fujii", Roughness=0.25)
    node = made.node_tree.nodes[ROUGH_DIFFUSE.name]
    node.inputs["Color"].driver_add("default_value", 0)
    before = read_surface(made)
    specialize(node)
    assert read_surface(made).surface == before.surface  # as Realtime, USD and glTF take it
    assert upgrade.upgrade().upgraded == ["Optimized"] and node.node_tree == ROUGH_DIFFUSE.ensure()
    assert (node.inputs["Model"].default_value, node.inputs["Roughness"].default_value) == ("Fujii", 0.25)
    assert len(made.node_tree.animation_data.drivers) == 1 and not list(upgrade.outdated())


def test_medium_of_an_older_version_gets_its_thickness() -> None:
    def build(graph: Graph) -> dict[str, Value]:
        return {"BSDF": graph.diffuse(graph.input(COLOR), graph.geometry("Normal"))}

    made = materials.create("Skin", replace(SUBSURFACE, version=5, inputs=(COLOR,), build=build))
    upgrade.upgrade()
    (link,) = made.node_tree.get_output_node("EEVEE").inputs["Thickness"].links
    assert link.from_node.node_tree == SUBSURFACE.ensure()


def test_second_upgrade_finds_nothing() -> None:
    old_material()
    upgrade.upgrade()
    assert not list(upgrade.outdated()) and not upgrade.upgrade().upgraded


def test_nodes_of_this_version_and_groups_of_the_user_are_left_alone() -> None:
    made = materials.create("New", ROUGH_DIFFUSE)
    theirs = bpy.data.node_groups.new("Rough Diffuse", "ShaderNodeTree")
    node = made.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = theirs
    assert not list(upgrade.outdated()) and node.node_tree == theirs


def test_group_of_the_user_with_our_name_stays_and_ours_comes_beside() -> None:
    theirs = bpy.data.node_groups.new("Rough Diffuse", "ShaderNodeTree")
    _, node = old_material()
    upgrade.upgrade()
    assert node.node_tree[GROUP_ID] == ROUGH_DIFFUSE.identifier and node.node_tree != theirs
    assert theirs.name == "Rough Diffuse" and not theirs.nodes and GROUP_ID not in theirs


def test_standard_specular_without_modes_keeps_its_lobe() -> None:
    def build_first(graph: Graph) -> dict[str, Value]:
        return {"BSDF": graph.diffuse(graph.input(COLOR), graph.normal()[0])}

    inputs = tuple(socket for socket in SPECULAR_GROUP.inputs if socket.name != "Quality")
    first = replace(SPECULAR_GROUP, version=1, inputs=inputs, build=build_first)
    made = materials.create("Old", first, Color=(0.1, 0.2, 0.3, 1.0), Specular=0.4, Exponent=70.0)
    node = made.node_tree.nodes[first.name]
    node.inputs["Exponent"].keyframe_insert("default_value", frame=1)
    report = upgrade.upgrade()
    assert report.upgraded == ["Old"] and not report.lines and node.node_tree == SPECULAR_GROUP.ensure()
    values = [node.inputs[name].default_value for name in ("Quality", "Specular", "Exponent")]
    assert values == ["Balanced", pytest.approx(0.4), pytest.approx(70.0)]
    curve = made.node_tree.animation_data.action.layers[0].strips[0].channelbags[0].fcurves[0]
    assert f"inputs[{node.inputs.find('Exponent')}]" in curve.data_path


def test_edited_and_newer_groups_are_left_alone() -> None:
    _, node = old_material()
    node.node_tree.nodes.new("ShaderNodeValue")
    newer = replace(OLD, version=ROUGH_DIFFUSE.version + 1)
    other = materials.create("Newer", newer).node_tree.nodes[newer.name]
    report = upgrade.upgrade()
    assert not report.upgraded and len(report.lines) == 2
    assert "edited" in " ".join(report.lines) and "newer" in " ".join(report.lines)
    assert node.node_tree[GROUP_ID] == OLD.identifier and other.node_tree[GROUP_ID] == newer.identifier


def test_linked_material_is_left_alone_and_reported(tmp_path: Path) -> None:
    made, _ = old_material()
    bpy.data.libraries.write(str(tmp_path / "a.blend"), {made})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "a.blend"), link=True) as (_, target):
        target.materials = ["Old"]
    report = upgrade.upgrade()
    assert not report.upgraded and len(report.lines) == 1 and "linked" in report.lines[0]


def test_chosen_lights_are_kept() -> None:
    old_lights = replace(chosen_lights.LIGHTS, key="lamps", version=1)
    lights = [bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT")) for name in ("A", "B")]
    old_lights.rebuild(lambda graph: chosen_lights.build(graph, lights))
    old_material()
    upgrade.upgrade()
    drivers = chosen_lights.LIGHTS.ensure().animation_data.drivers
    followed = {target.id for curve in drivers for variable in curve.driver.variables for target in variable.targets}
    assert set(lights) <= followed


@pytest.mark.usefixtures("registered")
def test_upgrade_is_undone_in_one_step() -> None:
    old_material()
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.true_diffuse.upgrade("EXEC_DEFAULT", True) == {"FINISHED"}
    assert not bpy.ops.true_diffuse.upgrade.poll()  # nothing is old any more
    bpy.ops.ed.undo()
    assert bpy.data.materials["Old"].node_tree.nodes["Rough Diffuse"].node_tree[GROUP_ID] == OLD.identifier
