# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures for people: renders with captions, errors as a heat map with its scale, and several side by side; a scene as a file.

Text is drawn by Blender's `blf`.
"""

import math
import re
import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import bpy

import blf
import imbuf
from bpy_extras.object_utils import world_to_camera_view
from imbuf.types import ImBuf

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Progress

PICTURE_WORK = 12.0  # roughly its time over that of measuring one character
INTER = 0  # blf's default font, Blender's bundled Inter
TEXT_SIZE = 0.021  # over the picture's width
STRIP_HEIGHT = 2.6  # over the text size
BACKGROUND = bytes((24, 24, 26, 255))
TEXT_COLOR = (0.93, 0.93, 0.93, 1.0)
NOT_MEASURED = (58, 58, 62)
SCALE_KNEE = 0.003  # errors below it are near white
SCALE_MARKS = (-1.0, -0.1, -0.01, 0.0, 0.01, 0.1, 1.0)
# Blue - white - red, equally light on both sides (after C. Brewer's RdBu), from -1 over 0 to +1.
DIVERGING = ((5, 48, 97), (67, 147, 195), (247, 247, 247), (214, 96, 77), (103, 0, 31))


@dataclass(frozen=True)
class Captions:
    """The text below a picture: labels, and the x [pixels] that each is centered on."""

    labels: list[str]
    centers: list[float]


@contextmanager
def _reported(progress: Progress) -> Generator[None]:
    """Report to `progress` the samples that Blender has rendered of a picture."""

    def report(text: str, _: object = None) -> None:
        found = re.search(r"(\d+) ?/ ?(\d+)", text.rpartition("|")[2])
        if found and int(found[2]):
            progress.within(PICTURE_WORK * int(found[1]) / int(found[2]))

    bpy.app.handlers.render_stats.append(report)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(report)


def render_picture(
    scene: bpy.types.Scene,
    engine: Engine,
    samples: int,
    target: Path,
    captions: Captions,
    progress: Progress,
    denoise: bool = False,
) -> float:
    """Render `scene`, write TARGET_ENGINE.exr (linear) and TARGET_ENGINE.png (with captions), return the seconds of rendering.

    With `denoise`, Cycles uses OpenImageDenoise.
    """
    engines.use(scene, engine, samples)
    scene.cycles.use_denoising = denoise
    start = time.perf_counter()
    with progress.step(f"Rendering  {engine.label}", PICTURE_WORK), _reported(progress):
        render.render(scene)
    seconds = time.perf_counter() - start
    result = bpy.data.images["Render Result"]
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    result.save_render(str(target.with_name(f"{target.name}_{engine.key}.exr")), scene=scene)
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
    plain = target.with_name(f"plain_{engine.key}.png")
    result.save_render(str(plain), scene=scene)
    caption(plain, target.with_name(f"{target.name}_{engine.key}.png"), captions.labels, captions.centers)
    plain.unlink()
    return seconds


def captions(scene: bpy.types.Scene, subjects: Mapping[str, bpy.types.Object]) -> Captions:
    """Return captions for `subjects`, by label, centered on their origins."""
    places = [world_to_camera_view(scene, scene.camera, subject.matrix_world.translation) for subject in subjects.values()]
    return Captions(list(subjects), [place.x * scene.render.resolution_x for place in places])


def save_blend(kept: bpy.types.Scene, path: Path) -> None:
    """Write the scene `kept` as a file to open in Blender, without the empty scene that Blender started with."""
    for scene in list(bpy.data.scenes):
        if scene is not kept:
            bpy.data.scenes.remove(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)


def diverging_color(value: float) -> tuple[int, int, int]:
    """Return the 8-bit sRGB color for `value`, clamped to [-1, 1]: blue is too dark, red too bright, white right."""
    place = (max(-1.0, min(1.0, value)) + 1.0) / 2.0 * (len(DIVERGING) - 1)
    index = min(int(place), len(DIVERGING) - 2)
    low, high = DIVERGING[index], DIVERGING[index + 1]
    red, green, blue = (round(a + (b - a) * (place - index)) for a, b in zip(low, high, strict=True))
    return red, green, blue


def _canvas(width: int, height: int) -> ImBuf:
    image = imbuf.new((width, height))
    with image.with_buffer(write=True) as pixels:
        pixels.cast("B")[:] = BACKGROUND * (width * height)
    return image


def _write_row(image: ImBuf, texts: Sequence[str], centers: Sequence[float], baseline: float, size: float) -> None:
    """Draw `texts` centered on the x `centers` [pixels] on one line, at most `size` high and small enough not to overlap."""
    blf.size(INTER, size)
    widths = [blf.dimensions(INTER, text)[0] for text in texts]
    limits = [0.0, *((a + b) / 2.0 for a, b in pairwise(centers)), float(image.size[0])]
    room = [2.0 * min(c - low, high - c) for c, (low, high) in zip(centers, pairwise(limits), strict=True)]
    shrink = min(1.0, *(0.86 * r / w for r, w in zip(room, widths, strict=True) if w > 0.0))
    blf.size(INTER, size * shrink)
    blf.color(INTER, *TEXT_COLOR)
    with blf.bind_imbuf(INTER, image):
        for text, center, width in zip(texts, centers, widths, strict=True):
            blf.position(INTER, center - shrink * width / 2.0, baseline, 0.0)
            blf.draw_buffer(INTER, text)


def caption(source: Path, target: Path, captions: Sequence[str], centers: Sequence[float]) -> None:
    """Write the picture `source` to `target` with a strip of `captions` below it, centered on the x `centers` [pixels]."""
    picture = imbuf.load(str(source))
    width, height = picture.size
    size = TEXT_SIZE * width
    strip = round(STRIP_HEIGHT * size)
    image = _canvas(width, height + strip)
    with picture.with_buffer() as old, image.with_buffer(write=True) as new:
        new.cast("B")[4 * width * strip :] = old.cast("B")
    _write_row(image, captions, centers, 0.9 * size, size)
    image.compress = 90
    imbuf.write(image, filepath=str(target))


def scale_place(value: float) -> float:
    """Return where the fraction `value` lies on the heat map's scale, in [-1, 1]: linear below SCALE_KNEE, then logarithmic."""
    place = math.log1p(abs(value) / SCALE_KNEE) / math.log1p(1.0 / SCALE_KNEE)
    return math.copysign(min(1.0, place), value)


