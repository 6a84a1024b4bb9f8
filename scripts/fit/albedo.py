# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the numbers of shaders/directional_albedo.glsl, models/wolff.py and shaders/coat.glsl to quadrature.

uv run scripts/fit/albedo.py      seconds
"""

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon.models import OrenNayar1994, directional_albedo
from true_diffuse.addon.models.blinn_phong import BELOW
from true_diffuse.addon.models.fresnel import boundary
from true_diffuse.addon.models.quadrature import integrate
from true_diffuse.scripts.cli.console import Parser, end, script_arguments
from true_diffuse.scripts.fit.least_squares import dot, least_squares

SIGMA = 0.5  # any does below 0.66, where the 1994 model begins to be cut off
NARROW = 9.0  # standard deviations of a highlight, beyond which nothing is left of it
ORDER = 64
STEPS = 24  # cosines, and roughnesses
ROUNDS = 400  # of new weights
EXPONENTS = (0.3, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 512.0, 2048.0, 10000.0)
HIGHEST_T = 5.0  # mu sqrt(n) above which all of the highlight is above the surface
# By hand, as models.specular.BELOW; all else is linear in what is fitted. The cubic below coat.glsl's fraction.
NEAR, SQUARE, PRODUCT = 0.18, 5.9, -2.1


class Fitted(NamedTuple):
    """The numbers that stand in a shader, and the largest error."""

    numbers: Sequence[float]
    error: float


def facets(mu: float) -> float:
    """Return f, of the 1994 model's directional albedo rho (A + B f(mu) + rho c), in [0, 0.4]."""
    model = OrenNayar1994(SIGMA)
    return (directional_albedo(model, mu, 1.0) - model.a - model.interreflection) / model.b


def azimuths(mu: float, z: float) -> float:
    """Return up to which azimuth from the viewer, in [0, pi], L = 2 (V.H) H - V is above the surface, for N.H = `z`."""
    level, reach = mu / (2.0 * z) - mu * z, math.sqrt(max(0.0, (1.0 - mu * mu) * (1.0 - z * z)))
    return math.acos(max(-1.0, min(1.0, level / reach if reach > 0.0 else math.copysign(1.0, level))))


def highlight(mu: float, exponent: float) -> float:
    """Return h, what the highlight of models/blinn_phong.py adds to the directional albedo, for k_s = 1; to about 2e-5 of it.

    The integral of (n + 8) / (2 pi) (N.H)^n (V.H)(N.L) over the half vectors H whose L is above the surface.
    """
    sine = math.sqrt(max(0.0, 1.0 - mu * mu))

    def around(angle: float) -> float:
        z, s = math.cos(angle), math.sin(angle)

        def seen(azimuth: float) -> float:
            v_dot_h = mu * z + sine * s * math.cos(azimuth)
            return v_dot_h * (2.0 * z * v_dot_h - mu)

        return 2.0 * integrate(seen, (0.0, azimuths(mu, z)), ORDER) * z**exponent * s

    end = min(0.5 * math.pi, NARROW / math.sqrt(exponent + 1.0))
    crease = 0.5 * math.asin(mu)  # beyond it L is below the surface at some azimuths
    breaks = (0.0, crease, end) if crease < end else (0.0, end)
    return (exponent + 8.0) / (2.0 * math.pi) * integrate(around, breaks, ORDER)


def mirrored(mu: float, alpha: float) -> float:
    """Return E(mu), what GGX microfacets without Fresnel mirror once, of light from everywhere; in (0, 1], to about 1e-4.

    The integral of G2 (V.H) / ((N.V)(N.H)) over the microfacets H by w = alpha / sqrt(tan^2 + alpha^2) of their angle from N, whose
    square is uniform.
    """
    sine = math.sqrt(max(0.0, 1.0 - mu * mu))
    mask = math.sqrt(alpha * alpha + (1.0 - alpha * alpha) * mu * mu)

    def around(w: float) -> float:
        tangent = alpha * math.sqrt(1.0 - w * w) / w
        z = 1.0 / math.hypot(1.0, tangent)

        def seen(azimuth: float) -> float:
            v_dot_h = mu * z + sine * z * tangent * math.cos(azimuth)
            n_dot_l = 2.0 * v_dot_h * z - mu
            masked = mu * math.sqrt(alpha * alpha + (1.0 - alpha * alpha) * n_dot_l**2) + n_dot_l * mask
            return 2.0 * n_dot_l * v_dot_h / (masked * z)

        return integrate(seen, (0.0, azimuths(mu, z)), ORDER) / math.pi * 2.0 * w

    slope = math.tan(0.5 * math.asin(mu))  # beyond it L is below the surface at some azimuths
    return integrate(around, (0.0, alpha / math.hypot(alpha, slope), 1.0), ORDER)


