# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurement renders: one object under chosen lamps, without fill and bounces, every sample at the pixel's center."""

import math
import tempfile
import time
from array import array
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from types import ModuleType

import bpy

from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector as BlenderVector

from ..blender import engines
from .error import Light, Surface

CENTER = 0.01  # pixels, the narrowest filter that Cycles has
# An edge this near a pixel's center [pixels] may fall to either side of it: there the engines may see different surfaces. It shows
# in a mean normal shorter than ONE_NORMAL (surfaces apart by over 5 degrees), a mean albedo other than the center's by ONE_PAINT,
# or less than full alpha.
EDGE, EDGE_SAMPLES, ONE_NORMAL, ONE_PAINT, COVERED = 0.1, 24, 0.999, 0.01, 0.999
MARGIN = 2  # pixels around the object's outline, so that none is lost to rounding


@dataclass(frozen=True)
class Region:
    """A rectangle of the frame in pixels; `x`, `y` its corner at the bottom left."""

    x: int
    y: int
    width: int
    height: int


def region_of(scene: bpy.types.Scene, subject: bpy.types.Object) -> Region:
    """Return the part of `scene`'s frame that holds `subject`, as its camera sees it."""
    width, height = scene.render.resolution_x, scene.render.resolution_y
    corners = [
        world_to_camera_view(scene, scene.camera, subject.matrix_world @ BlenderVector(corner)) for corner in subject.bound_box
    ]

    def span(values: list[float], size: int) -> tuple[int, int]:
        low = max(0, math.floor(min(values) * size) - MARGIN)
        high = min(size, math.ceil(max(values) * size) + MARGIN)
        return (low, max(low + 1, high)) if low < size else (size - 1, size)

    left, right = span([corner.x for corner in corners], width)
    bottom, top = span([corner.y for corner in corners], height)
    return Region(left, bottom, right - left, top - bottom)


def crop(scene: bpy.types.Scene, region: Region) -> None:
    """Make `scene` render `region` of its frame alone."""
    settings = scene.render
    settings.use_border = settings.use_crop_to_border = True
    # Blender keeps the border as shares of the frame in 32-bit floats and cuts them down to pixels: aim past the pixel's edge.
    left, bottom = region.x + 0.25, region.y + 0.25
    settings.border_min_x, settings.border_max_x = left / settings.resolution_x, (left + region.width) / settings.resolution_x
    settings.border_min_y, settings.border_max_y = bottom / settings.resolution_y, (bottom + region.height) / settings.resolution_y


def cropped(scene: bpy.types.Scene) -> Region:
    """Return the region of its frame that `scene` renders."""
    settings = scene.render
    width, height = settings.resolution_x, settings.resolution_y
    if not settings.use_border:
        return Region(0, 0, width, height)
    x, y = math.floor(settings.border_min_x * width), math.floor(settings.border_min_y * height)
    return Region(x, y, math.floor(settings.border_max_x * width) - x, math.floor(settings.border_max_y * height) - y)


@contextmanager
def measurement_scene(
    source: bpy.types.Scene, subject: bpy.types.Object, *lamps: bpy.types.Object, shadows: bool = False
) -> Generator[bpy.types.Scene]:
    """Yield a scene with `source`'s camera, `subject` and copies of `lamps` alone, suns as points; `source` stays as it is."""
    scene = bpy.data.scenes.new("True Diffuse Measurement")
    copies = [bpy.data.objects.new("Measurement Lamp", lamp.data.copy()) for lamp in lamps]
    for copy, lamp in zip(copies, lamps, strict=True):
        copy.data.use_shadow = shadows
        if copy.data.type == "SUN":
            copy.data.angle = 0.0
        copy.matrix_world = lamp.matrix_world
    for item in (subject, source.camera, *copies):
        scene.collection.objects.link(item)
    scene.camera = source.camera
    settings = scene.render
    settings.resolution_x, settings.resolution_y = source.render.resolution_x, source.render.resolution_y
    settings.resolution_percentage = 100
    crop(scene, region_of(scene, subject))
    settings.film_transparent = True
    settings.filter_size = 0.0
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"  # the width of BOX cannot be set
    scene.cycles.filter_width = CENTER
    scene.cycles.shading_system = source.cycles.shading_system
    scene.cycles.max_bounces = 0
    scene.cycles.light_sampling_threshold = 0.0  # else dim light is dropped at random
    scene.eevee.use_shadows = shadows
    scene.eevee.use_raytracing = False
    try:
        yield scene
    finally:
        for copy in copies:
            light = copy.data
            bpy.data.objects.remove(copy)
            bpy.data.lights.remove(light)
        bpy.data.scenes.remove(scene)


def openimageio() -> ModuleType:
    """Return Blender's own OpenImageIO. Raises ImportError where Blender was built without it, as some Linux packages are."""
    bpy.utils.expose_bundled_modules()
    import OpenImageIO as oiio

    return oiio