def heat_map(
    target: Path,
    resolution: tuple[int, int],
    difference: Mapping[tuple[int, int], float],
    captions: Sequence[str],
    centers: Sequence[float],
    title: str,
) -> None:
    """Write `difference`, signed fractions by pixel (x, y) from the bottom left, as a picture: blue too dark, red too bright.

    Below it are `captions` centered on the x `centers` [pixels], the scale, which is the same for every picture, and `title`.
    Pixels without a value are gray.
    """
    width, height = resolution
    size = TEXT_SIZE * width
    scale_strip = round(4.6 * size)
    strip = scale_strip + round(STRIP_HEIGHT * size)
    left, right = round(0.2 * width), round(0.8 * width)
    middle, half = (left + right) / 2.0, (right - left) / 2.0
    image = _canvas(width, height + strip)
    with image.with_buffer(write=True) as pixels:
        flat = pixels.cast("B")
        flat[4 * width * strip :] = bytes((*NOT_MEASURED, 255)) * (width * height)
        for (x, y), value in difference.items():
            start = 4 * ((y + strip) * width + x)
            flat[start : start + 3] = bytes(diverging_color(scale_place(value)))
        bar = b"".join(bytes((*diverging_color((x - middle) / half), 255)) for x in range(left, right))
        for y in range(round(3.2 * size), round(4.2 * size)):
            start = 4 * (y * width + left)
            flat[start : start + len(bar)] = bar
    _write_row(image, captions, centers, scale_strip + 0.9 * size, size)
    labels = ["0" if mark == 0.0 else f"{100.0 * mark:+g} %".replace("-", "\u2212") for mark in SCALE_MARKS]
    _write_row(image, labels, [middle + half * scale_place(mark) for mark in SCALE_MARKS], 2.1 * size, 0.8 * size)
    _write_row(image, [title], [width / 2.0], 0.7 * size, 0.8 * size)
    image.compress = 90
    imbuf.write(image, filepath=str(target))


def strip(sources: Sequence[Path], target: Path, captions: Sequence[str]) -> None:
    """Write the pictures `sources`, all of one size, side by side to `target`, a WebP file, `captions` below them."""
    parts = [imbuf.load(str(source)) for source in sources]
    width, height = parts[0].size
    size = max(0.075 * width, 11.0)
    below = round(STRIP_HEIGHT * size)
    image = _canvas(width * len(parts), height + below)
    with image.with_buffer(write=True) as pixels:
        flat = pixels.cast("B")
        for column, part in enumerate(parts):
            with part.with_buffer() as own:
                rows = own.cast("B")
                for y in range(height):
                    start = 4 * ((y + below) * width * len(parts) + column * width)
                    flat[start : start + 4 * width] = rows[4 * y * width : 4 * (y + 1) * width]
    _write_row(image, captions, [(column + 0.5) * width for column in range(len(parts))], 0.9 * size, size)
    image.file_type, image.quality = "WEBP", 88
    imbuf.write(image, filepath=str(target))
