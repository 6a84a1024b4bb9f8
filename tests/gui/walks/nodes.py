# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a node, the panel, the engines, and a file that is saved and opened again."""

import bpy

from window import RENDERED, Steps, area, cube, folder, menu, middle, mouse, nodes, picture, point, say, within


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
    for part in (add_a_group, look_at_the_panel, switch_engines, edit, save_and_reopen):
        say(part.__name__)
        yield from part()
