# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport of the realtime engine: each redraw adds a sample until there are enough."""

import math
from dataclasses import dataclass
from functools import partial

import bpy

from mathutils import Vector

from . import not_drawn
from .driver import DriverError, Rgba
from .expressions import Code
from .final import background, failure_message
from .lens import read_lens
from .not_drawn import Omission
from .objects import IsShown, has_hidden_collection
from .renderer import Renderer
from .scene_cache import SceneCache
from .view import View, eye_of

FIRST_READING = 0.03  # seconds for objects in the first picture; each redraw after it has twice as many as the one before


@dataclass(frozen=True)
class Picture:
    """What a picture is of, beside the scene: `filter_size` in pixels."""

    view: View
    filter_size: float
    background: Rgba | Code


class Viewport:
    """What an engine keeps for a viewport."""

    def __init__(self) -> None:
        self._cache: SceneCache | None = None
        self._renderer: Renderer | None = None
        self._picture: Picture | None = None  # None where it has to start anew
        self._sample = 0  # the number of samples in it
        self._reading = 0.0  # seconds that the next redraw may read objects; none before the first picture
        self._settings: list[Omission] = []  # what settings ask for that is not drawn, at the last picture with all samples
        self._has_read_settings = False
        self._failed_size: tuple[int, int] | None = None  # for which the driver refused something

    def update(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what changed in the scene; a failure is reported by `engine`."""
        self._failed_size, self._has_read_settings = None, False
        try:
            seconds = math.inf
            if self._cache is None:  # else nothing may vanish
                self._cache, self._reading, seconds = SceneCache(), 0.0, FIRST_READING
            self._cache.update(depsgraph, _filter(context.space_data, depsgraph.view_layer_eval), seconds)
        except Exception as error:
            self._cache = self._renderer = None
            self._report(engine, failure_message(error))

    def draw(self, engine: bpy.types.RenderEngine, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Add a sample, draw the picture so far into the window and ask for the next redraw; a failure is reported by `engine`."""
        if self._cache is None:
            return
        scene = depsgraph.scene
        size = (0, 0)
        try:
            region, seen = context.region, context.region_data
            place, camera = seen.view_matrix.inverted_safe(), _camera(context, scene)
            window = View(
                seen.perspective_matrix.copy(),
                eye_of(place, seen.is_perspective),
                seen.is_perspective,
                region.width,
                region.height,
                lens=read_lens(camera.evaluated_get(depsgraph), place) if camera else None,
            )
            x, y, width, height = _border(context, scene, window)
            size = (width, height)
            if min(size) <= 0 or self._failed_size == size:
                return
            if self._renderer is None:
                self._renderer = Renderer(self._cache)
            if not self._cache.is_complete:
                if self._reading:
                    shown = _filter(context.space_data, depsgraph.view_layer_eval)
                    self._cache.read_rest(depsgraph, shown, self._reading)
                self._reading = 2.0 * (self._reading or FIRST_READING)
            self._cache.follow(scene)
            # Not in `update`, where Blender may have no graphics context; and Blender calls none where a script sets pixels.
            if self._renderer.refresh():
                self._picture = None
            self._draw(engine, scene, self._renderer, window.cropped(x, y, width, height), (x, y))
            is_complete = self._cache.is_complete and self._sample >= scene.true_diffuse.viewport_samples
            if is_complete and not self._has_read_settings:  # now, as nothing waits for it
                self._settings, self._has_read_settings = list(not_drawn.of_settings(depsgraph)), True
            # Both later, as Blender ignores requests during a redraw.
            if not_drawn.keep(scene, [*self._renderer.cache.warnings, *self._renderer.warnings, *self._settings]):
                bpy.app.timers.register(not_drawn.redraw_properties)
            if not is_complete:
                bpy.app.timers.register(partial(redraw, region.as_pointer()))
        except DriverError as error:  # another size may do
            self._failed_size = size
            self._report(engine, str(error))
        except Exception as error:  # nothing is drawn until the scene changes; then all is read again
            self._cache = self._renderer = None
            self._report(engine, failure_message(error))

    def _report(self, engine: bpy.types.RenderEngine, message: str) -> None:
        """Say in the viewport and in a report why nothing is drawn."""
        self._picture = None
        engine.update_stats(engine.bl_label, message)
        engine.report({"ERROR"}, message)

    def _draw(
        self, engine: bpy.types.RenderEngine, scene: bpy.types.Scene, renderer: Renderer, view: View, corner: tuple[int, int]
    ) -> None:
        """Add a sample to the picture of `view`, whose lower left corner is at `corner` of the window [pixels], and draw it."""
        picture = Picture(view, scene.render.filter_size, background(scene, renderer.cache))
        if picture != self._picture:
            renderer.begin(view, starts_coarse=scene.true_diffuse.viewport_samples > 1)
            self._picture, self._sample = picture, 0
        if self._sample < scene.true_diffuse.viewport_samples:
            renderer.add(view, self._sample, picture.filter_size, picture.background, fades_in=True)
            self._sample += 1
        renderer.show_blended(*corner)  # Blender applies the view transform
        lacks = [group.heading for group in not_drawn.grouped([*renderer.cache.warnings, *renderer.warnings])]
        said = f"{lacks[0]}; {len(lacks) - 1} more in Render properties, Not Drawn Here" if len(lacks) > 1 else "".join(lacks)
        so_far = f"Sample {self._sample}/{scene.true_diffuse.viewport_samples}"
        engine.update_stats(so_far if renderer.cache.is_complete else "Reading the scene", said)


def _filter(space: bpy.types.SpaceView3D, layer: bpy.types.ViewLayer) -> IsShown | None:
    """Return what tells whether a viewport shows an object, None where it shows all of its view `layer`."""
    types = (name for name in dir(space) if name.startswith("show_object_viewport_"))
    is_local = space.local_view is not None or space.use_local_collections
    if not is_local and all(getattr(space, name) for name in types) and not has_hidden_collection(layer):
        return None
    return lambda item: item.original.visible_in_viewport_get(space)


def redraw(region: int) -> None:
    """Draw the region at the address `region` again unless it is closed, and nothing beside it: no header, no panel."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for open_region in area.regions:
                if open_region.as_pointer() == region:
                    open_region.tag_redraw()


def _camera(context: bpy.types.Context, scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Return the camera that a viewport looks through; None where it looks through none."""
    if context.region_data.view_perspective != "CAMERA":
        return None
    space = context.space_data
    camera = space.camera if space.use_local_camera else scene.camera
    return camera if camera and camera.type == "CAMERA" else None


def _border(context: bpy.types.Context, scene: bpy.types.Scene, view: View) -> tuple[int, int, int, int]:
    """Return the left, bottom, width and height of the drawn rectangle of a viewport [pixels]; a size of 0 or less if it is empty.

    The rectangle is that of the viewport's render border or, through a camera, of the scene's border in the camera's frame.
    """
    space, settings = context.space_data, scene.render
    low, high = Vector((0.0, 0.0)), Vector((view.width, view.height))
    if context.region_data.view_perspective == "CAMERA":
        if settings.use_border and (camera := _camera(context, scene)):
            to_window = view.projection @ camera.matrix_world.normalized()
            frame = [to_window @ corner.to_4d() for corner in camera.data.view_frame(scene=scene)]
            pixels = [Vector(((clip.x / clip.w + 1.0) * view.width, (clip.y / clip.w + 1.0) * view.height)) / 2.0 for clip in frame]
            corner, size = pixels[2], pixels[0] - pixels[2]  # the bottom left corner; from there to the top right
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
