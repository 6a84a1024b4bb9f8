# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters from files: converted, looked at, asked what is carried, and turned back."""

from pathlib import Path

import bpy

from window import DRAWN, Steps, close_other_windows, group_of, mouse, node_of, picture, point, side_by_side, undo, window, within

CHARACTERS = Path(__file__).resolve().parents[2] / "assets"


def walk() -> Steps:
    """Convert characters from files, look at them in real time, edit one, ask what is carried, and turn them back."""
    view, side = side_by_side()
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
