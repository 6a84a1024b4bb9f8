# SPDX-License-Identifier: GPL-3.0-or-later
"""How far subsurface scattering blurs, seen by the cameras of a scene: where that is under half a pixel, it is diffuse reflection.

The blur's measure is the edge of a shadow from 10 to 90 % of the light, as a lens's sharpness is measured, at the point of the
material that is nearest to the camera. Bounding boxes stand for the objects, so the blur is overestimated.
"""

from collections.abc import Iterator, Sequence

import bpy

from mathutils import Matrix, Vector

from ..closures.subsurface_fit import edge_width
from ..models.burley import EDGE_WIDTH_10_90, EDGE_WIDTH_25_75
from .arithmetic import Plain

VISIBLE = 0.5  # pixels
# Modifiers and constraints that may change with time alone
MOVING = {
    *("BUILD", "CLOTH", "DYNAMIC_PAINT", "EXPLODE", "FLUID", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "NODES", "OCEAN"),
    *("PARTICLE_INSTANCE", "PARTICLE_SYSTEM", "SOFT_BODY", "WAVE"),
    *("CAMERA_SOLVER", "FOLLOW_TRACK", "OBJECT_SOLVER", "TRANSFORM_CACHE"),
}


def is_flat(
    scene: bpy.types.Scene, material: bpy.types.Material, lengths: Sequence[float], color: Plain | None, now: bool = False
) -> bool:
    """Return whether a shadow's edge on `material` is narrower than VISIBLE at every camera, in every frame of the range or `now`.

    `lengths` are the mean free paths for red, green and blue [scene units]; `color` None where it varies. False where that cannot
    be told: without a camera, with a panoramic one, or where the material is not on any object at the current frame. `now` takes
    the scene as it was evaluated last, so that a handler may ask.
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
    later = (_smallest_pixel(scene, material, cameras) for _ in _frames(scene))
    return all(pixel is None or width < VISIBLE * pixel for pixel in later)


def _frames(scene: bpy.types.Scene) -> Iterator[int]:
    """Set `scene` to each frame that can differ from the current one, yield it, and set it back at the end."""
    if not _moves(scene):
        return
    before, subframe = scene.frame_current, scene.frame_subframe
    try:
        for frame in range(scene.frame_start, scene.frame_end + 1, scene.frame_step):
            scene.frame_set(frame)
            yield frame
    finally:
        scene.frame_set(before, subframe=subframe)


def _moves(scene: bpy.types.Scene) -> bool:
    """Return whether anything that `scene` evaluates is animated, driven or simulated; node trees and what they drive aside."""
    still = (bpy.types.NodeTree, bpy.types.Material, bpy.types.World, bpy.types.Light)
    for item in (item for layer in scene.view_layers for item in _evaluated(layer).ids):
        if not isinstance(item, still) and getattr(item, "animation_data", None):
            return True
        if isinstance(item, bpy.types.Object):
            kinds = {part.type for part in (*item.modifiers, *item.constraints)}
            if item.rigid_body or not kinds.isdisjoint(MOVING):
                return True
    return False


def _evaluated(layer: bpy.types.ViewLayer) -> bpy.types.Depsgraph:
    if layer.depsgraph is None:
        layer.update()
    return layer.depsgraph


def _smallest_pixel(scene: bpy.types.Scene, material: bpy.types.Material, cameras: set[bpy.types.Object]) -> float | None:
    """Return how wide a pixel of `cameras` is at this frame on the objects of `material`, where it is smallest [scene units]."""
    sizes = []
    for graph in map(_evaluated, scene.view_layers):
        views = [_View(scene, camera.evaluated_get(graph)) for camera in cameras]
        for instance in graph.object_instances:
            item = instance.object
            # an object's slots, and what its modifiers give it
            shown = {*(slot.material for slot in item.material_slots), *getattr(item.data, "materials", ())} - {None}
            if any(each.original == material for each in shown):
                corners = [instance.matrix_world @ Vector(corner) for corner in item.bound_box]
                sizes += [view.pixel(corners) for view in views]
    return min(sizes, default=None)


class _View:
    """A camera as seen by a render."""

    def __init__(self, scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
        settings, data = scene.render, camera.data
        top_right, _, bottom_left, _ = data.view_frame(scene=scene)
        size = top_right - bottom_left
        share = settings.resolution_percentage / 100.0
        across = min(abs(size.x) / (settings.resolution_x * share), abs(size.y) / (settings.resolution_y * share))
        self.per_depth = across / abs(top_right.z) if data.type == "PERSP" else 0.0
        self.fixed = across if data.type == "ORTHO" else 0.0
        self.nearest = data.clip_start
        place, turn, _ = camera.matrix_world.decompose()
        self.into = (Matrix.Translation(place) @ turn.to_matrix().to_4x4()).inverted()

    def pixel(self, corners: Sequence[Vector]) -> float:
        """Return how wide a pixel is at the nearest of `corners` that is in front of the camera [scene units]."""
        depth = max(self.nearest, min(-(self.into @ corner).z for corner in corners))
        return self.fixed + self.per_depth * depth
