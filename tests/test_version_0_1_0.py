# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that version 0.1.0 saved: they open and render as they did, and an upgrade keeps values, links, animation and the picture.

Version 0.1.0 saved data/version_0_1_0.blend, exported data/version_0_1_0.usda, and rendered the radiance in data/version_0_1_0.json
from the first: the mean of each material's tile at frame 6, of 8 by 8 pixels, without its border, over four seeds of 64 samples.
"""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import bpy

import pytest

from support import Layout
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.id_properties import GROUP_ID, SPECIALIZED_FOR
from true_diffuse.addon.material import upgrade
from true_diffuse.addon.measure import render
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.addon.ui import panels

DATA = Path(__file__).with_name("data")
TILE, TILES = 8, 8  # pixels, tiles in a row
RADIANCE: dict[str, list[float]] = json.loads((DATA / "version_0_1_0.json").read_text())
QUALITIES = {"Lobes": "Balanced", "Single": "Fast", "Signed": "Precise", "Lamps": "Exact for Chosen Lights"}
MODELS = ("Lambert", "Oren-Nayar", "Fujii", "EON", "Cycles Diffuse", "Oren-Nayar 1994", "Wolff", "Pits")
METHODS = ("Random Walk", "Christensen-Burley", "Random Walk (Skin)", "Random Walk (Legacy)")
SCATTERING = {*METHODS, "Fair Skin", "Animated Radius", "Driven Radius", "Linked Radius"}


@pytest.fixture
def old_file(request: pytest.FixtureRequest) -> None:
    request.getfixturevalue("registered")
    bpy.ops.wm.open_mainfile(filepath=str(DATA / "version_0_1_0.blend"))


@pytest.fixture
def upgraded(request: pytest.FixtureRequest) -> upgrade.Report:
    request.getfixturevalue("old_file")
    return upgrade.upgrade()


def node(material: str) -> bpy.types.Node:
    """The node of one of our groups in `material`."""
    return next(
        node for node in bpy.data.materials[material].node_tree.nodes if node.type == "GROUP" and GROUP_ID in node.node_tree
    )


def value(material: str, socket: str) -> object:
    return node(material).inputs[socket].default_value


def tiles() -> dict[str, list[float]]:
    """The radiance of each material in Cycles."""
    scene = bpy.context.scene
    radiance = render.radiance(scene, engines.CYCLES, 64)[1]
    width = scene.render.resolution_x
    inside = range(1, TILE - 1)

    def mean(index: int, channel: int) -> float:
        y, x = (TILE * place for place in divmod(index, TILES))
        values = [radiance[3 * ((y + j) * width + x + i) + channel] for j in inside for i in inside]
        return sum(values) / len(values)

    return {name: [mean(index, channel) for channel in range(3)] for index, name in enumerate(RADIANCE)}


def different() -> dict[str, list[float]]:
    """The materials whose radiance is another than version 0.1.0 rendered."""
    # Random walks are noisy: means of four seeds and one differ by up to 0.015 in version 0.1.0 itself, some 2.5 standard
    # deviations; the others have no noise, and are written with 5 digits.
    limits = {name: 0.03 if name in SCATTERING else 2e-5 for name in RADIANCE}
    return {name: got for name, got in tiles().items() if math.dist(got, RADIANCE[name]) > limits[name]}


@pytest.mark.render
@pytest.mark.usefixtures("old_file")
def test_old_file_renders_as_it_did_before_it_is_upgraded() -> None:
    assert different() == {}
    assert {tree[GROUP_ID] for tree in bpy.data.node_groups if GROUP_ID in tree} >= {
        "rough_diffuse/1",
        "subsurface/1",
        "specular/2",
    }


@pytest.mark.render
@pytest.mark.usefixtures("upgraded")
def test_upgraded_file_renders_as_version_0_1_0_did() -> None:
    assert different() == {}


def test_every_material_is_upgraded_without_loss(upgraded: upgrade.Report) -> None:
    assert set(upgraded.upgraded) == {*RADIANCE, "Dusty"} - {"Wrapped"} and not upgraded.lines
    assert not list(upgrade.outdated())


@pytest.mark.parametrize("mode", QUALITIES)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.usefixtures("upgraded")
def test_modes_become_qualities(model: str, mode: str) -> None:
    name = f"{model} {mode}"
    assert value(name, "Quality") == QUALITIES[mode] and value(name, "Roughness") == pytest.approx(0.6)
    assert value(name, "Model") == ("Pitted (Koenderink)" if model == "Pits" else model)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.usefixtures("upgraded")
def test_mean_free_path_becomes_subsurface_radius(method: str) -> None:
    assert value(method, "Method") == method and value(method, "Scale") == pytest.approx(0.5)
    assert list(value(method, "Subsurface Radius")) == pytest.approx([30.0, 20.0, 10.0])


@pytest.mark.parametrize(("mode", "quality"), [("Lobe", "Balanced"), ("Lamps", "Exact for Chosen Lights")])
@pytest.mark.usefixtures("upgraded")
def test_standard_specular_keeps_its_kind_of_highlight(mode: str, quality: str) -> None:
    assert value(f"Specular {mode}", "Quality") == quality and value(f"Specular {mode}", "Specular") == pytest.approx(0.2)


@pytest.mark.usefixtures("upgraded")
def test_keyframes_move_the_same_sockets() -> None:
    seen = {}
    for frame in (1, 11):
        bpy.context.scene.frame_set(frame)
        seen[frame] = value("Animated", "Roughness"), tuple(value("Animated Radius", "Subsurface Radius"))
    assert seen == {1: (pytest.approx(0.2), pytest.approx((40, 20, 5))), 11: (pytest.approx(0.7), pytest.approx((4, 2, 0.5)))}


@pytest.mark.usefixtures("upgraded")
def test_drivers_drive_the_same_sockets() -> None:
    bpy.context.scene["dust"] = 0.6
    bpy.context.scene.frame_set(2)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    rough, wax = (
        bpy.data.materials[name].evaluated_get(depsgraph).node_tree.nodes[node(name).name] for name in ("Driven", "Driven Radius")
    )
    assert rough.inputs["Roughness"].default_value == pytest.approx(0.6)
    assert list(wax.inputs["Subsurface Radius"].default_value) == pytest.approx([30.0, 30 * 0.6, 10.0])


@pytest.mark.parametrize(
    ("material", "socket", "source"),
    [("Linked", "Color", "RGB"), ("Linked Radius", "Subsurface Radius", "COMBXYZ"), ("Linked Mode", "Quality", "MENU_SWITCH")],
)
@pytest.mark.usefixtures("upgraded")
def test_links_stay(material: str, socket: str, source: str) -> None:
    (link,) = node(material).inputs[socket].links
    assert link.from_node.type == source and link.is_valid


@pytest.mark.usefixtures("upgraded")
def test_menu_switch_keeps_its_choices() -> None:
    switch = node("Linked Mode").inputs["Quality"].links[0].from_node
    assert [socket.default_value for socket in list(switch.inputs)[1:3]] == ["Fast", "Exact for Chosen Lights"]


@pytest.mark.usefixtures("upgraded")
def test_menus_that_the_artist_s_group_shows_keep_their_choices() -> None:
    outer = bpy.data.materials["Wrapped"].node_tree.nodes["Dusty"]
    assert [outer.inputs[name].default_value for name in ("Model", "Mode")] == ["Fujii", "Exact for Chosen Lights"]
    interface = bpy.data.node_groups["Dusty"].interface.items_tree
    assert [interface[name].default_value for name in ("Model", "Mode")] == ["Pitted (Koenderink)", "Fast"]


@pytest.mark.usefixtures("upgraded")
def test_chosen_lights_stay_in_order() -> None:
    assert [light.name for light in chosen_lights.chosen()] == ["Sun", "Lamp"]


@pytest.mark.usefixtures("upgraded")
def test_optimized_materials_get_the_whole_group() -> None:
    assert {node(name).node_tree for name in ("Simplified", "Simplified Lamps")} == {ROUGH_DIFFUSE.ensure()}
    assert value("Simplified", "Quality") == "Precise" and value("Simplified Lamps", "Quality") == "Exact for Chosen Lights"


@pytest.mark.usefixtures("old_file")
def test_optimized_material_keeps_an_edit_until_its_upgrade() -> None:
    node("Simplified").inputs["Roughness"].default_value = 0.3
    bpy.context.view_layer.update()
    assert SPECIALIZED_FOR in node("Simplified").node_tree
    upgrade.upgrade()
    assert value("Simplified", "Quality") == "Precise" and value("Simplified", "Roughness") == pytest.approx(0.3)


@pytest.mark.usefixtures("old_file")
def test_old_materials_offer_the_upgrade() -> None:
    layout = Layout()
    with bpy.context.temp_override(material=bpy.data.materials["Clay"]):
        panels.TRUE_DIFFUSE_PT_material.draw(SimpleNamespace(layout=layout, bl_label="True Diffuse"), bpy.context)
    assert "true_diffuse.upgrade" in layout.offered and not any("measure" in entry for entry in layout.offered)


@pytest.fixture
def imported(request: pytest.FixtureRequest) -> None:
    request.getfixturevalue("registered")
    assert bpy.ops.wm.usd_import(filepath=str(DATA / "version_0_1_0.usda")) == {"FINISHED"}


@pytest.mark.usefixtures("imported")
@pytest.mark.parametrize(
    ("material", "model", "quality"),
    [
        ("Oren_Nayar_Lobes", "Oren-Nayar", "Balanced"),
        ("EON_Single", "EON", "Fast"),
        ("Fujii_Signed", "Fujii", "Precise"),
        ("Pits_Lamps", "Pitted (Koenderink)", "Exact for Chosen Lights"),
    ],
)
def test_usd_file_of_version_0_1_0_keeps_model_and_mode(material: str, model: str, quality: str) -> None:
    assert (value(material, "Model"), value(material, "Quality")) == (model, quality)


@pytest.mark.usefixtures("imported")
@pytest.mark.parametrize(("mode", "quality"), [("Lobe", "Balanced"), ("Lamps", "Exact for Chosen Lights")])
def test_usd_file_of_version_0_1_0_keeps_the_kind_of_highlight(mode: str, quality: str) -> None:
    assert value(f"Specular_{mode}", "Quality") == quality


@pytest.mark.usefixtures("imported")
def test_usd_file_of_version_0_1_0_keeps_the_mean_free_path() -> None:
    assert value("Wax", "Model") == "Pitted (Koenderink)" and value("Wax", "Method") == "Christensen-Burley"
    assert list(value("Wax", "Subsurface Radius")) == pytest.approx([30.0, 20.0, 10.0])
    (link,) = node("Painted_Wax").inputs["Subsurface Radius"].links
    assert link.from_node.attribute_name == "lengths"
