# SPDX-License-Identifier: GPL-3.0-or-later
"""Perlin noise in one to four dimensions, and its fractal sums, as Blender's Noise and Wave Texture compute them.

K. Perlin, "Improving noise", SIGGRAPH (2002); F. K. Musgrave in Ebert et al., "Texturing and modeling" (2003), chapter 16, for the
sums. Cycles' kernel/svm/noise.h and fractal_noise.h, with the scales of Open Shading Language.
"""

import math
from collections.abc import Callable, Iterator
from itertools import product

from .float32 import Coordinates, f32, scaled
from .hashing import lookup3

SCALES = (0.25, 0.6616, 0.982, 0.8344)  # of noise in one to four dimensions, to reach -1 to 1
PERIOD, FAR = 100000.0, 1000000.0


def signed_noise(p: Coordinates) -> float:
    """Return Perlin noise, about -1 to 1, of one to four coordinates; it repeats every PERIOD.

    Beyond FAR, where 32-bit floats are multiples of a sixteenth and soon of 1, half a cell is added, as it is 0 at whole numbers.
    """
    p = tuple(math.fmod(x, PERIOD) + (0.5 if abs(x) >= FAR else 0.0) for x in p)
    cell = [math.floor(x) for x in p]
    local = [x - corner for x, corner in zip(p, cell, strict=True)]
    fades = [f * f * f * (f * (f * 6.0 - 15.0) + 10.0) for f in local]
    total = 0.0
    for corner in product((0, 1), repeat=len(p)):
        weight = math.prod(fade if c else 1.0 - fade for c, fade in zip(corner, fades, strict=True))
        hashed = lookup3(*(x + c for x, c in zip(cell, corner, strict=True)))
        total += weight * _slope(hashed, tuple(f - c for f, c in zip(local, corner, strict=True)))
    return SCALES[len(p) - 1] * total


def fbm(p: Coordinates, detail: float, roughness: float, lacunarity: float, normalized: bool) -> float:
    """Return fractal Brownian motion: each octave is `roughness` times as high and `lacunarity` times as fine as the one before.

    A fraction of `detail` gives the last octave that share. 0 to 1 if `normalized`.
    """
    total, amplitudes, amplitude, scale, level = 0.0, 0.0, 1.0, 1.0, 0.0
    for share in _shares(detail):
        total += signed_noise(scaled(p, scale)) * amplitude
        amplitudes += amplitude
        level += (((0.5 * total / amplitudes + 0.5) if normalized else total) - level) * share
        amplitude *= roughness
        scale = f32(scale * lacunarity)
    return level


def multifractal(p: Coordinates, detail: float, roughness: float, lacunarity: float, _offset: float, _gain: float) -> float:
    value, power = 1.0, 1.0
    for noise, share in _octaves(p, detail, lacunarity):
        value *= share * power * noise + 1.0
        power *= roughness
    return value


def hybrid_multifractal(p: Coordinates, detail: float, roughness: float, lacunarity: float, offset: float, gain: float) -> float:
    value, power, weight = 0.0, 1.0, 1.0
    for noise, share in _octaves(p, detail, lacunarity):
        if weight <= 0.001:
            break
        weight = min(weight, 1.0)
        signal = (noise + offset) * power
        value += share * weight * signal
        weight *= gain * signal
        power *= roughness
    return value


def ridged_multifractal(p: Coordinates, detail: float, roughness: float, lacunarity: float, offset: float, gain: float) -> float:
    """Return ridges where the noise is 0. A fraction of `detail` has no effect."""
    value, power, weight = 0.0, 1.0, 1.0
    for noise, _ in _octaves(p, math.floor(detail), lacunarity):
        signal = (offset - abs(noise)) ** 2 * weight
        value += signal * power
        weight = min(max(signal * gain, 0.0), 1.0)
        power *= roughness
    return value


def hetero_terrain(p: Coordinates, detail: float, roughness: float, lacunarity: float, offset: float, _gain: float) -> float:
    value, power = 1.0, 1.0
    for octave, (noise, share) in enumerate(_octaves(p, detail, lacunarity)):
        value = value + share * (noise + offset) * power * value if octave else noise + offset
        power *= roughness
    return value


MUSGRAVE: dict[str, Callable[[Coordinates, float, float, float, float, float], float]] = {
    "MULTIFRACTAL": multifractal,
    "HYBRID_MULTIFRACTAL": hybrid_multifractal,
    "RIDGED_MULTIFRACTAL": ridged_multifractal,
    "HETERO_TERRAIN": hetero_terrain,
}
"""The sums beside fBM by their names in Blender, all of coordinates, detail, roughness, lacunarity, offset and gain."""


def _shares(detail: float) -> Iterator[float]:
    """Yield 1 for each whole octave of 1 + `detail`, and the fraction that the last has."""
    yield from (1.0,) * (int(detail) + 1)
    if detail != int(detail):
        yield detail - int(detail)


def _octaves(p: Coordinates, detail: float, lacunarity: float) -> Iterator[tuple[float, float]]:
    """Yield the noise of each octave and its share."""
    for share in _shares(detail):
        yield signed_noise(p), share
        p = scaled(p, lacunarity)


def _slope(hashed: int, p: Coordinates) -> float:
    """Return one of Perlin's gradients, which the low bits of `hashed` choose, times `p`, the vector from a corner of the cell."""
    if len(p) == 1:
        terms = [0.0, 0.0, 0.0, (1 + (hashed & 7)) * p[0]]
    elif len(p) == 2:
        terms = [p[0], 2.0 * p[1]] if hashed & 7 < 4 else [p[1], 2.0 * p[0]]
    elif len(p) == 3:
        x, y, z = p
        h = hashed & 15
        terms = [x if h < 8 else y, y if h < 4 else x if h in (12, 14) else z]
    else:
        x, y, z, w = p
        h = hashed & 31
        terms = [x if h < 24 else y, y if h < 16 else z, z if h < 8 else w]
    return sum(-term if hashed >> bit & 1 else term for bit, term in enumerate(terms))
