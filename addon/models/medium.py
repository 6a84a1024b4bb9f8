# SPDX-License-Identifier: GPL-3.0-or-later
"""Scattering media: coefficients per channel, the lengths that follow from them, and twelve measured ones.

Two lengths are both called a radius: the mean free path 1 / sigma_t', what Cycles' random walk wants, and the diffuse mean free
path 1 / sigma_tr, what most charts of "subsurface radius" hold. Among these media the second is 0.6 to 110 times the first.
Coefficients in mm^-1, lengths in mm. Primes mark scattering made isotropic by similarity, sigma_s' = sigma_s (1 - g).
"""

import math
from dataclasses import dataclass, field

from .geometry import clamp

SHORTEST, LONGEST = 1e-6, 1e6  # mm: shorter paths than a wavelength and longer ones than 1 km mean nothing here


@dataclass(frozen=True)
class Channel:
    """One channel of a medium: `sigma_s_prime` and `sigma_a` [mm^-1], each clamped to [0, 1e6], NaN to 0.

    What would be clearer than 1 km of mean free path is made to absorb until it is not, so that nothing gives black.
    """

    sigma_s_prime: float
    sigma_a: float
    sigma_t_prime: float = field(init=False)

    def __post_init__(self) -> None:
        """Clamp both and fold sigma_t' = sigma_s' + sigma_a."""
        scattering, absorption = (clamp(sigma, 0.0, 1.0 / SHORTEST) for sigma in (self.sigma_s_prime, self.sigma_a))
        absorption = max(absorption, 1.0 / LONGEST - scattering)
        object.__setattr__(self, "sigma_s_prime", scattering)
        object.__setattr__(self, "sigma_a", absorption)
        object.__setattr__(self, "sigma_t_prime", scattering + absorption)

    @classmethod
    def from_albedo(cls, albedo: float, mean_free_path: float) -> "Channel":
        """Return the channel of a single-scattering `albedo` alpha', clamped to [0, 1], and 1 / sigma_t' [mm], to [1e-6, 1e6]."""
        albedo, sigma_t = clamp(albedo, 0.0, 1.0), 1.0 / clamp(mean_free_path, SHORTEST, LONGEST)
        return cls(albedo * sigma_t, (1.0 - albedo) * sigma_t)

    @property
    def albedo(self) -> float:
        """alpha' = sigma_s' / sigma_t' in [0, 1]."""
        return self.sigma_s_prime / self.sigma_t_prime

    @property
    def loss(self) -> float:
        """1 - alpha' = sigma_a / sigma_t' in [0, 1], with all its digits."""
        return self.sigma_a / self.sigma_t_prime

    @property
    def mean_free_path(self) -> float:
        """1 / sigma_t' [mm], finite without absorption too: what a Radius socket gets."""
        return 1.0 / self.sigma_t_prime

    @property
    def diffuse_mean_free_path(self) -> float:
        """1 / sigma_tr = 1 / sqrt(3 sigma_a sigma_t') [mm], at most 1 km: without absorption it has no end."""
        return min(LONGEST, self.mean_free_path / math.sqrt(3.0 * self.loss)) if self.loss > 0.0 else LONGEST


@dataclass(frozen=True)
class Medium:
    """Channels red, green, blue; `eta` index of refraction."""

    name: str
    channels: tuple[Channel, Channel, Channel]
    eta: float = 1.3

    @property
    def albedo(self) -> tuple[float, ...]:
        """alpha' of each channel."""
        return tuple(channel.albedo for channel in self.channels)

    @property
    def mean_free_path(self) -> tuple[float, ...]:
        """1 / sigma_t' of each channel [mm]."""
        return tuple(channel.mean_free_path for channel in self.channels)

    @property
    def diffuse_mean_free_path(self) -> tuple[float, ...]:
        """1 / sigma_tr of each channel [mm]."""
        return tuple(channel.diffuse_mean_free_path for channel in self.channels)


def _medium(name: str, scattering: tuple[float, ...], absorption: tuple[float, ...], eta: float = 1.3) -> Medium:
    red, green, blue = (Channel(s, a) for s, a in zip(scattering, absorption, strict=True))
    return Medium(name, (red, green, blue), eta)


# H. W. Jensen, S. Marschner, M. Levoy, P. Hanrahan, "A practical model for subsurface light transport" (SIGGRAPH 2001), figure 5:
# sigma_s', sigma_a, eta.
MEDIA = (
    _medium("Apple", (2.29, 2.39, 1.97), (0.0030, 0.0034, 0.046)),
    _medium("Chicken 1", (0.15, 0.21, 0.38), (0.015, 0.077, 0.19)),
    _medium("Chicken 2", (0.19, 0.25, 0.32), (0.018, 0.088, 0.20)),
    _medium("Cream", (7.38, 5.47, 3.15), (0.0002, 0.0028, 0.0163)),
    _medium("Ketchup", (0.18, 0.07, 0.03), (0.061, 0.97, 1.45)),
    _medium("Marble", (2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071), 1.5),
    _medium("Potato", (0.68, 0.70, 0.55), (0.0024, 0.0090, 0.12)),
    _medium("Skim milk", (0.70, 1.22, 1.90), (0.0014, 0.0025, 0.0142)),
    _medium("Skin 1", (0.74, 0.88, 1.01), (0.032, 0.17, 0.48)),
    _medium("Skin 2", (1.09, 1.59, 1.79), (0.013, 0.070, 0.145)),
    _medium("Spectralon", (11.6, 20.4, 14.9), (0.0, 0.0, 0.0)),
    _medium("Whole milk", (2.55, 3.21, 3.77), (0.0011, 0.0024, 0.014)),
)