def least_largest(rows: Sequence[Sequence[float]], wanted: Sequence[float]) -> Fitted:
    """Return the numbers x whose row.x are nearest to `wanted`, by C. Lawson's weights (1961): more where the error is large."""
    weights, best = [1.0 / len(rows)] * len(rows), Fitted((), math.inf)
    for _ in range(ROUNDS):
        x = least_squares(rows, wanted, weights)
        errors = [abs(dot(row, x) - value) for row, value in zip(rows, wanted, strict=True)]
        if max(errors) < best.error:
            best = Fitted(x, max(errors))
        weights = [weight * error for weight, error in zip(weights, errors, strict=True)]
        whole = sum(weights)
        weights = [weight / whole for weight in weights]
    return best


def cosines() -> list[float]:
    """Return cosines in (0, 1), close to each other at both ends."""
    return [math.sin(0.5 * math.pi * (i + 0.5) / STEPS) ** 2 for i in range(STEPS)]


def fit_facets() -> Fitted:
    """Return the numbers of f(mu) = (1 - mu) (c_0 + c_1 sqrt(mu) + c_2 mu)."""
    mus = [1e-6, *cosines()]
    return least_largest([[(1.0 - mu) * b for b in (1.0, math.sqrt(mu), mu)] for mu in mus], [facets(mu) for mu in mus])


def fit_reflectance() -> Fitted:
    """Return c of <F> = f (c_1 + c_2 f + c_3 f^2), f = (n - 1) / (n + 1), n in [1, 3], by least squares; error of <1 - F>."""
    rows, wanted = [], []
    for step in range(1, STEPS + 1):
        f = 0.5 * step / STEPS
        edge = boundary((1.0 + f) / (1.0 - f))
        passed = integrate(lambda mu, edge=edge: 2.0 * edge.transmittance(mu) * mu, (0.0, 1.0), 2 * STEPS)
        rows.append((f, f * f, f * f * f))
        wanted.append(1.0 - passed)
    numbers = least_squares(rows, wanted)
    left = (abs(dot(row, numbers) - value) / (1.0 - value) for row, value in zip(rows, wanted, strict=True))
    return Fitted(numbers, max(left))


def near(mu: float, alpha: float) -> float:
    """Return the fraction of coat.glsl's fit, which has the shape of 1 - E(mu) where both are small."""
    return mu * alpha**2 / ((mu + NEAR * alpha) * (mu * mu + alpha * (PRODUCT * mu + SQUARE * alpha)))


def fit_mirrored() -> Fitted:
    """Return the numbers of E(mu) = 1 - near (c_0 + c_1 a + c_2 a^2 + mu (c_3 + c_4 a + c_5 a^2)); the error is over E."""
    rows, wanted = [], []
    for mu in [0.001, *cosines(), 1.0]:
        for i in range(1, STEPS + 1):
            alpha = (i / STEPS) ** 2
            kept = mirrored(mu, alpha)
            rows.append([near(mu, alpha) / kept * a * b for b in (1.0, mu) for a in (1.0, alpha, alpha * alpha)])
            wanted.append(1.0 / kept - 1.0)
    return least_largest(rows, wanted)


def below(mu: float, exponent: float, numbers: Sequence[float]) -> float:
    """Return the part of the integral over all H whose L are below the surface, by directional_albedo.glsl's fit."""
    t = mu * math.sqrt(exponent)
    linear, square = numbers
    return (1.0 - 2.0 * mu * mu) * math.exp(-t * (0.5 * math.log(2.0) * t + (1.0 - mu) * (linear + square * t)))


def highlight_error(numbers: Sequence[float]) -> float:
    """Return the largest error of directional_albedo.glsl's h, over h, over all mu and the EXPONENTS."""
    largest = 0.0
    for n in EXPONENTS:
        for mu in cosines():
            if (mu := mu * min(1.0, HIGHEST_T / math.sqrt(n))) < 1.0:
                h = (n + 8.0) / ((n + 2.0) * (n + 4.0)) * (n * mu * mu + 2.0 * (1.0 - mu * mu) - below(mu, n, numbers))
                largest = max(largest, abs(h / highlight(mu, n) - 1.0))
    return largest


def shown(fitted: Fitted) -> str:
    return ", ".join(f"{number:.5g}" for number in fitted.numbers) + f"      error {fitted.error:.2g}"


def main() -> int:
    """Run the script; returns the exit status."""
    Parser(prog="fit/albedo.py", description=(__doc__ or "").splitlines()[0]).parse_args(script_arguments())
    fits: dict[str, Callable[[], Fitted]] = {
        "directional_albedo.glsl, f of oren_nayar_1994_albedo": fit_facets,
        "directional_albedo.glsl, h of blinn_phong_albedo": lambda: Fitted(BELOW, highlight_error(BELOW)),
        "directional_albedo.glsl, wolff_albedo, and models/wolff.py": fit_reflectance,
        "coat.glsl, coat_single_albedo": fit_mirrored,
    }
    for name, fit in fits.items():
        print(f"{name}: {shown(fit())}")
    return 0


if __name__ == "__main__":
    end(main())
