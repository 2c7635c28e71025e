"""The search finds the minimum of functions whose minimum is known."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control.gains import Gains
from mrpipe.law_design.search import FreeGain, SearchOptions, refine, search

VISCOSITY = FreeGain("c_n_s_m", 10.0, 10000.0)
STIFFNESS = FreeGain("k_n_m", -20000.0, -200.0)


@pytest.mark.property
@pytest.mark.parametrize("best", [15.0, 120.0, 650.0, 9000.0])
def test_one_gain(best: float) -> None:
    found = search(lambda gains: np.log(gains.c_n_s_m / best) ** 2, [VISCOSITY], {"k_n_m": -4500.0}, SearchOptions())
    assert found.c_n_s_m == pytest.approx(best, rel=0.03)
    assert found.k_n_m == -4500.0


@pytest.mark.property
def test_a_second_valley_is_not_taken_for_the_first() -> None:
    def value(gains: Gains) -> float:
        x = np.log(gains.c_n_s_m)
        return float(min((x - np.log(30.0)) ** 2 + 0.2, (x - np.log(3000.0)) ** 2))

    assert search(value, [VISCOSITY], {}, SearchOptions()).c_n_s_m == pytest.approx(3000.0, rel=0.05)


@pytest.mark.property
def test_two_gains_with_their_signs() -> None:
    def value(gains: Gains) -> float:
        return float(np.log(gains.c_n_s_m / 120.0) ** 2 + np.log(gains.k_n_m / -6000.0) ** 2)

    found = search(value, [VISCOSITY, STIFFNESS], {}, SearchOptions(evaluations=40))
    assert found.c_n_s_m == pytest.approx(120.0, rel=0.1)
    assert found.k_n_m == pytest.approx(-6000.0, rel=0.1)


@pytest.mark.property
def test_nothing_free_is_the_start() -> None:
    assert search(lambda _: 1.0, [], {"c_n_s_m": 5.0}, SearchOptions()) == Gains(5.0)


@pytest.mark.property
@pytest.mark.parametrize(("c", "k"), [(40.0, -900.0), (120.0, -6000.0), (900.0, -15000.0)])
def test_two_gains_on_a_function_with_kinks(c: float, k: float) -> None:
    # the largest of several resonances has kinks, along which a simplex that starts badly comes to rest
    def value(gains: Gains) -> float:
        u, v = np.log(gains.c_n_s_m / c), np.log(gains.k_n_m / k)
        return float(max(u + v, -(u + v), 0.5 * (u - v), -0.5 * (u - v)))

    found = search(value, [VISCOSITY, STIFFNESS], {}, SearchOptions())
    assert value(found) < 0.05


@pytest.mark.property
def test_a_second_search_moves_a_coarse_result_to_the_minimum() -> None:
    def value(gains: Gains) -> float:
        return 1.0 + np.log(gains.c_n_s_m / 650.0) ** 2 + np.log(gains.k_n_m / -4500.0) ** 2

    found = refine(value, [VISCOSITY], Gains(c_n_s_m=532.0, k_n_m=-4500.0), SearchOptions())
    assert found.c_n_s_m == pytest.approx(650.0, rel=0.03)
    assert found.k_n_m == -4500.0
    both = refine(value, [VISCOSITY, STIFFNESS], Gains(c_n_s_m=600.0, k_n_m=-4000.0), SearchOptions())
    assert value(both) < value(Gains(c_n_s_m=600.0, k_n_m=-4000.0))
    assert refine(value, [], Gains(c_n_s_m=532.0, k_n_m=-4500.0), SearchOptions()).c_n_s_m == 532.0
    # what is best already stays
    best = Gains(c_n_s_m=650.0, k_n_m=-4500.0)
    assert refine(value, [VISCOSITY], best, SearchOptions()) == best
