# SPDX-License-Identifier: GPL-3.0-or-later
"""The thickness that EEVEE takes a material for follows nodes of ours, however they come, and leaves what the artist did."""

from collections.abc import Callable
from pathlib import Path

import bpy

import pytest

import true_diffuse
from support import show
from true_diffuse.addon.blender.engines import EEVEE
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.revert import revert_material
from true_diffuse.addon.material.summary import node_summary, thickness_message
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group
from true_diffuse.scripts.studies import light_leaks

pytestmark = pytest.mark.usefixtures("registered")

every_group = pytest.mark.parametrize("group", [ROUGH_DIFFUSE, SPECULAR_GROUP, PRINCIPLED, SUBSURFACE], ids=lambda group: group.key)


def blank(name: str = "Material") -> bpy.types.Material:
    """Return a new material on an object, of an output alone."""
    material = bpy.data.materials.new(name)
    material.node_tree.nodes.clear()
    material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    show(material)
    bpy.context.view_layer.update()
    return material


def add(tree: bpy.types.NodeTree, group: Group) -> bpy.types.Node:
    """Add `group` as Blender's Add > Group does."""
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group.ensure()
    return node


def link_surface(material: bpy.types.Material, socket: bpy.types.NodeSocket) -> None:
    """Link the surface and have Blender update, as after any step of an artist."""
    tree = material.node_tree
    tree.links.new(socket, tree.get_output_node("EEVEE").inputs["Surface"])
    bpy.context.view_layer.update()


def added(group: Group, name: str = "Material") -> bpy.types.Material:
    """Return a new material whose surface is `group`, by Blender's own means."""
    material = blank(name)
    link_surface(material, add(material.node_tree, group).outputs["BSDF"])
    return material


def thickness(material: bpy.types.Material) -> bpy.types.NodeSocket:
    """Return the input of the material's output."""
    return material.node_tree.get_output_node("EEVEE").inputs["Thickness"]


def source(material: bpy.types.Material) -> bpy.types.Node | None:
    """Return the node that is linked to the thickness."""
    socket = thickness(material)
    return socket.links[0].from_node if socket.is_linked else None


def fits(material: bpy.types.Material, group: Group) -> bool:
    """Return whether the thickness is that of a material of `group`."""
    node = source(material)
    if group is SUBSURFACE:
        return node is not None and node.type == "GROUP" and node.node_tree == group.ensure() and material.use_thickness_from_shadow
    return node is not None and node.label == materials.THICK_LABEL and node.outputs[0].default_value == materials.THICK


@every_group
def test_group_that_is_added_has_its_thickness_once_it_is_the_surface(group: Group) -> None:
    material = blank()
    node = add(material.node_tree, group)
    bpy.context.view_layer.update()
    assert source(material) is None
    link_surface(material, node.outputs["BSDF"])
    assert fits(material, group)
    count = len(material.node_tree.nodes)
    materials.set_thickness(material)
    assert fits(material, group) and len(material.node_tree.nodes) == count


@every_group
@pytest.mark.parametrize("node", ["ShaderNodeMixShader", "ShaderNodeAddShader", "NodeReroute"])
def test_group_behind_other_nodes_has_its_thickness(group: Group, node: str) -> None:
    material = blank()
    tree = material.node_tree
    between = tree.nodes.new(node)
    tree.links.new(add(tree, group).outputs["BSDF"], between.inputs[-1])
    link_surface(material, between.outputs[0])
    assert fits(material, group)


@pytest.mark.parametrize("order", [1, -1])
def test_medium_beside_a_rough_surface_decides(order: int) -> None:
    material = blank()
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    for group, socket in zip((ROUGH_DIFFUSE, SUBSURFACE)[::order], mix.inputs[1:], strict=True):
        tree.links.new(add(tree, group).outputs["BSDF"], socket)
    link_surface(material, mix.outputs[0])
    assert fits(material, SUBSURFACE)


def wrapped(group: Group) -> bpy.types.NodeTree:
    """Return a group of the artist that holds `group`."""
    tree = bpy.data.node_groups.new("Mine", "ShaderNodeTree")
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    tree.links.new(add(tree, group).outputs["BSDF"], tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


@every_group
def test_group_inside_another_has_the_thickness_that_needs_no_output_of_it(group: Group) -> None:
    material = added(ROUGH_DIFFUSE)
    outer = material.node_tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = wrapped(group)
    link_surface(material, outer.outputs[0])
    assert source(material) is None if group is SUBSURFACE else fits(material, group)


def test_panel_says_what_a_missing_thickness_shows() -> None:
    scene = bpy.context.scene
    scene.render.engine = EEVEE.identifier
    material = blank()
    outer = material.node_tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = wrapped(SUBSURFACE)
    link_surface(material, outer.outputs[0])
    inner = next(node for node in outer.node_tree.nodes if node.type == "GROUP")
    assert "No light comes through" in thickness_message(node_summary(inner), material, scene)
    rough = added(ROUGH_DIFFUSE, "Rough")
    node = next(node for node in rough.node_tree.nodes if node.type == "GROUP")
    assert thickness_message(node_summary(node), rough, scene) == ""
    rough.node_tree.links.remove(thickness(rough).links[0])
    assert "Light from behind" in thickness_message(node_summary(node), rough, scene)
    scene.render.engine = "CYCLES"
    assert thickness_message(node_summary(node), rough, scene) == ""


@every_group
def test_thickness_of_the_artist_stays(group: Group) -> None:
    material = blank()
    tree = material.node_tree
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], thickness(material))
    link_surface(material, add(tree, group).outputs["BSDF"])
    assert source(material) == value


