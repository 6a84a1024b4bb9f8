# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of the manual, scripts/manual/panel.webp: a head in EEVEE, its node, and the sidebar."""

import bpy

from window import RENDERED, Steps, area, cube, mouse, picture, side_by_side, window, within


def walk() -> Steps:
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
    with bpy.context.temp_override(window=window(), area=area("DOPESHEET_EDITOR")):
        bpy.ops.screen.area_close()
    yield 1.0
    view, editor = side_by_side()
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
    for node in bpy.context.object.active_material.node_tree.nodes:
        node.select = node.type == "GROUP"
    with within(editor):
        bpy.ops.node.view_selected()
    yield 1.0
    with within(editor):
        bpy.ops.view2d.pan(deltax=200)  # from behind the sidebar
    for node in bpy.context.object.active_material.node_tree.nodes:
        node.select = False
    mouse("mousemove", 800, 995)
    yield RENDERED["BLENDER_EEVEE"]
    picture("panel")
