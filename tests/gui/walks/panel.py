# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of the manual, scripts/manual/panel.webp: a head in EEVEE, its node, and the sidebar."""

import bpy

from window import RENDERED, Steps, area, head_in_eevee, mouse, picture, side_by_side, window, within


def walk() -> Steps:
    with bpy.context.temp_override(window=window(), area=area("DOPESHEET_EDITOR")):
        bpy.ops.screen.area_close()
    yield 1.0
    view, editor = side_by_side()
    yield from head_in_eevee(view, editor)
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
