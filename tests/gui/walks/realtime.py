# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine True Diffuse Realtime: its panels, what it does not draw, Blender's overlays on its pictures, and a render."""

import math

import bpy

from window import (
    DRAWN,
    RENDERED,
    Steps,
    area,
    assign,
    close_other_windows,
    cube,
    dress,
    middle,
    mouse,
    nodes,
    orbit,
    picture,
    point,
    say,
    side_by_side,
    within,
)

ENGINE = "TRUE_DIFFUSE_REALTIME"


def select(*items: bpy.types.Object) -> None:
    """Select `items` alone, the first being active."""
    for item in bpy.context.scene.objects:
        item.select_set(item in items)
    bpy.context.view_layer.objects.active = items[0]


def in_mode(mode: str) -> None:
    with within(area("VIEW_3D")):
        assert bpy.ops.object.mode_set(mode=mode) == {"FINISHED"}


def build() -> Steps:
    """A matte cube and a head of skin on the ground, under a sun."""
    scene, view = bpy.context.scene, area("VIEW_3D")
    scene.render.engine = ENGINE
    assign(cube(), "clay")
    with within(view):
        bpy.ops.mesh.primitive_plane_add(size=12.0, location=(0.0, 0.0, -1.0))
        bpy.ops.mesh.primitive_monkey_add(location=(0.0, -2.2, 0.0), rotation=(-0.5, 0.0, 0.6))
        bpy.ops.object.shade_smooth()
        assert bpy.ops.true_diffuse.assign_preset("EXEC_DEFAULT", True, key="skin_1") == {"FINISHED"}
    light = bpy.data.objects["Light"]
    light.data.type, light.rotation_euler, light.data.energy = "SUN", (0.6, 0.5, 0.0), 2.0
    scene.true_diffuse.viewport_samples = 4
    yield 1.0


def tabs() -> Steps:
    """The Render tab starts with Sampling, and every kind of light has its settings, in both themes and at both scales."""
    properties, light = area("PROPERTIES").spaces.active, bpy.data.objects["Light"]
    properties.context = "RENDER"
    yield 2.0
    picture("tab_render")
    select(light)
    yield 1.0
    for tab in ("VIEW_LAYER", "WORLD", "OBJECT", "DATA"):
        properties.context = tab
        yield 1.0
        picture(f"tab_{tab.lower()}")
    for kind in ("POINT", "AREA", "SPOT"):
        light.data.type = kind
        yield 1.5
        picture(f"light_{kind.lower()}")
    bpy.context.window_manager.clipboard = "40"
    point(1502, 656)  # Beam Shape > Angle
    yield 1.0
    mouse("key", "ctrl+v")
    yield 1.0
    assert abs(math.degrees(light.data.spot_size) - 40.0) < 1e-3, "the angle of the spot was not pasted"
    point(*middle(area("VIEW_3D")))  # away from its tooltip
    view = area("VIEW_3D").spaces.active
    view.shading.type = "RENDERED"
    light.location, light.data.energy = (0.0, -2.0, 6.0), 1000.0
    light.rotation_euler = (0.0, 0.0, 0.0)
    yield DRAWN
    picture("spot_of_40_degrees")
    light.data.spot_blend = 1.0
    yield DRAWN
    picture("spot_blended")
    for theme, scale, step in (
        ("Light", 1.0, "light_theme"),
        ("Light", 1.5, "light_theme_large"),
        ("Dark", 1.5, "dark_theme_large"),
    ):
        dress(f"Blender_{theme}", scale)
        yield 2.0
        picture(step)
    dress("Blender_Dark", 1.0)
    light.data.type, light.rotation_euler, light.data.energy = "SUN", (0.6, 0.5, 0.0), 2.0
    yield 1.0


def not_drawn() -> Steps:
    """What the scene asks for that is not drawn is listed with names: of the camera, objects, lights, materials."""
    scene, properties = bpy.context.scene, area("PROPERTIES").spaces.active
    properties.context = "RENDER"
    yield 2.0
    picture("nothing_left_out")
    bpy.context.view_layer.use_pass_mist = True
    added = [bpy.data.objects.new("Spray", bpy.data.pointclouds.new("Spray"))]
    added.append(bpy.data.objects.new("Lantern", bpy.data.lights.new("Lantern", "POINT")))
    for index in range(3):
        glass = bpy.data.materials.new(f"Glass {index}")
        glass.node_tree.nodes["Principled BSDF"].inputs["Transmission Weight"].default_value = 1.0
        added.append(bpy.data.objects.new("Pane", cube().data.copy()))
        added[-1].data.materials[0] = glass
        added[-1].location = (-2.5, 2.0 * index, 0.0)
    for item in added:
        scene.collection.objects.link(item)
    scene.true_diffuse.viewport_samples = 2  # settings are looked at once all samples are there
    yield DRAWN
    picture("not_drawn")
    for item in added:
        bpy.data.objects.remove(item)
    bpy.context.view_layer.use_pass_mist = False
    scene.true_diffuse.viewport_samples = 4
    yield 1.0


