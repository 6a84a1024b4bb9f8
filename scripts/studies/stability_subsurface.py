# SPDX-License-Identifier: GPL-3.0-or-later
"""Where published subsurface formulas, coded as printed in 64-bit floats, fail or lose digits, and what our models give there.

Expected values come from closed forms, limits or 40 decimal digits, not from the models. No bpy.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal, localcontext
from functools import partial
from typing import Any

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import half_space
from true_diffuse.addon.models.burley import Burley
from true_diffuse.addon.models.dipole import StandardDipole, standard_a
from true_diffuse.addon.models.fresnel import passing
from true_diffuse.addon.models.medium import LONGEST, SHORTEST, Channel
from true_diffuse.addon.models.quadrature import integrate
from true_diffuse.scripts.studies import half_space_inverses
from true_diffuse.scripts.studies.dipoles import BetterDipole, standard_inverse
from true_diffuse.scripts.studies.study import Table, number_or_name

type Number = Any  # float or Decimal
type Functions = Any  # what has sqrt and exp of that Number: the module math or the class Decimal

# sigma_s', sigma_a [mm^-1]: alpha' from 1 to 0
COEFFICIENTS = ((1.0, 0.0), (1.0, 1e-16), (1.0, 1e-12), (1.0, 1e-6), (0.5, 0.5), (1e-6, 1.0), (0.0, 1.0))
# and r [mm]: at the source and far away, mean free paths of 1e-6 mm and 1 km, channels a factor of 1e3 apart
DISTANCES = (
    *((1.0, 1e-6, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 1e3), (1.0, 0.0, 1e6), (1.0, 1e-12, 1e5), (999999.0, 1.0, 1e-6)),
    *((1e-6, 1e-9, 1e6), (1.0, 1e-3, 1.0), (1.0, 1e3, 1e-3)),
)
H_CONSERVATIVE = 2.907810529  # H(1) at alpha = 1; Chandrasekhar (1960), table XI, has 2.9078


def records() -> Iterator[Record]:
    """Yield a record for each formula and input: model, case, plain, got, expected, error (relative, absolute at 0), finite.

    `plain` is the published formula's value, NaN where it divides by 0, overflows or leaves its domain; `got` is our model's.
    """
    yield from _boundary()
    yield from _lengths()
    yield from _dipoles()
    yield from _burley()
    yield from _albedo()


def _record(model: str, case: str, got: float, expected: float, plain: Callable[..., float], *arguments: float) -> Record:
    try:
        printed = plain(*arguments)
    except (ArithmeticError, ValueError):
        printed = math.nan
    return {
        "model": model,
        "case": case,
        "plain": number_or_name(printed),
        "got": number_or_name(got),
        "expected": expected,
        "error": number_or_name(abs(got - expected) / (abs(expected) or 1.0)),
        "finite": math.isfinite(got),
    }


def jensen_fdr(eta: float) -> float:
    """Return F_dr of H. W. Jensen and others (SIGGRAPH 2001) for eta >= 1."""
    return -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta


def jensen_a(eta: float) -> float:
    """Return A of the same paper."""
    return (1.0 + jensen_fdr(eta)) / (1.0 - jensen_fdr(eta))


def d_eon_2c1(eta: float) -> float:
    """Return 2 C1 of E. d'Eon and G. Irving (SIGGRAPH 2011) for eta >= 1."""
    return -9.23372 + eta * (22.2272 + eta * (-20.9292 + eta * (10.2291 + eta * (-2.54396 + eta * 0.254913))))


def d_eon_3c2(eta: float) -> float:
    """Return 3 C2 of the same paper for eta >= 1."""
    low = ((135.926 / eta - 656.175) / eta + 1376.53) / eta - 1641.1
    return low + eta * (1213.67 + eta * (-568.556 + eta * (164.798 + eta * (-27.0181 + eta * 1.91826))))


