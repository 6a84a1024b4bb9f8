# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender: installs the package and does what an artist would, by mouse and keys where there is something to click."""

import subprocess
import sys
import traceback
from collections.abc import Generator
from pathlib import Path

import bpy

package, folder = (Path(argument) for argument in sys.argv[sys.argv.index("--") + 1 :])
CHARACTERS = Path(__file__).resolve().parents[1] / "assets"
REPOSITORY = "walk"
RENDERED = {"CYCLES": 10.0, "BLENDER_EEVEE": 30.0}  # seconds until a software driver has compiled and drawn the viewport
DRAWN = 8.0  # the same for the realtime engine

type Steps = Generator[float]


def say(text: str) -> None:
    with (folder / "log.txt").open("a", encoding="utf-8") as log:
        log.write(text + "\n")


def picture(step: str) -> None:
    subprocess.run(["import", "-window", "root", str(folder / f"{step}.png")], check=True)


def mouse(*arguments: object) -> None:
    subprocess.run(["xdotool", *map(str, arguments)], check=True)


def point(x: int, y: int) -> None:
    """Move the mouse so that Blender notices."""
    mouse("mousemove", x - 4, y)
    mouse("mousemove", x, y)


def window() -> bpy.types.Window:
    return bpy.context.window_manager.windows[0]


def area(kind: str) -> bpy.types.Area:
    return next(area for area in window().screen.areas if area.type == kind)


def middle(place: bpy.types.Area) -> tuple[int, int]:
    return place.x + place.width // 2, window().height - (place.y + place.height // 2)


def within(place: bpy.types.Area) -> "bpy.types.ContextTempOverride":
    region = next(region for region in place.regions if region.type == "WINDOW")
    return bpy.context.temp_override(window=window(), area=place, region=region)


def close_other_windows() -> None:
    for other in bpy.context.window_manager.windows[1:]:
        with bpy.context.temp_override(window=other):
            bpy.ops.wm.window_close()


def menu(place: bpy.types.Area, name: str) -> None:
    with within(place):
        bpy.ops.wm.call_menu(name=name)


def cube() -> bpy.types.Object:
    return bpy.data.objects["Cube"]


def nodes() -> bpy.types.Nodes:
    return cube().active_material.node_tree.nodes


def node_of(material: str) -> bpy.types.Node | None:
    """Return the True Diffuse node of a material; None where it has none."""
    groups = (node for node in bpy.data.materials[material].node_tree.nodes if node.type == "GROUP")
    return next((node for node in groups if "true_diffuse" in node.node_tree), None)


def group_of(material: str) -> str:
    """Return the name of a material's True Diffuse group; empty where it has none."""
    node = node_of(material)
    return node.node_tree.name if node else ""


def install() -> Steps:
    bpy.context.preferences.extensions.repos.new(name=REPOSITORY, module=REPOSITORY, custom_directory=str(folder / "repository"))
    bpy.ops.extensions.package_install_files(filepath=str(package), repo=REPOSITORY, enable_on_install=True)
    assert f"bl_ext.{REPOSITORY}.true_diffuse" in bpy.context.preferences.addons
    yield 1.0
    picture("installed")


def add_a_group() -> Steps:
    view = area("VIEW_3D")
    view.ui_type = "ShaderNodeTree"
    yield 2.0
    with within(view):
        bpy.ops.node.view_all()
    yield 1.0
    point(*middle(view))
    yield 1.0
    menu(view, "TRUE_DIFFUSE_MT_add")
    yield 2.0
    picture("add_menu")
    mouse("click", 1)  # the first entry lies under the mouse
    yield 2.0
    x, y = middle(view)
    point(x, y + 150)
    yield 1.0
    mouse("click", 1)
    yield 1.0
    added = nodes()["Rough Diffuse"]
    added.inputs["Roughness"].default_value = 0.8
    tree = cube().active_material.node_tree
    tree.links.new(added.outputs["BSDF"], tree.get_output_node("ALL").inputs["Surface"])
    bpy.ops.ed.undo_push(message="Set up")
    yield 1.0
    picture("group_added")


