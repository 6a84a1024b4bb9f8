# SPDX-License-Identifier: GPL-3.0-or-later
"""Final renders of the realtime engine, with a window or without."""

import struct
import traceback
from collections.abc import Iterator

import bpy

import gpu
from mathutils import Matrix

from ..blender import engines
from .contents import Contents
from .drawing import Painter, Refused, Rgba, forget_shaders
from .view import View, eye_at


class Unrenderable(Exception):
    """A picture cannot be drawn; the message says why."""


def render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
    """Render the picture into Combined."""
    try:
        _render(engine, depsgraph)
    except (Unrenderable, Refused) as error:
        engine.report({"ERROR"}, str(error))
    except (Exception, KeyboardInterrupt) as error:  # Blender crashes where it gets neither a picture nor a report
        engine.report({"ERROR"}, failed(error))


def _render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
    _find_driver()
    scene = depsgraph.scene
    layer = depsgraph.view_layer.name
    full, x, y, width, height = frame(scene)
    views = [(name, _camera(engine, depsgraph, *full).part(x, y, width, height)) for name in _views(engine, layer)]
    contents = Contents()
    engine.update_stats("", "Reading the scene")
    contents.update(depsgraph)
    painter = Painter(contents)
    painter.refresh()
    for note in (*contents.notes, *painter.notes):
        engine.report({"WARNING"}, note)
    for step in painter.compile():
        engine.update_stats("", step)
    samples = scene.true_diffuse.samples
    for k, (name, view) in enumerate(views):
        painter.begin(view)
        for sample in range(samples):
            if engine.test_break():
                return
            engine.update_stats("", f"Sample {sample + 1} of {samples}")
            painter.add(view, sample, scene.render.filter_size, background(scene, contents))
            engine.update_progress((k * samples + sample + 1) / (len(views) * samples))
        pixels = painter.read()
        result = engine.begin_result(0, 0, width, height, layer=layer, view=name)
        result.layers[0].passes["Combined"].rect.foreach_set(pixels)
        engine.end_result(result)


def _views(engine: bpy.types.RenderEngine, layer: str) -> Iterator[str]:
    """Yield the names of the views of a stereoscopic picture, each made the active one; one without a name of any other."""
    result = engine.begin_result(0, 0, 1, 1, layer=layer)
    names = [view.name for view in result.views]
    engine.end_result(result, cancel=True)
    for name in names or [""]:
        engine.active_view_set(name)
        yield name


def _camera(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph, width: int, height: int) -> View:
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
    place = engine.camera_model_matrix(camera)
    fits_width = camera.data.sensor_fit == "HORIZONTAL" or (
        camera.data.sensor_fit == "AUTO" and width * settings.pixel_aspect_x >= height * settings.pixel_aspect_y
    )
    # by what the active view's frame is shifted beside the camera's own, in the frame's longer side or that which fits
    shift = engine.camera_shift_x(camera) - camera.data.shift_x
    side = width if fits_width else height * settings.pixel_aspect_y / settings.pixel_aspect_x
    projection = Matrix.Translation((-2.0 * shift * side / width, 0.0, 0.0)) @ projection
    is_perspective = camera.data.type == "PERSP"
    return View(projection @ place.inverted_safe(), eye_at(place, is_perspective), is_perspective, width, height)


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


def failed(error: BaseException) -> str:
    """Return what is said of a fault that was not foreseen; what the driver has may be of a context that is lost."""
    traceback.print_exception(error)
    forget_shaders()
    return f"True Diffuse Realtime failed: {str(error) or type(error).__name__}"


def background(scene: bpy.types.Scene, contents: Contents) -> Rgba:
    """Return what is behind all surfaces, its color times its alpha."""
    if scene.render.film_transparent:
        return 0.0, 0.0, 0.0, 0.0
    return *contents.world, 1.0