def first_moment(n: float) -> float:
    """Return 2 C1 in closed form: 1 - (1 - r) / n^2 with J. W. T. Walsh's (1926) external diffuse reflectance r; 0 at n = 1."""
    if n == 1.0:
        return 0.0
    n2, n4 = n * n, n**4
    r = 0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) ** 2)
    r += n2 * (n2 - 1.0) ** 2 / (n2 + 1.0) ** 3 * math.log((n - 1.0) / (n + 1.0))
    r -= 2.0 * n**3 * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
    r += 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0) ** 2) * math.log(n)
    return 1.0 - (1.0 - r) / n2


def second_moment(n: float) -> float:
    """Return 3 C2 as a sum over the cosines inside, with total reflection; accurate to about 1e-7."""
    critical, count = math.sqrt(1.0 - 1.0 / n**2), 4000
    total = critical**3
    for k in range(count if n > 1.0 else 0):
        w = (k + 0.5) / count
        mu = critical + (1.0 - critical) * w * w
        inside = math.acos(mu)
        outside = math.asin(min(1.0, n * math.sin(inside)))
        minus, plus = outside - inside, outside + inside
        f = 0.5 * ((math.sin(minus) / math.sin(plus)) ** 2 + (math.tan(minus) / math.tan(plus)) ** 2)
        total += 3.0 * f * mu * mu * (1.0 - critical) * 2.0 * w / count
    return total


def _boundary() -> Iterator[Record]:
    for eta in (1.0, 1.01, 1.3, 2.5, 3.0, 4.0):
        case, first, passed = f"eta {eta:g}", first_moment(eta), passing(eta)
        yield _record("Jensen F_dr", case, 1.0 - passed.flux, first, jensen_fdr, eta)
        yield _record("d'Eon 2 C1", case, 1.0 - passed.flux, first, d_eon_2c1, eta)
        yield _record("d'Eon 3 C2", case, 1.0 - passed.gradient, second_moment(eta), d_eon_3c2, eta)
        yield _record("standard dipole A", case, standard_a(eta), (1.0 + first) / (1.0 - first), jensen_a, eta)


def _lengths() -> Iterator[Record]:
    def mean_free_path(s: float, a: float) -> float:
        return 1.0 / (s + a)

    def diffuse_mean_free_path(s: float, a: float) -> float:
        return 1.0 / math.sqrt(3.0 * a * (a + s))

    # without absorption the diffuse mean free path is infinite, in vacuum both are; our models then have LONGEST, with alpha' = 0
    for case, s, a, length, diffuse in (
        ("Spectralon", 11.6, 0.0, 1.0 / 11.6, LONGEST),
        ("sigma_a 1e-18", 1.0, 1e-18, 1.0, LONGEST),
        ("sigma_a 1e-6", 1.0, 1e-6, 1.0 / 1.000001, 1.0 / math.sqrt(3.000003e-6)),
        ("vacuum", 0.0, 0.0, LONGEST, LONGEST / math.sqrt(3.0)),
    ):
        channel = Channel(s, a)
        yield _record("mean free path [mm]", case, channel.mean_free_path, length, mean_free_path, s, a)
        yield _record("diffuse mean free path [mm]", case, channel.diffuse_mean_free_path, diffuse, diffuse_mean_free_path, s, a)

    def by_way_of_sigma(length: float) -> float:
        return 1.0 / (1.0 / length)

    for length, expected in ((0.0, SHORTEST), (1e-6, 1e-6), (1e6, 1e6), (math.inf, LONGEST), (math.nan, SHORTEST)):
        got = Channel.from_albedo(0.9, length).mean_free_path
        yield _record("mean free path [mm]", f"asked for {length:g}", got, expected, by_way_of_sigma, length)


def exact(formula: Callable[..., Number], *arguments: float) -> float:
    """Return `formula` with 40 decimal digits."""
    with localcontext() as context:
        context.prec = 40
        return float(formula(Decimal, *map(Decimal, arguments)))


