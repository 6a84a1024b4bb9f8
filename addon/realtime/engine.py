# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine True Diffuse Realtime, in the viewport and in final renders."""

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import bpy

from mathutils import Vector

from .contents import Contents
from .view import View

if TYPE_CHECKING:
    from .drawing import Painter, Rgba

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

    _contents: Contents | None = None  # of a viewport
    _painter: "Painter | None" = None
    _view: View | None = None
    _sample = 0  # how many the picture of `_view` has
    _refused = ""  # why nothing is drawn until something changes

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the picture into Combined."""
        from .drawing import Refused

        try:
            self._render(depsgraph)
        except (Unrenderable, Refused) as error:
            self.report({"ERROR"}, str(error))
            self.error_set(str(error))

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what changed."""
        from .drawing import Painter

        if self._contents is None:
            self._contents = Contents()
        space = context.space_data
        self._contents.update(depsgraph, lambda item: item.original.visible_in_viewport_get(space))
        if self._painter is None:
            self._painter = Painter(self._contents)
        self._painter.refresh()
        self._view, self._refused = None, ""

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw one more sample, and all so far into the window; ask for the next."""
        from .drawing import Refused

        if self._painter is None or self._contents is None or self._refused:
            return
        try:
            self._draw(context, depsgraph.scene, self._painter, self._contents)
        except Refused as error:
            self._refused = str(error)
            self.update_stats(self.bl_label, self._refused)
            self.report({"ERROR"}, self._refused)

    def _draw(self, context: bpy.types.Context, scene: bpy.types.Scene, painter: "Painter", contents: Contents) -> None:
        view = _window(context)
        if view != self._view:
            painter.begin(view)
            self._view, self._sample = view, 0
        if self._sample < scene.true_diffuse.viewport_samples:
            painter.add(view, self._sample, scene.render.filter_size, _background(scene, contents))
            self._sample += 1
        self.bind_display_space_shader(scene)
        painter.show_blended()
        self.unbind_display_space_shader()
        notes = "; ".join(contents.notes)
        self.update_stats(f"Sample {self._sample}", notes)
        if self._sample < scene.true_diffuse.viewport_samples:
            bpy.app.timers.register(partial(_redraw, context.area))  # what asks for it while it is drawn is not heard

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
        samples = scene.true_diffuse.samples
        for sample in range(samples):
            if self.test_break():
                return
            self.update_stats("", f"Sample {sample + 1} of {samples}")
            painter.add(view, sample, scene.render.filter_size, _background(scene, contents))
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
        if camera.type != "CAMERA" or camera.data.type not in {"PERSP", "ORTHO"}:
            raise Unrenderable(f"{camera.name} is neither a perspective nor an orthographic camera")
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


def _window(context: bpy.types.Context) -> View:
    """Return the view of a viewport."""
    region, view = context.region, context.region_data
    place = view.view_matrix.inverted_safe()
    eye = place.translation.copy() if view.is_perspective else (place.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
    return View(view.perspective_matrix.copy(), eye, view.is_perspective, region.width, region.height)


def _redraw(area: bpy.types.Area) -> None:
    """Draw a viewport again, unless it is gone."""
    with suppress(ReferenceError):
        area.tag_redraw()


def _background(scene: bpy.types.Scene, contents: Contents) -> "Rgba":
    """Return what is behind all surfaces, its color times its alpha."""
    if scene.render.film_transparent:
        return 0.0, 0.0, 0.0, 0.0
    return *contents.world, 1.0
