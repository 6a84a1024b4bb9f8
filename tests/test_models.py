# SPDX-License-Identifier: GPL-3.0-or-later
"""The analytic models against closed forms, published numbers and mpmath, never against themselves."""

import math

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st
from true_diffuse.addon.models import (
    CyclesDiffuse,
    Eon,
    Fujii,
    Lambert,
    Model,
    OrenNayar,
    OrenNayar1994,
    Specular,
    average_albedo,
    directional_albedo,
)
from true_diffuse.addon.models.oren_nayar import as_printed, coefficients
from true_diffuse.addon.models.quadrature import gauss_legendre
from true_diffuse.addon.models.vector import from_polar

mpmath.mp.dps = 50
N = (0.0, 0.0, 1.0)
cosines = st.floats(1e-6, 1.0)
azimuths = st.floats(0.0, 2.0 * math.pi)
sigmas = st.floats(0.0, 10.0)


def oren_nayar_1994(sigma: float, theta_i: float, theta_r: float, azimuth: float) -> mpmath.mpf:
    """Oren and Nayar's equation (30), rho = E0 = 1, in their angles."""
    s2 = mpmath.mpf(sigma) ** 2
    a, b = 1 - s2 / (s2 + mpmath.mpf("0.33")) / 2, mpmath.mpf("0.45") * s2 / (s2 + mpmath.mpf("0.09"))
    alpha, beta = max(theta_i, theta_r), min(theta_i, theta_r)
    return mpmath.cos(theta_i) / mpmath.pi * (a + b * max(0, mpmath.cos(azimuth)) * mpmath.sin(alpha) * mpmath.tan(beta))


def albedo_closed_form(sigma: float, mu: mpmath.mpf) -> mpmath.mpf:
    """E(mu) of equation (1): A + (2 B / pi) sin v [ (v - sin v cos v) / 2 + (1 - sin^3 v) / (3 cos v) ], by integrating by hand."""
    s2 = mpmath.mpf(sigma) ** 2
    a, b = 1 - s2 / (s2 + mpmath.mpf("0.33")) / 2, mpmath.mpf("0.45") * s2 / (s2 + mpmath.mpf("0.09"))
    v = mpmath.acos(mu)
    sine = mpmath.sin(v)
    return a + 2 * b / mpmath.pi * sine * ((v - sine * mu) / 2 + (1 - sine**3) / (3 * mu))


@pytest.mark.parametrize(
    ("sigma", "a", "b"), [(0.0, 1.0, 0.0), (0.2, 0.9459, 0.1385), (0.33, 0.8759, 0.2464), (1.0, 0.6241, 0.4128)]
)
def test_coefficients_equal_published_values(sigma: float, a: float, b: float) -> None:
    assert coefficients(sigma) == pytest.approx((a, b), abs=5e-5)  # printed to 4 digits


@pytest.mark.parametrize("sigma", [1e-200, 1e-8, 1e200, math.inf])
def test_coefficients_are_finite_at_the_ends(sigma: float) -> None:
    a, b = coefficients(sigma)
    assert 0.5 <= a <= 1.0 and 0.0 <= b <= 0.45


@pytest.mark.parametrize("sigma", [-1e-9, -1.0, math.nan, -math.inf])
def test_sigma_out_of_range_is_refused(sigma: float) -> None:
    with pytest.raises(ValueError, match="sigma"):
        OrenNayar(sigma)


@given(cosines, cosines, azimuths, st.floats(0.0, 1.0))
def test_oren_nayar_at_sigma_zero_is_lambert(mu_i: float, mu_o: float, azimuth: float, albedo: float) -> None:
    l, v = from_polar(mu_i, azimuth), from_polar(mu_o, 0.0)
    assert OrenNayar(0.0).radiance(N, l, v, albedo) == Lambert().radiance(N, l, v, albedo)


@given(sigmas, cosines, cosines, azimuths)
def test_oren_nayar_equals_the_form_in_angles(sigma: float, mu_i: float, mu_o: float, azimuth: float) -> None:
    got = OrenNayar(sigma).radiance(N, from_polar(mu_i, azimuth), from_polar(mu_o, 0.0), 1.0)
    expected = oren_nayar_1994(sigma, mpmath.acos(mu_i), mpmath.acos(mu_o), azimuth)
    # s = E.L - (N.E)(N.L) cancels: a rounding error of 2^-52 of the products, a few of them.
    assert got == pytest.approx(float(expected), rel=1e-12, abs=4e-16)


