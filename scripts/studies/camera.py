# SPDX-License-Identifier: GPL-3.0-or-later
"""Realtime's depth of field, motion blur and hair against Cycles, by the number of samples."""

import time
from array import array
from collections.abc import Iterator, Sequence
from functools import cache, partial

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.measure import render
from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.hair import ball_of_hair
from true_diffuse.scripts.studies.soft_shadows import FILTER, LIGHTS, Characters, differences
from true_diffuse.scripts.studies.study import Step, Table, pivot

# The middle character is in focus, the first and the last, 0.6 m behind and before it, are blurred by circles of 12 pixels.
FOCUS, FSTOP = 28.5, 0.13  # m; of 400 mm
SAMPLES, NOISELESS = (16, 64), 512
TURN, FRAMES = 2.0, 10  # radians that each character turns around itself in so many frames; the picture is of the middle one
PLAIN, DEPTH_OF_FIELD, MOTION_BLUR, HAIR = "Five characters", "Depth of field", "Motion blur", "Hair"


def steps(mesh: bpy.types.Mesh, quick: bool) -> list[Step]:
    """Return steps that yield Realtime's RMS difference from Cycles, of all pixels and without the WORST."""
    characters = Characters(mesh)
    dof = characters.scene.camera.data.dof
    dof.focus_distance, dof.aperture_fstop = FOCUS, FSTOP
    scene = characters.scene
    for figure in characters.figures:
        figure.rotation_mode = "XYZ"
        middle = figure.rotation_euler.z
        for frame, side in ((0, -0.5), (FRAMES, 0.5)):
            figure.rotation_euler.z = middle + side * TURN
            figure.keyframe_insert("rotation_euler", index=2, frame=frame)
    scene.frame_set(FRAMES // 2)

    fur = ball_of_hair(FILTER)

    def picture(case: str, engine: engines.Engine, samples: int) -> array[float]:
        if case == HAIR:
            return render.radiance(fur, engine, samples)[1]
        dof.use_dof, scene.render.use_motion_blur = case == DEPTH_OF_FIELD, case == MOTION_BLUR
        return characters.radiance(LIGHTS["key"], engine, samples)

    cycles = cache(partial(picture, engine=engines.CYCLES, samples=NOISELESS))

    def measure(case: str, samples: int) -> Iterator[Record]:
        expected = cycles(case)
        start = time.perf_counter()
        got = picture(case, engines.REALTIME, samples)
        seconds = time.perf_counter() - start
        yield {"case": case, "samples": samples, **differences(got, expected), "seconds": seconds}

    return [
        Step(f"{case}  {count} samples", partial(measure, case, count), count + 60.0)
        for case in ((DEPTH_OF_FIELD,) if quick else (PLAIN, DEPTH_OF_FIELD, MOTION_BLUR, HAIR))
        for count in SAMPLES
    ]


def table(records: Sequence[Record]) -> Table:
    """Return the differences and the time of a render, a row for each case and a column for each number of samples."""

    def cell(found: list[Record]) -> str:
        (one,) = found
        return f"{100.0 * one['rms_difference']:.1f} / {100.0 * one['rms_difference_of_best']:.1f} %, {one['seconds']:.0f} s"

    return pivot(records, ("Camera",), lambda one: (one["case"],), lambda one: f"{one['samples']} samples", cell)