def read_exr(path: Path) -> dict[str, array[float]]:
    """Return the channels of all parts of an OpenEXR file by name, rows from the top. Raises OSError where it cannot be read."""
    oiio = openimageio()
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise OSError(f"cannot read {path}: {oiio.geterror()}")
    channels = {}
    part = 0
    while file.seek_subimage(part, 0):
        for index, name in enumerate(file.spec(part).channelnames):
            values = array("f")
            values.frombytes(file.read_image(part, 0, index, index + 1, "float").tobytes())
            channels[name] = values
        part += 1
    file.close()
    return channels


def _interleave(channels: dict[str, array[float]], name: str, components: str) -> array[float]:
    planes = [next(values for key, values in channels.items() if key.endswith(f"{name}.{c}")) for c in components]
    result = array("f", bytes(4 * len(components) * len(planes[0])))
    for offset, plane in enumerate(planes):
        result[offset :: len(components)] = plane
    return result


def interleaved(channels: dict[str, array[float]]) -> array[float]:
    """Return the linear RGB of a picture's channels, three values a pixel."""
    return _interleave(channels, "Combined", "RGB")


def render(scene: bpy.types.Scene, **options: bool) -> None:
    """Render `scene`; raises RuntimeError where the render was cancelled."""
    if bpy.ops.render.render(scene=scene.name, **options) != {"FINISHED"}:
        raise RuntimeError("the render was cancelled")


def _render(scene: bpy.types.Scene) -> tuple[float, dict[str, array[float]]]:
    with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
        path = Path(folder) / "measurement.exr"
        scene.render.filepath = str(path)
        image = scene.render.image_settings
        image.media_type, image.file_format, image.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
        start = time.perf_counter()
        render(scene, write_still=True)
        seconds = time.perf_counter() - start
        return seconds, read_exr(path)


def surface(scene: bpy.types.Scene, plain: bpy.types.Material) -> Surface:
    """Return normal, position and albedo of every pixel of a measurement scene, which is of no other use afterwards.

    Cycles renders them, in 32-bit floats, at the same pixel centers that either engine is measured at. `plain` is a Diffuse
    material with the subject's albedo: Cycles' Normal pass is the mean of the closures' normals, so bent ones would show in it.
    """
    layer = scene.view_layers[0]
    layer.use_pass_normal = layer.use_pass_position = layer.use_pass_diffuse_color = True
    layer.material_override = plain
    engines.use(scene, engines.CYCLES, EDGE_SAMPLES)
    scene.cycles.filter_width = EDGE
    _, around = _render(scene)
    mean_normal, mean_albedo = _interleave(around, "Normal", "XYZ"), _interleave(around, "Diffuse Color", "RGB")
    engines.use(scene, engines.CYCLES, 1)
    scene.cycles.filter_width = CENTER
    _, center = _render(scene)
    albedo = _interleave(center, "Diffuse Color", "RGB")
    measurable = bytearray(len(albedo) // 3)
    for pixel, covered in enumerate(_interleave(around, "Combined", "A")):
        rgb = slice(3 * pixel, 3 * pixel + 3)
        measurable[pixel] = (
            covered >= COVERED
            and math.hypot(*mean_normal[rgb]) >= ONE_NORMAL
            and math.dist(mean_albedo[rgb], albedo[rgb]) <= ONE_PAINT
        )
    return Surface(_interleave(center, "Normal", "XYZ"), _interleave(center, "Position", "XYZ"), albedo, measurable)


def radiance(scene: bpy.types.Scene, engine: engines.Engine, samples: int, seed: int = 0) -> tuple[float, array[float]]:
    """Return the seconds that the render of a measurement scene took, and its linear RGB radiance [W/(m^2 sr)].

    `seed`, 0 or more, gives the noise another pattern. EEVEE's goes by a pixel's place in the picture, so the picture gets so many
    pixels more at the left, which are cut off again. Raises ValueError where EEVEE's frame has no room for them.
    """
    engines.use(scene, engine, samples, seed)
    region, more = cropped(scene), seed if engine is engines.EEVEE else 0
    if more > region.x:
        raise ValueError(f"a seed of {seed} needs as many pixels of the frame left of what is rendered, not {region.x}")
    if more:
        crop(scene, replace(region, x=region.x - more, width=region.width + more))
    seconds, channels = _render(scene)
    rgb = interleaved(channels)
    if more:
        crop(scene, region)
        wide = 3 * (region.width + more)
        rgb = array("f", chain.from_iterable(rgb[row + 3 * more : row + wide] for row in range(0, len(rgb), wide)))
    return seconds, rgb


def mean_albedo(scene: bpy.types.Scene, samples: int) -> array[float]:
    """Return the red albedo of every pixel of any scene's picture, rows from the top, as the pixel filter mixes it by Cycles."""
    engines.use(scene, engines.CYCLES, samples)
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = True
    _, channels = _render(scene)
    layer.use_pass_diffuse_color = False
    return _interleave(channels, "Diffuse Color", "R")


def light_of(sun: bpy.types.Object) -> Light:
    """Return the direction and irradiance of a white sun lamp; its Strength is the irradiance [W/m^2]."""
    towards = sun.matrix_world.to_3x3() @ BlenderVector((0.0, 0.0, 1.0))
    return Light(tuple(towards.normalized()), sun.data.energy)
