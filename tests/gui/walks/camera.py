# SPDX-License-Identifier: GPL-3.0-or-later
"""The camera of True Diffuse Realtime: depth of field in a viewport, its panels, hair, and motion blur in a render."""

import math

import bpy

from mathutils import Matrix, Vector
from window import DRAWN, Steps, area, assign, close_other_windows, cube, picture, within

ENGINE = "TRUE_DIFFUSE_REALTIME"
HAIRS = 600


def furry_ball() -> bpy.types.Object:
    """Return a ball of hair, which turns by the golden angle from one hair to the next."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([5] * HAIRS)
    points: list[float] = []
    radii: list[float] = []
    for hair in range(HAIRS):
        z = 1.0 - (2 * hair + 1) / HAIRS
        across, angle = math.sqrt(1.0 - z * z), 2.4 * hair
        root = Vector((across * math.cos(angle), across * math.sin(angle), z))
        for step in range(5):
            points.extend(root * (0.5 + 0.12 * step) - Vector((0.0, 0.0, 0.02 * step * step)))
            radii.append(0.012 * (1.0 - 0.2 * step))
    data.attributes["position"].data.foreach_set("vector", points)
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    item = bpy.data.objects.new("Hair", data)
    item.matrix_world = Matrix.Translation((-2.5, 1.5, 0.0))
    bpy.context.scene.collection.objects.link(item)
    return item


def build() -> Steps:
    """Three cubes and a ball of hair one behind the other, seen through the camera."""
    scene, view = bpy.context.scene, area("VIEW_3D")
    scene.render.engine = ENGINE
    assign(cube(), "clay")
    with within(view):
        bpy.ops.mesh.primitive_plane_add(size=30.0, location=(0.0, 0.0, -1.0))
    for index, place in enumerate(((3.0, -3.0, 0.0), (-5.0, 5.0, 0.0))):
        other = cube().copy()
        other.name, other.location = f"Cube {index}", place
        scene.collection.objects.link(other)
    hair = furry_ball()
    hair.data.materials.append(cube().material_slots[0].material)
    light = bpy.data.objects["Light"]
    light.data.type, light.rotation_euler, light.data.energy, light.data.angle = "SUN", (0.6, 0.5, 0.0), 3.0, 0.05
    scene.true_diffuse.viewport_samples = 48
    with within(view):
        bpy.ops.view3d.view_camera()
    view.spaces.active.shading.type = "RENDERED"
    yield DRAWN
    picture("in_focus")


def depth_of_field() -> Steps:
    """The panel of the camera, what is focused by a distance, and by an object."""
    scene, properties = bpy.context.scene, area("PROPERTIES").spaces.active
    camera = scene.camera
    for item in scene.objects:
        item.select_set(item is camera)
    bpy.context.view_layer.objects.active = camera
    yield 1.0
    properties.context = "DATA"
    dof = camera.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 0.05, 6.0
    yield 2.0 * DRAWN
    picture("near")
    dof.focus_object = bpy.data.objects["Hair"]
    yield 2.0 * DRAWN
    picture("on_the_hair")
    dof.aperture_blades, dof.aperture_ratio = 5, 2.0
    yield 2.0 * DRAWN
    picture("narrow_aperture")
    with within(area("VIEW_3D")):
        bpy.ops.view3d.view_persportho()  # out of the camera: all is in focus
    yield DRAWN
    picture("out_of_the_camera")
    dof.use_dof = False


def motion_blur() -> Steps:
    """The shutter's panel, and a render of a cube that turns and one that moves."""
    scene, properties = bpy.context.scene, area("PROPERTIES").spaces.active
    for frame, turn in ((0, 0.0), (20, 4.0)):
        cube().rotation_euler.z = turn
        cube().keyframe_insert("rotation_euler", frame=frame)
        bpy.data.objects["Cube 0"].location.z = turn
        bpy.data.objects["Cube 0"].keyframe_insert("location", frame=frame)
    scene.frame_set(10)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    properties.context = "RENDER"
    yield DRAWN
    picture("shutter")
    scene.render.resolution_percentage, scene.true_diffuse.samples = 30, 32
    bpy.ops.render.render("INVOKE_DEFAULT")
    for _ in range(300):
        yield 0.5
        if not bpy.app.is_job_running("RENDER"):
            break
    yield 2.0
    picture("rendered")
    assert scene.frame_current == 10
    close_other_windows()
    yield 1.0


def walk() -> Steps:
    for part in (build, depth_of_field, motion_blur):
        yield from part()
