# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of the manual: a head in EEVEE, its node, the sidebar after Measure This Material."""

import bpy

from window import RENDERED, Steps, cube, picture, side_by_side, within


def walk() -> Steps:
    """Leave the picture of the manual: a head in EEVEE, its node, the sidebar after Measure This Material."""
    bpy.context.scene.render.engine = "BLENDER_EEVEE"
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
    with within(editor):
        bpy.ops.node.view_all()
        assert bpy.ops.true_diffuse.measure("EXEC_DEFAULT", True) == {"FINISHED"}
    yield RENDERED["BLENDER_EEVEE"]
    picture("measured")
