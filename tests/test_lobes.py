# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the engines' closures come to the models, from the formulas alone; and that the table of lobes is what its fit gives."""

import itertools
import math
from collections.abc import Iterable, Iterator

import mpmath
import pytest

from true_diffuse.addon.closures.lobe import CYCLES, PAIR, SIGNED, SINGLE, capped, capped_albedo, cycles_bump_shadowing
from true_diffuse.addon.closures.lobe_error import lobe_error
from true_diffuse.addon.closures.lobe_table import TABLE
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.models import (
    MODELS,
    CyclesDiffuse,
    Eon,
    Fujii,
    Lambert,
    Model,
    OrenNayar,
    OrenNayar1994,
    Pitted,
    by_formula,
    directional_albedo,
)
from true_diffuse.addon.models.terms import float_view
from true_diffuse.addon.models.vector import from_polar
from true_diffuse.addon.models.wolff import AVERAGE_REFLECTANCE, average_transmittance
from true_diffuse.scripts.fit import albedo, lobes

N = (0.0, 0.0, 1.0)
LOBE_SETS = (SINGLE, PAIR, SIGNED, CYCLES)
ROUGH = [model.reference({"Roughness": 0.33, "IOR": 1.5}) for model in MODELS.values() if model.id != "lambert"]


@pytest.mark.parametrize(
    ("lobe_set", "bounds"),
    [
        (SINGLE, (0.0285, 0.0520, 0.1070)),
        (PAIR, (0.019, 0.034, 0.0705)),
        (SIGNED, (0.004, 0.007, 0.016)),
        (CYCLES, (0.0033, 0.0061, 0.013)),
    ],
)
def test_lobes_are_near_equation_1(lobe_set: str, bounds: tuple[float, ...]) -> None:
    for sigma, bound in zip((0.2, 0.33, 1.0), bounds, strict=True):
        assert lobe_error(Rendered(OrenNayar(sigma), lobe_set), OrenNayar(sigma)) < bound


@pytest.mark.parametrize(("sigma", "share"), [(0.2, 0.0574), (0.33, 0.1261), (1.0, 0.4665)])
def test_lambert_is_far_from_equation_1(sigma: float, share: float) -> None:
    # what is to be beaten; fixes the measure itself, so that the test above means something
    assert lobe_error(Lambert(), OrenNayar(sigma)) == pytest.approx(share, abs=5e-4)


@pytest.mark.parametrize("lobe_set", LOBE_SETS)
@pytest.mark.parametrize("model", ROUGH, ids=lambda model: type(model).__name__)
def test_lobes_are_nearer_than_lambert(lobe_set: str, model: Model) -> None:
    assert lobe_error(Rendered(model, lobe_set), model) < 0.6 * lobe_error(Lambert(), model)


@pytest.mark.parametrize("model", [Fujii(0.7), Eon(0.7), CyclesDiffuse(0.7)], ids=lambda model: type(model).__name__)
def test_cycles_has_fujii_and_related_models(model: Model) -> None:
    assert lobe_error(Rendered(model, CYCLES), model) < 1e-12


@pytest.mark.parametrize("lobe_set", LOBE_SETS)
@pytest.mark.parametrize("make", [model.formula for model in MODELS.values() if model.is_rough])
@pytest.mark.parametrize("mu_i", [1e-6, 0.3, 1.0])
def test_lobes_at_sigma_zero_are_lambert(lobe_set: str, make: type, mu_i: float) -> None:
    l, v = from_polar(mu_i, 2.0), from_polar(0.4, 0.0)
    assert Rendered(make(0.0), lobe_set).radiance(N, l, v, 0.7) == pytest.approx(Lambert().radiance(N, l, v, 0.7), rel=1e-15)


@pytest.mark.parametrize("lobe_set", LOBE_SETS)
def test_lobes_are_finite_where_view_and_normal_meet(lobe_set: str) -> None:
    assert Rendered(OrenNayar(0.33), lobe_set).radiance(N, N, N, 1.0) == pytest.approx(
        OrenNayar(0.33).radiance(N, N, N, 1.0), rel=1e-12
    )


@pytest.mark.parametrize(
    "model", [OrenNayar(1.0), Fujii(1.0), OrenNayar1994(1.0), Pitted()], ids=lambda model: type(model).__name__
)
@pytest.mark.parametrize("degrees", [10, 45, 70, 85])
def test_signed_lobes_reflect_a_uniform_world_as_the_model_does(model: Model, degrees: int) -> None:
    mu, rho = math.cos(math.radians(degrees)), 1.0
    facing, functions = by_formula(model).terms_of(model, float_view(mu, rho)).expansion()
    creases, table = TABLE[SIGNED][next(iter(functions))]
    weights = [sum(factor * table[name][k].at(mu) for name, factor in functions.items()) for k in range(1 + 2 * len(creases))]
    toward, *away = (capped_albedo(crease, mu, *weights[2 * k + 1 : 2 * k + 3]) for k, crease in enumerate(creases))
    shown = facing + weights[0] + toward - sum(away)
    # the weights have four numbers each, too few for a surface of pits; the 1994 model's functions leave out that it is cut at 0
    # from sigma = 0.66
    assert shown == pytest.approx(directional_albedo(model, mu, rho), abs=0.01 if isinstance(model, Pitted) else 0.004)


