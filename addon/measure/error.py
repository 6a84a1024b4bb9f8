# SPDX-License-Identifier: GPL-3.0-or-later
"""The analytic radiance of every pixel of a render, and how far the render is from it. No bpy."""

import math
from array import array
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..models import Lambert, Model
from ..models.color import LUMINANCE
from ..models.vector import Vector, dot, normalize


@dataclass(frozen=True)
class Surface:
    """What a measurement render sees: one entry per pixel, three floats each, rows from the top as in the file.

    `normal` unit vectors and `position` in world space [m], `albedo` linear RGB; `measurable` is 1 for a pixel that shows one
    surface, 0 where there is none or an edge runs through, as such a pixel has no normal of its own.
    """

    normal: array[float]
    position: array[float]
    albedo: array[float]
    measurable: bytearray


@dataclass(frozen=True)
class Light:
    """A sun: `direction` towards it (unit vector) and `irradiance` E0 [W/m^2] on a plane that faces it."""

    direction: Vector
    irradiance: float


@dataclass(frozen=True)
class Analytic:
    """The radiance [W/(m^2 sr)] a model gives, linear RGB.

    `pixels` lists those it is for: measurable ones that face both light and camera.
    """

    pixels: array[int]
    radiance: array[float]


@dataclass(frozen=True)
class Errors:
    """`rms` and `p99` (99th percentile of the absolute error) are relative to the RMS of the analytic value.

    `mean_luminance` is of the render [W/(m^2 sr)]; `luminance_over_lambert` divides it by that of an ideal Lambert surface with
    the same albedo, seen in the same pixels.
    """

    pixels: int
    rms: float
    p99: float
    mean_luminance: float
    luminance_over_lambert: float


def directions(surface: Surface, pixel: int, camera: Vector) -> tuple[Vector, Vector]:
    """Return N and V of a measurable pixel, seen from `camera` (a point [m])."""
    normal, position, i = surface.normal, surface.position, 3 * pixel
    n = normalize((normal[i], normal[i + 1], normal[i + 2]))
    return n, normalize((camera[0] - position[i], camera[1] - position[i + 1], camera[2] - position[i + 2]))


def analytic(surface: Surface, models: Sequence[Model], camera: Vector, light: Light) -> list[Analytic]:
    """Return what each of `models` says of `surface`, seen from `camera` (a point [m]) under `light`
    alone, all for the same pixels."""
    pixels = array("l")
    radiances = [array("f") for _ in models]
    albedo = surface.albedo
    l, irradiance = light.direction, light.irradiance
    for pixel, measurable in enumerate(surface.measurable):
        if not measurable:
            continue
        i = 3 * pixel
        n, v = directions(surface, pixel, camera)
        if dot(n, l) <= 0.0 or dot(n, v) <= 0.0:
            continue
        pixels.append(pixel)
        red, green, blue = albedo[i], albedo[i + 1], albedo[i + 2]
        for model, radiance in zip(models, radiances, strict=True):
            radiance.append(irradiance * model.radiance(n, l, v, red))
            radiance.append(irradiance * model.radiance(n, l, v, green))
            radiance.append(irradiance * model.radiance(n, l, v, blue))
    return [Analytic(pixels, radiance) for radiance in radiances]


def distances(surface: Surface, camera: Vector) -> array[float]:
    """Return the distance [m] of every pixel's surface from `camera` (a point [m]); without meaning where there is none."""
    p = surface.position
    return array("f", (math.dist(camera, p[i : i + 3]) for i in range(0, len(p), 3)))


def luminance(rgb: array[float], i: int) -> float:
    """Return the luminance of the pixel whose red is at index `i` of `rgb`."""
    return LUMINANCE[0] * rgb[i] + LUMINANCE[1] * rgb[i + 1] + LUMINANCE[2] * rgb[i + 2]


def errors(rendered: array[float], expected: Analytic, lambert: Analytic) -> Errors:
    """Return how far `rendered` (linear RGB of the whole region) is from `expected`; NaN where there is nothing to compare.

    rms = sqrt(sum (L - Lref)^2 / sum Lref^2) over all channels of the expected pixels.
    """
    count = len(expected.pixels)
    if count == 0:
        return Errors(0, math.nan, math.nan, math.nan, math.nan)
    squares = reference = shown = ideal = 0.0
    deviations = []
    for k, pixel in enumerate(expected.pixels):
        i, j = 3 * pixel, 3 * k
        square = 0.0
        for channel in range(3):
            value = expected.radiance[j + channel]
            square += (rendered[i + channel] - value) ** 2
            reference += value * value
        squares += square
        deviations.append(square)
        shown += luminance(rendered, i)
        ideal += luminance(lambert.radiance, j)
    if reference == 0.0:
        return Errors(count, math.nan, math.nan, shown / count, math.nan)
    deviations.sort()
    return Errors(
        pixels=count,
        rms=math.sqrt(squares / reference),
        p99=math.sqrt(deviations[math.ceil(0.99 * count) - 1] * count / reference),
        mean_luminance=shown / count,
        luminance_over_lambert=shown / ideal if ideal > 0.0 else math.nan,
    )


def difference(rendered: array[float], reference: array[float], pixels: Iterable[int]) -> float:
    """Return sqrt(sum (a - b)^2 / sum b^2) of two pictures over `pixels`; NaN where the reference is black."""
    squares = total = 0.0
    for pixel in pixels:
        for i in range(3 * pixel, 3 * pixel + 3):
            squares += (rendered[i] - reference[i]) ** 2
            total += reference[i] ** 2
    return math.sqrt(squares / total) if total > 0.0 else math.nan


def signed_difference(rendered: array[float], expected: Analytic, surface: Surface, light: Light) -> dict[int, float]:
    """Return, by pixel, the luminance error as a share of what a Lambert surface of the pixel's albedo shows when lit head on."""
    white = Lambert().radiance((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1.0) * light.irradiance
    difference = {}
    for k, pixel in enumerate(expected.pixels):
        error = luminance(rendered, 3 * pixel) - luminance(expected.radiance, 3 * k)
        difference[pixel] = error / (white * max(luminance(surface.albedo, 3 * pixel), 1e-6))
    return difference
