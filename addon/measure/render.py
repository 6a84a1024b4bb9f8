# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurement renders: one object under given lights, without fill light and bounces, every sample at the pixel's center."""

import math
import tempfile
import time
from array import array
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from types import ModuleType

import bpy

from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector as BlenderVector

from ..blender import engines
from . import probes
from .error import Coverage, GBuffer, Light

CENTER = 0.01  # pixels, the narrowest filter that Cycles has
# With an edge nearer than EDGE [pixels] to a pixel's center the engines may see different surfaces. Around the center of a
# measurable pixel the mean normal is at least MIN_NORMAL long (normals within 5 degrees), the mean albedo within MAX_ALBEDO_CHANGE
# of that at the center, and the mean alpha at least MIN_ALPHA.
# What is no diffuse reflection may take MAX_NOT_DIFFUSE of a measurable pixel, and emit MAX_EMISSION [W/(m^2 sr)].
EDGE, EDGE_SAMPLES, MIN_NORMAL, MAX_ALBEDO_CHANGE, MIN_ALPHA = 0.1, 24, 0.999, 0.01, 0.999
MAX_NOT_DIFFUSE, MAX_EMISSION = 1e-3, 1e-5
MARGIN = 2  # pixels around the object's bounding box, against rounding


@dataclass(frozen=True)
class Region:
    """A rectangle of the frame in pixels; `x`, `y` its corner at the bottom left."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True)
class ProbedGBuffer:
    """A `surface`, its `coverage`, and the weight k_s and exponent n of each pixel's highlight: three floats, the last 0."""

    surface: GBuffer
    coverage: Coverage
    highlight: array[float]


def region_of(scene: bpy.types.Scene, subject: bpy.types.Object) -> Region:
    """Return the region of `scene`'s frame that contains `subject` and the objects below it, as its camera sees them."""
    width, height = scene.render.resolution_x, scene.render.resolution_y
    corners = [
        world_to_camera_view(scene, scene.camera, item.matrix_world @ BlenderVector(corner))
        for item in with_children(subject)
        if item.type != "EMPTY"
        for corner in item.bound_box
    ]

    def span(values: list[float], size: int) -> tuple[int, int]:
        low = max(0, math.floor(min(values) * size) - MARGIN)
        high = min(size, math.ceil(max(values) * size) + MARGIN)
        return (low, max(low + 1, high)) if low < size else (size - 1, size)

    left, right = span([corner.x for corner in corners], width)
    bottom, top = span([corner.y for corner in corners], height)
    return Region(left, bottom, right - left, top - bottom)


def with_children(subject: bpy.types.Object) -> list[bpy.types.Object]:
    """Return `subject` and the objects below it."""
    return [subject, *subject.children_recursive]


def crop(scene: bpy.types.Scene, region: Region) -> None:
    """Restrict the renders of `scene` to `region`."""
    settings = scene.render
    settings.use_border = settings.use_crop_to_border = True
    # Blender stores the border as fractions of the frame in 32-bit floats and rounds down to pixels: aim past the pixel's edge.
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
    source: bpy.types.Scene, subject: bpy.types.Object, *lights: bpy.types.Object, shadows: bool = False
) -> Generator[bpy.types.Scene]:
    """Yield a scene with `source`'s camera, `subject` with the objects below it and copies of `lights`, suns of angle 0.

    `source` stays unchanged.
    """
    scene = bpy.data.scenes.new("True Diffuse Measurement")
    copies = [bpy.data.objects.new("Measurement Light", light.data.copy()) for light in lights]
    for copy, light in zip(copies, lights, strict=True):
        copy.data.use_shadow = shadows
        if copy.data.type == "SUN":
            copy.data.angle = 0.0
        copy.matrix_world = light.matrix_world
    for item in (*with_children(subject), source.camera, *copies):
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
    engines.leave_out_bounces(scene)
    scene.cycles.light_sampling_threshold = 0.0  # else dim lights are skipped at random
    scene.eevee.use_shadows = shadows
    scene.eevee.use_raytracing = False
    try:
        yield scene
    finally:
        for copy in copies:
            data = copy.data
            bpy.data.objects.remove(copy)
            bpy.data.lights.remove(data)
        bpy.data.scenes.remove(scene)


