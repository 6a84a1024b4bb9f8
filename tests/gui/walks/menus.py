# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus and the menu search, what operators say, Build Comparison Scene, and the asset library's entry in the preferences."""

import sys

import bpy

from window import (
    MODULE,
    Steps,
    area,
    close_other_windows,
    cube,
    dress,
    group_of,
    menu,
    middle,
    mouse,
    picture,
    point,
    show_preferences,
    side_by_side,
    undo,
    window,
    within,
)


def open_menu(place: bpy.types.Area, name: str, step: str) -> Steps:
    """Open a menu of Blender, leave its picture and close it."""
    point(*middle(place))
    yield 1.0
    menu(place, name)
    yield 2.0
    picture(step)
    for _ in range(2):
        mouse("key", "Escape")
        yield 0.5


def search(place: bpy.types.Area, text: str, step: str, key: str = "Escape") -> Steps:
    """Open the menu search over an editor, type `text`, leave the picture of what is found, and press a key."""
    point(*middle(place))
    yield 1.0
    with within(place):
        bpy.ops.wm.search_menu("INVOKE_DEFAULT")
    yield 1.5
    mouse("type", "--delay", "60", text)
    yield 2.0
    picture(f"search_{step}")
    mouse("key", key)
    yield 3.0
    if key == "Escape":
        mouse("key", key)
        yield 0.5


def said() -> list[str]:
    """Return what the Info editor lists, the newest last."""
    with within(area("INFO")):
        bpy.ops.info.select_all(action="SELECT")
        bpy.ops.info.report_copy()
    return bpy.context.window_manager.clipboard.splitlines()


def operators_say_what_they_did() -> Steps:
    """Convert three materials, once more, and revert them."""
    others = [bpy.data.materials.new(name) for name in ("Skin", "Shirt", "Boots")]
    for material in others:
        cube().data.materials.append(material)
    cube().data.materials.pop(index=0)
    bpy.ops.ed.undo_push(message="Three materials")
    view, place = side_by_side()
    place.ui_type = "INFO"
    yield 1.0
    for text, step in (("convert to true", "and_convert"), ("convert to true", "and_again"), ("revert to blender", "and_revert")):
        yield from search(view, text, step, "Return")
        picture(f"said_{step}")
    lines = said()
    for line in ("Converted 3 materials: Skin, Shirt, Boots", "Already True Diffuse", "Reverted 3 materials: Skin, Shirt, Boots"):
        assert line in lines, lines
    place.ui_type = "VIEW_3D"
    yield 0.5
    with bpy.context.temp_override(window=window(), area=place, region=place.regions[-1]):
        bpy.ops.screen.area_close()
    yield 1.0
    assert group_of("Skin") == ""


def menus() -> Steps:
    view = area("VIEW_3D")
    for theme, scale in (("Blender_Light", 1.0), ("Blender_Light", 1.5), ("Blender_Dark", 1.5), ("Blender_Dark", 1.0)):
        dress(theme, scale)
        yield 1.0
        yield from open_menu(view, "TRUE_DIFFUSE_MT_object", f"object_menu_{theme.lower()}_{scale:g}")
    x, y = middle(view)
    point(x, y)
    yield 1.0
    menu(view, "TRUE_DIFFUSE_MT_object")
    yield 1.5
    for step in range(12):  # down to Upgrade Groups, which is greyed
        mouse("mousemove", x, y + 10 * step)
        yield 0.1
    yield 2.5
    picture("greyed")
    mouse("key", "Escape")
    yield 1.0
    yield from open_menu(view, "VIEW3D_MT_object_context_menu", "object_context_menu")
    for text, step in (
        ("measure this", "measure"),
        ("asset library", "library"),
        ("convert to true", "convert"),
        ("true diffuse", "all"),
    ):
        yield from search(view, text, step)