def look_at_the_panel() -> Steps:
    properties = area("PROPERTIES")
    properties.spaces.active.context = "MATERIAL"
    area("NODE_EDITOR").ui_type = "VIEW_3D"
    yield 2.0
    picture("panel")


def switch_engines() -> Steps:
    view = area("VIEW_3D")
    for engine, name in (("CYCLES", "cycles"), ("BLENDER_EEVEE", "eevee")):
        bpy.context.scene.render.engine = engine
        bpy.context.scene.cycles.preview_samples = 16
        view.spaces.active.shading.type = "RENDERED"
        yield RENDERED[engine]
        picture(name)
    view.spaces.active.shading.type = "SOLID"
    yield 1.0


def draw_in_real_time() -> Steps:
    """Orbit, edit, switch engines while the viewport draws and while a picture renders, with shadows and skin."""
    scene, view, properties = bpy.context.scene, area("VIEW_3D"), area("PROPERTIES")
    before = view.spaces.active.region_3d.view_matrix.copy()
    with within(view):
        bpy.ops.mesh.primitive_plane_add(size=12.0, location=(0.0, 0.0, -1.0))
        bpy.ops.mesh.primitive_monkey_add(location=(0.0, -2.2, 0.0), rotation=(-0.5, 0.0, 0.6))
        bpy.ops.object.shade_smooth()
        assert bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="skin_1") == {"FINISHED"}
    added = list(bpy.context.view_layer.objects)[-2:]
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler = (0.6, 0.5, 0.0)
    sun.data.energy = 2.0
    scene.collection.objects.link(sun)
    bpy.context.view_layer.objects.active = cube()
    scene.render.engine = "TRUE_DIFFUSE_REALTIME"
    properties.spaces.active.context = "RENDER"
    view.spaces.active.shading.type = "RENDERED"
    yield DRAWN
    picture("realtime")
    x, y = middle(view)
    point(x, y)
    mouse("mousedown", 2)
    for step in range(8):
        mouse("mousemove", x + 12 * step, y - 6 * step)
        yield 0.3
    mouse("mouseup", 2)
    nodes()["Rough Diffuse"].inputs["Roughness"].default_value = 0.0
    yield DRAWN
    picture("realtime_orbited")
    scene.render.resolution_percentage = 30  # a software driver takes minutes for a whole picture
    bpy.ops.render.render("INVOKE_DEFAULT")
    scene.render.engine = "BLENDER_EEVEE"  # while it renders
    yield DRAWN
    picture("realtime_rendered")
    close_other_windows()
    scene.render.engine, scene.render.resolution_percentage = "TRUE_DIFFUSE_REALTIME", 100
    yield 1.0
    for item in (*added, sun):
        bpy.data.objects.remove(item)
    cube().select_set(True)
    view.spaces.active.region_3d.view_matrix = before
    bpy.ops.ed.undo_push(message="Cleaned up")
    yield 2.0
    view.spaces.active.shading.type = "SOLID"
    scene.render.engine = "BLENDER_EEVEE"
    properties.spaces.active.context = "MATERIAL"
    nodes()["Rough Diffuse"].inputs["Roughness"].default_value = 0.8
    yield 1.0


def undo() -> Steps:
    """Undo the last step by the keyboard."""
    point(*middle(area("VIEW_3D")))
    yield 0.5
    mouse("key", "ctrl+z")
    yield 2.0


def convert() -> Steps:
    plain = bpy.data.materials.new("Plain")
    cube().active_material = plain
    principled = plain.node_tree.nodes["Principled BSDF"]
    principled.inputs["Specular IOR Level"].default_value = 0.0
    principled.inputs["Base Color"].default_value = (0.6, 0.2, 0.1, 1.0)
    bpy.ops.ed.undo_push(message="Plain")
    view = area("VIEW_3D")
    point(*middle(view))
    yield 1.0
    menu(view, "VIEW3D_MT_object_context_menu")
    yield 2.0
    picture("context_menu")
    mouse("key", "Escape")
    yield 1.0
    with within(view):
        assert bpy.ops.true_diffuse.convert("EXEC_DEFAULT", True) == {"FINISHED"}
    yield 2.0
    assert group_of("Plain") == "Principled Rough Diffuse"
    picture("converted")
    yield from undo()
    assert group_of("Plain") == "" and nodes()["Principled BSDF"].type == "BSDF_PRINCIPLED"


