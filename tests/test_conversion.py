# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of the engines' closures against the exact reflectance of a half-space, random walks and the engines' own fits."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from true_diffuse.addon.closures.coat import mean_cosine, mean_fresnel
from true_diffuse.addon.closures.subsurface_fit import (
    BEAM,
    DARKEST,
    LEAST_ALPHA,
    MU,
    SKIN_IOR,
    H,
    closure_inputs,
    edge_width,
    lost,
)
from true_diffuse.addon.models.fresnel import boundary
from true_diffuse.addon.models.half_space import plane_albedo
from true_diffuse.addon.models.quadrature import integrate
from true_diffuse.scripts.fit.subsurface import width, wrenninge
from true_diffuse.scripts.studies.random_walk import exits

COLORS = (0.005, 0.02, 0.05, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95, 0.99)
WALKS = ("RANDOM_WALK", "RANDOM_WALK_LEGACY", "RANDOM_WALK_SKIN")
anything = st.floats(allow_nan=True, allow_infinity=True)


def openpbr(color: float) -> float:
    """The alpha that Cycles' Random Walk makes of a color, constants as OpenPBR 1.1 prints them."""
    s = 4.20863 * color - math.sqrt(9.59217 + 41.6808 * color + 17.7126 * color * color) + 4.09712
    return min(0.999999, max(0.0, 1.0 - s * s))


def reflected(alpha: float) -> float:
    """What Cycles' random walk reflects of a beam from MU, with what it loses: below LEAST_ALPHA in proportion to alpha."""
    return plane_albedo(LEAST_ALPHA, MU) * alpha / LEAST_ALPHA if alpha < LEAST_ALPHA else plane_albedo(alpha, MU)


@pytest.mark.parametrize("s", [k / 20 for k in range(1, 20)])
def test_beam_is_within_its_stated_error(s: float) -> None:
    assert BEAM.reflectance(s) == pytest.approx(plane_albedo(1.0 - s * s, MU), rel=5e-5)


@pytest.mark.parametrize("color", COLORS)
def test_random_walk_returns_the_color(color: float) -> None:
    # 5e-5 of the fit, and what Cycles' rounded constants make of it; near black `darkened` is a line for a slight curve
    color_input = closure_inputs("RANDOM_WALK", color).color
    assert reflected(openpbr(color_input)) == pytest.approx(color, rel=0.006 if color < DARKEST else 5e-4)


@pytest.mark.parametrize("color", COLORS)
def test_legacy_random_walk_returns_the_color(color: float) -> None:
    # 0.15 % of the fit to the color, near black 0.6 % as above, near white alpha is ever steeper in it
    got = reflected(min(0.999999, wrenninge(closure_inputs("RANDOM_WALK_LEGACY", color).color)))
    assert got == pytest.approx(color, rel=0.012 if color < DARKEST or color > 0.95 else 0.005)


@pytest.mark.parametrize("alpha", [0.9999, 0.999, 0.99])
def test_lost_light_is_that_of_late_orders(alpha: float) -> None:
    paths = 20_000
    late = [sum(one.weight for one in found if one.order > 255) for found in exits(alpha, mu_i=MU, paths=paths)]
    mean = sum(late) / paths
    error = math.sqrt(max(1e-12, sum(value * value for value in late) / paths - mean * mean) / paths)
    assert lost(math.sqrt(1.0 - alpha)) == pytest.approx(mean, abs=4.0 * error + 0.003 * H / math.sqrt(255.5 * math.pi))


@pytest.mark.parametrize("alpha", [0.3, 0.7, 0.94, 0.99])
def test_edge_width_is_that_of_a_random_walk(alpha: float) -> None:
    paths = 40_000
    color, expected = width(exits(alpha, mu_i=MU, paths=paths))
    # the median of |x| from n values is off by 1.6 / sqrt(n) of it for this steep a density; 1 % is the fit's
    assert edge_width(color / paths) == pytest.approx(expected, rel=0.01 + 4.0 * 1.6 / math.sqrt(2.0 * color))


