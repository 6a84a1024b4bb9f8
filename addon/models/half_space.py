# SPDX-License-Identifier: GPL-3.0-or-later
"""What a half-space that scatters isotropically reflects, exactly, and which albedo it needs to reflect what is wanted.

alpha = sigma_s / sigma_t is the albedo of a single scattering; the boundary is index-matched. S. Chandrasekhar, "Radiative
Transfer" (1960), chapters III to V, with the H function of that albedo:

    collimated light from mu:        R(mu) = 1 - H(mu) sqrt(1 - alpha)
    light from everywhere alike:     R = 1 - 2 sqrt(1 - alpha) integral of H(mu) mu dmu over [0, 1]
    ln H(mu) = -(mu / pi) integral of ln(1 - alpha u / tan(u)) / (cos^2(u) + mu^2 sin^2(u)) du over u in [0, pi/2]

The logarithm is singular at u = i artanh(k), close to u = 0 where alpha is near 1; k in [0, 1] solves k = alpha artanh(k). With its
argument divided by sin^2(u) + k^2 cos^2(u) it is smooth, and that factor's own part of ln H is ln((1 + mu) / (1 + k mu)). Media
that scatter forward are reduced to isotropic ones by similarity: sigma_s' = sigma_s (1 - g).

Every albedo and reflectance is clamped to [0, 1], NaN to 0; cosines to [0, 1].
"""

import functools
import math
from typing import NamedTuple

from .geometry import clamp
from .quadrature import gauss_legendre
from .terms import FLOATS, Arithmetic, Number, polynomial

ORDER = 48
LN_2 = math.log(2.0)


def diffusion_root(albedo: float) -> float:
    """Return k in [0, 1] with k = alpha artanh(k), the decay of the diffuse light with depth as a fraction of sigma_t."""
    low, high = 0.0, 1.0
    for _ in range(60):
        k = 0.5 * (low + high)
        low, high = (k, high) if k < 1.0 and albedo * math.atanh(k) < k else (low, k)
    return high


@functools.lru_cache(maxsize=64)
def _smooth(albedo: float) -> tuple[float, tuple[tuple[float, float, float], ...]]:
    """Return k, and (weight times logarithm, cos^2, sin^2) of the nodes u = (pi/2)(1 - v^2), close where a small mu needs them."""
    k, nodes = diffusion_root(albedo), []
    for x, weight in gauss_legendre(ORDER):
        v = 0.5 * (1.0 + x)
        u = 0.5 * math.pi * (1.0 - v * v)
        cos2, sin2 = math.cos(u) ** 2, math.sin(u) ** 2
        logarithm = math.log((1.0 - albedo * u / math.tan(u)) / (sin2 + k * k * cos2))
        nodes.append((0.5 * math.pi * v * weight * logarithm, cos2, sin2))
    return k, tuple(nodes)


def log_h(mu: float, albedo: float) -> float:
    """Return ln H(mu) of Chandrasekhar's H function for isotropic scattering; to about 1e-12, or 1e-8 mu where mu < 0.05.

    With 1 - alpha below 1e-13 k has lost its digits, and H may be wrong by 1e-8.
    """
    mu, albedo = clamp(mu, 0.0, 1.0), clamp(albedo, 0.0, 1.0)
    k, nodes = _smooth(albedo)
    rest = sum(value / (cos2 + mu * mu * sin2) for value, cos2, sin2 in nodes)
    return math.log1p(mu) - math.log1p(k * mu) - mu / math.pi * rest


def plane_albedo(albedo: float, mu: float) -> float:
    """Return the fraction reflected of a beam from the cosine `mu`; in [0, 1]."""
    albedo = clamp(albedo, 0.0, 1.0)
    if albedo in (0.0, 1.0):
        return albedo
    return max(0.0, -math.expm1(log_h(mu, albedo) + 0.5 * math.log1p(-albedo)))


def diffuse_albedo(albedo: float) -> float:
    """Return the fraction reflected of light from everywhere alike; in [0, 1], to about 1e-10 of it. About 1 ms."""
    albedo = clamp(albedo, 0.0, 1.0)
    if albedo in (0.0, 1.0):
        return albedo
    # mu = v^2, since H has a term mu ln(mu)
    nodes = ((0.5 * (1.0 + x), weight) for x, weight in gauss_legendre(ORDER))
    return min(1.0, sum(2.0 * weight * v**3 * plane_albedo(albedo, v * v) for v, weight in nodes))


class Rational(NamedTuple):
    """R = (1 - s)(1 - p s) / (1 + q s + r s^2), the form of all fits to a half-space's reflectance; s = sqrt(1 - alpha)."""

    p: float
    q: float
    r: float

    def reflectance(self, s: Number, ops: Arithmetic = FLOATS) -> Number:
        """Return R in [0, 1]."""
        return (1.0 - s) * (1.0 - s * self.p) / polynomial(ops, (1.0, self.q, self.r), s)

    def s(self, reflectance: Number, ops: Arithmetic = FLOATS) -> Number:
        """Return the s in [0, 1] at which R is `reflectance`, in [0, 1]."""
        b = reflectance * self.q + (1.0 + self.p)
        off = 1.0 - reflectance
        root = ops.sqrt(b * b - (4.0 * self.p - reflectance * (4.0 * self.r)) * off)
        return ops.minimum(off * 2.0 / (b + root), 1.0)

    def albedo(self, reflectance: float) -> float:
        """Return alpha = 1 - s^2 in [0, 1]."""
        s = self.s(reflectance)
        return (1.0 - s) * (1.0 + s)


# diffuse_albedo as a rational function of s = sqrt(1 - alpha), R = (1 - s)(1 - P s) / (1 + Q s + S s^2): van de Hulst's form with
# one more term. Q and S are set by the exact slopes at both ends, dR/ds = -4 / sqrt(3) at s = 0 and dR/dalpha = (2/3)(1 - ln 2) at
# alpha = 0; P by the least largest relative error.
P = -0.3415
Q = 4.0 / math.sqrt(3.0) - 1.0 - P
DIFFUSE = Rational(P, Q, 0.75 * (1.0 - P) / (1.0 - LN_2) - 1.0 - Q)
VAN_DE_HULST = Rational(0.139, 1.17, 0.0)


def diffuse_albedo_fit(albedo: float) -> float:
    """Return `diffuse_albedo` to 2e-5 of it, in closed form."""
    return DIFFUSE.reflectance(math.sqrt(1.0 - clamp(albedo, 0.0, 1.0)))


def single_scattering_albedo_fit(reflectance: float) -> float:
    """Return the alpha of which `diffuse_albedo_fit` is `reflectance`, in closed form; in [0, 1]."""
    return DIFFUSE.albedo(clamp(reflectance, 0.0, 1.0))


def single_plane_albedo(albedo: float, mu: float) -> float:
    """Return the fraction of a beam from `mu` that is scattered exactly once and leaves: (alpha / 2)(1 - mu ln(1 + 1 / mu))."""
    mu = clamp(mu, 0.0, 1.0)
    kept = mu * (math.log1p(mu) - math.log(mu)) if mu > 0.0 else 0.0
    return 0.5 * clamp(albedo, 0.0, 1.0) * (1.0 - kept)
