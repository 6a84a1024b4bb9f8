# SPDX-License-Identifier: GPL-3.0-or-later
"""The presets: their values against the published table, their pictures, and the operators that use them."""

import math
from itertools import product
from pathlib import Path

import bpy

import pytest

from true_diffuse.addon.blender import fcurves
from true_diffuse.addon.closures.subsurface_fit import MU
from true_diffuse.addon.material import materials, revert
from true_diffuse.addon.material.apply_preset import apply, create_material, preset_of
from true_diffuse.addon.material.convert import ConversionError
from true_diffuse.addon.material.presets import PICTURES, PRESETS, Preset, picture
from true_diffuse.addon.models.half_space import plane_albedo
from true_diffuse.addon.models.medium import MEDIA
from true_diffuse.addon.models.skin import TONES
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from true_diffuse.addon.nodes.graph import key_and_version

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


@pytest.mark.usefixtures("empty_file")
def test_presets_make_materials_that_are_them() -> None:
    for preset in PRESETS.values():
        node = own(create_material(preset))
        assert has(node, preset.inputs) and preset_of(node) is preset


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


CHALK, MARBLE = PRESETS["chalk"], PRESETS["marble"]


def own(material: bpy.types.Material) -> bpy.types.Node:
    """The node of ours that is the surface of `material`."""
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def texture(node: bpy.types.Node, *names: str) -> bpy.types.Node:
    """Link a new image texture, named Brick, to inputs of `node`; returns it."""
    image = node.id_data.nodes.new("ShaderNodeTexImage")
    image.name = "Brick"
    for name in names:
        node.id_data.links.new(image.outputs["Color"], node.inputs[name])
    return image


def principled_material() -> tuple[bpy.types.Material, bpy.types.Node]:
    material = bpy.data.materials.new("Mine")
    return material, material.node_tree.nodes["Principled BSDF"]


def has(node: bpy.types.Node, values: dict[str, object]) -> bool:
    for name, value in values.items():
        actual = node.inputs[name].default_value
        if isinstance(value, str):
            is_same = actual == value
        else:
            is_same = (tuple(actual) if isinstance(value, tuple) else actual) == pytest.approx(value, rel=1e-6)
        if not is_same:
            return False
    return True


@pytest.mark.usefixtures("empty_file")
def test_preset_takes_the_place_of_a_node_with_its_color_and_normal_links() -> None:
    groups = {"Rough Diffuse": ROUGH_DIFFUSE, "Subsurface": SUBSURFACE, "Standard Specular": SPECULAR_GROUP}
    for kind, preset in product((*groups, "BsdfDiffuse", "BsdfPrincipled", "SubsurfaceScattering"), (CHALK, MARBLE)):
        if kind in groups:
            material = materials.create("Mine", groups[kind])
        else:
            material = bpy.data.materials.new("Mine")
            tree = material.node_tree
            tree.nodes.remove(tree.nodes["Principled BSDF"])
            tree.links.new(tree.nodes.new(f"ShaderNode{kind}").outputs[0], tree.get_output_node("ALL").inputs["Surface"])
        node = own(material)
        node.name = "Kept"
        image = texture(node, "Base Color" if kind == "BsdfPrincipled" else "Color")
        bump = material.node_tree.nodes.new("ShaderNodeBump")
        material.node_tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])
        before = tuple(material.diffuse_color)
        assert apply(material, node if kind in groups else None, preset, 1.0) == ["Color stays linked to Brick"]
        node = own(material)
        assert key_and_version(node)[0] == preset.group.key and node.name == "Kept"
        assert node.inputs["Color"].links[0].from_node == image and node.inputs["Normal"].links[0].from_node == bump
        assert has(node, {"Model": "Oren-Nayar"} | {name: value for name, value in preset.inputs.items() if name != "Color"})
        assert tuple(material.diffuse_color) == before and material.metallic == 0.0  # as the color is the image's


@pytest.mark.usefixtures("empty_file")
def test_preset_resets_what_the_node_had_of_another_look() -> None:
    """A model, or a scale of the radius, would make another material of the preset's numbers; the quality would not."""
    material = materials.create("Mine", ROUGH_DIFFUSE, Model="EON", Quality="Precise", Roughness=0.9)
    assert apply(material, own(material), CHALK, 1.0) == []
    assert has(own(material), {"Model": "Oren-Nayar", "Quality": "Precise", **CHALK.inputs}) and preset_of(own(material)) is CHALK
    material = materials.create("Mine", SUBSURFACE, Scale=7.0, Method="Christensen-Burley")
    apply(material, own(material), MARBLE, 1.0)
    assert has(own(material), {"Scale": 1.0, "Method": "Christensen-Burley"}) and preset_of(own(material)) is MARBLE