def test_edge_widens_with_the_color() -> None:
    assert all(low < high for low, high in pairwise(edge_width(k / 100) for k in range(101)))


@pytest.mark.parametrize("method", [*WALKS, "BURLEY"])
def test_fed_color_rises(method: str) -> None:
    # to 0.98, where the older walks' own curve ends
    assert all(low < high for low, high in pairwise(closure_inputs(method, k / 50).color for k in range(50)))


@pytest.mark.parametrize("method", WALKS)
def test_fed_colors_add_up_to_no_more_than_all(method: str) -> None:
    assert all(0.0 <= closure_inputs(method, k / 100).rest <= 0.103 for k in range(101))
    assert closure_inputs(method, 0.5).rest < 1e-6


@pytest.mark.parametrize("method", [*WALKS, "BURLEY"])
@given(color=anything)
def test_fed_numbers_are_sane_for_anything(method: str, color: float) -> None:
    got = closure_inputs(method, color)
    assert 0.0 <= got.color <= 1.0 and 0.0 <= got.rest <= 1.0
    assert 0.0 < got.radius < 1e4


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.5, 1.0])
def test_smooth_coat_reflects_as_fresnel(mu: float) -> None:
    assert mean_fresnel(mu, 0.0, 1.4) == pytest.approx(1.0 - boundary(1.4).transmittance(max(mu, 1e-9)), rel=1e-6)


@pytest.mark.parametrize("roughness", [0.3, 0.5, 0.7, 1.0])
@pytest.mark.parametrize("mu", [0.1, 0.4, 0.7, 1.0])
def test_rough_coat_reflects_as_the_mean_over_ggx(mu: float, roughness: float) -> None:
    assert mean_fresnel(mu, roughness, SKIN_IOR) == pytest.approx(mean_over_ggx(mu, roughness**2, SKIN_IOR), abs=0.02)


def mean_over_ggx(mu: float, alpha: float, eta: float) -> float:
    """Return the mean of F(V.H) of what a GGX surface reflects towards N.V = `mu`, by quadrature over L.

    B. Walter and others, "Microfacet Models for Refraction through Rough Surfaces" (2007): D G / (4 N.V), G correlated as E. Heitz
    (2014) has it.
    """
    edge, sine = boundary(eta), math.sqrt(1.0 - mu * mu)

    def smith(cosine: float) -> float:
        return 0.5 * (math.sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0)

    def over(azimuth: float, with_fresnel: bool) -> float:
        def reflected(z: float) -> float:
            x, y = math.sqrt(1.0 - z * z) * math.cos(azimuth), math.sqrt(1.0 - z * z) * math.sin(azimuth)
            length = math.hypot(sine + x, y, mu + z)
            n_dot_h, v_dot_h = (mu + z) / length, math.sqrt(max(0.0, 0.5 * (1.0 + mu * z + sine * x)))
            d = (alpha / (1.0 + n_dot_h * n_dot_h * (alpha * alpha - 1.0))) ** 2 / math.pi
            f = 1.0 - edge.transmittance(max(1e-9, v_dot_h)) if with_fresnel else 1.0
            return f * d / (1.0 + smith(mu) + smith(z))

        return integrate(reflected, (1e-6, 0.1, 0.5, 0.9, 1.0), 24)

    def total(with_fresnel: bool) -> float:
        return integrate(lambda azimuth: over(azimuth, with_fresnel), (0.0, 0.5, 1.5, 2.5, math.pi), 24)

    return total(True) / total(False)


@given(mu=anything, roughness=anything, eta=anything)
def test_coat_is_sane_for_anything(mu: float, roughness: float, eta: float) -> None:
    assert 0.0 <= mean_cosine(mu, roughness) <= 1.0 + 1e-12
    assert -1e-12 <= mean_fresnel(mu, roughness, eta) <= 1.0
