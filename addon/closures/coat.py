# SPDX-License-Identifier: GPL-3.0-or-later
"""A rough dielectric coat, as nodes can have it: how much of it the viewer sees, whatever the light.

A coat over a base reflects the share F, the Fresnel reflectance averaged over the microfacets that the viewer sees, and lets 1 - F
through to the base and back: together never more than the light that falls on both.
"""

import math

from ..models.fresnel import boundary
from ..models.geometry import clamp
from ..models.terms import FLOATS, Arithmetic, Number


def squared_cosine(mu: Number, roughness: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the square of the cosine at which a smooth surface reflects what a rough one does, seen at N.V = `mu`; all in [0, 1].

    A + B mu + C mu^2, our fit to GGX, F within 0.02 at index 1.4. Floats or sockets.
    """
    alpha = roughness * roughness
    at_normal = 1.0 - alpha / (1.0 + 3.1 * alpha)  # A + B + C
    a, b = alpha * alpha / (0.2 + alpha * (1.6 + 2.4 * alpha)), 0.5 * alpha
    return ops.multiply_add(mu, ops.multiply_add(mu, at_normal - a - b, b), a)


def mean_cosine(mu: float, roughness: float) -> float:
    """Return the root of `squared_cosine`; both are clamped to [0, 1]."""
    return math.sqrt(squared_cosine(clamp(mu, 0.0, 1.0), clamp(roughness, 0.0, 1.0)))


def mean_fresnel(mu: float, roughness: float, eta: float) -> float:
    """Return F in [0, 1], seen at N.V = `mu`; `eta` index of refraction, clamped to [1, 4]."""
    return 1.0 - boundary(eta).transmittance(max(1e-9, mean_cosine(mu, roughness)))
