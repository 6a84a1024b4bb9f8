# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light the layers of a Principled BSDF leave for the diffuse reflection below them, as Cycles has it, seen at N.V = mu.

Each layer takes away its directional albedo (`closure_layering_weight`, intern/cycles/kernel/closure/bsdf_util.h, in the order of
kernel/svm/closure.h): sheen, coat, coat tint, specular. That of the specular layer and of the coat is

    A = F D,    F = F0 + (1 - F0) s(mu, roughness, n),    D = 1 - (1 - E) (1 - F_ms)

s is the mean of Fresnel's reflectance over the microfacets that the viewer sees, as a fraction of the way from F0 to 1; E(mu,
roughness) is what GGX microfacets without Fresnel reflect once, F_ms what further scattering adds (C. Kulla, A. Conty, "Revisiting
Physically Based Shading at Imageworks", 2017). A layer with the distribution GGX instead of Multiscatter GGX has D = 1: Cycles
takes away what a lossless one would reflect. Cycles reads s and E from tables; here F is Fresnel's reflectance at the cosine c of
a smooth surface that reflects as much, which hardly depends on n:

    c^2 = mu^2 + r^2 P(mu, r),    1 - E = r^2 Q(mu, r)

with P and Q biquadratic. All functions take floats or sockets.
"""

from collections.abc import Sequence

from ..models.terms import FLOATS, SMALLEST_DIVISOR, Arithmetic, Number, polynomial
from ..models.wolff import transmittance

# Rows by power of mu, columns by power of the roughness
SMOOTHER = (
    (0.0162, 0.9567, -0.7614),
    (-0.2656, 1.3795, -0.6035),
    (-0.7654, -1.6473, 1.4729),
)
LOST = (
    (3.068, -7.19, 4.372),
    (-8.631, 25.682, -16.397),
    (4.763, -15.377, 10.415),
)
AVERAGE = (1.0195, -0.6015, -0.0335)  # of E over all views, in powers of the squared roughness
F0_MOST = 0.99  # above which Cycles takes no index of refraction from a reflectance
FSS = 4.08567, 1.00071  # Kulla and Conty's fit: <F> = (n - 1) / (FSS[0] + FSS[1] n)
LEAST_COSINE = 1e-4
# Numerator and denominator of the sheen's albedo
SHEEN = ((-0.00425, 0.18192, 0.50299), (-0.10204, -0.40377), (0.11563,))
SHEEN_BELOW = ((0.0, -0.017685, 1.70673, -0.81585), (1.0, -2.94999, 2.07602), (2.09361, -2.07726), (-0.178067,))


def biquadratic(ops: Arithmetic, table: Sequence[Sequence[float]], mu: Number, roughness: Number) -> Number:
    """Return the sum of table[i][j] mu^i roughness^j; what has the roughness alone is worked out first, as it is often constant."""
    rows = [polynomial(ops, row, roughness) if len(row) > 1 else row[0] for row in table]
    return polynomial(ops, rows, mu)


def specular_albedo(mu: Number, roughness: Number, f0: Number, tint: Number, multiple: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return A in [0, 1] of a specular layer: `f0` its reflectance at normal incidence, times the brightest channel of `tint`.

    `multiple`: 1 for Multiscatter GGX, 0 for GGX. `mu` and `roughness` are in [0, 1].
    """
    plain = ops.clamp(f0, 0.0, F0_MOST)
    root = ops.sqrt(plain)
    ior = (1.0 + root) / (1.0 - root)
    toward_1 = (1.0 - ops.minimum(f0 * tint, 1.0)) / (1.0 - plain)  # over that without a tint
    square = roughness * roughness
    cosine2 = mu * mu + square * biquadratic(ops, SMOOTHER, mu, roughness)
    cosine = ops.sqrt(ops.clamp(cosine2, LEAST_COSINE**2, 1.0))
    single = 1.0 - toward_1 * transmittance(ops, cosine, ior)
    lost = ops.clamp(square * biquadratic(ops, LOST, mu, roughness), 0.0, 1.0)
    average = polynomial(ops, AVERAGE, square)
    mean_fresnel = 1.0 - toward_1 * (1.0 - (ior - 1.0) / (FSS[0] + FSS[1] * ior))
    further = mean_fresnel * average / (1.0 - mean_fresnel * (1.0 - average))
    return single * (1.0 - multiple * lost * (1.0 - further))


def sheen_albedo(mu: Number, roughness: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the directional albedo of a white sheen, in [0, 1]; `mu` and `roughness` are in [0, 1]."""
    below = biquadratic(ops, SHEEN_BELOW, mu, roughness)
    return ops.clamp(biquadratic(ops, SHEEN, mu, roughness) / ops.maximum(below, SMALLEST_DIVISOR), 0.0, 1.0)


def level_f0(ior: Number, level: Number) -> Number:
    """Return the reflectance at normal incidence of an index of refraction and a Specular IOR Level."""
    ratio = (ior - 1.0) / (ior + 1.0)
    return ratio * ratio * (2.0 * level)


def coat_depth(mu: Number, ior: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the length of the view's path through a coat, over its thickness: the exponent of its tint."""
    return 1.0 / ops.sqrt(1.0 - (1.0 - mu * mu) / (ior * ior))