@contextmanager
def temporary_data() -> Generator[None]:
    """Remove all data-blocks created in the context at its end."""
    before = set(bpy.data.user_map())
    try:
        yield
    finally:
        kept = {image for image in bpy.data.images if image.type == "RENDER_RESULT"}  # where Blender keeps renders
        bpy.data.batch_remove(set(bpy.data.user_map()) - before - kept)


def openimageio() -> ModuleType:
    """Return Blender's own OpenImageIO. Raises ImportError where Blender was built without it, as some Linux packages are."""
    bpy.utils.expose_bundled_modules()
    import OpenImageIO as oiio

    return oiio


def read_exr(path: Path) -> dict[str, array[float]]:
    """Return the channels of all parts of an OpenEXR file by name, rows from the top. Raises OSError where that fails."""
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


def interleaved(channels: dict[str, array[float]], name: str = "Combined", components: str = "RGB") -> array[float]:
    """Return a pass of a render's channels, one value for each of its `components` a pixel; by default the linear RGB."""
    planes = [next(values for key, values in channels.items() if key.endswith(f"{name}.{c}")) for c in components]
    result = array("f", bytes(4 * len(components) * len(planes[0])))
    for offset, plane in enumerate(planes):
        result[offset :: len(components)] = plane
    return result


def render(scene: bpy.types.Scene, **options: bool) -> None:
    """Render `scene`; raises RuntimeError where the render was cancelled."""
    if bpy.ops.render.render(scene=scene.name, **options) != {"FINISHED"}:
        raise RuntimeError("the render was cancelled")


def passes(scene: bpy.types.Scene) -> dict[str, array[float]]:
    """Return the passes of a render of `scene` by the names of their channels, rows from the top."""
    return _render(scene)[1]


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