@pytest.mark.usefixtures("empty_file")
def test_principled_with_other_links_keeps_them_all() -> None:
    names = ("Base Color", "Metallic", "Alpha", "Subsurface Scale", "Emission Color")
    for preset in (CHALK, MARBLE):
        material, node = principled_material()
        node.inputs["Coat Weight"].default_value = node.inputs["Transmission Weight"].default_value = 0.5
        texture(node, *names)
        assert apply(material, None, preset, 1.0) == [f"{name} stays linked to Brick" for name in names]
        node = own(material)
        assert key_and_version(node)[0] == PRINCIPLED.key and all(node.inputs[name].is_linked for name in names)
        values = {"Model": "Oren-Nayar", "Diffuse Roughness": preset.inputs["Roughness"], "Coat Weight": 0.0}
        # half of a Specular IOR Level is the reflectance of the IOR, which is Specular 1 of the group Subsurface
        is_marble = float(preset is MARBLE)
        assert has(
            node, values | {"Transmission Weight": 0.0, "Subsurface Weight": is_marble, "Specular IOR Level": 0.5 * is_marble}
        )
        if is_marble:
            own_names = {"Subsurface Radius": "Subsurface Radius", "IOR": "IOR", "Roughness": "Specular Roughness"}
            assert has(node, {name: preset.inputs[own] for name, own in own_names.items()})


@pytest.mark.usefixtures("empty_file")
def test_principled_of_ours_stays_one_and_shows_the_preset() -> None:
    material = materials.create("Mine", PRINCIPLED, Metallic=1.0, **{"Sheen Weight": 0.3})
    for preset in (CHALK, MARBLE, CHALK):
        assert apply(material, own(material), preset, 1.0) == [] and preset_of(own(material)) is preset
        assert has(own(material), {"Base Color": preset.inputs["Color"], "Metallic": 0.0, "Sheen Weight": 0.0})


@pytest.mark.usefixtures("empty_file")
def test_links_without_a_place_are_said() -> None:
    material = materials.create("Mine", SUBSURFACE)
    texture(own(material), "Scale", "Roughness")
    notes = apply(material, own(material), CHALK, 1.0)
    assert notes == ["what went into Scale is lost: Rough Diffuse has no such input", "Roughness stays linked to Brick"]


@pytest.mark.usefixtures("empty_file")
def test_animation_is_kept_or_the_preset_refused() -> None:
    material = materials.create("Mine", ROUGH_DIFFUSE)
    node = own(material)
    for frame, value in ((1, 0.1), (11, 0.9)):
        node.inputs["Roughness"].default_value = value
        node.inputs["Roughness"].keyframe_insert("default_value", frame=frame)
    assert apply(material, node, MARBLE, 1.0) == ["Roughness stays animated"]
    paths = [curve.data_path for curve in fcurves.curves(material.node_tree)]
    assert paths == [own(material).inputs["Roughness"].path_from_id("default_value")]
    material, node = principled_material()
    node.inputs["Alpha"].keyframe_insert("default_value", frame=1)
    assert apply(material, None, CHALK, 1.0) == ["Alpha stays animated"] and key_and_version(own(material))[0] == PRINCIPLED.key
    material = materials.create("Mine", SUBSURFACE)
    own(material).inputs["Scale"].keyframe_insert("default_value", frame=1)
    with pytest.raises(ConversionError, match=r"is animated \(Scale\)"):
        apply(material, own(material), CHALK, 1.0)
    assert key_and_version(own(material))[0] == SUBSURFACE.key


@pytest.mark.usefixtures("empty_file")
def test_preset_in_a_mix_changes_the_nearest_and_names_the_others() -> None:
    material, first = principled_material()
    tree = material.node_tree
    second, mix = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeMixShader")
    names = {first.name, second.name}
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    (note,) = apply(material, None, CHALK, 1.0)
    ours = [node.name for node in tree.nodes if key_and_version(node)[0]]
    assert len(ours) == 1 and note == f"{(names - set(ours)).pop()} stays as it is"
    assert own(material) == mix


