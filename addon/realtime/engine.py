# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine True Diffuse Realtime, in the viewport and in final renders."""

import bpy

from mathutils import Vector

from .contents import Contents
from .view import View

IDENTIFIER = "TRUE_DIFFUSE_REALTIME"


class Unrenderable(Exception):
    """A picture cannot be drawn; the message says why."""


class TrueDiffuseRealtime(bpy.types.RenderEngine):
    """Draws with the shaders of True Diffuse: every model exact, under every lamp"""

    bl_idname = IDENTIFIER
    bl_label = "True Diffuse Realtime"
    bl_use_gpu_context = True  # in final renders, too
    bl_use_eevee_viewport = True  # material previews are EEVEE's
    bl_use_shading_nodes_custom = False
    bl_use_preview = False

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the picture into Combined."""
        try:
            self._render(depsgraph)
        except Unrenderable as error:
            self.report({"ERROR"}, str(error))
            self.error_set(str(error))

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        from .drawing import Painter

        scene = depsgraph.scene
        full, x, y, width, height = frame(scene)
        view = self._camera(depsgraph, *full).part(x, y, width, height)
        contents = Contents()
        self.update_stats("", "Reading the scene")
        contents.update(depsgraph)
        for note in contents.notes:
            self.report({"WARNING"}, note)
        painter = Painter(contents)
        painter.refresh()
        for step in painter.compile():
            self.update_stats("", step)
        painter.begin(view)
        samples = max(1, scene.true_diffuse.samples)
        alpha = 0.0 if scene.render.film_transparent else 1.0
        background = (*(alpha * channel for channel in contents.world), alpha)
        for sample in range(samples):
            if self.test_break():
                return
            painter.add(view, sample, scene.render.filter_size, background)
            self.update_progress((sample + 1) / samples)
        pixels = painter.read()
        result = self.begin_result(0, 0, width, height)
        result.layers[0].passes["Combined"].rect.foreach_set(pixels)
        self.end_result(result)

    def _camera(self, depsgraph: bpy.types.Depsgraph, width: int, height: int) -> View:
        """Return the view of the scene's camera; raises Unrenderable where there is none that can be drawn."""
        scene = depsgraph.scene
        if scene.camera is None:
            raise Unrenderable("The scene has no camera")
        camera = scene.camera.evaluated_get(depsgraph)
        if camera.type != "CAMERA" or camera.data.type == "PANO":
            raise Unrenderable(f"{camera.name} is a panoramic camera, which True Diffuse Realtime cannot draw")
        settings = scene.render
        projection = camera.calc_matrix_camera(
            depsgraph, x=width, y=height, scale_x=settings.pixel_aspect_x, scale_y=settings.pixel_aspect_y
        )
        place = self.camera_model_matrix(camera)
        is_perspective = camera.data.type == "PERSP"
        eye = place.translation.copy() if is_perspective else (place.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
        return View(projection @ place.inverted_safe(), eye, is_perspective, width, height)


def frame(scene: bpy.types.Scene) -> tuple[tuple[int, int], int, int, int, int]:
    """Return the size of the whole picture and the corner, width and height of the part that is rendered, in pixels."""
    settings = scene.render
    share = settings.resolution_percentage / 100.0
    width, height = int(settings.resolution_x * share), int(settings.resolution_y * share)
    if not settings.use_border:
        return (width, height), 0, 0, width, height
    x, y = int(settings.border_min_x * width), int(settings.border_min_y * height)
    right, top = int(settings.border_max_x * width), int(settings.border_max_y * height)
    return (width, height), x, y, max(1, right - x), max(1, top - y)
