# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension while it is registered: what it adds to Blender, and operators of no other test's."""

import re
import subprocess
import sys
from array import array
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import bpy

import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

import true_diffuse
from support import Layout
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.wording import counted, counted_names
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, chosen_lights
from true_diffuse.addon.nodes.chosen_lights import LIGHTS
from true_diffuse.addon.operators.context import editor_obstacle
from true_diffuse.addon.ui import menus
from true_diffuse.scenes import subject


def blender_state() -> tuple[set[str], int, list[str]]:
    """All registered types, the entries of the menus that get ours, the open handlers."""
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    handlers = [f"{name}:{len(value)}" for name, value in lists.items() if isinstance(value, list)]
    entries = sum(len(getattr(bpy.types, menu)._dyn_ui_initialize()) for menu, _ in menus.ENTRIES)
    return set(dir(bpy.types)), entries, handlers


def test_registering_twice_leaves_blender_as_it_was() -> None:
    before = blender_state()
    for _ in range(2):
        true_diffuse.register()
        during = blender_state()
        assert "TRUE_DIFFUSE_MT_add" in during[0] - before[0] and during[1] == before[1] + len(menus.ENTRIES)
        true_diffuse.unregister()
        assert blender_state() == before


@pytest.mark.usefixtures("registered")
def test_add_group_needs_a_shader_editor() -> None:
    assert not bpy.ops.true_diffuse.add_group.poll()


@pytest.mark.usefixtures("registered")
def test_use_selected_lights_chooses_the_selected_lights() -> None:
    assert not bpy.ops.true_diffuse.use_selected_lights.poll()  # no light
    for _ in range(5):
        bpy.ops.object.light_add(type="POINT")
    bpy.ops.object.select_all(action="DESELECT")
    assert not bpy.ops.true_diffuse.use_selected_lights.poll()  # too many
    chosen = bpy.context.object
    chosen.select_set(True)
    assert bpy.ops.true_diffuse.use_selected_lights() == {"FINISHED"}
    drivers = LIGHTS.ensure().animation_data.drivers
    followed = {target.id for curve in drivers for variable in curve.driver.variables for target in variable.targets}
    assert followed == {chosen, chosen.data}


def build_comparison(plaster: bool = False) -> set[str]:
    bpy.ops.ed.undo_push(message="Before")
    return bpy.ops.true_diffuse.build_comparison("EXEC_DEFAULT", True, plaster=plaster)