@pytest.mark.usefixtures("empty_file")
def test_preset_in_a_group_of_the_artist_changes_it_for_all_unless_another_file_owns_it(tmp_path: Path) -> None:
    group = bpy.data.node_groups.new("Shell", "ShaderNodeTree")
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner, output = group.nodes.new("ShaderNodeBsdfDiffuse"), group.nodes.new("NodeGroupOutput")
    group.links.new(inner.outputs[0], output.inputs[0])
    material, outer = principled_material()
    tree = material.node_tree
    tree.nodes.remove(outer)
    outer = tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = group
    tree.links.new(outer.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {group})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.node_groups = ["Shell"]
    outer.node_tree = wanted.node_groups[0]
    with pytest.raises(ConversionError, match="made by the group Shell, which is linked from another file"):
        apply(material, None, CHALK, 1.0)
    outer.node_tree = group
    assert apply(material, None, CHALK, 1.0) == ["the group Shell was changed inside, for all that use it"]
    assert preset_of(output.inputs[0].links[0].from_node) is CHALK


@pytest.mark.usefixtures("empty_file")
def test_preset_becomes_the_surface_where_none_can_take_it() -> None:
    for is_output, is_emission in ((True, True), (True, False), (False, False)):
        material, _ = principled_material()
        tree = material.node_tree
        tree.nodes.clear()
        if is_output:
            output = tree.nodes.new("ShaderNodeOutputMaterial")
        if is_emission:
            tree.links.new(tree.nodes.new("ShaderNodeEmission").outputs[0], output.inputs["Surface"])
        assert apply(material, None, CHALK, 1.0) == ["Emission is no longer the surface"] * is_emission
        assert preset_of(own(material)) is CHALK


@pytest.mark.usefixtures("empty_file")
def test_applied_preset_can_be_reverted_to_the_node_before() -> None:
    material, node = principled_material()
    node.inputs["Base Color"].default_value, node.inputs["Metallic"].default_value = (0.1, 0.2, 0.3, 1.0), 0.75
    apply(material, None, CHALK, 1.0)
    assert revert.revert_material(material).reverted == ["Mine"]
    assert has(own(material), {"Base Color": (0.1, 0.2, 0.3, 1.0), "Metallic": 0.75})


@pytest.mark.usefixtures("empty_file")
def test_solid_view_shows_the_preset() -> None:
    for preset, roughness in ((CHALK, 1.0), (MARBLE, MARBLE.inputs["Specular Roughness"])):
        material, _ = principled_material()
        material.metallic = 1.0
        apply(material, None, preset, 1.0)
        for each in (material, create_material(preset)):
            assert tuple(each.diffuse_color) == pytest.approx(preset.inputs["Color"], rel=1e-6)
            assert each.roughness == pytest.approx(roughness) and each.metallic == 0.0


@pytest.mark.usefixtures("registered")
def test_preset_is_applied_in_place_and_undone(capsys: pytest.CaptureFixture[str]) -> None:
    bpy.ops.mesh.primitive_cube_add()
    material, node = principled_material()
    bpy.context.object.active_material = material
    texture(node, "Base Color")
    bpy.ops.ed.undo_push(message="Before")
    color = tuple(material.diffuse_color)
    for key in ("clay", "chalk"):
        assert bpy.ops.true_diffuse.apply_preset("EXEC_DEFAULT", True, key=key) == {"FINISHED"}
    assert "Applied Chalk to Mine; Color stays linked to Brick" in capsys.readouterr().out
    bpy.ops.ed.undo()
    roughness = own(bpy.data.materials["Mine"]).inputs["Roughness"].default_value
    assert roughness == pytest.approx(PRESETS["clay"].inputs["Roughness"])
    bpy.ops.ed.undo()
    assert own(bpy.data.materials["Mine"]).type == "BSDF_PRINCIPLED" and tuple(bpy.data.materials["Mine"].diffuse_color) == color


@pytest.mark.usefixtures("registered")
def test_assigned_preset_says_to_what(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for _ in range(3):
        bpy.ops.mesh.primitive_cube_add()
    assert bpy.ops.true_diffuse.assign_preset(key="chalk") == {"FINISHED"}
    bpy.ops.object.select_all(action="SELECT")
    assert bpy.ops.true_diffuse.assign_preset(key="chalk") == {"FINISHED"}
    bpy.data.libraries.write(str(tmp_path / "library.blend"), {bpy.data.objects["Cube"]})
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, wanted):
        wanted.objects = ["Cube"]
    bpy.context.collection.objects.link(wanted.objects[0])
    wanted.objects[0].select_set(True)
    assert bpy.ops.true_diffuse.assign_preset(key="clay") == {"FINISHED"}
    out = capsys.readouterr().out
    assert "Assigned Chalk to Cube.002" in out and "Assigned Chalk to 3 objects" in out
    assert "Assigned Clay to 3 objects; linked from other files and not changed: Cube" in out