def overlays() -> Steps:
    """Overlays, modes and Grease Pencil stand in the picture's space: before and behind its surfaces."""
    view = area("VIEW_3D")
    space, head = view.spaces.active, bpy.data.objects["Suzanne"]
    with within(view):
        bpy.ops.object.grease_pencil_add(type="MONKEY", location=(-1.5, 0.0, 0.3))
        bpy.context.object.show_in_front = False
        bpy.ops.object.armature_add(location=(2.0, -1.0, -1.0))
    select(head, cube())
    yield DRAWN
    picture("outlines_and_grease_pencil")
    select(cube())
    yield 0.5
    picture("selected")  # without starting the picture anew
    space.overlay.show_wireframes = True
    yield 3.0
    picture("wireframe_overlay")
    space.overlay.show_wireframes = False
    for mode in ("EDIT", "SCULPT"):
        in_mode(mode)
        yield 4.0
        picture(f"mode_{mode.lower()}")
    in_mode("OBJECT")
    select(bpy.data.objects["Armature"])
    in_mode("POSE")
    yield 2.0
    picture("mode_pose")
    in_mode("OBJECT")
    for shading, has_xray in (("WIREFRAME", True), ("SOLID", True), ("RENDERED", False)):
        space.shading.type, space.shading.show_xray = shading, has_xray
        yield 2.0
        picture(f"shading_{shading.lower()}")


def regions() -> Steps:
    """Render regions, the camera's frame, local view, four views, a hidden collection, two viewports."""
    scene, view = bpy.context.scene, area("VIEW_3D")
    space = view.spaces.active
    x, y = middle(view)
    point(x, y)
    yield 0.5
    mouse("key", "ctrl+b")
    yield 0.5
    point(x - 200, y - 150)
    mouse("mousedown", 1)
    for step in range(1, 6):
        mouse("mousemove", x - 200 + 60 * step, y - 150 + 50 * step)
        yield 0.1
    mouse("mouseup", 1)
    yield DRAWN
    assert space.use_render_border
    picture("render_region")
    space.use_render_border = False
    with within(view):
        bpy.ops.view3d.view_camera()
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x, scene.render.border_min_y, scene.render.border_max_y = 0.2, 0.7, 0.1, 0.8
    yield DRAWN
    picture("camera_border")
    scene.render.use_border = False
    space.lock_camera = True
    before = scene.camera.matrix_world.copy()
    point(x, y)
    mouse("mousedown", 2)
    for step in range(6):
        mouse("mousemove", x + 10 * step, y)
        yield 0.2
    mouse("mouseup", 2)
    yield DRAWN
    assert scene.camera.matrix_world != before
    picture("camera_locked")
    space.lock_camera = False
    scene.camera.matrix_world = before
    select(bpy.data.objects["Suzanne"], bpy.data.objects["Light"])
    with within(view):
        bpy.ops.view3d.localview()
    yield DRAWN
    picture("local_view")
    with within(view):
        bpy.ops.view3d.localview()
        bpy.ops.screen.region_quadview()
    yield DRAWN
    picture("four_views")
    with within(view):
        bpy.ops.screen.region_quadview()
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    for item in (bpy.data.objects["Suzanne"],):
        item.users_collection[0].objects.unlink(item)
        hidden.objects.link(item)
    bpy.context.view_layer.layer_collection.children["Hidden"].hide_viewport = True
    yield DRAWN
    picture("hidden_collection")
    bpy.context.view_layer.layer_collection.children["Hidden"].hide_viewport = False
    left, right = side_by_side()
    left.spaces.active.shading.type = "SOLID"
    nodes()["Rough Diffuse"].inputs["Color"].default_value = (0.1, 0.3, 0.8, 1.0)
    yield DRAWN
    picture("two_viewports")
    left.spaces.active.shading.type = "RENDERED"
    scene.frame_end = 20
    cube().keyframe_insert("location", frame=1)
    cube().location.z = 2.0
    cube().keyframe_insert("location", frame=20)
    bpy.ops.screen.animation_play()
    yield 4.0
    picture("playing")
    bpy.ops.screen.animation_cancel(restore_frame=False)
    assert scene.frame_current > 1
    scene.frame_set(1)
    with within(right):
        bpy.ops.screen.area_close()
    yield 1.0


def orbit_and_render() -> Steps:
    """Orbit, edit, switch engines while the viewport draws and while a picture renders, with shadows and skin."""
    scene, view, properties = bpy.context.scene, area("VIEW_3D"), area("PROPERTIES")
    properties.spaces.active.context = "RENDER"
    view.spaces.active.shading.type = "RENDERED"
    yield DRAWN
    picture("realtime")
    yield from orbit(view, 8)
    nodes()["Rough Diffuse"].inputs["Roughness"].default_value = 0.0
    yield DRAWN
    picture("realtime_orbited")
    for drawing in [item for item in scene.objects if item.type == "GREASEPENCIL"]:
        bpy.data.objects.remove(drawing)  # Blender crashes where it draws these in a render while EEVEE starts in a viewport
    scene.render.resolution_percentage = 30  # a software driver takes minutes for a whole picture
    stats: list[str] = []
    bpy.app.handlers.render_stats.append(lambda said, *_: stats.append(str(said)))
    bpy.ops.render.render("INVOKE_DEFAULT")
    for _ in range(300):  # until then Blender crashes where the engine changes: it frees the engine that is to render
        yield 0.2
        if any("Sample" in said for said in stats):
            break
    say(f"changed the engine after {stats}")
    scene.render.engine = "BLENDER_EEVEE"  # while it renders
    yield DRAWN
    picture("realtime_rendered")
    close_other_windows()
    scene.render.engine = ENGINE
    view.spaces.active.shading.type = "MATERIAL"  # which EEVEE draws
    yield RENDERED["BLENDER_EEVEE"]
    picture("material_preview")


def walk() -> Steps:
    for part in (build, tabs, not_drawn, overlays, regions, orbit_and_render):
        yield from part()
