# SPDX-License-Identifier: GPL-3.0-or-later
"""The accuracy of each reflectance model in a glTF file, drawn by web engines in a browser."""

from array import array
from collections.abc import Sequence

from true_diffuse.addon.measure import error
from true_diffuse.addon.models import Model
from true_diffuse.scripts.web.engines import ALBEDO, NORMAL, POSITION, Engine, Sun, Triple


def surface(engine: Engine) -> error.GBuffer:
    """Return the geometry and the base color in each pixel that the engine draws: pixels have one sample, in their middle."""
    (position, shown), (normal, _), (albedo, _) = (engine.draw(what) for what in (POSITION, NORMAL, ALBEDO))
    return error.GBuffer(normal, position, albedo, shown)


def analytic(surface: error.GBuffer, models: Sequence[Model], eye: Triple, suns: Sequence[Sun]) -> list[error.Analytic]:
    """Return the radiance of each of `models` under all `suns` together, in the pixels that face the point `eye` [m] and a sun."""
    sums = [array("d", bytes(8 * len(surface.albedo))) for _ in models]
    lit = set()
    for sun in suns:
        found = error.analytic(surface, models, eye, error.Light(sun.direction, 1.0))
        lit.update(found[0].pixels)
        for total, one in zip(sums, found, strict=True):
            for k, pixel in enumerate(one.pixels):
                for channel, irradiance in enumerate(sun.irradiance):
                    total[3 * pixel + channel] += irradiance * one.radiance[3 * k + channel]
    pixels = array("l", sorted(lit))
    return [error.Analytic(pixels, array("f", (total[3 * i + c] for i in pixels for c in range(3)))) for total in sums]
