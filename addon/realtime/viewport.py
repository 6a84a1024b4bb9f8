# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport of the realtime engine: draws one more sample each time until there are enough."""

from functools import partial

import bpy

from mathutils import Vector

from .contents import Contents
from .drawing import Painter, Refused
from .final import background, failed
from .view import View, eye_at


class Viewport:
    """What an engine keeps for a viewport."""

    def __init__(self) -> None:
        self._contents: Contents | None = None
        self._painter: Painter | None = None
        self._is_sent = False  # what has changed, to the driver
        self._view: View | None = None
        self._sample = 0  # how many the picture of `_view` has
        self._refused_size: tuple[int, int] | None = None  # for which the driver refuses something

    def update(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
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
            self._refuse(engine, failed(error))

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, scene: bpy.types.Scene) -> None:
        """Draw one more sample, and all so far into the window; ask for the next."""
        if self._contents is None:
            return
        size = (0, 0)
        try:
            whole = _window(context)
            x, y, width, height = _border(context, scene, whole)
            size = (width, height)
            if min(size) <= 0 or self._refused_size == size:
                return
            if self._painter is None:
                self._painter = Painter(self._contents)
            if not self._is_sent:  # here, as Blender may have no graphics context while it updates
                self._painter.refresh()
                self._is_sent = True
            self._draw(engine, scene, self._painter, whole.part(x, y, width, height), (x, y))
            if self._sample < scene.true_diffuse.viewport_samples:  # what asks for it while it is drawn is not heard
                bpy.app.timers.register(partial(redraw, context.area.as_pointer()))
        except Refused as error:  # another size may do
            self._refused_size = size
            self._refuse(engine, str(error))
        except Exception as error:  # nothing is drawn until something changes, then all anew
            self._contents = self._painter = None
            self._refuse(engine, failed(error))

    def _refuse(self, engine: bpy.types.RenderEngine, message: str) -> None:
        """Say in the viewport why nothing is drawn, and report it."""
        self._view = None
        engine.update_stats(engine.bl_label, message)
        engine.report({"ERROR"}, message)

    def _draw(
        self, engine: bpy.types.RenderEngine, scene: bpy.types.Scene, painter: Painter, view: View, corner: tuple[int, int]
    ) -> None:
        """Draw what `view` sees of it, its lower left corner at `corner` of the window [pixels]."""
        if view != self._view:
            painter.begin(view)
            self._view, self._sample = view, 0
        if self._sample < scene.true_diffuse.viewport_samples:
            painter.add(view, self._sample, scene.render.filter_size, background(scene, painter.contents))
            self._sample += 1
        painter.show_blended(*corner)  # Blender applies the view transform
        engine.update_stats(f"Sample {self._sample}", "; ".join((*painter.contents.notes, *painter.notes)))


def _window(context: bpy.types.Context) -> View:
    """Return the view of a viewport."""
    region, view = context.region, context.region_data
    place = view.view_matrix.inverted_safe()
    eye = eye_at(place, view.is_perspective)
    return View(view.perspective_matrix.copy(), eye, view.is_perspective, region.width, region.height)


def _border(context: bpy.types.Context, scene: bpy.types.Scene, view: View) -> tuple[int, int, int, int]:
    """Return the corner, width and height of what of a viewport is drawn, in pixels; none of it may be left.

    That is inside its render border or, through a camera, inside that of the scene in the camera's frame.
    """
    space, settings = context.space_data, scene.render
    low, high = Vector((0.0, 0.0)), Vector((view.width, view.height))
    if context.region_data.view_perspective == "CAMERA":
        camera = space.camera if space.use_local_camera else scene.camera
        if settings.use_border and camera and camera.type == "CAMERA":
            to_window = view.projection @ camera.matrix_world.normalized()
            frame = [to_window @ corner.to_4d() for corner in camera.data.view_frame(scene=scene)]
            pixels = [Vector(((clip.x / clip.w + 1.0) * view.width, (clip.y / clip.w + 1.0) * view.height)) / 2.0 for clip in frame]
            corner, size = pixels[2], pixels[0] - pixels[2]  # at the bottom left; to the top right
            low = corner + size * Vector((settings.border_min_x, settings.border_min_y))
            high = corner + size * Vector((settings.border_max_x, settings.border_max_y))
    elif space.use_render_border:
        low, high = (
            Vector((x * view.width, y * view.height))
            for x, y in (
                (space.render_border_min_x, space.render_border_min_y),
                (space.render_border_max_x, space.render_border_max_y),
            )
        )
    left, bottom = (max(0, round(start)) for start in low)
    right, top = (min(size, round(end)) for size, end in zip((view.width, view.height), high, strict=True))
    return left, bottom, right - left, top - bottom


def redraw(area: int) -> None:
    """Draw a viewport again, unless it is gone: `area` is where it was in memory."""
    for window in bpy.context.window_manager.windows:
        for shown in window.screen.areas:
            if shown.as_pointer() == area:
                shown.tag_redraw()
