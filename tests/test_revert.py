# SPDX-License-Identifier: GPL-3.0-or-later
"""Converted nodes turned back: what was there is there again, and what the artist changed meanwhile stays changed."""

import bpy

import pytest

from support import BSDF, bsdf, node_dump
from true_diffuse.addon.material import convert, materials, revert
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE

pytestmark = pytest.mark.usefixtures("empty_file")


def material(kind: str, name: str = "Mine", **inputs) -> tuple[bpy.types.Material, bpy.types.Node]:
    """A material of one BSDF with a texture, a muted link and a frame, and that node; sockets by name with _ for a space."""
    made, node = bsdf(kind, name, **inputs)
    tree = made.node_tree
    node.parent, node.location, node.label, node.width = tree.nodes.new("NodeFrame"), (12.0, 34.0), "Skin of mine", 300.0
    image, value = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeValue")
    tree.links.new(image.outputs["Color"], node.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeNormalMap").outputs[0], node.inputs["Normal"])
    tree.links.new(value.outputs[0], node.inputs[1]).is_muted = True
    for _ in range(2):
        tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made, node


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("Diffuse", {"Roughness": 0.0}),
        ("Diffuse", {"Roughness": 0.7}),
        ("Subsurface", {"Scale": 0.013, "Radius": (1.0, 0.0, 0.3), "Anisotropy": 0.4}),
        ("Principled", {}),
        ("Principled", {"Metallic": 0.3, "Subsurface_Scale": 0.013, "Diffuse_Roughness": 0.5, "Thin_Wall": True}),
    ],
)
def test_revert_gives_what_was_there(kind: str, inputs: dict) -> None:
    made, node = material(kind, **inputs)
    if kind == "Principled":
        node.distribution, node.subsurface_method = "GGX", "RANDOM_WALK_SKIN"
        node.inputs["Coat Tint"].hide = True
    before = node_dump(made.node_tree)
    convert.convert_materials([made], 0.01)
    assert node_dump(made.node_tree) != before
    report = revert.revert_material(made)
    assert report.reverted == ["Mine"] and not report.lines
    assert node_dump(made.node_tree) == before


def test_revert_gives_animation_and_linked_lengths_back() -> None:
    made, node = material("Principled")
    node.inputs["Roughness"].keyframe_insert("default_value", frame=1)
    node.inputs["Coat Weight"].driver_add("default_value").driver.expression = "0.25"
    node.inputs["Subsurface Scale"].keyframe_insert("default_value", frame=1)
    tree = made.node_tree
    tree.links.new(tree.nodes["Value"].outputs[0], node.inputs["Thin Film Thickness"])
    tree.links.new(tree.nodes["Value"].outputs[0], node.inputs["Subsurface Scale"])
    before, paths = node_dump(tree), sorted(curve.data_path for curve in convert.fcurves.curves(tree))
    convert.convert_materials([made], 1.0)
    revert.revert_material(made)
    assert node_dump(tree) == before
    assert sorted(curve.data_path for curve in convert.fcurves.curves(tree)) == paths


def test_drivers_that_read_the_node_follow_it_both_ways() -> None:
    made, node = material("Principled")
    paths = []
    for index, (name, component) in enumerate((("Roughness", ""), ("Base Color", "[2]"), ("Subsurface Scale", ""))):
        curve = made.driver_add("diffuse_color", index)
        variable = curve.driver.variables.new()
        variable.targets[0].id_type, variable.targets[0].id = "MATERIAL", made
        path = f"node_tree.{node.inputs[name].path_from_id('default_value')}{component}"
        variable.targets[0].data_path = path
        paths.append(path)
    read = lambda: [curve.driver.variables[0].targets[0].data_path for curve in made.animation_data.drivers]  # noqa: E731
    convert.convert_materials([made], 1.0)
    new = made.node_tree.nodes["Principled BSDF"]
    assert read()[0] == f"node_tree.{new.inputs['Roughness'].path_from_id('default_value')}"
    assert read()[1] == f"node_tree.{new.inputs['Base Color'].path_from_id('default_value')}[2]"
    times = new.inputs["Subsurface Scale"].links[0].from_node  # the driver reads the scene's unit, as before
    assert read()[2] == f"node_tree.{times.inputs[0].path_from_id('default_value')}"
    revert.revert_material(made)
    assert read() == paths


