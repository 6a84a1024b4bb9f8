# SPDX-License-Identifier: GPL-3.0-or-later
"""Equation (1) made of the closures that the engines offer: what the Oren-Nayar node group renders, since no node sees the light.

Both ways add one clamped cosine around a bent normal M, in the plane of N and V, to a base around N; mu = N.V = cos(v), and V_t is
the unit tangent towards the viewer.

- EEVEE: B max(0, s) min(1, (N.L)/mu) is nearly a cosine lobe towards the viewer, so
      L_r ~ (rho / pi) E0 [ A max(0, N.L) + B sin(v) (w_0 + w_1 mu) max(0, M.L) H ],   M along V_t + cot_1 mu N
  H = clamp(10 (N.L) + 1) is EEVEE's own: light from behind the surface fades out within 6 degrees.
- Cycles: its Diffuse BSDF is Fujii's model, which at r = B / A, times A (1 + K1 r), is equation (1) wherever s >= 0. For s < 0 it
  falls below by B |s|, which a lobe away from the viewer brings back:
      L_r ~ (rho / pi) E0 [ A (N.L) (1 + r s / t) + B sin(v) w_0 max(0, M.L) G ],   M along -V_t + cot_0 N
  G is Cycles' own ("bump map correction"): the shadowing of a GGX surface of alpha^2 = tan^2(angle of N, M) / 8, at most 1, by
  A. Conty Estevez, P. Lecocq, C. Stein, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem" (2019).

The constants are least-squares fits over all lights above the surface and all views.
"""

import math
from dataclasses import dataclass, field

from .fujii import K1, Fujii
from .oren_nayar import OrenNayar, coefficients
from .vector import Vector, add, dot, normalize, scale


@dataclass(frozen=True)
class BentLobe:
    """A cosine lobe along `side` V_t + (cot_0 + cot_1 mu) N with the weight B sin(v) (w_0 + w_1 mu)."""

    side: float
    w_0: float
    w_1: float
    cot_0: float
    cot_1: float

    def normal_and_weight(self, b: float, n: Vector, v: Vector) -> tuple[Vector, float]:
        """Return M (unit length) and the lobe's weight for B = `b`."""
        mu = dot(n, v)
        tangent = add(v, scale(n, -mu))
        sine = math.sqrt(dot(tangent, tangent))
        bent = normalize(add(scale(tangent, self.side), scale(n, (self.cot_0 + self.cot_1 * mu) * sine)))
        return bent, b * sine * (self.w_0 + self.w_1 * mu)


EEVEE_LOBE = BentLobe(side=1.0, w_0=0.916, w_1=-0.643, cot_0=0.0, cot_1=0.630)
CYCLES_LOBE = BentLobe(side=-1.0, w_0=0.728, w_1=0.0, cot_0=1.0 / math.tan(math.radians(85.6)), cot_1=0.0)


def eevee_horizon(n_dot_l: float) -> float:
    """Return the factor by which EEVEE fades all closures of a pixel near the horizon of its first one; N.L may be negative."""
    return min(1.0, max(0.0, 10.0 * n_dot_l + 1.0))


def cycles_bump_shadowing(n_dot_l: float, n_dot_m: float, m_dot_l: float) -> float:
    """Return the factor by which Cycles shadows a diffuse closure with the bent normal M, for unit vectors; in [0, 1]."""
    if n_dot_l <= 0.0 or n_dot_m <= 0.0 or m_dot_l <= 0.0:
        return 0.0
    alpha2 = min(1.0, 0.125 * (1.0 / (n_dot_m * n_dot_m) - 1.0))
    tangent2 = 1.0 / (n_dot_l * n_dot_l) - 1.0
    return 2.0 / (1.0 + math.sqrt(1.0 + max(0.0, alpha2 * tangent2)))


@dataclass(frozen=True)
class EeveeLobes(OrenNayar):
    """What the Oren-Nayar group reflects in EEVEE; the package's `Model` interface. `sigma` in radians, >= 0."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; also from just below the horizon, as EEVEE lets it."""
        if dot(n, v) <= 0.0:
            return 0.0
        bent, weight = EEVEE_LOBE.normal_and_weight(self.b, n, v)
        n_dot_l = dot(n, l)
        lobe = weight * max(0.0, dot(bent, l)) * eevee_horizon(n_dot_l)
        return albedo / math.pi * (self.a * max(0.0, n_dot_l) + lobe)


@dataclass(frozen=True)
class CyclesLobes:
    """What the Oren-Nayar group reflects in Cycles; the package's `Model` interface. `sigma` in radians, >= 0."""

    sigma: float
    b: float = field(init=False)
    base: Fujii = field(init=False)
    base_weight: float = field(init=False)

    def __post_init__(self) -> None:
        """Fold what depends on sigma alone; raises ValueError for a sigma out of range."""
        a, b = coefficients(self.sigma)
        object.__setattr__(self, "b", b)
        object.__setattr__(self, "base", Fujii(b / a))
        object.__setattr__(self, "base_weight", a + K1 * b)

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2."""
        n_dot_l = dot(n, l)
        if n_dot_l <= 0.0 or dot(n, v) <= 0.0:
            return 0.0
        bent, weight = CYCLES_LOBE.normal_and_weight(self.b, n, v)
        m_dot_l = dot(bent, l)
        lobe = weight * max(0.0, m_dot_l) * cycles_bump_shadowing(n_dot_l, dot(n, bent), m_dot_l)
        return self.base_weight * self.base.radiance(n, l, v, albedo) + albedo / math.pi * lobe
