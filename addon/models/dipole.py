# SPDX-License-Identifier: GPL-3.0-or-later
"""Dipoles: where light that enters a half-space at one point, along the normal, comes out again, by diffusion theory.

A source lies at the depth z_r = 1 / sigma_t', its negative image at z_v above the surface, so that the flux across the boundary is
as Fresnel has it. R(r) is the radiant exitance at the distance r per entered flux. sigma_tr, D and A as in each class;
d_r = sqrt(r^2 + z_r^2), d_v = sqrt(r^2 + z_v^2); C1 and C2 from fresnel.py, exact in place of the published fits.
"""

import math
from dataclasses import dataclass, field

from .fresnel import passing
from .geometry import clamp
from .medium import LONGEST, Channel

FARTHEST = 1e3 * LONGEST  # mm


def _gradient(z: float, d: float, sigma_tr: float) -> float:
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
    a: float = field(init=False)

    def __post_init__(self) -> None:
        """Fold A."""
        object.__setattr__(self, "a", standard_a(self.eta))

    def profile(self, r: float) -> float:
        """Return R(r) [mm^-2]; `r` [mm] is clamped to [0, 1e9], NaN to 0."""
        r, z = clamp(r, 0.0, FARTHEST), self.channel.mean_free_path
        z_v = z * (1.0 + 4.0 / 3.0 * self.a)
        sigma_tr = math.sqrt(3.0 * self.channel.loss) / z
        both = _gradient(z, math.hypot(r, z), sigma_tr) + _gradient(z_v, math.hypot(r, z_v), sigma_tr)
        return self.channel.albedo / (4.0 * math.pi) * both

    @property
    def reflectance(self) -> float:
        """R_d, the integral of R over the surface; in [0, 1]."""
        return _standard_reflectance(self.channel.albedo, math.sqrt(3.0 * self.channel.loss), self.a)


def standard_a(eta: float) -> float:
    """Return A = (1 + F_dr) / (1 - F_dr) of the boundary of index `eta`, clamped to [1, 4]; at least 1."""
    inside = passing(eta).flux
    return (2.0 - inside) / inside


def _standard_reflectance(albedo: float, q: float, a: float) -> float:
    """Return (alpha' / 2) (1 + e^(-4 A q / 3)) e^(-q), q = sqrt(3 (1 - alpha'))."""
    return 0.5 * albedo * (1.0 + math.exp(-4.0 / 3.0 * a * q)) * math.exp(-q)


def standard_inverse(reflectance: float, eta: float = 1.3) -> float:
    """Return the alpha' at which the standard dipole's R_d is `reflectance`, clamped to [0, 1], by halving an interval."""
    reflectance, a = clamp(reflectance, 0.0, 1.0), standard_a(eta)
    low, high = 0.0, math.sqrt(3.0)
    for _ in range(60):
        q = 0.5 * (low + high)
        low, high = (q, high) if _standard_reflectance(1.0 - q * q / 3.0, q, a) > reflectance else (low, q)
    return max(0.0, 1.0 - low * low / 3.0) if reflectance > 0.0 else 0.0


@dataclass(frozen=True)
class BetterDipole:
    """E. d'Eon, "A better dipole" (2012): Grosjean's diffusion, and an exitance that has flux and fluence.

        R(r) = alpha'^2 / (4 pi) sum over the real source minus the image of
               [ C_E z (1 + sigma_tr d) e^(-sigma_tr d) / d^3 + (C_phi / D) e^(-sigma_tr d) / d ]
        D = (2 sigma_a + sigma_s') / (3 sigma_t'^2),   sigma_tr = sqrt(sigma_a / D),   z_v = -z_r - 4 A D
        A = (1 + 3 C2) / (1 - 2 C1),   C_phi = (1 - 2 C1) / 4,   C_E = (1 - 3 C2) / 2

    The paper adds the light scattered once (albedo.single_plane_albedo at eta = 1). The dipole alone already returns all light at
    alpha' = 1, so the sum is above 1 there. `eta` is clamped to [1, 4], NaN to 1.
    """

    channel: Channel
    eta: float = 1.3
    a: float = field(init=False)
    c_phi: float = field(init=False)
    c_e: float = field(init=False)

    def __post_init__(self) -> None:
        """Fold what depends on eta alone."""
        flux, gradient = passing(self.eta)
        object.__setattr__(self, "a", (2.0 - gradient) / flux)
        object.__setattr__(self, "c_phi", 0.25 * flux)
        object.__setattr__(self, "c_e", 0.5 * gradient)

    def profile(self, r: float) -> float:
        """Return R(r) [mm^-2]; `r` [mm] is clamped to [0, 1e9], NaN to 0."""
        r, z, loss = clamp(r, 0.0, FARTHEST), self.channel.mean_free_path, self.channel.loss
        d = (1.0 + loss) / 3.0 * z
        sigma_tr = math.sqrt(3.0 * loss / (1.0 + loss)) / z
        z_v = z + 4.0 * self.a * d  # how far above the surface
        d_r, d_v = math.hypot(r, z), math.hypot(r, z_v)
        flux = _gradient(z, d_r, sigma_tr) + _gradient(z_v, d_v, sigma_tr)
        # e^(-sigma_tr d_r) / d_r - e^(-sigma_tr d_v) / d_v, far away a small difference, put together from terms of one sign
        apart = (z_v - z) / (d_v + d_r) * (z_v + z)
        fluence = math.exp(-sigma_tr * d_r) * (apart / d_r - math.expm1(-sigma_tr * apart)) / d_v
        return self.channel.albedo**2 / (4.0 * math.pi) * (self.c_e * flux + self.c_phi / d * fluence)

    @property
    def reflectance(self) -> float:
        """The integral of R over the surface, without what is scattered once; in [0, 1], and 1 without absorption.

        alpha'^2 / 2 e^(-sigma_tr z_r) [ C_E (1 + e^(-x)) + 4 A C_phi (1 - e^(-x)) / x ],   x = 4 A D sigma_tr
        """
        loss = self.channel.loss
        x = 4.0 * self.a * math.sqrt(loss * (1.0 + loss) / 3.0)
        mean = -math.expm1(-x) / x if x > 0.0 else 1.0
        both = self.c_e * (1.0 + math.exp(-x)) + 4.0 * self.a * self.c_phi * mean
        return 0.5 * self.channel.albedo**2 * math.exp(-math.sqrt(3.0 * loss / (1.0 + loss))) * both
