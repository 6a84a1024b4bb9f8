# SPDX-License-Identifier: GPL-3.0-or-later
"""A rough dielectric coat, as nodes can have it: how much of it the viewer sees, whatever the light.

A coat over a base reflects the share F, the Fresnel reflectance averaged over the microfacets that the viewer sees, and lets 1 - F
through to the base and back: together never more than the light that falls on both.
"""

import math

from ..models.fresnel import boundary
from ..models.geometry import clamp

NORMAL_INCIDENCE, GRAZING, SLOPE = 3.1, (0.2, 1.6, 2.4), 0.5


def mean_cosine(mu: float, roughness: float) -> float:
    """Return the cosine at which a smooth surface reflects what a rough one does, seen at N.V = `mu`; in [0, 1].

    sqrt(A + B mu + C mu^2) with alpha = `roughness`^2, B = alpha / 2, A = alpha^2 / (0.2 + 1.6 alpha + 2.4 alpha^2),
    A + B + C = 1 - alpha / (1 + 3.1 alpha): our fit to GGX, F within 0.02 at index 1.4. Both are clamped to [0, 1].
    """
    mu, alpha = clamp(mu, 0.0, 1.0), clamp(roughness, 0.0, 1.0) ** 2
    at_normal = 1.0 - alpha / (1.0 + NORMAL_INCIDENCE * alpha)
    a, b = alpha * alpha / (GRAZING[0] + alpha * (GRAZING[1] + GRAZING[2] * alpha)), SLOPE * alpha
    return math.sqrt(a + mu * (b + mu * (at_normal - a - b)))


def mean_fresnel(mu: float, roughness: float, eta: float) -> float:
    """Return F in [0, 1], seen at N.V = `mu`; `eta` index of refraction, clamped to [1, 4]."""
    return 1.0 - boundary(eta).transmittance(max(1e-9, mean_cosine(mu, roughness)))