def standard_profile(m: Functions, s: Number, a: Number, r: Number) -> Number:
    """Return the standard dipole's R(r) at eta = 1, where A = 1."""
    z, sigma_tr, total = 1 / (s + a), m.sqrt(3 * a * (s + a)), 0
    for depth in (z, z * 7 / 3):
        d = m.sqrt(r * r + depth * depth)
        total += depth * (sigma_tr * d + 1) * m.exp(-sigma_tr * d) / d**3
    return s / (s + a) * total / (4 * type(s)(math.pi))


def better_profile(m: Functions, s: Number, a: Number, r: Number) -> Number:
    """Return the better dipole's R(r) at eta = 1, where A = 1, C_E = 1/2, C_phi = 1/4."""
    z, diffusion, total = 1 / (s + a), (2 * a + s) / (3 * (s + a) ** 2), 0
    sigma_tr = m.sqrt(a / diffusion)
    for depth, sign in ((z, 1), (-z - 4 * diffusion, -1)):
        d = m.sqrt(r * r + depth * depth)
        total += sign * (depth * (sigma_tr * d + 1) / d**2 / 2 + 1 / (4 * diffusion)) * m.exp(-sigma_tr * d) / d
    return (s / (s + a)) ** 2 * total / (4 * type(s)(math.pi))


def standard_total(m: Functions, alpha: Number) -> Number:
    """Return the standard dipole's R_d at eta = 1."""
    q = m.sqrt(3 * (1 - alpha))
    return alpha / 2 * (1 + m.exp(-4 * q / 3)) * m.exp(-q)


def better_total(m: Functions, alpha: Number) -> Number:
    """Return the better dipole's reflectance at eta = 1; the formula divides by 0 at alpha' = 1, where it tends to 1."""
    k = m.sqrt((1 - alpha) * (2 - alpha) / 3)
    both = (1 + m.exp(-4 * k)) / 2 + (1 - m.exp(-4 * k)) / k / 4
    return alpha * alpha / 2 * m.exp(-m.sqrt(3 * (1 - alpha) / (2 - alpha))) * both


def of_coefficients(total: Callable[..., Number], m: Functions, s: Number, a: Number) -> Number:
    """Return a `total` of alpha' = sigma_s' / (sigma_s' + sigma_a)."""
    return total(m, s / (s + a))


def twelve_halvings(reflectance: float) -> float:
    """Return alpha' of the standard dipole at eta = 1 as Cycles does, by bisection; a reflectance from 0.995 on counts as white."""
    if reflectance < 1e-4 or reflectance >= 0.995:
        return 0.0 if reflectance < 1e-4 else 0.999999
    low, high = 0.0, 1.0
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if standard_total(math, middle) < reflectance else (low, middle)
    return 0.5 * (low + high)


def _dipoles() -> Iterator[Record]:
    for s, a in COEFFICIENTS:
        channel, case, alpha = Channel(s, a), f"sigma_s' {s:g}, sigma_a {a:g}", s / (s + a)
        total = exact(partial(of_coefficients, standard_total), s, a)
        got = StandardDipole(channel, 1.0).reflectance
        yield _record("standard dipole R_d", case, got, total, partial(standard_total, math), alpha)
        yield _record("standard dipole alpha'", case, standard_inverse(total, 1.0), alpha, twelve_halvings, total)
        total = exact(partial(of_coefficients, better_total), s, a) if a else 1.0
        yield _record("better dipole R_d", case, BetterDipole(channel, 1.0).reflectance, total, partial(better_total, math), alpha)
    for s, a, r in DISTANCES:
        channel, case = Channel(s, a), f"sigma_s' {s:g}, sigma_a {a:g}, r {r:g}"
        for name, dipole, profile in (
            ("standard", StandardDipole(channel, 1.0), standard_profile),
            ("better", BetterDipole(channel, 1.0), better_profile),
        ):
            expected = exact(profile, s, a, r)
            yield _record(f"{name} dipole R(r)", case, dipole.profile(r), expected, partial(profile, math), s, a, r)


