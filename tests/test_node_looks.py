# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist sees of a group's node: its width, its panels, the range of its sliders, and which inputs Blender dims."""

from array import array
from dataclasses import replace

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials, upgrade
from true_diffuse.addon.material.presets import picture
from true_diffuse.addon.material.read import read_surface
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SUBSURFACE, Group
from true_diffuse.addon.nodes.model_nodes import ROUGHNESS

pytestmark = pytest.mark.usefixtures("empty_file")

# The panels of Blender 5.2's Principled BSDF, in its order, and what its node has in each: its two menus are first in theirs.
PANELS = {
    "Diffuse": ["Diffuse Roughness"],
    "Subsurface": [
        "Subsurface Method",
        "Subsurface Weight",
        "Subsurface Radius",
        "Subsurface Scale",
        "Subsurface IOR",
        "Subsurface Anisotropy",
    ],
    "Specular": ["Distribution", "Specular IOR Level", "Specular Tint", "Anisotropic", "Anisotropic Rotation", "Tangent"],
    "Transmission": ["Transmission Weight"],
    "Coat": ["Coat Weight", "Coat Roughness", "Coat IOR", "Coat Tint", "Coat Normal"],
    "Sheen": ["Sheen Weight", "Sheen Roughness", "Sheen Tint"],
    "Emission": ["Emission Color", "Emission Strength"],
    "Thin Film": ["Thin Film Thickness", "Thin Film IOR"],
}
OWN = {"Model", "Quality"}  # what the Principled BSDF lacks
HIGH = 1.3  # radians: more than the slider shows
ROUGH = ((ROUGH_DIFFUSE, "Roughness"), (SUBSURFACE, "Roughness"), (PRINCIPLED, "Diffuse Roughness"))


def panels(group: Group) -> dict[str, list[str]]:
    """The names of the panels of a group, and of the inputs in each."""
    found: dict[str, list[str]] = {}
    for item in group.ensure().interface.items_tree:
        if item.item_type == "PANEL":
            found[item.name] = []
        elif item.parent.name:
            found[item.parent.name].append(item.name)
    return found


def test_panels_are_those_of_the_principled_in_its_order() -> None:
    ours = panels(PRINCIPLED)
    assert list(ours) == list(PANELS) and ours["Diffuse"] == ["Model", "Quality", "Diffuse Roughness"]
    assert {name: [socket for socket in sockets if socket not in OWN] for name, sockets in ours.items()} == PANELS
    assert list(panels(SUBSURFACE)) == [name for name in PANELS if name in panels(SUBSURFACE)]
    for group, name in ((PRINCIPLED, "Diffuse"), (SUBSURFACE, "Subsurface")):  # what a group is for is open
        items = [item for item in group.ensure().interface.items_tree if item.item_type == "PANEL"]
        assert [item.name for item in items if not item.default_closed] == [name]


@pytest.mark.parametrize(("group", "name"), ROUGH, ids=[group.key for group, _ in ROUGH])
def test_roughness_slides_from_0_to_1_and_more_is_kept(group: Group, name: str) -> None:
    item = group.ensure().interface.items_tree[name]
    assert (item.subtype, item.min_value, item.max_value) == ("FACTOR", 0.0, 1.0)
    assert "radians" in item.description and "1.57" in item.description
    made = materials.create("Dusty", group, **{name: HIGH})
    node = made.node_tree.nodes[group.name]
    assert node.inputs[name].default_value == pytest.approx(HIGH)
    made.node_tree.interface_update(bpy.context)
    group.ensure().interface_update(bpy.context)
    assert node.inputs[name].default_value == pytest.approx(HIGH)


@pytest.mark.parametrize("group", [ROUGH_DIFFUSE, SUBSURFACE], ids=lambda group: group.key)
def test_roughness_of_an_old_slider_stays_above_1(group: Group) -> None:
    """Before, the slider ended at pi / 2, and no group had panels."""
    wide = replace(ROUGHNESS, maximum=1.5707964)
    inputs = tuple(wide if socket.name == "Roughness" else replace(socket, panel="") for socket in group.inputs)
    old = replace(group, version=group.version - 1, inputs=inputs[::-1], open_panel="")
    made = materials.create("Old", old, Roughness=HIGH, Model="Fujii")
    before = read_surface(made).surface
    assert upgrade.upgrade().upgraded == ["Old"]
    node = made.node_tree.nodes[group.name]
    assert node.node_tree == group.ensure() and node.inputs["Roughness"].default_value == pytest.approx(HIGH)
    assert read_surface(made).surface == before


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_node_is_200_wide_and_blender_dims_no_input_that_another_engine_needs(group: Group) -> None:
    """Blender dims what it finds unused: Method may not stay so when the engine changes to Cycles."""
    made = shown(group)
    node = made.node_tree.nodes[group.name]
    assert node.width == group.ensure().default_group_node_width == 200.0 and not node.show_options
    for engine in (engines.EEVEE, engines.CYCLES, engines.EEVEE):
        bpy.context.scene.render.engine = engine.identifier
        bpy.context.view_layer.update()
        assert dimmed(made, group) == []


def test_what_lambert_has_not_is_dimmed_for_lambert_alone() -> None:
    """With Lambert the group is one Principled BSDF, the same in all qualities and whatever the roughness."""
    made = shown(PRINCIPLED, Model="Lambert")
    assert "Quality" in dimmed(made, PRINCIPLED) and set(dimmed(made, PRINCIPLED)) <= {"Quality", "Diffuse Roughness"}
    made.node_tree.nodes[PRINCIPLED.name].inputs["Model"].default_value = "Fujii"
    bpy.context.view_layer.update()
    assert dimmed(made, PRINCIPLED) == []


def shown(group: Group, **inputs: materials.Setting) -> bpy.types.Material:
    """A material of an object in the scene, so that its drivers are evaluated."""
    made = materials.create("New", group, **inputs)
    mesh = bpy.data.meshes.new("Mesh")
    mesh.materials.append(made)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Object", mesh))
    return made


def dimmed(material: bpy.types.Material, group: Group) -> list[str]:
    return [socket.name for socket in material.node_tree.nodes[group.name].inputs if socket.is_inactive]


def test_picture_of_standard_specular_shows_its_highlight() -> None:
    """Its base is red, 0.35 to 0.05: green is 0.39 of red in sRGB, and only a white highlight brings it near red."""
    image = bpy.data.images.load(str(picture("specular")))
    pixels = array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(pixels)
    lit = [(red, green) for red, green in zip(pixels[0::4], pixels[1::4], strict=True) if red > 0.5]
    assert sum(green > 0.8 * red for red, green in lit) > 100  # pixels
