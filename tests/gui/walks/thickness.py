# SPDX-License-Identifier: GPL-3.0-or-later
"""A group that comes by Add > Group and by paste has its thickness, with undo and redo."""

import bpy

from window import Steps, area, cube, middle, mouse, nodes, picture, point, within


def thickness() -> str:
    """Return the label or the name of what is linked to the thickness of the cube's material; empty where nothing is."""
    socket = cube().active_material.node_tree.get_output_node("EEVEE").inputs["Thickness"]
    return next((link.from_node.label or link.from_node.name for link in socket.links), "")


def link_surface() -> Steps:
    """Link the group to the surface as one step."""
    tree = cube().active_material.node_tree
    group = next(node for node in nodes() if node.type == "GROUP")
    tree.links.new(group.outputs["BSDF"], tree.get_output_node("EEVEE").inputs["Surface"])
    bpy.ops.ed.undo_push(message="Link")
    yield 2.0


def walk() -> Steps:
    editor = area("VIEW_3D")
    with within(editor):
        bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="fair_skin")
    group = next(tree for tree in bpy.data.node_groups if tree.name == "Subsurface")
    cube().active_material = bpy.data.materials.new("Added")
    editor.ui_type = "ShaderNodeTree"
    yield 2.0
    bpy.ops.ed.undo_push(message="Set up")
    with within(editor):
        assert bpy.ops.node.add_group("EXEC_DEFAULT", True, session_uid=group.session_uid) == {"FINISHED"}
    yield 1.0
    assert not thickness()
    yield from link_surface()
    assert thickness() == next(node for node in nodes() if node.type == "GROUP").name
    picture("added")
    point(*middle(editor))
    mouse("key", "ctrl+z")
    yield 2.0
    assert not thickness()
    mouse("key", "ctrl+shift+z")
    yield 2.0
    assert thickness()
    for node in nodes():
        node.select = node.type == "GROUP"
    with within(editor):
        bpy.ops.node.clipboard_copy()
    cube().active_material = bpy.data.materials.new("Pasted")
    yield 2.0
    with within(editor):
        assert bpy.ops.node.clipboard_paste("EXEC_DEFAULT", True) == {"FINISHED"}
    yield 1.0
    yield from link_surface()
    assert thickness()
    picture("pasted")