def _burley() -> Iterator[Record]:
    def ring(d: float, r: float) -> float:
        return 2.0 * math.pi * r * (math.exp(-r / d) + math.exp(-r / (3.0 * d))) / (8.0 * math.pi * d * r)

    def cdf(m: Functions, x: Number) -> Number:
        return 1 - m.exp(-x) / 4 - 3 * m.exp(-x / 3) / 4

    def radius(share: float) -> float:
        return -3.0 * math.log(2.0 * math.sinh(math.asinh(2.0 * (1.0 - share)) / 3.0))

    yield _record("Burley 2 pi r R(r)", "d 1, r 0", Burley(1.0).ring(0.0), 0.5, ring, 1.0, 0.0)
    yield _record("Burley 2 pi r R(r)", "d 0, r 0", Burley(0.0).ring(0.0), 0.5 / SHORTEST, ring, 0.0, 0.0)
    for x in (1e-12, 1e-8, 1e-3):
        share = exact(cdf, x)
        yield _record("Burley CDF", f"r {x:g} d", Burley(1.0).cdf(x), share, partial(cdf, math), x)
        yield _record("Burley r / d", f"of its share, {x:g}", Burley(1.0).radius(share), x, radius, share)


def _albedo() -> Iterator[Record]:
    def rounded_inverse(color: float) -> float:
        root = math.sqrt(9.59217 + 41.6808 * color + 17.7126 * color * color)
        return 1.0 - (4.09712 + 4.20863 * color - root) ** 2

    def exact_inverse(_: Functions, color: Decimal) -> Decimal:
        b = Decimal("1.139") + Decimal("1.17") * color
        s = (b - (b * b - Decimal("0.556") * (1 - color)).sqrt()) / Decimal("0.278")
        return 1 - s * s

    def h(alpha: float) -> float:
        logarithms = integrate(lambda u: math.log1p(-alpha * u / math.tan(u)), (0.0, 0.5 * math.pi), 48)
        return math.exp(-logarithms / math.pi)

    for color in (0.0, 1e-6, 1e-3, 0.5, 0.999999, 1.0):
        got, expected = half_space_inverses.van_de_hulst_inverse(color), exact(exact_inverse, color)
        yield _record("van de Hulst alpha", f"color {color:g}", got, expected, rounded_inverse, color)
    yield _record("Chandrasekhar H(1)", "alpha 1", math.exp(half_space.log_h(1.0, 1.0)), H_CONSERVATIVE, h, 1.0)
    # limits: single scattering, next to which double scattering is 1e-6; and 1 - (4 / sqrt(3)) sqrt(1 - alpha)
    dark, white = 2e-6 / 3.0 * (1.0 - math.log(2.0)), 1.0 - 4e-6 / math.sqrt(3.0)
    for alpha, expected in ((0.0, 0.0), (1e-6, dark), (1.0 - 1e-12, white), (1.0, 1.0), (math.inf, 1.0), (math.nan, 0.0)):
        got = half_space.diffuse_albedo(alpha)
        yield _record("diffuse albedo, van de Hulst's", f"alpha {alpha:.12g}", got, expected, van_de_hulst, alpha)


def van_de_hulst(alpha: float) -> float:
    """Return van de Hulst's approximation of the diffuse albedo at g = 0, as published."""
    s = math.sqrt(1.0 - alpha)
    return (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)


def table(found: Sequence[Record]) -> Table:
    """Return a row for each record."""

    def text(value: float | str) -> str:
        return value if isinstance(value, str) else f"{value:.6g}"

    rows: list[tuple[str, ...]] = [
        (one["model"], one["case"], *(text(one[key]) for key in ("plain", "got", "expected")), f"{one['error']:.1e}")
        for one in found
    ]
    return ("Formula", "Case", "As published", "Ours", "Expected", "Our error"), rows