def drag_an_asset() -> Steps:
    bpy.ops.screen.userpref_show()
    yield 2.0
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "True Diffuse"
    bpy.ops.preferences.addon_expand(module=f"bl_ext.{REPOSITORY}.true_diffuse")
    yield 2.0
    picture("preferences")
    bpy.ops.true_diffuse.add_assets()
    yield 2.0
    close_other_windows()
    yield 1.0
    with within(area("VIEW_3D")):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    yield 1.0
    view, browser = sorted((place for place in window().screen.areas if place.type == "VIEW_3D"), key=lambda place: place.x)
    browser.ui_type = "ASSETS"
    yield 2.0
    browser.spaces.active.params.asset_library_reference = "True Diffuse"
    yield 5.0
    shown = next(region for region in browser.regions if region.type == "WINDOW")
    x, y = shown.x + 60, window().height - (shown.y + shown.height - 60)
    target = middle(view)
    point(x, y)
    yield 1.0
    mouse("mousemove", x + 1, y + 1)
    mouse("mousedown", 1)
    yield 0.5
    for step in range(1, 21):
        mouse("mousemove", x + (target[0] - x) * step // 20, y + (target[1] - y) * step // 20)
        yield 0.1
    picture("dragged")
    before = cube().active_material
    mouse("mouseup", 1)
    yield 4.0
    assert cube().active_material != before, "the drop gave the cube no material"
    picture("dropped")
    browser.ui_type = "VIEW_3D"
    yield 1.0


def use_characters() -> Steps:
    """Convert characters from files, look at them in real time, edit one, ask what is carried, and turn them back."""
    view, side = sorted((place for place in window().screen.areas if place.type == "VIEW_3D"), key=lambda place: place.x)
    scene = bpy.context.scene
    others = [item.name for item in scene.objects if item.visible_get()]
    for name in others:
        scene.objects[name].hide_set(True)
    with within(view):
        bpy.ops.object.select_all(action="DESELECT")
        for index, name in enumerate(("normal_and_roughness", "metal_in_parts", "alpha")):
            bpy.ops.import_scene.gltf(filepath=str(CHARACTERS / f"{name}.glb"))
            bpy.context.object.location.x = 0.9 * index
    characters = [item.name for item in scene.objects if item.visible_get()]
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.rotation_euler, sun.data.energy = (0.9, 0.3, 0.0), 3.0
    scene.collection.objects.link(sun)
    for name in characters:
        scene.objects[name].select_set(True)
    bpy.context.view_layer.objects.active = scene.objects["Normal Map"]
    scene.render.engine = "TRUE_DIFFUSE_REALTIME"
    side.ui_type = "ShaderNodeTree"
    yield 1.0
    side.spaces.active.show_region_ui = True
    view.spaces.active.shading.type = "RENDERED"
    with within(view):
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_selected()
    bpy.ops.ed.undo_push(message="Characters")
    yield DRAWN
    picture("characters")
    materials = [slot.material.name for name in characters for slot in scene.objects[name].material_slots]
    with within(view):
        assert bpy.ops.true_diffuse.convert("EXEC_DEFAULT", True) == {"FINISHED"}
    yield DRAWN
    assert {group_of(name) for name in materials} == {"Principled Rough Diffuse"}
    sidebar = next(region for region in side.regions if region.type == "UI")
    sidebar.active_panel_category = "True Diffuse"
    with within(side):
        bpy.ops.node.view_all()
    yield 2.0
    picture("characters_converted")
    yield from undo()
    assert {group_of(name) for name in materials} == {""}
    with within(view):
        bpy.ops.ed.redo()
    yield 2.0
    assert {group_of(name) for name in materials} == {"Principled Rough Diffuse"}
    for name in materials:
        node = node_of(name)
        node.inputs["Model"].default_value, node.inputs["Diffuse Roughness"].default_value = "Oren-Nayar", 1.0
    bpy.ops.ed.undo_push(message="Rough")
    yield DRAWN
    picture("characters_rough")
    tree, node = bpy.data.materials["Hide"].node_tree, node_of("Hide")
    tree.links.new(tree.nodes.new("ShaderNodeWireframe").outputs[0], node.inputs["Roughness"])
    bpy.ops.ed.undo_push(message="Wireframe")
    with within(side):
        assert bpy.ops.true_diffuse.check_exports("EXEC_DEFAULT", True) == {"FINISHED"}
    point(sidebar.x + sidebar.width // 2, window().height - (sidebar.y + sidebar.height // 2))
    yield 1.0
    for _ in range(40):  # down to Not Carried
        mouse("click", 5)
    yield DRAWN
    picture("not_carried")
    with within(view):
        bpy.ops.export_scene.gltf("INVOKE_DEFAULT")
    yield 3.0
    picture("gltf_options")
    close_other_windows()
    yield 1.0
    yield from undo()
    assert not any(node.bl_idname == "ShaderNodeWireframe" for node in bpy.data.materials["Hide"].node_tree.nodes)
    with within(view):
        assert bpy.ops.true_diffuse.revert("EXEC_DEFAULT", True) == {"FINISHED"}
    yield DRAWN
    assert {group_of(name) for name in materials} == {""}
    assert bpy.data.materials["Hide"].node_tree.nodes["Principled BSDF"].type == "BSDF_PRINCIPLED"
    picture("reverted")
    yield from undo()
    assert {group_of(name) for name in materials} == {"Principled Rough Diffuse"}
    scene = bpy.context.scene
    for name in (*characters, "Sun"):
        bpy.data.objects.remove(scene.objects[name])
    for name in others:
        scene.objects[name].hide_set(False)
    bpy.context.view_layer.objects.active = cube()
    cube().select_set(True)
    view.spaces.active.shading.type = "SOLID"
    side.ui_type = "VIEW_3D"
    yield 1.0


def portrait() -> Steps:
    """Leave the picture of the manual: a head in EEVEE, its node, the sidebar after Measure This Material."""
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    view, editor = sorted((place for place in window().screen.areas if place.type == "VIEW_3D"), key=lambda place: place.x)
    cube().hide_set(True)
    with within(view):
        bpy.ops.mesh.primitive_monkey_add(rotation=(0.0, 0.0, 0.6))
        bpy.ops.object.shade_smooth()
        bpy.ops.object.modifier_add(type="SUBSURF")
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="clay")
        bpy.ops.view3d.view_selected()
    view.spaces.active.overlay.show_overlays = False
    view.spaces.active.shading.type = "RENDERED"
    editor.ui_type = "ShaderNodeTree"
    yield 2.0
    editor.spaces.active.show_region_ui = True
    yield 2.0
    next(region for region in editor.regions if region.type == "UI").active_panel_category = "True Diffuse"
    with within(editor):
        bpy.ops.node.view_all()
        assert bpy.ops.true_diffuse.measure("EXEC_DEFAULT", True) == {"FINISHED"}
    yield RENDERED["BLENDER_EEVEE"]
    picture("measured")


def edit() -> Steps:
    bpy.context.view_layer.objects.active = cube()
    cube().active_material = bpy.data.materials["Material"]
    nodes()["Rough Diffuse"].inputs["Roughness"].default_value = 0.5
    yield 2.0
    picture("edited")


def save_and_reopen() -> Steps:
    file = str(folder / "walk.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    yield 1.0
    bpy.ops.wm.open_mainfile(filepath=file)
    yield 3.0
    assert abs(nodes()["Rough Diffuse"].inputs["Roughness"].default_value - 0.5) < 1e-6
    picture("reopened")


def walk() -> Steps:
    for part in (
        install,
        add_a_group,
        look_at_the_panel,
        switch_engines,
        draw_in_real_time,
        convert,
        drag_an_asset,
        use_characters,
        portrait,
        edit,
        save_and_reopen,
    ):
        say(part.__name__)
        yield from part()
    say("walked to the end")


steps = walk()


def tick() -> float | None:
    """Do the next step; whatever goes wrong ends Blender, with the reason in the log."""
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        say(traceback.format_exc())
        picture("failed")
    bpy.ops.wm.quit_blender()
    return None


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=3.0, persistent=True)
