# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact for Chosen Lights: the panel's warning, its list of lights, and the menu that the tooltip names."""

import bpy

from window import Steps, area, cube, dress, folder, middle, mouse, nodes, open_sidebar, picture, point, side_by_side, undo, within


def warning() -> Steps:
    """Set the quality without a chosen light; the panel warns, and its button chooses the light."""
    view, editor = side_by_side()
    with within(view), bpy.context.temp_override(selected_objects=[cube()]):
        assert bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="clay") == {"FINISHED"}
    nodes()["Rough Diffuse"].inputs["Quality"].default_value = "Exact for Chosen Lights"
    properties = area("PROPERTIES")
    properties.spaces.active.context = "MATERIAL"
    yield from open_sidebar(editor)
    with within(editor):
        bpy.ops.node.view_all()
    bpy.ops.ed.undo_push(message="Clay")
    for theme, scale, step in (
        ("Blender_Dark", 1.0, "dark"),
        ("Blender_Light", 1.0, "light"),
        ("Blender_Light", 1.5, "light_large"),
        ("Blender_Dark", 1.5, "dark_large"),
    ):
        dress(theme, scale)
        yield 2.0
        picture(f"warning_{step}")
    dress("Blender_Dark", 1.0)
    yield 1.0


def choose() -> Steps:
    """Choose by the menu that the tooltip names: Object > True Diffuse > Use Selected Lights; then hide, and undo."""
    view = area("VIEW_3D")
    lamp = bpy.data.objects["Light"]
    with within(view):
        bpy.ops.object.light_add(type="SUN", location=(0.0, -2.0, 3.0))
        bpy.ops.object.select_all(action="DESELECT")
    lamp.select_set(True)
    bpy.ops.ed.undo_push(message="Two lights")
    point(*middle(view))
    yield 1.0
    with within(view):
        bpy.ops.wm.call_menu(name="VIEW3D_MT_object")
    yield 1.5
    picture("object_menu")
    mouse("key", "Escape")
    mouse("key", "Escape")
    yield 1.0
    with within(view):
        bpy.ops.wm.search_menu("INVOKE_DEFAULT")
    yield 1.5
    mouse("type", "--delay", "60", "use selected lights")
    yield 2.0
    picture("search")
    mouse("key", "Return")
    yield 3.0
    bpy.context.view_layer.objects.active = cube()
    yield 2.0
    picture("chosen")
    lamp.hide_render = True
    bpy.data.objects["Sun"].hide_set(True)
    bpy.ops.true_diffuse.toggle_light(light="Sun")
    yield 2.0
    picture("hidden")
    for theme, scale in (("Blender_Light", 1.0), ("Blender_Dark", 1.5)):
        dress(theme, scale)
        yield 2.0
        picture(f"hidden_{theme.lower()}_{scale:g}")
    dress("Blender_Dark", 1.0)
    bpy.data.objects.remove(lamp)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    bpy.ops.ed.undo_push(message="Deleted")
    yield 2.0
    picture("deleted")
    yield from undo()
    assert "Sun" in bpy.data.objects


def others() -> Steps:
    """The panel of a highlight without lights, in Realtime, and of a material that is linked from another file."""
    scene, library = bpy.context.scene, str(folder / "library.blend")
    bpy.context.view_layer.objects.active = cube()
    node = nodes()["Rough Diffuse"]
    bpy.data.libraries.write(library, {cube().active_material}, fake_user=True)
    for light in ("Light", "Sun"):
        bpy.ops.true_diffuse.toggle_light(light=light)  # which removes it
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.materials = [cube().active_material.name]
    linked, own = wanted.materials[0], cube().active_material
    cube().active_material = linked
    yield 2.0
    picture("linked")
    cube().active_material = own
    scene.render.engine = "TRUE_DIFFUSE_REALTIME"
    node.inputs["Quality"].default_value = "Exact for Chosen Lights"
    yield 2.0
    picture("realtime")
    scene.render.engine = "BLENDER_EEVEE"


def walk() -> Steps:
    yield from warning()
    yield from choose()
    yield from others()