def g_buffer(scene: bpy.types.Scene, plain: bpy.types.Material) -> GBuffer:
    """Return normal, position and albedo in every pixel of a measurement scene, which cannot be used afterwards.

    Cycles renders them in 32-bit floats at the pixel centers, where all engines are measured. `plain` is a Diffuse material with
    the subject's albedo: Cycles' Normal pass is the mean of the closures' normals, and lobes have bent ones.
    """
    layer = scene.view_layers[0]
    layer.use_pass_normal = layer.use_pass_position = layer.use_pass_diffuse_color = True
    layer.material_override = plain
    engines.use(scene, engines.CYCLES, EDGE_SAMPLES)
    scene.cycles.filter_width = EDGE
    _, around = _render(scene)
    mean_normal, mean_albedo = interleaved(around, "Normal", "XYZ"), interleaved(around, "Diffuse Color", "RGB")
    engines.use(scene, engines.CYCLES, 1)
    scene.cycles.filter_width = CENTER
    _, center = _render(scene)
    albedo = interleaved(center, "Diffuse Color", "RGB")
    measurable = bytearray(len(albedo) // 3)
    for pixel, alpha in enumerate(interleaved(around, "Combined", "A")):
        rgb = slice(3 * pixel, 3 * pixel + 3)
        measurable[pixel] = (
            alpha >= MIN_ALPHA
            and math.hypot(*mean_normal[rgb]) >= MIN_NORMAL
            and math.dist(mean_albedo[rgb], albedo[rgb]) <= MAX_ALBEDO_CHANGE
        )
    return GBuffer(interleaved(center, "Normal", "XYZ"), interleaved(center, "Position", "XYZ"), albedo, measurable)


def probed_g_buffer(scene: bpy.types.Scene, show: Callable[[str], None], has_highlight: bool) -> ProbedGBuffer:
    """Return what `g_buffer` does of a subject with materials of its own, which `show` replaces by those that emit a channel.

    Measurable are pixels of one surface that reflects diffusely alone: no metal, opaque, without light of its own.
    """
    layer = scene.view_layers[0]
    layer.use_pass_position = True
    around, center = {}, {}
    for channel in (
        probes.ALBEDO,
        probes.NORMAL,
        probes.FACE_NORMAL,
        probes.DIFFUSE,
        *((probes.HIGHLIGHT,) if has_highlight else ()),
    ):
        show(channel)
        engines.use(scene, engines.CYCLES, EDGE_SAMPLES)
        scene.cycles.filter_width = EDGE
        _, around[channel] = _render(scene)
        engines.use(scene, engines.CYCLES, 1)
        scene.cycles.filter_width = CENTER
        _, center[channel] = _render(scene)
    mean_normal, mean_albedo = probes.decoded(interleaved(around[probes.NORMAL])), interleaved(around[probes.ALBEDO])
    albedo, fractions = interleaved(center[probes.ALBEDO]), interleaved(around[probes.DIFFUSE])
    measurable = bytearray(len(albedo) // 3)
    visible = diffuse = 0
    for pixel, alpha in enumerate(interleaved(around[probes.ALBEDO], "Combined", "A")):
        rgb = slice(3 * pixel, 3 * pixel + 3)
        fraction, emission, _ = fractions[rgb]
        is_diffuse = abs(fraction - 1.0) <= MAX_NOT_DIFFUSE and abs(emission) <= MAX_EMISSION
        visible += alpha >= 0.5
        diffuse += alpha >= 0.5 and is_diffuse
        measurable[pixel] = (
            is_diffuse
            and alpha >= MIN_ALPHA
            and math.hypot(*mean_normal[rgb]) >= MIN_NORMAL
            and math.dist(mean_albedo[rgb], albedo[rgb]) <= MAX_ALBEDO_CHANGE
        )
    surface = GBuffer(
        probes.decoded(interleaved(center[probes.NORMAL])),
        interleaved(center[probes.ALBEDO], "Position", "XYZ"),
        albedo,
        measurable,
        probes.decoded(interleaved(center[probes.FACE_NORMAL])),
    )
    highlight = interleaved(center[probes.HIGHLIGHT]) if has_highlight else array("f")
    return ProbedGBuffer(surface, Coverage(visible, diffuse), highlight)


def probed_inputs(scene: bpy.types.Scene, engine: engines.Engine, show: Callable[[str], None]) -> tuple[array[float], array[float]]:
    """Return albedo and normal of a subject with materials of its own, as `engine` has them; `show` as in `probed_g_buffer`."""
    show(probes.ALBEDO)
    _, albedo = radiance(scene, engine, 1)
    show(probes.NORMAL)
    _, normal = radiance(scene, engine, 1)
    return albedo, probes.decoded(normal)


def radiance(scene: bpy.types.Scene, engine: engines.Engine, samples: int, seed: int = 0) -> tuple[float, array[float]]:
    """Return the seconds that a render of a measurement scene takes, and its linear RGB radiance [W/(m^2 sr)].

    `seed`, 0 or more, changes the noise. EEVEE's depends on a pixel's position in the picture, so `seed` pixels are added at the
    left and removed again. Raises ValueError where EEVEE's frame has no room for them.
    """
    engines.use(scene, engine, samples, seed)
    region, added = cropped(scene), seed if engine is engines.EEVEE else 0
    if added > region.x:
        raise ValueError(f"a seed of {seed} needs {seed} pixels of the frame left of the region, not {region.x}")
    if added:
        crop(scene, replace(region, x=region.x - added, width=region.width + added))
    seconds, channels = _render(scene)
    rgb = interleaved(channels)
    if added:
        crop(scene, region)
        stride = 3 * (region.width + added)
        rgb = array("f", chain.from_iterable(rgb[row + 3 * added : row + stride] for row in range(0, len(rgb), stride)))
    return seconds, rgb


def mean_albedo(scene: bpy.types.Scene, engine: engines.Engine, samples: int) -> array[float]:
    """Return the red albedo in every pixel of a scene's picture, rows from the top, with the engine's pixel filter."""
    engines.use(scene, engine, samples)
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = True
    _, channels = _render(scene)
    layer.use_pass_diffuse_color = False
    return interleaved(channels, "Diffuse Color", "R")


def light_of(sun: bpy.types.Object) -> Light:
    """Return the direction and irradiance of a white sun light, whose Strength is its irradiance [W/m^2]."""
    towards = sun.matrix_world.to_3x3() @ BlenderVector((0.0, 0.0, 1.0))
    return Light(tuple(towards.normalized()), sun.data.energy)
