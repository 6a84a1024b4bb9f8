# SPDX-License-Identifier: GPL-3.0-or-later
"""Equation (1) as the paper prints it, to show why it is not used."""

import math
import sys

from true_diffuse.addon.models.geometry import clamp
from true_diffuse.addon.models.oren_nayar import coefficients
from true_diffuse.addon.models.vector import Vector, dot, normalize


def as_printed(n: Vector, l: Vector, v: Vector, albedo: float, sigma: float) -> float:
    """Return the radiance of equation (1) with MAX(1, (N.L)/(N.E)), as the paper prints it. Never use it to shade.

    It grows without bound towards the silhouette (N.E -> 0) and glows at the terminator (N.L = 0). Units as in
    `OrenNayar.radiance`; the printed square roots cancel and are left out, else it would be 0/0 at N.L = N.E = 1.
    """
    n, l, v = normalize(n), normalize(l), normalize(v)
    n_dot_l, n_dot_e = dot(n, l), dot(n, v)
    if n_dot_l < 0.0 or n_dot_e <= 0.0:
        return 0.0
    a, b = coefficients(sigma)
    s = dot(v, l) - n_dot_e * n_dot_l
    ramp = min(max(1.0, n_dot_l / n_dot_e), sys.float_info.max)
    return clamp(albedo, 0.0, 1.0) / math.pi * (a * n_dot_l + b * max(0.0, s) * ramp)
