# SPDX-License-Identifier: GPL-3.0-or-later
"""The models' formulas once more, as the papers print them, in 50 digits: what everything else is measured against.

Written from the papers' forms in angles and from nothing of ours, without a thought for cancellation, which 50 digits outlast. No
bpy. The vectors are taken as they are, not normalized: cosines above 1 count as 1, and there is no radiance where a cosine is below
1e-18, a vector is zero or not finite, N or V is longer than about 1e9, or N.L is above 1e18, which is what the shaders promise.
Parameters and albedo outside their range are moved to its nearest end, NaN to the lower one.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mpmath

type Vector = Sequence[float]
type Context = Any  # one of mpmath's: its functions and constants
type Number = Any  # mpmath.mpf or float, whichever the context makes

EXACT = mpmath.mp.clone()
EXACT.dps = 50
DOUBLE = mpmath.fp  # the same statements in 64-bit floats: 50 times as fast, to find where to look


class Angles(NamedTuple):
    """Light's and viewer's angles from the normal [radians], and the azimuth phi between the two.

    `s` = L.V - (N.L)(N.V) = sin(theta_i) sin(theta_o) cos(phi), and `turn` = N.(L x V) has sin(phi) in place of cos(phi).
    """

    cos_i: Number
    cos_o: Number
    theta_i: Number
    theta_o: Number
    cos_phi: Number
    s: Number
    turn: Number


def angles(n: Vector, l: Vector, v: Vector, context: Context) -> Angles | None:
    """Return the angles between vectors of about unit length, None where there is nothing to see."""
    if not sum(map(abs, (*n, *v))) < 1e9 or not all(map(math.isfinite, l)):
        return None
    n, l, v = ([context.mpf(x) for x in vector] for vector in (n, l, v))
    cos_i, cos_o = dot(n, l), dot(n, v)
    if not 1e-18 < cos_i < 1e18 or cos_o < 1e-18:
        return None
    cos_i, cos_o = min(context.one, cos_i), min(context.one, cos_o)
    sines = context.sqrt(1 - cos_i**2) * context.sqrt(1 - cos_o**2)
    s = limit(dot(l, v) - cos_i * cos_o, -sines, sines)
    turn = limit(dot(n, cross(l, v)), -context.one, context.one)
    cos_phi = limit(s / sines, -context.one, context.one) if sines else context.zero
    return Angles(cos_i, cos_o, context.acos(cos_i), context.acos(cos_o), cos_phi, s, turn)


def lambert(g: Angles, rho: Number, context: Context) -> Number:
    """Return (rho / pi) cos(theta_i)."""
    return rho / context.pi * g.cos_i


def oren_nayar(g: Angles, rho: Number, context: Context, sigma: float) -> Number:
    """Return M. Oren and S. Nayar (SIGGRAPH 1994), equation (30); `sigma` in radians, 0 to 100."""
    alpha, beta = max(g.theta_i, g.theta_o), min(g.theta_i, g.theta_o)
    a, b = slopes(sigma, context)
    return rho / context.pi * g.cos_i * (a + b * max(0, g.cos_phi) * context.sin(alpha) * context.tan(beta))


def oren_nayar_1994(g: Angles, rho: Number, context: Context, sigma: float) -> Number:
    """Return Oren and Nayar (SIGGRAPH 1994), equations (27) to (29), 0 where they fall below; `sigma` in radians, 0 to 100."""
    alpha, beta = max(g.theta_i, g.theta_o), min(g.theta_i, g.theta_o)
    pi, s2, c = context.pi, limit(context.mpf(sigma), 0, 100) ** 2, g.cos_phi
    c1, b = slopes(sigma, context)
    c2 = b * (context.sin(alpha) - (0 if c >= 0 else (2 * beta / pi) ** 3))
    c3 = s2 / (s2 + ratio(9, 100, context)) / 8 * (4 * alpha * beta / pi**2) ** 2
    once = c1 + c * c2 * context.tan(beta) + (1 - abs(c)) * c3 * context.tan((alpha + beta) / 2)
    twice = ratio(17, 100, context) * s2 / (s2 + ratio(13, 100, context)) * (1 - c * (2 * beta / pi) ** 2)
    return max(context.zero, rho / pi * g.cos_i * (once + rho * twice))


def fujii(g: Angles, rho: Number, context: Context, roughness: float) -> Number:
    """Return Y. Fujii's model (2015); `roughness` 0 to 1."""
    r = limit(context.mpf(roughness), 0, 1)
    t = max(g.cos_i, g.cos_o) if g.s > 0 else 1
    return rho / context.pi * g.cos_i * (1 + r * g.s / t) / (1 + r * k1(context))


