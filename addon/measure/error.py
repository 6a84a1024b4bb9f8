# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiance of a model in every pixel of a render, and the errors of the render relative to it. No bpy."""

import math
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from ..models import Model
from ..models.color import LUMINANCE
from ..models.vector import Vector, dot, normalize


@dataclass(frozen=True)
class GBuffer:
    """The geometry in the pixels of a measurement render: three floats a pixel, rows from the top.

    `normal` (unit vectors) and `position` [m] are in world space, `albedo` is linear RGB. `measurable` is 1 for a pixel that shows
    one surface, 0 without a surface or with an edge, where the normal is not defined. Of surfaces whose shading normals are not
    those of their faces, `face_normal` has the latter: no model says what light from below a face does.
    """

    normal: array[float]
    position: array[float]
    albedo: array[float]
    measurable: bytearray
    face_normal: array[float] | None = None


@dataclass(frozen=True)
class Coverage:
    """Numbers of pixels that show a character, and of those in which it reflects diffusely alone."""

    visible: int
    diffuse: int


@dataclass(frozen=True)
class Light:
    """A sun: the `direction` towards it (unit vector) and its `irradiance` E0 [W/m^2] on a plane that faces it."""

    direction: Vector
    irradiance: float


@dataclass(frozen=True)
class Analytic:
    """The `radiance` [W/(m^2 sr)] of a model, linear RGB, in `pixels`: the measurable ones that face both light and camera."""

    pixels: array[int]
    radiance: array[float]


@dataclass(frozen=True)
class Errors:
    """The errors of a render over a number of `pixels`.

    `rms` and `p99` (99th percentile of the absolute error) are divided by the RMS of the analytic radiance. `mean_luminance` is
    that of the render [W/(m^2 sr)]; `luminance_over_lambert` divides it by that of Lambert with the same albedo in the same pixels.
    """

    pixels: int
    rms: float
    p99: float
    mean_luminance: float
    luminance_over_lambert: float


def directions(surface: GBuffer, pixel: int, camera: Vector) -> tuple[Vector, Vector]:
    """Return N and V (unit vectors) of a measurable pixel, seen from the point `camera` [m]."""
    normal, position, i = surface.normal, surface.position, 3 * pixel
    n = normalize((normal[i], normal[i + 1], normal[i + 2]))
    return n, normalize((camera[0] - position[i], camera[1] - position[i + 1], camera[2] - position[i + 2]))


@dataclass(frozen=True)
class ByPixel:
    """A model that differs from pixel to pixel: `model` returns that of a pixel."""

    model: Callable[[int], Model]


def analytic(surface: GBuffer, models: Sequence[Model | ByPixel], camera: Vector, light: Light) -> list[Analytic]:
    """Return the radiance of each of `models` under `light` alone, seen from the point `camera` [m]; all have the same pixels."""
    pixels = array("l")
    radiances = [array("f") for _ in models]
    albedo, faces = surface.albedo, surface.face_normal
    l, irradiance = light.direction, light.irradiance
    for pixel, measurable in enumerate(surface.measurable):
        if not measurable:
            continue
        i = 3 * pixel
        n, v = directions(surface, pixel, camera)
        if dot(n, l) <= 0.0 or dot(n, v) <= 0.0:
            continue
        if faces is not None:
            face = faces[i], faces[i + 1], faces[i + 2]
            if dot(face, l) <= 0.0 or dot(face, v) <= 0.0:
                continue
        pixels.append(pixel)
        red, green, blue = albedo[i], albedo[i + 1], albedo[i + 2]
        for given, radiance in zip(models, radiances, strict=True):
            model = given.model(pixel) if isinstance(given, ByPixel) else given
            radiance.append(irradiance * model.radiance(n, l, v, red))
            radiance.append(irradiance * model.radiance(n, l, v, green))
            radiance.append(irradiance * model.radiance(n, l, v, blue))
    return [Analytic(pixels, radiance) for radiance in radiances]


def luminance(rgb: array[float], i: int) -> float:
    """Return the luminance of the pixel whose red is at index `i` of `rgb`."""
    return LUMINANCE[0] * rgb[i] + LUMINANCE[1] * rgb[i + 1] + LUMINANCE[2] * rgb[i + 2]


def errors(rendered: array[float], expected: Analytic, lambert: Analytic) -> Errors:
    """Return the errors of `rendered`, linear RGB of all pixels, relative to `expected`; NaN without pixels or where that is black.

    rms = sqrt(sum (L - Lref)^2 / sum Lref^2) over all channels of the expected pixels.
    """
    count = len(expected.pixels)
    if count == 0:
        return Errors(0, math.nan, math.nan, math.nan, math.nan)
    squares = reference = luminances = ideal = 0.0
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
        luminances += luminance(rendered, i)
        ideal += luminance(lambert.radiance, j)
    if reference == 0.0:
        return Errors(count, math.nan, math.nan, luminances / count, math.nan)
    deviations.sort()
    return Errors(
        pixels=count,
        rms=math.sqrt(squares / reference),
        p99=math.sqrt(deviations[math.ceil(0.99 * count) - 1] * count / reference),
        mean_luminance=luminances / count,
        luminance_over_lambert=luminances / ideal if ideal > 0.0 else math.nan,
    )


def difference(rendered: array[float], reference: array[float], pixels: Iterable[int]) -> float:
    """Return sqrt(sum (a - b)^2 / sum b^2) of two pictures over `pixels`, b being the reference; NaN where that is black."""
    squares = total = 0.0
    for pixel in pixels:
        for i in range(3 * pixel, 3 * pixel + 3):
            squares += (rendered[i] - reference[i]) ** 2
            total += reference[i] ** 2
    return math.sqrt(squares / total) if total > 0.0 else math.nan