def _box(scene: bpy.types.Scene, item: bpy.types.Object) -> tuple[float, float, float, float]:
    """Where `item` is in the picture of the scene's camera: left, right, low and high, as fractions of the picture's sides."""
    points = [world_to_camera_view(scene, scene.camera, item.matrix_world @ Vector(corner)) for corner in item.bound_box]
    across, up = [point.x for point in points], [point.y for point in points]
    return min(across), max(across), min(up), max(up)


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("plaster", [False, True])
def test_comparison_shows_the_active_object_five_times_and_is_undone(plaster: bool) -> None:
    bpy.ops.mesh.primitive_cone_add(radius1=1.0, depth=3.0, location=(5.0, 6.0, 7.0))
    cone = bpy.context.object
    cone.modifiers.new("Subdivision", "SUBSURF").levels = 1
    before = len(cone.data.vertices)
    assert build_comparison(plaster) == {"FINISHED"}
    shown = [item for item in bpy.context.window.scene.objects if item.type == "MESH" and item.name != "Backdrop"]
    assert len(shown) == 5 and len({item.data for item in shown}) == 1 and len({item.active_material for item in shown}) == 5
    mesh = shown[0].data
    assert len(mesh.vertices) > before == len(cone.data.vertices)  # the modifier is in the copies alone
    # upright on the ground, 1.8 m tall like the human
    heights = [(shown[0].matrix_world @ vertex.co).z for vertex in mesh.vertices]
    assert [round(limit(heights), 4) for limit in (min, max)] == [0.0, 1.8]
    built = bpy.context.window.scene
    assert built != bpy.data.scenes["Scene"]
    views = [area.spaces.active.region_3d for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"]
    assert views and all(view.view_perspective == "CAMERA" for view in views)
    labels = [item for item in built.objects if item.type == "FONT"]
    assert [label.data.body.split() for label in labels] == [
        ["Standard", "specular"],
        ["Lambert"],
        *(["Oren-Nayar", "\u03c3", "=", sigma] for sigma in ("0", "0.2", "0.33")),
    ]
    built.view_layers[0].update()
    places = [_box(built, item) for item in (*labels, *shown)]
    for (left, right, low, high), (_, _, feet, _) in zip(places[:5], places[5:], strict=True):
        assert 0.0 < left < right < 1.0 and 0.0 < low < high < feet  # in the picture, and below the character
    assert all(one[1] < other[0] for one, other in pairwise(places[:5]))  # beside each other
    corner = min((label.matrix_world @ Vector(point)).z for label in labels for point in label.bound_box)
    assert corner > 0.0  # above the floor
    bpy.ops.ed.undo()
    assert bpy.context.window.scene.name == "Scene" and len(bpy.data.scenes) == 1 and len(bpy.data.materials) == 0


@pytest.mark.usefixtures("registered")
def test_mirrored_object_is_not_turned_inside_out() -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.scale.x = -1.0
    mesh = subject.from_object(bpy.context.object, bpy.context.evaluated_depsgraph_get())
    middle = Vector((0.0, 0.0, subject.HEIGHT / 2.0))
    assert all(face.normal.dot(face.center - middle) > 0.0 for face in mesh.polygons)


@pytest.mark.usefixtures("registered")
def test_comparison_is_refused_without_a_mesh_that_stands() -> None:
    bpy.ops.object.light_add()
    assert not bpy.ops.true_diffuse.build_comparison.poll()
    bpy.ops.mesh.primitive_plane_add()
    meshes = len(bpy.data.meshes)
    with pytest.raises(RuntimeError, match="Plane is flat"):
        build_comparison()
    assert len(bpy.data.scenes) == 1 and len(bpy.data.meshes) == meshes


ALONE = """
import bpy, sys
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], use_scripts=False)
assert not hasattr(bpy.types.Scene, "true_diffuse")
bpy.context.scene.render.engine = "CYCLES"
bpy.ops.render.render(write_still=True)
"""


@pytest.mark.usefixtures("registered")
def test_file_renders_the_same_without_the_extension(tmp_path: Path) -> None:
    scene = bpy.context.scene
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.2, 0.0))
    chosen_lights.choose([bpy.context.object])
    shown = [
        materials.create("Precise", ROUGH_DIFFUSE, Quality="Precise", Roughness=1.0),
        materials.create("Chosen Lights", ROUGH_DIFFUSE, Quality="Exact for Chosen Lights", Roughness=1.0),
        materials.create("Marble", SUBSURFACE, **PRESETS["marble"].inputs),
        materials.create("Highlight", SPECULAR_GROUP),
        materials.create("Metal", PRINCIPLED, Metallic=0.5),
    ]
    for index, material in enumerate(shown):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(index - 2.0, 0.0, 0.0))
        bpy.context.object.active_material = material
    bpy.ops.object.camera_add(location=(0.0, 0.0, 5.0))
    scene.camera = bpy.context.object
    scene.render.resolution_x, scene.render.resolution_y = 160, 40
    scene.render.image_settings.file_format = "OPEN_EXR"
    engines.use(scene, engines.CYCLES, 4)
    scene.render.engine = "BLENDER_EEVEE"  # the file's own, which the drivers of the groups follow
    scene.render.filepath = str(tmp_path / "alone.exr")
    file = tmp_path / "file.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    alone = subprocess.run([sys.executable, "-c", ALONE, str(file)], capture_output=True, text=True, check=False)
    assert alone.returncode == 0, alone.stderr
    scene.render.engine = "CYCLES"
    scene.render.filepath = str(tmp_path / "with.exr")
    bpy.ops.render.render(write_still=True)
    pixels = [array("f", bpy.data.images.load(str(tmp_path / f"{name}.exr")).pixels[:]) for name in ("alone", "with")]
    assert max(pixels[0]) > 0.1 and pixels[0] == pixels[1]  # Cycles' random numbers are the same


