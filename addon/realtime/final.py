# SPDX-License-Identifier: GPL-3.0-or-later
"""Final renders of the realtime engine, with or without a window."""

import struct
import traceback
from collections.abc import Iterator

import bpy

import gpu
from mathutils import Matrix

from ..blender import engines
from . import not_drawn
from .driver import DriverError, Rgba, forget_shaders
from .expressions import Code
from .lens import read_lens
from .passes import asked
from .renderer import Renderer
from .scene_cache import SceneCache
from .shutter import open_shutter
from .view import View, distances_of, eye_of

DEPTH = "Depth"  # Blender's name of the pass


class RenderError(Exception):
    """A picture cannot be rendered; the message says why."""


def render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
    """Render the picture into the pass Combined; any failure becomes a report of `engine`."""
    try:
        _render(engine, depsgraph)
    except (RenderError, DriverError) as error:
        engine.report({"ERROR"}, str(error))
    except (Exception, KeyboardInterrupt) as error:  # Blender crashes where it gets neither a picture nor a report
        engine.report({"ERROR"}, failure_message(error))


def picture_frame(scene: bpy.types.Scene) -> tuple[tuple[int, int], int, int, int, int]:
    """Return the size of the whole picture, and the left, bottom, width and height of its rendered rectangle, in pixels."""
    settings = scene.render
    width, height = (size * settings.resolution_percentage // 100 for size in (settings.resolution_x, settings.resolution_y))
    if not settings.use_border:
        return (width, height), 0, 0, width, height
    x, y = _pixels(settings.border_min_x * width), _pixels(settings.border_min_y * height)
    right, top = _pixels(settings.border_max_x * width), _pixels(settings.border_max_y * height)
    return (width, height), x, y, max(1, right - x), max(1, top - y)


def background(scene: bpy.types.Scene, cache: SceneCache) -> Rgba | Code:
    """Return what is behind all surfaces: its radiance times its alpha, and its alpha; or GLSL of the world's radiance."""
    if scene.render.film_transparent:
        return 0.0, 0.0, 0.0, 0.0
    camera = cache.environment.camera
    return camera if isinstance(camera, Code) else (*camera, 1.0)


def failure_message(error: BaseException) -> str:
    """Return the report of an unforeseen error, whose traceback is printed. Shaders are freed, as their context may be lost."""
    traceback.print_exception(error)
    forget_shaders()
    return f"True Diffuse Realtime failed: {str(error) or type(error).__name__}"


def _render(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
    """Render every view. Raises RenderError or DriverError."""
    if not engine.bl_use_gpu_context:  # see TrueDiffuseRealtime.update
        raise RenderError("No graphics driver is found here")
    scene = depsgraph.scene
    layer = depsgraph.view_layer.name
    size, x, y, width, height = picture_frame(scene)
    views = [(name, _camera_view(engine, depsgraph, *size).cropped(x, y, width, height)) for name in _view_names(engine, layer)]
    cache = SceneCache()
    engine.update_stats("", "Reading the scene")
    cache.update(depsgraph)
    cache.follow(scene)
    renderer = Renderer(cache)
    renderer.refresh()
    warnings = [*cache.warnings, *renderer.warnings]
    settings = list(not_drawn.of_settings(depsgraph))
    if not_drawn.keep(scene, [*warnings, *settings]):
        not_drawn.redraw_properties()
    for group in not_drawn.grouped(settings):
        engine.report({"INFO"}, str(group))
    for warning in warnings:
        engine.report({"WARNING"}, str(warning))
    for message in renderer.compile():
        engine.update_stats("", message)
    samples = depsgraph.view_layer.samples or scene.true_diffuse.samples
    has_strokes = any(item.type == "GREASEPENCIL" for item in depsgraph.objects)  # which Blender draws by the depth of surfaces
    has_depth = depsgraph.view_layer.use_pass_z or has_strokes
    if has_depth:
        engine.add_pass(DEPTH, 1, "Z", layer=layer)
    for data in asked(depsgraph.view_layer):
        engine.add_pass(data.name, len(data.channels), data.channels, layer=layer)
    with open_shutter(engine, scene, samples) as go_to_sample:
        for index, (name, view) in enumerate(views):
            engine.active_view_set(name)
            renderer.begin(view)
            data_passes = renderer.data_passes(depsgraph, view)
            for sample in range(samples):
                if engine.test_break():
                    return
                engine.update_stats("", f"Sample {sample + 1} of {samples}")
                if go_to_sample(sample):
                    cache.update(depsgraph)
                    view = _camera_view(engine, depsgraph, *size).cropped(x, y, width, height)
                    renderer.move(view, sample)
                renderer.add(view, sample, scene.render.filter_size, background(scene, cache))
                data_passes.add(view.at_sample(sample, scene.render.filter_size), sample)
                if not sample and has_depth:  # of the pixels' centers
                    distances = renderer.read_distances(view)
                engine.update_progress((index * samples + sample + 1) / (len(views) * samples))
            pixels = renderer.read()
            result = engine.begin_result(0, 0, width, height, layer=layer, view=name)
            passes = result.layers[0].passes
            passes["Combined"].rect.foreach_set(pixels)
            if has_depth:
                passes[DEPTH].rect.foreach_set(distances)
            for data, values in data_passes.read():
                passes[data.name].rect.foreach_set(values)
            engine.end_result(result)


def _view_names(engine: bpy.types.RenderEngine, layer: str) -> Iterator[str]:
    """Yield the names of a stereoscopic picture's views, each made the active one; an empty name for any other picture."""
    result = engine.begin_result(0, 0, 1, 1, layer=layer)
    names = [view.name for view in result.views]
    engine.end_result(result, cancel=True)
    for name in names or [""]:
        engine.active_view_set(name)
        yield name


def _camera_view(engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph, width: int, height: int) -> View:
    """Return the scene camera's view of the active stereoscopic view. Raises RenderError without a camera that can be drawn."""
    scene = depsgraph.scene
    if scene.camera is None:
        raise RenderError("The scene has no camera")
    camera = scene.camera.evaluated_get(depsgraph)
    if camera.type != "CAMERA" or camera.data.type not in {"PERSP", "ORTHO"}:
        raise RenderError(f"{camera.name} is neither a perspective nor an orthographic camera")
    settings = scene.render
    projection = camera.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=settings.pixel_aspect_x, scale_y=settings.pixel_aspect_y
    )
    matrix = engine.camera_model_matrix(camera)
    fits_width = camera.data.sensor_fit == "HORIZONTAL" or (
        camera.data.sensor_fit == "AUTO" and width * settings.pixel_aspect_x >= height * settings.pixel_aspect_y
    )
    # The shift of the active view's frame beyond the camera's own is a fraction of the side that the sensor fits.
    shift = engine.camera_shift_x(camera) - camera.data.shift_x
    side = width if fits_width else height * settings.pixel_aspect_y / settings.pixel_aspect_x
    projection = Matrix.Translation((-2.0 * shift * side / width, 0.0, 0.0)) @ projection
    is_perspective = camera.data.type == "PERSP"
    eye, distances = eye_of(matrix, is_perspective), distances_of(projection, is_perspective)
    return View(projection @ matrix.inverted_safe(), eye, is_perspective, width, height, distances, read_lens(camera, matrix))


def _pixels(length: float) -> int:
    """Return whole pixels rounded down as Blender does, which multiplies in 32 bits: 0.7 of 10 are 7."""
    return int(struct.unpack("f", struct.pack("f", length))[0])


def has_driver() -> bool:
    """Return whether Blender finds a graphics driver; where it has drawn nothing yet, another process tries."""
    try:
        gpu.platform.renderer_get()
    except SystemError:
        return engines.eevee_runs_here()
    return True