@given(sigmas, cosines, cosines, azimuths)
def test_oren_nayar_is_reciprocal(sigma: float, mu_i: float, mu_o: float, azimuth: float) -> None:
    model, a, b = OrenNayar(sigma), from_polar(mu_i, azimuth), from_polar(mu_o, 0.0)
    # f_r(L, V) = f_r(V, L), cross-multiplied so that no small cosine divides
    assert model.radiance(N, a, b, 1.0) * mu_o == pytest.approx(model.radiance(N, b, a, 1.0) * mu_i, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("sigma", [0.2, 0.33, 1.0])
@pytest.mark.parametrize("mu", [1.0, 0.5, 0.2, 0.05])
def test_directional_albedo_equals_closed_form(sigma: float, mu: float) -> None:
    # the integrand is smooth between the creases: 32 points leave only rounding
    assert directional_albedo(OrenNayar(sigma), mu) == pytest.approx(float(albedo_closed_form(sigma, mpmath.mpf(mu))), abs=1e-9)


@pytest.mark.parametrize("sigma", [0.2, 0.33, 1.0])
def test_average_albedo_equals_mpmath(sigma: float) -> None:
    expected = mpmath.quad(lambda mu: 2 * mu * albedo_closed_form(sigma, mu), [0, 0.25, 1])
    assert average_albedo(OrenNayar(sigma), order=16) == pytest.approx(float(expected), abs=1e-7)


@given(st.floats(0.01, 1.0), st.floats(0.0, 1.0))
def test_lambert_albedo_is_rho(mu: float, albedo: float) -> None:
    assert directional_albedo(Lambert(), mu, albedo, order=8) == pytest.approx(albedo, abs=1e-6)


@pytest.mark.parametrize("roughness", [0.3, 1.0])
@pytest.mark.parametrize("mu", [1.0, 0.5, 0.1])
def test_fujii_albedo_equals_closed_form(roughness: float, mu: float) -> None:
    # Portsmouth, Kutz and Hill (2025): E = A (1 + r G / pi)
    theta, sine, m = mpmath.acos(mu), mpmath.sqrt(1 - mpmath.mpf(mu) ** 2), mpmath.mpf(mu)
    g = sine * (theta - sine * m) + mpmath.mpf(2) / 3 * (sine / m * (1 - sine**3) - sine)
    a = 1 / (1 + (mpmath.mpf(1) / 2 - 2 / (3 * mpmath.pi)) * roughness)
    assert directional_albedo(Fujii(roughness), mu) == pytest.approx(float(a * (1 + roughness * g / mpmath.pi)), abs=1e-9)


@pytest.mark.parametrize("roughness", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("mu", [1.0, 0.5, 0.05])
def test_white_eon_reflects_all_light(roughness: float, mu: float) -> None:
    assert directional_albedo(Eon(roughness), mu) == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize(("roughness", "eon", "cycles"), [(1.0, 0.4390, 0.4136), (0.5, 0.4670, 0.4521)])
def test_grey_albedo_equals_published_values(roughness: float, eon: float, cycles: float) -> None:
    # measured in a furnace at rho = 0.5, seen head on, to 4 digits: Cycles' own node loses 6 % at full roughness
    assert directional_albedo(Eon(roughness), 1.0, 0.5) == pytest.approx(eon, abs=5e-5)
    assert directional_albedo(CyclesDiffuse(roughness), 1.0, 0.5) == pytest.approx(cycles, abs=5e-5)


@pytest.mark.parametrize("model", [Eon(0.7), CyclesDiffuse(0.7), Fujii(0.7), OrenNayar1994(0.7)])
@given(cosines, cosines, azimuths, st.floats(0.0, 1.0))
def test_rough_models_are_reciprocal(model: Model, mu_i: float, mu_o: float, azimuth: float, albedo: float) -> None:
    a, b = from_polar(mu_i, azimuth), from_polar(mu_o, 0.0)
    there, back = model.radiance(N, a, b, albedo) * mu_o, model.radiance(N, b, a, albedo) * mu_i
    assert there == pytest.approx(back, rel=1e-9, abs=1e-15)  # acos near 1 costs the 1994 model half the digits of a small angle


@pytest.mark.parametrize("make", [Eon, CyclesDiffuse, Fujii, OrenNayar1994])
@given(cosines, cosines, azimuths, st.floats(0.0, 1.0))
def test_rough_models_at_zero_are_lambert(make: type, mu_i: float, mu_o: float, azimuth: float, albedo: float) -> None:
    l, v = from_polar(mu_i, azimuth), from_polar(mu_o, 0.0)
    assert make(0.0).radiance(N, l, v, albedo) == pytest.approx(Lambert().radiance(N, l, v, albedo), rel=1e-12)


@given(sigmas, st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.floats(0.0, math.pi), st.floats(0.0, 1.0))
def test_full_oren_nayar_equals_the_form_in_angles(sigma: float, mu_i: float, mu_o: float, azimuth: float, albedo: float) -> None:
    s2, rho, pi, c = mpmath.mpf(sigma) ** 2, mpmath.mpf(albedo), mpmath.pi, mpmath.cos(azimuth)
    theta_i, theta_r = mpmath.acos(mu_i), mpmath.acos(mu_o)
    alpha, beta = max(theta_i, theta_r), min(theta_i, theta_r)
    c1 = 1 - s2 / (s2 + mpmath.mpf("0.33")) / 2
    c2 = mpmath.mpf("0.45") * s2 / (s2 + mpmath.mpf("0.09")) * (mpmath.sin(alpha) - (0 if c >= 0 else (2 * beta / pi) ** 3))
    c3 = mpmath.mpf("0.125") * s2 / (s2 + mpmath.mpf("0.09")) * (4 * alpha * beta / pi**2) ** 2
    once = c1 + c * c2 * mpmath.tan(beta) + (1 - abs(c)) * c3 * mpmath.tan((alpha + beta) / 2)
    twice = mpmath.mpf("0.17") * s2 / (s2 + mpmath.mpf("0.13")) * (1 - c * (2 * beta / pi) ** 2)
    expected = rho / pi * mu_i * (once + rho * twice)
    got = OrenNayar1994(sigma).radiance(N, from_polar(mu_i, azimuth), from_polar(mu_o, 0.0), albedo)
    # cos(phi) is a quotient by sin sin, which is as small as 2e-8 next to N: its error, 1e-16 over that, meets tan(beta) as small
    assert got == pytest.approx(float(expected), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("sigma", "albedos"), [(0.3, (0.962, 0.983, 1.012, 1.036)), (1.0, (0.775, 0.813, 0.866, 0.910))], ids=["0.3", "1"]
)
def test_full_oren_nayar_albedo_equals_published_values(sigma: float, albedos: tuple[float, ...]) -> None:
    for mu, albedo in zip((1.0, 0.5, 0.2, 0.05), albedos, strict=True):
        assert directional_albedo(OrenNayar1994(sigma), mu) == pytest.approx(albedo, abs=6e-4)  # printed to 3 digits


@pytest.mark.parametrize("exponent", [0.0, 1.0, 30.0, 1000.0])
def test_highlight_albedo_head_on_equals_closed_form(exponent: float) -> None:
    n = exponent
    # N = V: the half vector is at theta / 2, and the integral over theta is elementary
    expected = (n + 8) * (2 * (1 - 2 ** (-(n + 4) / 2)) / (n + 4) - (1 - 2 ** (-(n + 2) / 2)) / (n + 2))
    assert directional_albedo(Specular(1.0, exponent), 1.0, albedo=0.0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("specular", "exponent"), [(-0.1, 30.0), (1.1, 30.0), (math.nan, 30.0), (0.5, -1.0), (0.5, math.inf)])
def test_specular_out_of_range_is_refused(specular: float, exponent: float) -> None:
    with pytest.raises(ValueError, match=r"specular|exponent"):
        Specular(specular, exponent)


@pytest.mark.parametrize("model", [Lambert(), Specular(), OrenNayar(0.33), Fujii(0.5)])
@pytest.mark.parametrize(("mu_i", "mu_o"), [(-0.1, 0.5), (0.5, -0.1), (0.0, 0.5), (0.5, 0.0)])
def test_light_or_viewer_behind_the_surface_sees_nothing(model: Lambert, mu_i: float, mu_o: float) -> None:
    assert model.radiance(N, from_polar(mu_i, 1.0), from_polar(mu_o, 0.0), 1.0) == 0.0


@pytest.mark.parametrize(("mu", "albedo"), [(1.0, 0.893), (0.5, 1.006), (0.2, 1.141), (0.05, 1.850)])
def test_as_printed_reflects_more_than_it_receives(mu: float, albedo: float) -> None:
    class AsPrinted:
        def radiance(self, n, l, v, rho):
            return as_printed(n, l, v, rho, 0.3)

    # independently integrated values, 3 digits; OrenNayar(0.3) stays at 1.0016 where this reaches 1.85
    assert directional_albedo(AsPrinted(), mu) == pytest.approx(albedo, abs=5e-4)


def test_as_printed_glows_at_the_terminator() -> None:
    l, v = from_polar(0.0, 0.0), from_polar(math.sqrt(0.5), 0.0)
    _, b = coefficients(0.3)
    assert as_printed(N, l, v, 1.0, 0.3) == pytest.approx(b * math.sqrt(0.5) / math.pi)
    assert OrenNayar(0.3).radiance(N, l, v, 1.0) == 0.0


def test_gauss_legendre_integrates_polynomials_exactly() -> None:
    # order n is exact up to degree 2 n - 1: the integral of x^14 over [-1, 1] is 2/15
    assert sum(weight * x**14 for x, weight in gauss_legendre(8)) == pytest.approx(2.0 / 15.0, rel=1e-14)


@pytest.mark.parametrize("mu", [0.0, -0.5, 1.1, math.nan])
def test_albedo_of_an_impossible_view_is_refused(mu: float) -> None:
    with pytest.raises(ValueError, match="mu_o"):
        directional_albedo(Lambert(), mu)
