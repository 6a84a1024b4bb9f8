# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the engines' closures come to equation (1), from the formulas alone."""

import pytest
from true_diffuse.addon.measure.lobe_error import lobe_error
from true_diffuse.addon.models import Lambert, OrenNayar
from true_diffuse.addon.models.lobes import CyclesLobes, EeveeLobes, cycles_bump_shadowing
from true_diffuse.addon.models.vector import from_polar

N = (0.0, 0.0, 1.0)


@pytest.mark.parametrize(("sigma", "bound"), [(0.2, 0.018), (0.33, 0.034), (1.0, 0.071)])
def test_eevee_lobes_are_near_equation_1(sigma: float, bound: float) -> None:
    assert lobe_error(EeveeLobes(sigma), OrenNayar(sigma)) < bound


@pytest.mark.parametrize(("sigma", "bound"), [(0.2, 0.0033), (0.33, 0.0061), (1.0, 0.013)])
def test_cycles_lobes_are_near_equation_1(sigma: float, bound: float) -> None:
    assert lobe_error(CyclesLobes(sigma), OrenNayar(sigma)) < bound


@pytest.mark.parametrize(("sigma", "share"), [(0.2, 0.0574), (0.33, 0.1261), (1.0, 0.4665)])
def test_lambert_is_far_from_equation_1(sigma: float, share: float) -> None:
    # what is to be beaten; fixes the measure itself, so that the two tests above mean something
    assert lobe_error(Lambert(), OrenNayar(sigma)) == pytest.approx(share, abs=5e-4)


@pytest.mark.parametrize("lobes", [EeveeLobes, CyclesLobes])
@pytest.mark.parametrize("mu_i", [1e-6, 0.3, 1.0])
def test_lobes_at_sigma_zero_are_lambert(lobes: type, mu_i: float) -> None:
    l, v = from_polar(mu_i, 2.0), from_polar(0.4, 0.0)
    assert lobes(0.0).radiance(N, l, v, 0.7) == pytest.approx(Lambert().radiance(N, l, v, 0.7), rel=1e-15)


@pytest.mark.parametrize("lobes", [EeveeLobes, CyclesLobes])
def test_lobes_are_finite_where_view_and_normal_meet(lobes: type) -> None:
    assert lobes(0.33).radiance(N, N, N, 1.0) == pytest.approx(OrenNayar(0.33).radiance(N, N, N, 1.0), rel=1e-12)


@pytest.mark.parametrize("n_dot_l", [1e-9, 0.2, 0.999])
def test_bump_shadowing_is_a_share(n_dot_l: float) -> None:
    assert 0.0 < cycles_bump_shadowing(n_dot_l, 0.1, 0.5) <= 1.0