@pytest.mark.parametrize("family", TABLE[SIGNED])
@pytest.mark.parametrize("degrees", [10, 45, 70, 85])
def test_signed_lobes_leave_nothing_of_light_from_below(family: str, degrees: int) -> None:
    mu = math.cos(math.radians(degrees))
    creases, table = TABLE[SIGNED][family]
    weights = [weight.at(mu) for weight in table[family]]
    for k, crease in enumerate(creases):
        for height, azimuth in itertools.product((-0.02, -0.3, -0.9), (0.0, 1.0, 2.0, 3.0)):
            l = from_polar(height, azimuth)
            assert capped(crease, l, mu, *weights[2 * k + 1 : 2 * k + 3]) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("azimuth", [0, 90, 180])
@pytest.mark.parametrize("height", [-10, 0, 10])
def test_signed_lobes_are_right_under_a_light_that_is_partly_below(height: int, azimuth: int) -> None:
    """A disc of 40 degrees across, which EEVEE integrates for each lobe alone; white, sigma = 1.

    What comes from below takes a little of what comes from above. A sum of lobes that each have a horizon of their own, which is as
    near to the model under suns, is up to 0.2 off here: the light past the terminator.
    """
    disc = list(disc_of_lights(math.radians(height), math.radians(azimuth), math.radians(20.0)))
    model = OrenNayar(1.0)
    crease = TABLE[SIGNED]["oren_nayar"].lobes[0]
    _, toward_weight, under_weight = TABLE[SIGNED]["oren_nayar"].weights["oren_nayar"]
    for view in (30, 60, 80):
        mu = math.cos(math.radians(view))
        v = from_polar(mu, 0.0)

        def mean(values: Iterable[float]) -> float:
            return sum(values) / len(disc)

        beyond = toward_weight.at(mu) * mean(crease.value(*l, mu) for l in disc)
        beyond -= under_weight.at(mu) * mean(crease.under.value(*l, mu) for l in disc)
        toward = toward_weight.at(mu) * mean(max(0.0, l[0]) for l in disc)
        shown = model.a * mean(max(0.0, l[2]) for l in disc) + model.b * max(0.0, toward - max(0.0, beyond))
        exact = math.pi * mean(model.radiance(N, l, v, 1.0) if l[2] > 0.0 else 0.0 for l in disc)
        # under a sun the lobes are up to 0.037 off at these views, and a mean over suns is no farther off
        assert shown == pytest.approx(exact, abs=0.04)


def disc_of_lights(height: float, azimuth: float, radius: float) -> Iterator[tuple[float, float, float]]:
    """Yield directions evenly spread over a disc around a direction `height` above the horizon; all in radians."""
    for ring in range(8):
        for k in range(24):
            tilt, turn = radius * math.sqrt((ring + 0.5) / 8), 2.0 * math.pi * (k + 0.5) / 24
            forward, aside, up = math.cos(tilt), math.sin(tilt) * math.sin(turn), math.sin(tilt) * math.cos(turn)
            along = forward * math.cos(height) - up * math.sin(height)
            yield (
                along * math.cos(azimuth) - aside * math.sin(azimuth),
                along * math.sin(azimuth) + aside * math.cos(azimuth),
                forward * math.sin(height) + up * math.cos(height),
            )


def test_average_transmittance_equals_walshs_closed_form() -> None:
    for ior in (1.2, 1.5, 2.0, 3.0):
        n = mpmath.mpf(ior)
        # J. W. T. Walsh (1926), as in S. Q. Duntley (1942): the diffuse reflectance of a smooth boundary from outside
        reflected = (
            mpmath.mpf(1) / 2
            + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2)
            + n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3 * mpmath.log((n - 1) / (n + 1))
            - 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
            + 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * mpmath.log(n)
        )
        assert average_transmittance(ior) == pytest.approx(float(1 - reflected), abs=2e-3)  # three terms of a series


def test_table_is_what_the_fit_gives() -> None:
    table = lobes.fit_all(lobes.ORDER, lobes.VIEWS)
    for lobe_set, families in TABLE.items():
        for family, (directions, weights) in families.items():
            assert table[lobe_set][family].lobes == directions
            for name, row in weights.items():
                for written, fitted in zip(row, table[lobe_set][family].weights[name], strict=True):
                    assert written == pytest.approx(fitted, rel=1e-4, abs=1e-4)  # written with 5 digits
    assert albedo.fit_reflectance().numbers == pytest.approx(AVERAGE_REFLECTANCE, rel=1e-4)


@pytest.mark.parametrize("n_dot_l", [1e-9, 0.2, 0.999])
def test_bump_shadowing_is_a_share(n_dot_l: float) -> None:
    assert 0.0 < cycles_bump_shadowing(n_dot_l, 0.1, 0.5) <= 1.0
