# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine True Diffuse Realtime in the viewport and in a render."""

import bpy

from window import DRAWN, Steps, area, assign, close_other_windows, cube, middle, mouse, nodes, picture, point, within


def walk() -> Steps:
    """Orbit, edit, switch engines while the viewport draws and while a picture renders, with shadows and skin."""
    scene, view, properties = bpy.context.scene, area("VIEW_3D"), area("PROPERTIES")
    before = view.spaces.active.region_3d.view_matrix.copy()
    assign(cube(), "clay")
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
