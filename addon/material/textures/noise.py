# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Noise Texture (Cycles' kernel/svm/noisetex.h)."""

from ...models.vector import Vector
from .float32 import Coordinates, coordinates, f32, moved
from .fractal_noise import MUSGRAVE, fbm, signed_noise
from .hashing import random


def noise_value(
    dimensions: int,
    noise_type: str,
    normalize: bool,
    vector: Vector,
    w: float,
    scale: float,
    detail: float,
    roughness: float,
    lacunarity: float,
    offset: float,
    gain: float,
    distortion: float,
) -> float:
    """Return the output Value. One dimension reads `w`, two and three `vector`, four both; `normalize` is for fBM alone."""
    p = _distorted(dimensions, vector, w, scale, distortion)
    return _fractal(p, noise_type, normalize, detail, roughness, lacunarity, offset, gain)


def noise_color(
    dimensions: int,
    noise_type: str,
    normalize: bool,
    vector: Vector,
    w: float,
    scale: float,
    detail: float,
    roughness: float,
    lacunarity: float,
    offset: float,
    gain: float,
    distortion: float,
) -> Vector:
    """Return the output Color: the value and two more, of other places."""
    p = _distorted(dimensions, vector, w, scale, distortion)
    red, green, blue = (
        _fractal(place, noise_type, normalize, detail, roughness, lacunarity, offset, gain)
        for place in (p, _elsewhere(p, dimensions), _elsewhere(p, dimensions + 1))
    )
    return (red, green, blue)


def _fractal(
    p: Coordinates, kind: str, normalize: bool, detail: float, roughness: float, lacunarity: float, offset: float, gain: float
) -> float:
    detail, roughness = min(max(detail, 0.0), 15.0), max(roughness, 0.0)
    if kind == "FBM":
        return fbm(p, detail, roughness, lacunarity, normalize)
    return MUSGRAVE[kind](p, detail, roughness, lacunarity, offset, gain)


def _distorted(dimensions: int, vector: Vector, w: float, scale: float, distortion: float) -> Coordinates:
    p = coordinates(dimensions, vector, w, scale)
    if not distortion:
        return p
    return moved(p, (signed_noise(_elsewhere(p, axis)) * distortion for axis in range(dimensions)))


def away(dimensions: int, seed: int) -> Coordinates:
    """Return how far another place of the noise lies: 100 to 200 along each axis."""
    keys = ((seed,),) if dimensions == 1 else ((seed, axis) for axis in range(dimensions))
    return tuple(f32(100.0 + random(*key) * 100.0) for key in keys)


def _elsewhere(p: Coordinates, seed: int) -> Coordinates:
    return moved(p, away(len(p), seed))
