# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of made-up pixels, with results worked out by hand."""

import math
from array import array

import pytest

from true_diffuse.addon.measure.error import Analytic, GBuffer, Light, analytic, errors
from true_diffuse.addon.models import Lambert
from true_diffuse.scripts.studies.five import signed_difference
from true_diffuse.scripts.studies.pictures import DIVERGING, diverging_color, scale_place

SUN = Light((0.0, 0.0, 1.0), math.pi)


def g_buffer(normals: list[tuple[float, float, float]], measurable: list[int]) -> GBuffer:
    count = len(normals)
    flat = array("f", [component for normal in normals for component in normal])
    return GBuffer(flat, array("f", bytes(12 * count)), array("f", [0.5] * (3 * count)), bytearray(measurable))


def test_analytic_skips_what_cannot_be_compared() -> None:
    slanted = (0.6, 0.0, 0.8)
    seen = g_buffer([(0.0, 0.0, 1.0), slanted, (0.0, 0.0, -1.0), slanted], [1, 1, 1, 0])
    (result,) = analytic(seen, (Lambert(),), (0.0, 0.0, 5.0), SUN)
    assert list(result.pixels) == [0, 1]  # not the one that faces away, nor the one with an edge
    assert result.radiance[0] == pytest.approx(0.5) and result.radiance[3] == pytest.approx(0.4)


def test_errors_of_a_known_deviation() -> None:
    expected = Analytic(array("l", [0, 1]), array("f", [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]))
    rendered = array("f", [1.1, 1.1, 1.1, 2.0, 2.0, 2.0])
    result = errors(rendered, expected, expected)
    assert result.rms == pytest.approx(math.sqrt(3 * 0.01 / 15.0), rel=1e-5)
    assert result.luminance_over_lambert == pytest.approx(3.1 / 3.0, rel=1e-5)
    assert result.pixels == 2


def test_errors_of_nothing_are_not_a_number() -> None:
    nothing = Analytic(array("l"), array("f"))
    assert math.isnan(errors(array("f"), nothing, nothing).rms)


def test_errors_of_a_black_surface_are_not_a_number() -> None:
    black = Analytic(array("l", [0]), array("f", [0.0, 0.0, 0.0]))
    result = errors(array("f", [0.0, 0.0, 0.0]), black, black)
    assert result.pixels == 1 and math.isnan(result.rms)


def test_luminance_over_a_black_lambert_is_not_a_number() -> None:
    lit, black = Analytic(array("l", [0]), array("f", [1.0] * 3)), Analytic(array("l", [0]), array("f", [0.0] * 3))
    result = errors(array("f", [1.0] * 3), lit, black)
    assert result.rms == 0.0 and math.isnan(result.luminance_over_lambert)


def test_signed_difference_is_a_fraction_of_white() -> None:
    seen = g_buffer([(0.0, 0.0, 1.0)], [1])
    (expected,) = analytic(seen, (Lambert(),), (0.0, 0.0, 5.0), SUN)
    assert signed_difference(array("f", [0.45] * 3), expected, seen, SUN)[0] == pytest.approx(-0.1, rel=1e-5)


def test_heat_map_colors_reach_both_ends() -> None:
    assert diverging_color(-2.0) == DIVERGING[0] and diverging_color(2.0) == DIVERGING[-1]
    assert diverging_color(0.0) == (247, 247, 247)


def test_heat_map_scale_is_odd_and_rises() -> None:
    places = [scale_place(value) for value in (0.0, 1e-4, 1e-3, 0.01, 0.1, 1.0, 5.0)]
    assert places == sorted(places) and places[0] == 0.0 and places[-2:] == [1.0, 1.0]
    assert scale_place(-0.01) == -scale_place(0.01)