@every_group
def test_thickness_that_the_artist_removed_stays_removed(group: Group) -> None:
    material = added(group)
    material.node_tree.links.remove(thickness(material).links[0])
    material.use_thickness_from_shadow = False
    node = next(node for node in material.node_tree.nodes if node.type == "GROUP")
    bpy.context.view_layer.update()
    node.inputs["Normal"].default_value = (0.0, 0.0, 1.0)
    bpy.context.view_layer.update()
    materials.set_thickness(material)
    assert source(material) is None and not material.use_thickness_from_shadow


@pytest.mark.parametrize(("first", "second"), [(ROUGH_DIFFUSE, SUBSURFACE), (SUBSURFACE, ROUGH_DIFFUSE), (SUBSURFACE, SUBSURFACE)])
def test_thickness_follows_another_surface(first: Group, second: Group) -> None:
    material = added(first)
    new = add(material.node_tree, second)
    link_surface(material, new.outputs["BSDF"])
    assert fits(material, second) and (second is not SUBSURFACE or source(material) == new)


def test_thickness_goes_where_other_nodes_let_light_through_and_stays_for_a_preview() -> None:
    material = added(ROUGH_DIFFUSE)
    tree = material.node_tree
    link_surface(material, tree.nodes.new("ShaderNodeEmission").outputs[0])
    assert fits(material, ROUGH_DIFFUSE)
    link_surface(material, tree.nodes.new("ShaderNodeSubsurfaceScattering").outputs[0])
    assert source(material) is None and not any(node.label == materials.THICK_LABEL for node in tree.nodes)


def test_thickness_follows_the_weights_of_principled() -> None:
    material = added(PRINCIPLED)
    node = next(node for node in material.node_tree.nodes if node.type == "GROUP")
    for weight in ("Subsurface Weight", "Transmission Weight"):
        node.inputs[weight].default_value = 0.5
        bpy.context.view_layer.update()
        assert source(material) is None
        node.inputs[weight].default_value = 0.0
        bpy.context.view_layer.update()
        assert fits(material, PRINCIPLED)


def test_updates_come_to_an_end() -> None:
    material = added(SUBSURFACE)
    calls = []

    def count(*_: object) -> None:
        calls.append(None)

    material.node_tree.nodes[0].location.x += 1.0
    bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.append(count)
    for _ in range(3):
        bpy.context.view_layer.update()
    bpy.app.handlers.depsgraph_update_post.remove(count)
    assert not calls


@every_group
def test_undo_takes_the_node_and_its_thickness(group: Group) -> None:
    material = blank()
    bpy.ops.ed.undo_push(message="Before")
    node = add(material.node_tree, group)
    material.node_tree.links.new(node.outputs["BSDF"], material.node_tree.get_output_node("EEVEE").inputs["Surface"])
    bpy.ops.ed.undo_push(message="Added")  # Blender keeps a step before it updates
    bpy.context.view_layer.update()
    bpy.ops.ed.undo()
    material = bpy.data.materials["Material"]
    assert source(material) is None and [node.type for node in material.node_tree.nodes] == ["OUTPUT_MATERIAL"]
    bpy.ops.ed.redo()
    assert fits(bpy.data.materials["Material"], group)


@every_group
def test_duplicate_of_a_material_keeps_what_the_artist_did(group: Group) -> None:
    material = added(group)
    copy = material.copy()
    show(copy)
    bpy.context.view_layer.update()
    assert fits(copy, group)
    copy.node_tree.links.remove(thickness(copy).links[0])
    again = copy.copy()
    show(again)
    bpy.context.view_layer.update()
    assert source(again) is None and fits(material, group)


@pytest.fixture
def bare(tmp_path: Path) -> Callable[[Group], Path]:
    """Saves a file with a material of a group that has no thickness, and empties it again."""

    def save(group: Group) -> Path:
        true_diffuse.unregister()
        material = added(group)
        assert source(material) is None
        path = tmp_path / "bare.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        true_diffuse.register()
        return path

    return save


@every_group
def test_appended_material_has_its_thickness(bare: Callable[[Group], Path], group: Group) -> None:
    assert bpy.ops.wm.append(directory=str(bare(group) / "Material"), filename="Material") == {"FINISHED"}
    assert fits(bpy.data.materials["Material"], group)


def test_linked_material_is_left_until_it_is_local(bare: Callable[[Group], Path]) -> None:
    assert bpy.ops.wm.link(directory=str(bare(SUBSURFACE) / "Material"), filename="Material") == {"FINISHED"}
    material = bpy.data.materials["Material"]
    show(material)
    bpy.context.view_layer.update()
    assert source(material) is None
    local = material.make_local()
    bpy.context.view_layer.update()
    assert source(local).type == "GROUP"


def test_script_without_the_extension_sets_the_thickness_itself() -> None:
    true_diffuse.unregister()
    material = added(SUBSURFACE)
    assert source(material) is None
    materials.set_thickness(material)
    assert fits(material, SUBSURFACE)
    true_diffuse.register()


def test_revert_leaves_nothing_of_the_thickness() -> None:
    material = added(SUBSURFACE)
    revert_material(material)
    assert source(material) is None and not material.use_thickness_from_shadow
    assert not [key for key, _ in material.items() if key.startswith("true_diffuse")]


@pytest.mark.render
@pytest.mark.usefixtures("driver")
def test_thin_slab_of_an_added_group_shows_no_light_from_behind() -> None:
    """As it would with EEVEE's own thickness of it, of 0.5 mm."""
    slab, material = light_leaks.body(0.0005), added(ROUGH_DIFFUSE)
    assert slab.leak(material, EEVEE, 120.0, True) == 0.0
    material.node_tree.links.remove(thickness(material).links[0])
    assert slab.leak(material, EEVEE, 120.0, True) > 0.1
