# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets: their values against the published table, their pictures, and the operators that use them."""

import math

import bpy

import pytest

from true_diffuse.addon.closures.subsurface_fit import MU
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.presets import PICTURES, PRESETS, Preset, picture
from true_diffuse.addon.models.half_space import plane_albedo
from true_diffuse.addon.models.medium import MEDIA
from true_diffuse.addon.models.skin import TONES
from true_diffuse.addon.nodes import GROUPS, ROUGH_DIFFUSE, SUBSURFACE

every_preset = pytest.mark.parametrize("preset", PRESETS.values(), ids=PRESETS)
every_medium = pytest.mark.parametrize("medium", MEDIA, ids=lambda medium: medium.name)
# Diffuse reflectance in figure 5 of H. W. Jensen and others (SIGGRAPH 2001)
PRINTED = {
    "Marble": (0.83, 0.79, 0.75),
    "Skin 1": (0.44, 0.22, 0.13),
    "Spectralon": (1.00, 1.00, 1.00),
    "Whole Milk": (0.91, 0.88, 0.76),
}


def test_every_medium_and_tone_has_a_preset() -> None:
    kinds = [preset.kind for preset in PRESETS.values() if preset.group is SUBSURFACE]
    assert kinds == ["Skin"] * len(TONES) + ["Translucent"] * len(MEDIA)


def test_matte_materials_are_oren_nayar_s() -> None:
    rough = {preset.name: preset for preset in PRESETS.values() if preset.kind == "Matte"}
    assert set(rough) == {"Chalk", "Clay", "Plaster", "Felt", "Moon"}
    assert all(preset.group is ROUGH_DIFFUSE and preset.inputs["Roughness"] > 0.0 for preset in rough.values())
    # the moon's geometric albedo, which a catalog of planets gives as 0.12; weights of sRGB's luminance
    moon = rough["Moon"].inputs["Color"]
    assert sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), moon, strict=False)) == pytest.approx(0.12, abs=0.005)


@every_preset
def test_values_are_finite_and_in_the_sockets_ranges(preset: Preset) -> None:
    sockets = {socket.name: socket for socket in preset.group.inputs}
    for name, value in preset.inputs.items():
        low, high = sockets[name].minimum or 0.0, sockets[name].maximum or (1.0 if name == "Color" else 20.0)
        assert all(low <= v <= high for v in (value if isinstance(value, tuple) else (value,))), name
    assert min(preset.inputs.get("Subsurface Radius", (1.0,))) > 0.01


@pytest.mark.parametrize("name", PRINTED)
def test_color_of_a_medium_is_its_printed_reflectance(name: str) -> None:
    preset = next(preset for preset in PRESETS.values() if preset.name == name)
    assert preset.inputs["Color"][:3] == pytest.approx(PRINTED[name], abs=0.008)


@every_medium
def test_light_gets_as_far_as_in_the_medium(medium) -> None:
    preset = next(preset for preset in PRESETS.values() if preset.name == medium.name.title())
    assert preset.inputs["IOR"] == medium.eta
    for channel, color, length in zip(medium.channels, preset.inputs["Color"], preset.inputs["Subsurface Radius"], strict=False):
        sigma_tr = math.sqrt(3.0 * max(channel.sigma_a, 1e-6) * (channel.sigma_a + channel.sigma_s_prime))
        # the half-space with this length and that sigma_tr, without a boundary, reflects the color
        assert plane_albedo(1.0 - (length * sigma_tr) ** 2 / 3.0, MU) == pytest.approx(color, rel=2e-4)


def test_darker_skin_is_darker() -> None:
    tones = [preset.inputs["Color"][:3] for preset in PRESETS.values() if preset.kind == "Skin"]
    assert tones == sorted(tones, reverse=True) and all(r > g > b for r, g, b in tones)


@every_preset
@pytest.mark.usefixtures("empty_file")
def test_preset_makes_a_material(preset: Preset) -> None:
    node = materials.create(preset.name, preset.group, **preset.inputs).node_tree.nodes[preset.group.name]
    for name, value in preset.inputs.items():
        actual = node.inputs[name].default_value
        assert (tuple(actual) if isinstance(value, tuple) else actual) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("key", [*PRESETS, *(group.key for group in GROUPS)])
@pytest.mark.usefixtures("empty_file")
def test_picture_is_square_and_shows_something_before_black(key: str) -> None:
    image = bpy.data.images.load(str(picture(key)))
    width, height = image.size
    pixels = image.pixels[:]
    light = [max(pixels[at : at + 3]) for at in range(0, len(pixels), image.channels)]
    assert width == height >= 128
    shown = sum(value > 0.02 for value in light) / len(light)
    assert min(light) < 0.005 and 0.2 < shown < 0.8 and light[0] < 0.02


def test_pictures_are_light() -> None:
    assert sum(path.stat().st_size for path in PICTURES.iterdir()) < 50_000


@pytest.mark.usefixtures("registered")
def test_preset_is_added_to_a_material_and_undone() -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.active_material = bpy.data.materials.new("Mine")
    assert not bpy.ops.true_diffuse.add_preset.poll()  # no Shader Editor
    area = bpy.context.window.screen.areas[0]
    area.ui_type = "ShaderNodeTree"
    with bpy.context.temp_override(area=area, region=area.regions[-1]):
        before = len(bpy.data.materials["Mine"].node_tree.nodes)
        bpy.ops.ed.undo_push(message="Before")
        assert bpy.ops.true_diffuse.add_preset("EXEC_DEFAULT", True, key="marble") == {"FINISHED"}
        nodes = bpy.data.materials["Mine"].node_tree.nodes
        assert len(nodes) == before + 1 and nodes.active.inputs["IOR"].default_value == 1.5
    bpy.ops.ed.undo()
    assert len(bpy.data.materials["Mine"].node_tree.nodes) == before


@pytest.mark.usefixtures("registered")
def test_preset_is_assigned_to_selected_objects_and_undone() -> None:
    bpy.ops.object.light_add()
    assert not bpy.ops.true_diffuse.assign_preset.poll()  # a light has no surface
    for add in (bpy.ops.mesh.primitive_cube_add, bpy.ops.object.metaball_add, bpy.ops.object.light_add):
        add()
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="whole_milk") == {"FINISHED"}
    assert [item.active_material.name for item in bpy.data.objects if item.type != "LIGHT"] == ["Whole Milk"] * 2
    bpy.ops.ed.undo()
    assert not bpy.data.materials and not any(item.active_material for item in bpy.data.objects if item.type != "LIGHT")


@pytest.mark.usefixtures("registered")
def test_preset_is_assigned_in_the_properties_editor_to_its_object() -> None:
    bpy.ops.mesh.primitive_cube_add()
    other = bpy.context.object
    bpy.ops.mesh.primitive_cube_add()
    shown = bpy.context.object
    shown.select_set(False)
    other.select_set(True)
    area = bpy.context.window.screen.areas[0]
    area.ui_type = "PROPERTIES"
    with bpy.context.temp_override(area=area, region=area.regions[-1]):
        assert bpy.ops.true_diffuse.assign_preset(key="clay") == {"FINISHED"}
    assert shown.active_material.name == "Clay" and other.active_material is None
