# SPDX-License-Identifier: GPL-3.0-or-later
"""The width of the blur by subsurface scattering in the pictures of a scene's cameras: below half a pixel it is invisible.

The width is that of a shadow's edge from 10 to 90 % of the light, as for the sharpness of a lens, at the point of the material that
is nearest to the camera. Objects are replaced by their bounding boxes, so the width is overestimated.
"""

from collections.abc import Iterator, Sequence

import bpy

from mathutils import Matrix, Vector

from ..closures.subsurface_fit import edge_width
from ..models.burley import EDGE_WIDTH_10_90, EDGE_WIDTH_25_75
from .arithmetic import Plain

VISIBLE = 0.5  # pixels
# Modifiers and constraints whose result may change from frame to frame without animation data
TIME_DEPENDENT = {
    *("BUILD", "CLOTH", "DYNAMIC_PAINT", "EXPLODE", "FLUID", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "NODES", "OCEAN"),
    *("PARTICLE_INSTANCE", "PARTICLE_SYSTEM", "SOFT_BODY", "WAVE"),
    *("CAMERA_SOLVER", "FOLLOW_TRACK", "OBJECT_SOLVER", "TRANSFORM_CACHE"),
}


def is_flat(
    scene: bpy.types.Scene, material: bpy.types.Material, lengths: Sequence[float], color: Plain | None, now: bool = False
) -> bool:
    """Return whether a shadow's edge on `material` is narrower than VISIBLE for every camera and every frame of `scene`'s range.

    `lengths` are the mean free paths for red, green and blue [scene units]; `color` is None where it varies. Returns False where
    the width is unknown: without a camera, with a panoramic one, or where no object has the material at the current frame. With
    `now` only the current frame counts, as evaluated last, so that a handler may call this.
    """
    colors = color if isinstance(color, tuple) else (1.0, 1.0, 1.0)
    edges = (length * edge_width(rho) for length, rho in zip(lengths, colors, strict=True))
    width = max(edges) * EDGE_WIDTH_10_90 / EDGE_WIDTH_25_75
    cameras = {marker.camera for marker in scene.timeline_markers if marker.camera} | ({scene.camera} - {None})
    if not cameras or any(camera.type != "CAMERA" or camera.data.type not in ("PERSP", "ORTHO") for camera in cameras):
        return False
    if not now:
        for layer in scene.view_layers:
            layer.update()
    smallest = _smallest_pixel(scene, material, cameras)
    if smallest is None or width >= VISIBLE * smallest:
        return False
    if now:
        return True
    pixels = (_smallest_pixel(scene, material, cameras) for _ in _frames(scene))
    return all(pixel is None or width < VISIBLE * pixel for pixel in pixels)


def _frames(scene: bpy.types.Scene) -> Iterator[int]:
    """Yield the frames of `scene`'s range after setting it to each; none where nothing moves. Restores the current frame."""
    if not _is_animated(scene):
        return
    before, subframe = scene.frame_current, scene.frame_subframe
    try:
        for frame in range(scene.frame_start, scene.frame_end + 1, scene.frame_step):
            scene.frame_set(frame)
            yield frame
    finally:
        scene.frame_set(before, subframe=subframe)


def _is_animated(scene: bpy.types.Scene) -> bool:
    """Return whether anything in `scene` is animated, driven or simulated, apart from node trees, materials, worlds and lights."""
    shading = (bpy.types.NodeTree, bpy.types.Material, bpy.types.World, bpy.types.Light)
    for item in (item for layer in scene.view_layers for item in _evaluated(layer).ids):
        if not isinstance(item, shading) and getattr(item, "animation_data", None):
            return True
        if isinstance(item, bpy.types.Object):
            types = {modifier.type for modifier in (*item.modifiers, *item.constraints)}
            if item.rigid_body or not types.isdisjoint(TIME_DEPENDENT):
                return True
    return False


def _evaluated(layer: bpy.types.ViewLayer) -> bpy.types.Depsgraph:
    if layer.depsgraph is None:
        layer.update()
    return layer.depsgraph


def _smallest_pixel(scene: bpy.types.Scene, material: bpy.types.Material, cameras: set[bpy.types.Object]) -> float | None:
    """Return the width [scene units] of the smallest pixel of `cameras` on objects with `material`; None where there is none."""
    sizes = []
    for graph in map(_evaluated, scene.view_layers):
        views = [_View(scene, camera.evaluated_get(graph)) for camera in cameras]
        for instance in graph.object_instances:
            item = instance.object
            # from the object's slots, and from the mesh that its modifiers return
            assigned = {*(slot.material for slot in item.material_slots), *getattr(item.data, "materials", ())} - {None}
            if any(used.original == material for used in assigned):
                corners = [instance.matrix_world @ Vector(corner) for corner in item.bound_box]
                sizes += [view.pixel(corners) for view in views]
    return min(sizes, default=None)


class _View:
    """The pixels of a camera in a render of `scene`."""

    def __init__(self, scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
        settings, data = scene.render, camera.data
        top_right, _, bottom_left, _ = data.view_frame(scene=scene)
        size = top_right - bottom_left
        scale = settings.resolution_percentage / 100.0
        width = min(abs(size.x) / (settings.resolution_x * scale), abs(size.y) / (settings.resolution_y * scale))
        self.width_per_depth = width / abs(top_right.z) if data.type == "PERSP" else 0.0
        self.width = width if data.type == "ORTHO" else 0.0
        self.clip_start = data.clip_start
        location, rotation, _ = camera.matrix_world.decompose()
        self.world_to_camera = (Matrix.Translation(location) @ rotation.to_matrix().to_4x4()).inverted()

    def pixel(self, corners: Sequence[Vector]) -> float:
        """Return the width [scene units] of a pixel at the nearest of `corners` in front of the camera."""
        depth = max(self.clip_start, min(-(self.world_to_camera @ corner).z for corner in corners))
        return self.width + self.width_per_depth * depth