def eon(g: Angles, rho: Number, context: Context, roughness: float) -> Number:
    """Return EON by J. Portsmouth, P. Kutz and S. Hill (JCGT 14(1), 2025), with the exact E; `roughness` 0 to 1."""
    return fujii(g, rho, context, roughness) + rho**2 * scattered(g, rho, context, roughness)


def cycles_diffuse(g: Angles, rho: Number, context: Context, roughness: float) -> Number:
    """Return Cycles' Diffuse BSDF: EON with rho^3 in place of rho^2; `roughness` 0 to 1."""
    return fujii(g, rho, context, roughness) + rho**3 * scattered(g, rho, context, roughness)


def scattered(g: Angles, rho: Number, context: Context, roughness: float) -> Number:
    """Return EON's multiple scattering without the factor rho^2."""
    r = limit(context.mpf(roughness), 0, 1)
    if not r:
        return context.zero
    pi, scale = context.pi, 1 / (1 + k1(context) * r)

    def missing(theta: Number) -> Number:
        sine, cosine = context.sin(theta), context.cos(theta)
        shape = sine * (theta - sine * cosine) + 2 * (sine / cosine * (1 - sine**3) - sine) / 3
        return 1 - scale * (1 + r * shape / pi)

    average = scale * (1 + (context.mpf(2) / 3 - 28 / (15 * pi)) * r)
    lost = missing(g.theta_i) * missing(g.theta_o)
    return g.cos_i / pi * average / (1 - rho * (1 - average)) * lost / (1 - average)


def wolff(g: Angles, rho: Number, context: Context, ior: float) -> Number:
    """Return L. Wolff's model (JOSA A 11(11), 1994) with Fresnel's equations in angles; `ior` 1 to 3, NaN to 1."""
    index = limit(context.mpf(ior), 1, 3)
    if index == 1:
        return lambert(g, rho, context)

    def reflectance(theta: Number, n: Number) -> Number:
        inside = context.asin(context.sin(theta) / n)
        if not theta:
            return ((n - 1) / (n + 1)) ** 2
        minus, plus = theta - inside, theta + inside
        return ((context.sin(minus) / context.sin(plus)) ** 2 + (context.tan(minus) / context.tan(plus)) ** 2) / 2

    leaving = context.asin(context.sin(g.theta_o) / index)
    return rho / context.pi * g.cos_i * (1 - reflectance(g.theta_i, index)) * (1 - reflectance(leaving, 1 / index))


def pitted(g: Angles, rho: Number, context: Context) -> Number:
    """Return J. Koenderink and others' thoroughly pitted surface (IJCV 31, 1999).

    The light reflected once is an integral of (m.L)(m.V) over the triangle m.N > 0, m.L' > 0, m.V' > 0, by J. Arvo's double axial
    moments (SIGGRAPH 1995): a third of [ (L.V) Omega + the sum over its sides of (integral of m along the side).L (pole.V) ]. The
    sides lie on the great circles around the poles N, L' and V', and the integral along one is the sum of the unit tangents at
    its pole towards the two others. Where two poles coincide or are opposite, their tangents have no direction, but cancel.
    """
    pi, phi = context.pi, context.atan2(abs(g.turn), g.s)
    n = (context.zero, context.zero, context.one)
    l = (context.sin(g.theta_i), context.zero, g.cos_i)
    v = (context.sin(g.theta_o) * context.cos(phi), context.sin(g.theta_o) * context.sin(phi), g.cos_o)
    poles = (n, *([2 * cosine * x - y for x, y in zip(u, n, strict=True)] for u, cosine in ((l, g.cos_i), (v, g.cos_o))))
    omega, total = 2 * pi, context.zero
    for k, pole in enumerate(poles):
        others = (poles[k - 1], poles[k - 2])
        along = [sum(parts) for parts in zip(*(tangent(pole, other, context) for other in others), strict=True)]
        total += dot(along, l) * dot(pole, v)
        omega -= context.atan2(norm(cross(pole, others[0]), context), dot(pole, others[0]))
    total += dot(l, v) * max(context.zero, omega)
    return rho / (3 * pi**2) * max(context.zero, total) / g.cos_o + rho**2 / (pi * (4 - 2 * rho)) * g.cos_i


