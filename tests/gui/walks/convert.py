# SPDX-License-Identifier: GPL-3.0-or-later
"""Convert to True Diffuse, and undo."""

import bpy

from window import Steps, area, cube, group_of, menu, middle, mouse, nodes, picture, point, undo, within


def walk() -> Steps:
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