def test_messages_count_and_name_in_plain_english() -> None:
    names = [f"M{k}" for k in range(6)]
    assert [counted(number, "material") for number in (0, 1, 2)] == ["0 materials", "1 material", "2 materials"]
    assert counted_names(names[:1], "material") == "1 material: M0"
    assert counted_names(names[:4], "material") == "4 materials: M0, M1, M2, M3"
    assert counted_names(names[:5], "material") == "5 materials: M0, M1, M2 and 2 more"
    assert counted_names([], "material") == "no material"


@pytest.mark.usefixtures("registered")
def test_operators_say_what_they_did(capfd: pytest.CaptureFixture[str]) -> None:
    bpy.ops.mesh.primitive_cube_add()
    for name in ("Skin", "Shirt", "Boots"):
        bpy.context.object.data.materials.append(bpy.data.materials.new(name))  # with a Principled BSDF

    def said(operator: str, **options: str) -> str:
        capfd.readouterr()
        getattr(bpy.ops.true_diffuse, operator)(**options)
        (line,) = re.findall("Info: (.*)", capfd.readouterr().out)
        return line

    colors = [tuple(material.diffuse_color) for material in bpy.data.materials]
    assert said("convert") == "Converted 3 materials: Skin, Shirt, Boots"
    assert said("convert") == "Already True Diffuse"
    assert [tuple(material.diffuse_color) for material in bpy.data.materials] == colors  # Solid view shows what it did
    assert said("revert") == "Reverted 3 materials: Skin, Shirt, Boots"
    assert said("match_engines").startswith("Converted no material; ")
    assert said("match_engines") == "EEVEE is set up like Cycles already"
    glow = bpy.data.materials.new("Glow")
    glow.node_tree.nodes.clear()
    bpy.context.object.data.materials.clear()
    bpy.context.object.data.materials.append(glow)
    assert said("convert") == "No Diffuse, Principled or Subsurface Scattering BSDF is used in 1 material: Glow"
    for name in ("Key", "Rim"):
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN")))
    assert said("use_selected_lights") == "Chose 2 lights: Key, Rim"
    assert said("toggle_light", light="Key") == "Removed Key; chosen now: Rim"
    assert said("toggle_light", light="Rim") == "Removed Rim; no light is chosen now"
    assert said("toggle_light", light="Key") == "Added Key; chosen now: Key"


@pytest.mark.usefixtures("registered")
def test_menu_search_lists_each_preset_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Layout, "emboss", "NORMAL")  # as Blender draws menus to search them
    names = []
    for menu in menus.PRESET_MENUS:
        layout = Layout()
        menu.draw(SimpleNamespace(layout=layout, bl_label=menu.bl_label), bpy.context)
        names += layout.offered
    assert sorted(names) == sorted(f"true_diffuse.assign_preset {preset.name}" for preset in PRESETS.values())


@pytest.mark.usefixtures("registered")
def test_nodes_of_lights_and_worlds_have_no_menu_of_ours() -> None:
    light = bpy.data.lights.new("Key", "POINT")
    for owner, is_ours in ((bpy.data.materials.new("Clay"), True), (light, False), (bpy.data.worlds.new("Sky"), False)):
        space = SimpleNamespace(type="NODE_EDITOR", tree_type="ShaderNodeTree", id=owner, edit_tree=owner.node_tree)
        editor = SimpleNamespace(space_data=space)
        for draw in (menus.draw_add_menu, menus.draw_node_menu):
            layout = Layout()
            draw(SimpleNamespace(layout=layout), editor)
            assert len(layout.offered) == is_ours
        assert bool(editor_obstacle(editor)) != is_ours
