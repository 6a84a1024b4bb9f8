# SPDX-License-Identifier: GPL-3.0-or-later
"""Van de Hulst's fit of a half-space's reflectance, and the ways back from reflectance to single-scattering albedo."""

import math

from true_diffuse.addon.models.geometry import clamp
from true_diffuse.addon.models.half_space import VAN_DE_HULST, diffuse_albedo, single_scattering_albedo_fit


def single_scattering_albedo(reflectance: float) -> float:
    """Return the alpha of which `diffuse_albedo` is `reflectance`; in [0, 1].

    Each step corrects what is asked of the fit by what its answer misses, and is 1e-4 of the step before.
    """
    wanted = asked = clamp(reflectance, 0.0, 1.0)
    for _ in range(4):
        asked += wanted - diffuse_albedo(single_scattering_albedo_fit(asked))
    return single_scattering_albedo_fit(asked)


def van_de_hulst(albedo: float, g: float = 0.0) -> float:
    """Return the fraction reflected of light from everywhere, by H. C. van de Hulst's fit; `g` mean cosine of scattering.

    R = (1 - s)(1 - 0.139 s) / (1 + 1.17 s), s = sqrt((1 - alpha) / (1 - g alpha)); `g` is clamped to [-0.99, 0.99]. "Multiple Light
    Scattering" (1980), as E. d'Eon gives it in "A Hitchhiker's Guide to Multiple Scattering". 3 % too low where alpha is small.
    """
    albedo, g = clamp(albedo, 0.0, 1.0), clamp(g, -0.99, 0.99)
    return VAN_DE_HULST.reflectance(math.sqrt((1.0 - albedo) / (1.0 - g * albedo)))


def van_de_hulst_inverse(reflectance: float, g: float = 0.0) -> float:
    """Return the alpha of which `van_de_hulst` is `reflectance`: what Cycles' random walk and OpenPBR make of a color.

    Both write the same root with rounded constants, which costs a color of 1e-6 half its value, and Cycles keeps alpha below
    0.999999. In [0, 1]; `g` is clamped to [-0.99, 0.99].
    """
    isotropic, g = VAN_DE_HULST.albedo(clamp(reflectance, 0.0, 1.0)), clamp(g, -0.99, 0.99)
    return isotropic / (1.0 - g * (1.0 - isotropic))
