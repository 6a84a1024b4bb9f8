# SPDX-License-Identifier: GPL-3.0-or-later
"""What MaterialX has for each rough diffuse model: its oren_nayar_diffuse_bsdf, one of two formulas.

Without energy_compensation that is equation (1), roughness its sigma; with it EON. Another model becomes the nearest of them, with
the color that gives it the model's average albedo, so both reflect as much of light from everywhere. The averages over all views,
with rho the albedo, <E> that of Fujii's model at rho = 1 and k = 1 - <E>:

    equation (1)      rho (A + B (K2 + 4 / (9 pi)))
    EON               rho <E> / (1 - rho k)
    Fujii             rho <E>
    Cycles Diffuse    rho <E> (1 + rho^2 k / (1 - rho k))
    Wolff             rho (1 - <F>)^2
    Pits              rho / (2 - rho)

The 1994 model is a rho + b rho^2 of which a has no closed form.
"""

import functools
from collections.abc import Callable
from math import pi
from typing import NamedTuple

from ..models import OrenNayar1994, Wolff, average_albedo
from ..models.eon import K2, fujii_average_albedo
from ..models.geometry import clamp
from ..models.oren_nayar import coefficients

ORDER = 12  # of the quadratures: to 1e-4


class Shape(NamedTuple):
    """What a model's albedo depends on beside its color: roughness, sigma in radians or 0 to 1, and index of refraction."""

    roughness: float
    ior: float


class Law(NamedTuple):
    """A model: its average albedo, and how oren_nayar_diffuse_bsdf comes near it."""

    albedo: Callable[[float, Shape], float]
    compensated: bool
    roughness: float | None = None
    """Of the closure; None for the model's own."""
    near: str = ""
    """What stands for the model, where MaterialX does not have its formula."""


def _lambert(rho: float, _shape: Shape) -> float:
    return rho


def _oren_nayar(rho: float, shape: Shape) -> float:
    a, b = coefficients(shape.roughness)
    return rho * (a + b * (K2 + 4.0 / (9.0 * pi)))


def _fujii(rho: float, shape: Shape) -> float:
    return rho * fujii_average_albedo(clamp(shape.roughness, 0.0, 1.0))


def _eon(rho: float, shape: Shape) -> float:
    average = fujii_average_albedo(clamp(shape.roughness, 0.0, 1.0))
    return rho * average / (1.0 - rho * (1.0 - average))


def _cycles_diffuse(rho: float, shape: Shape) -> float:
    average = fujii_average_albedo(clamp(shape.roughness, 0.0, 1.0))
    lost = 1.0 - average
    return rho * average * (1.0 + rho * rho * lost / (1.0 - rho * lost))


@functools.lru_cache(maxsize=256)
def _average_1994(sigma: float) -> tuple[float, float]:
    """Return a and b of the 1994 model's albedo a rho + b rho^2."""
    model = OrenNayar1994(sigma)
    white, half = (average_albedo(model, rho, ORDER) for rho in (1.0, 0.5))
    return 4.0 * half - white, 2.0 * (white - 2.0 * half)


def _oren_nayar_1994(rho: float, shape: Shape) -> float:
    once, twice = _average_1994(shape.roughness)
    return rho * (once + twice * rho)


@functools.lru_cache(maxsize=256)
def _average_wolff(ior: float) -> float:
    return average_albedo(Wolff(ior), 1.0, ORDER)


def _wolff(rho: float, shape: Shape) -> float:
    return rho * _average_wolff(shape.ior)


def _pits(rho: float, _shape: Shape) -> float:
    return rho / (2.0 - rho)


LAWS = {
    "Lambert": Law(_lambert, compensated=False, roughness=0.0),
    "Oren-Nayar": Law(_oren_nayar, compensated=False),
    "Fujii": Law(_fujii, compensated=True, near="EON of equal average albedo"),
    "EON": Law(_eon, compensated=True),
    "Cycles Diffuse": Law(_cycles_diffuse, compensated=True, near="EON of equal average albedo"),
    "Oren-Nayar 1994": Law(_oren_nayar_1994, compensated=False, near="Oren-Nayar of equal average albedo"),
    "Wolff": Law(_wolff, compensated=False, roughness=0.0, near="Lambert of equal average albedo"),
    "Pitted (Koenderink)": Law(_pits, compensated=True, roughness=1.0, near="EON of roughness 1 and equal average albedo"),
}


class Nearest:
    """The closure that stands for a `model` of LAWS, by its name in the menu Model."""

    def __init__(self, model: str, roughness: float, ior: float) -> None:
        self.law = LAWS[model]
        self.shape = Shape(clamp(roughness, 0.0, 100.0), clamp(ior, 1.0, 3.0))
        limit = 1.0 if self.law.compensated else 100.0
        self.roughness = clamp(self.shape.roughness, 0.0, limit) if self.law.roughness is None else self.law.roughness

    def albedo(self, rho: float) -> float:
        """Return the model's average albedo, in [0, 1] or a little above; `rho` is clamped to [0, 1]."""
        return self.law.albedo(clamp(rho, 0.0, 1.0), self.shape)

    def color(self, rho: float) -> float:
        """Return the closure's color; `rho` is clamped to [0, 1]."""
        if not self.law.near:
            return clamp(rho, 0.0, 1.0)
        albedo = self.albedo(rho)
        if self.law.compensated:
            average = fujii_average_albedo(self.roughness)
            return albedo / (average + albedo * (1.0 - average))
        return clamp(albedo / _oren_nayar(1.0, Shape(self.roughness, 1.0)), 0.0, 1.0)
