# SPDX-License-Identifier: GPL-3.0-or-later
"""A ball of hair curves on the ground before a sun."""

import math

import bpy

import bmesh
from mathutils import Matrix, Vector

from true_diffuse.scenes.elements import add, add_sun

SIZE, LENS = 160, 50.0  # pixels, mm
HAIRS, POINTS = 600, 5
SKIN, LENGTH, THICKNESS = 0.35, 0.25, 0.006  # m: radius of the ball, length and radius of a hair at its root
TURN = math.pi * (3.0 - math.sqrt(5.0))  # radians from one hair to the next, the golden angle


def ball_of_hair(filter_size: float) -> bpy.types.Scene:
    """Return a scene of hair of a Principled BSDF under a sun of 0.05 radians; `filter_size` is in pixels."""
    scene = bpy.data.scenes.new("Hair")
    settings = scene.render
    settings.resolution_x = settings.resolution_y = SIZE
    settings.filter_size, scene.cycles.filter_width = filter_size, filter_size / 2.0
    scene.cycles.pixel_filter_type, scene.cycles.max_bounces = "BLACKMAN_HARRIS", 0
    scene.cycles_curves.shape = "RIBBONS"
    camera = bpy.data.cameras.new("Camera")
    camera.lens = LENS
    scene.camera = add(scene, "Camera", camera)
    place = Matrix.Translation((0.0, 0.0, -2.2))
    add(scene, "Hair", _hair(), place)
    ball, ground = bpy.data.meshes.new("Ball"), bpy.data.meshes.new("Ground")
    for mesh, make in (
        (ball, lambda made: bmesh.ops.create_uvsphere(made, u_segments=96, v_segments=48, radius=SKIN)),
        (ground, lambda made: bmesh.ops.create_grid(made, x_segments=1, y_segments=1, size=2.0)),
    ):
        made = bmesh.new()
        make(made)
        for face in made.faces:
            face.smooth = True
        made.to_mesh(mesh)
        made.free()
        mesh.materials.append(_principled((0.5, 0.5, 0.5)))
    add(scene, "Ball", ball, place)
    add(scene, "Ground", ground, Matrix.Translation((0.0, 0.0, -3.2)))
    add_sun(scene, "Sun", (0.4, 0.6, 1.0), 3.0, 0.05)
    return scene


def _hair() -> bpy.types.Curves:
    """Return hair that grows straight out of the ball and hangs."""
    data = bpy.data.hair_curves.new("Hair")
    data.add_curves([POINTS] * HAIRS)
    places, radii = [], []
    for hair in range(HAIRS):
        z = 1.0 - (2 * hair + 1) / HAIRS
        across, angle = math.sqrt(1.0 - z * z), TURN * hair
        root = Vector((across * math.cos(angle), across * math.sin(angle), z))
        for step in range(POINTS):
            t = step / (POINTS - 1)
            places.extend(root * (SKIN + LENGTH * t) - Vector((0.0, 0.5 * LENGTH * t * t, 0.0)))
            radii.append(THICKNESS * (1.0 - 0.8 * t))
    data.attributes["position"].data.foreach_set("vector", places)
    data.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radii)
    data.materials.append(_principled((0.6, 0.3, 0.1)))
    return data


def _principled(color: tuple[float, float, float]) -> bpy.types.Material:
    made = bpy.data.materials.new("Principled")
    node = made.node_tree.nodes["Principled BSDF"]
    node.inputs["Base Color"].default_value, node.inputs["Roughness"].default_value = (*color, 1.0), 0.4
    return made