def test_edits_after_the_conversion_carry_over() -> None:
    made, _ = material("Principled", Roughness=0.3, Subsurface_Scale=0.01)
    convert.convert_materials([made], 1.0)
    node = made.node_tree.nodes["Principled BSDF"]
    node.inputs["Roughness"].default_value, node.inputs["Subsurface Scale"].default_value = 0.6, 25.0
    node.inputs["Model"].default_value = "EON"
    report = revert.revert_material(made)
    back = made.node_tree.nodes["Principled BSDF"]
    assert back.bl_idname == BSDF["Principled"] and back.inputs["Roughness"].default_value == pytest.approx(0.6)
    assert back.inputs["Subsurface Scale"].default_value == pytest.approx(0.025)  # 25 mm
    assert len(report.lines) == 1 and "EON" in report.lines[0]


def test_length_that_the_artist_linked_is_turned_into_the_scenes_unit() -> None:
    made, _ = material("Principled")
    convert.convert_materials([made], 1.0)
    tree = made.node_tree
    tree.links.new(tree.nodes["Value"].outputs[0], tree.nodes["Principled BSDF"].inputs["Subsurface Scale"])
    revert.revert_material(made)
    over = tree.nodes["Principled BSDF"].inputs["Subsurface Scale"].links[0].from_node
    assert over.operation == "DIVIDE" and over.inputs[1].default_value == 1000.0


@pytest.mark.parametrize(
    ("name", "kind"), [("clay", "ShaderNodeBsdfDiffuse"), ("marble", BSDF["Principled"]), (None, BSDF["Principled"])]
)
def test_node_of_a_preset_becomes_the_nearest_node(name: str | None, kind: str) -> None:
    made = (
        materials.create("Mine", SPECULAR_GROUP)
        if name is None
        else materials.create("Mine", PRESETS[name].group, **PRESETS[name].inputs)
    )
    report = revert.revert_material(made)
    (node,) = [node for node in made.node_tree.nodes if node.bl_idname == kind]
    assert made.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node == node
    assert "was none of Blender's nodes" in report.lines[0]


@pytest.mark.parametrize("group", [ROUGH_DIFFUSE, SUBSURFACE, SPECULAR_GROUP, PRINCIPLED], ids=lambda group: group.key)
def test_to_principled_leaves_principled_alone(group) -> None:
    made = materials.create("Mine", group)
    tree = made.node_tree
    color = tree.nodes.new("ShaderNodeTexImage").outputs["Color"]
    node = next(node for node in tree.nodes if node.type == "GROUP")
    tree.links.new(color, node.inputs["Base Color" if group is PRINCIPLED else "Color"])
    revert.to_principled(made)
    assert not [node for node in tree.nodes if node.type in {"GROUP", "BSDF_DIFFUSE"}]
    assert tree.nodes[group.name].inputs["Base Color"].links[0].from_socket == color


def test_copy_is_turned_back_alone() -> None:
    made, _ = material("Principled")
    group = bpy.data.node_groups.new("Skin Shader", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    group.links.new(group.nodes.new(BSDF["Principled"]).outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    inner = made.node_tree.nodes.new("ShaderNodeGroup")
    inner.node_tree = group
    made.node_tree.links.new(inner.outputs[0], made.node_tree.get_output_node("ALL").inputs["Surface"])
    convert.convert_materials([made], 1.0)
    before = node_dump(made.node_tree), node_dump(group)
    copy = made.copy()
    report = revert.to_principled(copy)
    assert (node_dump(made.node_tree), node_dump(group)) == before and len(report.copies) == 1
    assert not revert.nodes_of(copy)


def test_thickness_is_taken_back() -> None:
    made, _ = material("Subsurface")
    convert.convert_materials([made], 1.0)
    assert made.use_thickness_from_shadow
    revert.revert_material(made)
    assert not made.use_thickness_from_shadow


@pytest.mark.usefixtures("registered")
def test_operator_reverts_the_selection_and_is_undone() -> None:
    made, _ = material("Principled")
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(made)
    assert not bpy.ops.true_diffuse.revert.poll()
    convert.convert_materials([made], 1.0)
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.true_diffuse.revert("EXEC_DEFAULT", True) == {"FINISHED"}
    assert not revert.nodes_of(bpy.data.materials["Mine"])
    bpy.ops.ed.undo()
    assert revert.nodes_of(bpy.data.materials["Mine"])