def tangent(at: Sequence[Number], to: Sequence[Number], context: Context) -> list[Number]:
    """Return the unit tangent of the sphere at `at` towards `to`, zero where that has no direction."""
    side = [y - dot(at, to) * x for x, y in zip(at, to, strict=True)]
    length = norm(side, context)
    return [x / length for x in side] if length > 1000 * context.eps else [context.zero] * 3


MODELS: dict[str, Callable[..., Number]] = {
    "lambert": lambert,
    "oren_nayar": oren_nayar,
    "oren_nayar_1994": oren_nayar_1994,
    "fujii": fujii,
    "eon": eon,
    "cycles_diffuse": cycles_diffuse,
    "wolff": wolff,
    "pitted": pitted,
}


def radiance(
    model: str, n: Vector, l: Vector, v: Vector, albedo: float, parameters: Sequence[float] = (), context: Context = EXACT
) -> Number:
    """Return the radiance towards `v` [W/(m^2 sr)] for E0 = 1 W/m^2 from `l`.

    `model` is a key of MODELS or "blinn_phong", `parameters` its shape: sigma, roughness, ior, or the highlight's
    weight and exponent.
    """
    g = angles(n, l, v, context)
    if g is None:
        return context.zero
    rho = limit(context.mpf(albedo), 0, 1)
    if model == "blinn_phong":
        return rho / context.pi * g.cos_i + highlight(n, l, v, g, context, *parameters)
    return MODELS[model](g, rho, context, *parameters)


def highlight(n: Vector, l: Vector, v: Vector, g: Angles, context: Context, specular: float, exponent: float) -> Number:
    """Return k_s (m + 8) / (8 pi) (N.H)^m cos(theta_i), H the unit vector along L + V; k_s 0 to 1, m 0 to 10000."""
    weight, power = limit(context.mpf(specular), 0, 1), limit(context.mpf(exponent), 0, 10000)
    half = [context.mpf(x) + context.mpf(y) for x, y in zip(l, v, strict=True)]
    n_dot_h = limit(sum(context.mpf(x) * y for x, y in zip(n, half, strict=True)) / norm(half, context), 0, 1)
    return weight * (power + 8) / (8 * context.pi) * n_dot_h**power * g.cos_i


def slopes(sigma: float, context: Context) -> tuple[Number, Number]:
    """Return 1 - 0.5 s2 / (s2 + 0.33) and 0.45 s2 / (s2 + 0.09), s2 = sigma^2; `sigma` in radians, 0 to 100."""
    s2 = limit(context.mpf(sigma), 0, 100) ** 2
    return 1 - s2 / (s2 + ratio(33, 100, context)) / 2, ratio(45, 100, context) * s2 / (s2 + ratio(9, 100, context))


def k1(context: Context) -> Number:
    """Return 1/2 - 2 / (3 pi)."""
    return context.mpf(1) / 2 - 2 / (3 * context.pi)


def ratio(a: int, b: int, context: Context) -> Number:
    """Return a / b, as a decimal such as 0.33 means it."""
    return context.mpf(a) / b


def limit(x: Number, low: Number, high: Number) -> Number:
    """Return `x` inside [low, high]; NaN counts as `low`."""
    return min(x, high) if x > low else low


def dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    """Return a.b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Sequence[Number], b: Sequence[Number]) -> tuple[Number, Number, Number]:
    """Return a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Sequence[Number], context: Context) -> Number:
    """Return the length of `a`."""
    return context.sqrt(dot(a, a))
