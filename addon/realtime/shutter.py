# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur: each sample of a final render shows the scene at a time at which the shutter is open."""

import math
from bisect import bisect_right
from collections.abc import Callable, Generator
from contextlib import contextmanager
from itertools import accumulate, pairwise

import bpy

PARTS = 256  # of the shutter's curve, as in Cycles
FRAME = {"START": 0.0, "CENTER": 0.5, "END": 1.0}  # where in the shutter's time the frame is


def shutter_times(settings: bpy.types.RenderSettings, samples: int) -> list[float]:
    """Return when each sample of a picture is taken, in frames from the picture's, so that all have the same weight.

    They go up from the middle of the shutter's time to its end, then from its start to the middle: neighbors stay neighbors, so
    that together with their places in a pixel, in the lens and in the lights they fill all evenly.
    """
    fractions = (((sample + samples // 2 + 0.5) / samples) % 1.0 for sample in range(samples))
    openings = _opening_times(settings.motion_blur_shutter_curve)
    first = FRAME[settings.motion_blur_position]
    return [settings.motion_blur_shutter * (_inverse(openings, fraction) - first) for fraction in fractions]


@contextmanager
def open_shutter(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, samples: int) -> Generator[Callable[[int], bool]]:
    """Yield a function that takes the scene to the time of a sample, and returns whether it did: with motion blur it does.

    At the end the scene is back at its frame.
    """
    if not scene.render.use_motion_blur:
        yield lambda _: False
        return
    now = scene.frame_current + scene.frame_subframe
    times = shutter_times(scene.render, samples)

    def go(time: float) -> bool:
        frame = math.floor(time)
        engine.frame_set(frame, time - frame)
        return True

    try:
        yield lambda sample: go(now + times[sample])
    finally:
        go(now)


def _opening_times(mapping: bpy.types.CurveMapping) -> list[float]:
    """Return how much light came in up to each of PARTS + 1 times, 0 to 1; a shutter that is always closed counts as open."""
    mapping.initialize()
    heights = [max(mapping.evaluate(mapping.curves[0], index / PARTS), 0.0) for index in range(PARTS + 1)]
    sums = list(accumulate(((a + b) / 2.0 for a, b in pairwise(heights)), initial=0.0))
    return [light / sums[-1] for light in sums] if sums[-1] > 0.0 else [index / PARTS for index in range(PARTS + 1)]


def _inverse(sums: list[float], fraction: float) -> float:
    """Return the time, 0 to 1, up to which a fraction below 1 of the light has come in."""
    part = bisect_right(sums, fraction) - 1
    return (part + (fraction - sums[part]) / (sums[part + 1] - sums[part])) / PARTS