def library() -> Steps:
    """Add the library; the Add menu has its one entry still, and the Asset Browser no node groups."""
    with within(area("VIEW_3D")):
        assert bpy.ops.true_diffuse.add_assets() == {"FINISHED"}
    _, place = side_by_side()
    place.ui_type = "ASSETS"
    yield 3.0
    place.spaces.active.params.asset_library_reference = "True Diffuse"
    yield 4.0
    yield from open_menu(place, "ASSETBROWSER_MT_library", "library_menu")
    picture("library")
    place.ui_type = "ShaderNodeTree"
    yield 2.0
    yield from open_menu(place, "NODE_MT_add", "add_menu")
    yield from open_menu(place, "NODE_MT_node", "node_menu")
    yield from open_menu(place, "TRUE_DIFFUSE_MT_node", "node_menu_true_diffuse")
    yield from search(place, "rough diffuse", "group")
    yield from search(place, "convert to true", "nodes_convert")
    yield from search(place, "measure this", "nodes_measure")
    point(*middle(place))
    yield 0.5
    mouse("key", "shift+a")
    yield 1.5
    mouse("type", "--delay", "60", "rough diff")
    yield 2.0
    picture("add_menu_typed")
    for _ in range(3):
        mouse("key", "Escape")
        yield 0.5
    lamp = bpy.data.objects["Light"]
    lamp.data.use_nodes = True
    bpy.context.view_layer.objects.active = lamp
    yield 2.0
    assert place.spaces.active.id == lamp.data
    with within(place):
        assert not bpy.ops.true_diffuse.add_group.poll()
    yield from open_menu(place, "NODE_MT_add", "add_menu_light")
    place.spaces.active.shader_type = "WORLD"
    yield 2.0
    with within(place):
        assert not bpy.ops.true_diffuse.add_group.poll()
    yield from open_menu(place, "NODE_MT_add", "add_menu_world")
    bpy.context.view_layer.objects.active = cube()
    place.spaces.active.shader_type = "OBJECT"
    place.ui_type = "VIEW_3D"
    yield 1.0
    with bpy.context.temp_override(window=window(), area=place, region=place.regions[-1]):
        bpy.ops.screen.area_close()
    yield 1.0


def comparison() -> Steps:
    view = area("VIEW_3D")
    with within(view):
        bpy.ops.object.select_all(action="DESELECT")
        bpy.ops.mesh.primitive_monkey_add()
        bpy.ops.object.shade_smooth()
    bpy.ops.ed.undo_push(message="Suzanne")
    yield 1.0
    with within(view):
        assert bpy.ops.true_diffuse.build_comparison("INVOKE_DEFAULT", True) == {"FINISHED"}
    yield 3.0
    picture("comparison_solid")
    view.spaces.active.shading.type = "RENDERED"
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.preview_samples = 32
    yield 20.0
    picture("comparison")
    view.spaces.active.shading.type = "SOLID"
    yield 1.0
    assert view.spaces.active.region_3d.view_perspective == "CAMERA"
    yield from undo()
    if len(bpy.data.scenes) > 1:  # the engine was a step of its own
        yield from undo()
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"]
    picture("comparison_undone")


def preferences() -> Steps:
    """The page, and the library's entry while the extension is disabled and enabled again."""
    yield from show_preferences()
    for theme, scale in (("Blender_Light", 1.5), ("Blender_Dark", 1.0)):
        dress(theme, scale)
        yield 2.0
        picture(f"preferences_{theme.lower()}_{scale:g}")
    sys.modules[f"{MODULE}.addon.ui.preferences"].website = lambda: "https://example.org/"  # as the manifest of a release states it
    for place in bpy.context.window_manager.windows[-1].screen.areas:
        place.tag_redraw()
    yield 2.0
    picture("preferences_manual")
    libraries = bpy.context.preferences.filepaths.asset_libraries
    assert "True Diffuse" in libraries
    bpy.ops.preferences.addon_disable(module=MODULE)
    yield 1.0
    assert "True Diffuse" not in libraries
    bpy.ops.preferences.addon_enable(module=MODULE)
    yield 1.0
    assert "True Diffuse" in libraries
    close_other_windows()
    yield 1.0


def walk() -> Steps:
    yield from operators_say_what_they_did()
    yield from menus()
    yield from library()
    yield from comparison()
    yield from preferences()
