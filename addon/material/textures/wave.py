# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Wave Texture (Cycles' kernel/svm/wave.h)."""

import math

from ...models.vector import Vector
from .float32 import f32, off_borders, scaled
from .fractal_noise import fbm


def wave_fac(
    wave_type: str,
    bands_direction: str,
    rings_direction: str,
    wave_profile: str,
    vector: Vector,
    scale: float,
    distortion: float,
    detail: float,
    detail_scale: float,
    detail_roughness: float,
    phase_offset: float,
) -> float:
    """Return the output Fac, 0 to 1. `phase_offset` in radians; `detail` is clamped to its socket's range, 0 to 15."""
    p = x, y, z = off_borders(scaled(vector, scale))
    if wave_type == "BANDS":
        phase = {"X": x, "Y": y, "Z": z, "DIAGONAL": 0.5 * (x + y + z)}[bands_direction]
    else:
        phase = math.hypot(*(value for axis, value in zip("XYZ", p, strict=True) if axis != rings_direction))
    phase = f32(f32(phase * 20.0) + phase_offset)
    if distortion:
        noise = fbm(scaled(p, detail_scale), min(max(detail, 0.0), 15.0), detail_roughness, 2.0, normalized=True)
        phase = f32(phase + distortion * (noise * 2.0 - 1.0))
    if wave_profile == "SIN":
        return 0.5 + 0.5 * math.sin(f32(phase - f32(math.pi / 2.0)))
    turns = f32(phase / f32(math.tau))
    return turns - math.floor(turns) if wave_profile == "SAW" else 2.0 * abs(turns - math.floor(turns + 0.5))


def wave_color(*arguments: str | float | Vector) -> Vector:
    """Return the output Color, a gray; the arguments are those of `wave_fac`."""
    gray = wave_fac(*arguments)  # ty: ignore[invalid-argument-type]
    return (gray, gray, gray)
