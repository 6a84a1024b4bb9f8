# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine True Diffuse Realtime, in the viewport and in final renders."""

import struct
import traceback
from collections.abc import Iterator
from functools import partial

import bpy

import gpu
from mathutils import Matrix, Vector

from .. import engines
from .contents import Contents
from .drawing import Painter, Refused, Rgba, forget_shaders
from .view import View

IDENTIFIER = "TRUE_DIFFUSE_REALTIME"


class Unrenderable(Exception):
    """A picture cannot be drawn; the message says why."""


class TrueDiffuseRealtime(bpy.types.RenderEngine):
    """Draws with the shaders of True Diffuse: every model exact, under every lamp"""

    bl_idname = IDENTIFIER
    bl_label = "True Diffuse Realtime"
    bl_use_gpu_context = not bpy.app.background  # in final renders, too; without windows `_find_driver` sees to it
    bl_use_eevee_viewport = True  # material previews are EEVEE's
    bl_use_shading_nodes_custom = False
    bl_use_preview = False

    _contents: Contents | None = None  # of a viewport
    _painter: Painter | None = None
    _is_sent = False  # what has changed, to the driver
    _view: View | None = None
    _sample = 0  # how many the picture of `_view` has
    _refused_size: tuple[int, int] | None = None  # of a viewport for which the driver refuses something

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the picture into Combined."""
        try:
            self._render(depsgraph)
        except (Unrenderable, Refused) as error:
            self.report({"ERROR"}, str(error))
        except (Exception, KeyboardInterrupt) as error:  # Blender crashes where it gets neither a picture nor a report
            self.report({"ERROR"}, _failed(error))

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what changed."""
        self._view = self._refused_size = None
        self._is_sent = False
        try:
            if self._contents is None:
                self._contents = Contents()
            space = context.space_data
            self._contents.update(depsgraph, lambda item: item.original.visible_in_viewport_get(space))
        except Exception as error:
            self._contents = self._painter = None
            self._refuse(_failed(error))

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw one more sample, and all so far into the window; ask for the next."""
        size = (context.region.width, context.region.height)
        if self._contents is None or self._refused_size == size:
            return
        try:
            if self._painter is None:
                self._painter = Painter(self._contents)
            if not self._is_sent:  # here, as Blender may have no graphics context while it updates
                self._painter.refresh()
                self._is_sent = True
            self._draw(context, depsgraph.scene, self._painter, self._contents)
        except Refused as error:  # another size may do
            self._refused_size = size
            self._refuse(str(error))
        except Exception as error:  # nothing is drawn until something changes, then all anew
            self._contents = self._painter = None
            self._refuse(_failed(error))

    def _refuse(self, message: str) -> None:
        """Say in the viewport and in the status bar why nothing is drawn."""
        self._view = None
        self.update_stats(self.bl_label, message)
        self.report({"ERROR"}, message)

    def _draw(self, context: bpy.types.Context, scene: bpy.types.Scene, painter: Painter, contents: Contents) -> None:
        view = _window(context)
        if view != self._view:
            painter.begin(view)
            self._view, self._sample = view, 0
        if self._sample < scene.true_diffuse.viewport_samples:
            painter.add(view, self._sample, scene.render.filter_size, _background(scene, contents))
            self._sample += 1
        self.bind_display_space_shader(scene)
        try:
            painter.show_blended()
        finally:
            self.unbind_display_space_shader()
        notes = "; ".join((*contents.notes, *painter.notes))
        self.update_stats(f"Sample {self._sample}", notes)
        if self._sample < scene.true_diffuse.viewport_samples:
            bpy.app.timers.register(partial(_redraw, context.area.as_pointer()))  # what asks for it while it is drawn is not heard

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        _find_driver()
        scene = depsgraph.scene
        layer = depsgraph.view_layer.name
        full, x, y, width, height = frame(scene)
        views = [(name, self._camera(depsgraph, *full).part(x, y, width, height)) for name in self._views(layer)]
        contents = Contents()
        self.update_stats("", "Reading the scene")
        contents.update(depsgraph)
        painter = Painter(contents)
        painter.refresh()
        for note in (*contents.notes, *painter.notes):
            self.report({"WARNING"}, note)
        for step in painter.compile():
            self.update_stats("", step)
        samples = scene.true_diffuse.samples
        for k, (name, view) in enumerate(views):
            painter.begin(view)
            for sample in range(samples):
                if self.test_break():
                    return
                self.update_stats("", f"Sample {sample + 1} of {samples}")
                painter.add(view, sample, scene.render.filter_size, _background(scene, contents))
                self.update_progress((k * samples + sample + 1) / (len(views) * samples))
            pixels = painter.read()
            result = self.begin_result(0, 0, width, height, layer=layer, view=name)
            result.layers[0].passes["Combined"].rect.foreach_set(pixels)
            self.end_result(result)

    def _views(self, layer: str) -> Iterator[str]:
        """Yield the names of the views of a stereoscopic picture, each made the active one; one without a name of any other."""
        result = self.begin_result(0, 0, 1, 1, layer=layer)
        names = [view.name for view in result.views]
        self.end_result(result, cancel=True)
        for name in names or [""]:
            self.active_view_set(name)
            yield name

    def _camera(self, depsgraph: bpy.types.Depsgraph, width: int, height: int) -> View:
        """Return what the scene's camera sees in the active view; raises Unrenderable where there is none that can be drawn."""
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
        fits_width = camera.data.sensor_fit == "HORIZONTAL" or (
            camera.data.sensor_fit == "AUTO" and width * settings.pixel_aspect_x >= height * settings.pixel_aspect_y
        )
        # by what the active view's frame is shifted beside the camera's own, in the frame's longer side or that which fits
        shift = self.camera_shift_x(camera) - camera.data.shift_x
        side = width if fits_width else height * settings.pixel_aspect_y / settings.pixel_aspect_x
        projection = Matrix.Translation((-2.0 * shift * side / width, 0.0, 0.0)) @ projection
        is_perspective = camera.data.type == "PERSP"
        eye = place.translation.copy() if is_perspective else (place.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
        return View(projection @ place.inverted_safe(), eye, is_perspective, width, height)


def frame(scene: bpy.types.Scene) -> tuple[tuple[int, int], int, int, int, int]:
    """Return the size of the whole picture and the corner, width and height of the part that is rendered, in pixels."""
    settings = scene.render
    width, height = (size * settings.resolution_percentage // 100 for size in (settings.resolution_x, settings.resolution_y))
    if not settings.use_border:
        return (width, height), 0, 0, width, height
    x, y = _whole(settings.border_min_x * width), _whole(settings.border_min_y * height)
    right, top = _whole(settings.border_max_x * width), _whole(settings.border_max_y * height)
    return (width, height), x, y, max(1, right - x), max(1, top - y)


def _whole(size: float) -> int:
    """Return a number of pixels as Blender has it, which multiplies in 32 bits: 0.7 of 10 are 7."""
    return int(struct.unpack("f", struct.pack("f", size))[0])


def _find_driver() -> None:
    """Have a graphics context where Blender has no windows; raises Unrenderable where no driver has one."""
    if not bpy.app.background:
        return
    try:
        gpu.platform.renderer_get()
    except SystemError as error:  # nothing has been drawn yet; Blender itself would end with a crash
        if not engines.eevee_runs_here():
            raise Unrenderable("No graphics driver is found here") from error
    gpu.init()


def _window(context: bpy.types.Context) -> View:
    """Return the view of a viewport."""
    region, view = context.region, context.region_data
    place = view.view_matrix.inverted_safe()
    eye = place.translation.copy() if view.is_perspective else (place.to_3x3() @ Vector((0.0, 0.0, 1.0))).normalized()
    return View(view.perspective_matrix.copy(), eye, view.is_perspective, region.width, region.height)


def _redraw(area: int) -> None:
    """Draw a viewport again, unless it is gone: `area` is where it was in memory."""
    for window in bpy.context.window_manager.windows:
        for shown in window.screen.areas:
            if shown.as_pointer() == area:
                shown.tag_redraw()


def _failed(error: BaseException) -> str:
    """Return what is said of a fault that was not foreseen; what the driver has may be of a context that is lost."""
    traceback.print_exception(error)
    forget_shaders()
    return f"True Diffuse Realtime failed: {str(error) or type(error).__name__}"


def _background(scene: bpy.types.Scene, contents: Contents) -> Rgba:
    """Return what is behind all surfaces, its color times its alpha."""
    if scene.render.film_transparent:
        return 0.0, 0.0, 0.0, 0.0
    return *contents.world, 1.0
