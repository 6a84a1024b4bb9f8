# SPDX-License-Identifier: GPL-3.0-or-later
"""Dipoles that the extension does without, held against half-spaces by stability_subsurface.py: the better one, and an inverse."""

import math
from dataclasses import dataclass, field

from true_diffuse.addon.models.dipole import FARTHEST, source_flux, standard_a, standard_reflectance
from true_diffuse.addon.models.fresnel import passing
from true_diffuse.addon.models.geometry import clamp
from true_diffuse.addon.models.medium import Channel


def standard_inverse(reflectance: float, eta: float = 1.3) -> float:
    """Return the alpha' at which the standard dipole's R_d is `reflectance`, clamped to [0, 1], by halving an interval."""
    reflectance, a = clamp(reflectance, 0.0, 1.0), standard_a(eta)
    low, high = 0.0, math.sqrt(3.0)
    for _ in range(60):
        q = 0.5 * (low + high)
        low, high = (q, high) if standard_reflectance(1.0 - q * q / 3.0, q, a) > reflectance else (low, q)
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
        flux = source_flux(z, d_r, sigma_tr) + source_flux(z_v, d_v, sigma_tr)
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
