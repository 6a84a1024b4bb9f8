# SPDX-License-Identifier: GPL-3.0-or-later
"""Dipoles: where light that enters a half-space at one point, along the normal, comes out again, by diffusion theory.

A source lies at the depth z_r = 1 / sigma_t', its negative image at z_v above the surface, so that the flux across the boundary is
as Fresnel has it. R(r) is the radiant exitance at the distance r per entered flux. sigma_tr, D and A as in each class;
d_r = sqrt(r^2 + z_r^2), d_v = sqrt(r^2 + z_v^2); C1 and C2 from fresnel.py, exact in place of the published fits.
"""

import math
from dataclasses import dataclass
from functools import cached_property

from .fresnel import passing
from .geometry import clamp
from .medium import LONGEST, Channel

FARTHEST = 1e3 * LONGEST  # mm


def source_flux(z: float, d: float, sigma_tr: float) -> float:
    """Return z (1 + sigma_tr d) e^(-sigma_tr d) / d^3, the flux through the surface from a source at the depth z [mm^-2]."""
    return z / d * (1.0 + sigma_tr * d) * math.exp(-sigma_tr * d) / d / d


@dataclass(frozen=True)
class StandardDipole:
    """H. W. Jensen and others (SIGGRAPH 2001), with the expression corrected by C. Donner and H. W. Jensen (SIGGRAPH 2005).

        R(r) = alpha' / (4 pi) sum over z_r with d_r and z_v with d_v of z (1 + sigma_tr d) e^(-sigma_tr d) / d^3
        z_v = z_r (1 + 4 A / 3),   A = (1 + 2 C1) / (1 - 2 C1),   sigma_tr = sqrt(3 sigma_a sigma_t')

    `eta` is clamped to [1, 4], NaN to 1. Single scattering is left out of the paper's R and part of its reflectance.
    """

    channel: Channel
    eta: float = 1.3

    @cached_property
    def a(self) -> float:
        """A."""
        return standard_a(self.eta)

    def profile(self, r: float) -> float:
        """Return R(r) [mm^-2]; `r` [mm] is clamped to [0, 1e9], NaN to 0."""
        r, z = clamp(r, 0.0, FARTHEST), self.channel.mean_free_path
        z_v = z * (1.0 + 4.0 / 3.0 * self.a)
        sigma_tr = math.sqrt(3.0 * self.channel.loss) / z
        both = source_flux(z, math.hypot(r, z), sigma_tr) + source_flux(z_v, math.hypot(r, z_v), sigma_tr)
        return self.channel.albedo / (4.0 * math.pi) * both

    @property
    def reflectance(self) -> float:
        """R_d, the integral of R over the surface; in [0, 1]."""
        return standard_reflectance(self.channel.albedo, math.sqrt(3.0 * self.channel.loss), self.a)


def standard_a(eta: float) -> float:
    """Return A = (1 + F_dr) / (1 - F_dr) of the boundary of index `eta`, clamped to [1, 4]; at least 1."""
    inside = passing(eta).flux
    return (2.0 - inside) / inside


def standard_reflectance(albedo: float, q: float, a: float) -> float:
    """Return (alpha' / 2) (1 + e^(-4 A q / 3)) e^(-q), q = sqrt(3 (1 - alpha'))."""
    return 0.5 * albedo * (1.0 + math.exp(-4.0 / 3.0 * a * q)) * math.exp(-q)
