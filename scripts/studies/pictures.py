# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a comparison, with captions, and its scene as a file."""

import re
import time
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import bpy

from bpy_extras.object_utils import world_to_camera_view

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Progress
from true_diffuse.scripts.studies import picture

PICTURE_WORK = 12.0  # about how long it takes beside the measurement of one character


@dataclass(frozen=True)
class Captions:
    """What stands below a picture: each label and the x around which it is centered [pixels]."""

    labels: list[str]
    centers: list[float]


@contextmanager
def _reported(progress: Progress) -> Generator[None]:
    """Pass on the samples that Blender reports while it renders a picture."""

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
    """Render `scene`, write TARGET_ENGINE.exr (linear) and TARGET_ENGINE.png (with captions), return the seconds it took.

    `denoise` lets Cycles do so by OpenImageDenoise.
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
    picture.caption(plain, target.with_name(f"{target.name}_{engine.key}.png"), captions.labels, captions.centers)
    plain.unlink()
    return seconds


def captions(scene: bpy.types.Scene, subjects: Mapping[str, bpy.types.Object]) -> Captions:
    """Return the captions of `subjects`, by label."""
    places = [world_to_camera_view(scene, scene.camera, subject.matrix_world.translation) for subject in subjects.values()]
    return Captions(list(subjects), [place.x * scene.render.resolution_x for place in places])


def save_blend(kept: bpy.types.Scene, path: Path) -> None:
    """Write the scene `kept` as a file to open in Blender, without the empty scene that Blender started with."""
    for scene in list(bpy.data.scenes):
        if scene is not kept:
            bpy.data.scenes.remove(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, copy=True)
