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

    c^2 = mu^2 + P(mu, r),    1 - E = r^2 Q(mu, r)

with polynomials P and Q. EEVEE does the same with other tables: another P and another sheen, and it takes both distributions for
Multiscatter GGX. For indices of refraction from 1.3 to 2, over all views and roughnesses, what the specular layer or a coat leaves
is off by 0.15 % RMS (GGX: 0.25 %) from Cycles, 0.45 % from EEVEE, and the albedo of a sheen by 0.0035 and 0.0005; a thin film is
not known here. `scripts/fit/principled.py` finds the numbers. All functions take floats or sockets.
"""

from collections.abc import Sequence
from typing import NamedTuple

from ..models.terms import FLOATS, SMALLEST_DIVISOR, Arithmetic, Number, polynomial
from ..models.wolff import transmittance

type Table = Sequence[Sequence[Number]]  # of factors: rows by power of mu, columns by power of the roughness


class Layers(NamedTuple):
    """The numbers of an engine: P, and numerator and denominator of the sheen's albedo."""

    smoother: Table
    sheen: Table
    sheen_below: Table


CYCLES = Layers(
    smoother=(
        (0.0, 0.0, 0.15125, 0.35696, -0.31825),
        (0.0, 0.0, -1.1092, 5.0296, -3.395),
        (0.0, 0.0, -0.09766, -4.8885, 4.0134),
    ),
    sheen=((0.0006275, -0.0059957, 1.5152), (-0.01712, -0.76239), (0.09528,)),
    sheen_below=((0.0, -0.27793, 3.5287, -1.3054), (1.0, -4.2017, 4.0718), (6.6905, -6.7404), (-0.39736,)),
)
# The sheen is EEVEE's own formula, in gpu_shader_material_principled.glsl
EEVEE = Layers(
    smoother=(
        (0.0095475, 0.0, 0.074954, 0.66496, -0.40205),
        (-0.20826, 0.0, -1.1824, 7.4202, -5.714),
        (0.63358, 0.0, -1.225, -5.9883, 5.801),
    ),
    sheen=((-0.1405, 6.1211, 35.6694), (0.28105, -24.4269), (-0.1405,)),
    sheen_below=((-0.2246, 1.925, 58.5299), (74.2268, -85.0941), (9.8955,)),
)
LOST = ((2.8603, -6.0241, 3.4272), (-7.7172, 21.157, -12.811), (4.04, -11.906, 7.6805))  # Q
AVERAGE = (1.0192, -0.58765, -0.056457)  # E's average over all views, by power of the squared roughness
F0_MOST = 0.99  # above which Cycles takes no index of refraction from a reflectance
FSS = 4.08567, 1.00071  # Kulla and Conty's fit: <F> = (n - 1) / (FSS[0] + FSS[1] n)
LEAST_COSINE = 1e-4


def bivariate(ops: Arithmetic, table: Table, mu: Number, roughness: Number) -> Number:
    """Return the sum of table[i][j] mu^i roughness^j; what has the roughness alone is worked out first, as it is often constant."""
    rows = [polynomial(ops, row, roughness) if len(row) > 1 else row[0] for row in table]
    return polynomial(ops, rows, mu)


class Interface:
    """A specular layer: `f0` its reflectance at normal incidence, times the brightest channel of a `tint`."""

    def __init__(self, f0: Number, tint: Number = 1.0, ops: Arithmetic = FLOATS) -> None:
        self.ops = ops
        plain = ops.clamp(f0, 0.0, F0_MOST)
        root = ops.sqrt(plain)
        self.ior = (1.0 + root) / (1.0 - root)
        self.passed = (1.0 - ops.minimum(f0 * tint, 1.0)) / (1.0 - plain)
        """What passes of what would pass without the tint."""

    def lost(self, mu: Number, roughness: Number) -> Number:
        """Return 1 - D of Multiscatter GGX."""
        ops, square = self.ops, roughness * roughness
        lost = ops.clamp(square * bivariate(ops, LOST, mu, roughness), 0.0, 1.0)
        average = polynomial(ops, AVERAGE, square)
        mean_fresnel = 1.0 - self.passed * (1.0 - (self.ior - 1.0) / (FSS[0] + FSS[1] * self.ior))
        further = mean_fresnel * average / (1.0 - mean_fresnel * (1.0 - average))
        return lost * (1.0 - further)

    def single(self, layers: Layers, mu: Number, roughness: Number) -> Number:
        """Return F."""
        ops = self.ops
        cosine2 = ops.multiply_add(mu, mu, bivariate(ops, layers.smoother, mu, roughness))
        cosine = ops.sqrt(ops.clamp(cosine2, LEAST_COSINE**2, 1.0))
        return 1.0 - self.passed * transmittance(ops, cosine, self.ior)


def specular_albedo(layers: Layers, mu: Number, roughness: Number, interface: Interface, keeps_all: Number = 1.0) -> Number:
    """Return A in [0, 1] of a specular layer; `keeps_all` is 1 for Multiscatter GGX, 0 for GGX. `mu`, `roughness` in [0, 1]."""
    return interface.single(layers, mu, roughness) * (1.0 - keeps_all * interface.lost(mu, roughness))


def sheen_albedo(layers: Layers, mu: Number, roughness: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the directional albedo of a white sheen, in [0, 1]; `mu` and `roughness` are in [0, 1]."""
    below = ops.maximum(bivariate(ops, layers.sheen_below, mu, roughness), SMALLEST_DIVISOR)
    return ops.clamp(bivariate(ops, layers.sheen, mu, roughness) / below, 0.0, 1.0)


def level_f0(ior: Number, level: Number = 0.5) -> Number:
    """Return the reflectance at normal incidence of an index of refraction and a Specular IOR Level."""
    ratio = (ior - 1.0) / (ior + 1.0)
    return ratio * ratio * (2.0 * level)


def coat_depth(mu: Number, ior: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the length of the view's path through a coat, over its thickness: the exponent of its tint."""
    return 1.0 / ops.sqrt(1.0 - (1.0 - mu * mu) / (ior * ior))
