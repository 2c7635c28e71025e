"""Fits: planted parameters come back, and the pieces they rest on."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.dampers.laws import LawShape, bernstein, bernstein_to_power
from mrpipe.dampers.library import base_form
from mrpipe.dampers.model import DamperModel, thesis_parameters
from mrpipe.fitting.engine import predict, start_of
from mrpipe.fitting.form_fit import FitMethod, fit_form, form_problem
from mrpipe.fitting.samples import bench_recordings, blocks_of, fit_window, smooth_motion, thinned
from mrpipe.fitting.scoring import pool, score_tests
from mrpipe.fitting.search import Space
from mrpipe.fitting.solution import bounded_solution, solve
from mrpipe.fitting.start import base_of, distinct_levels, polynomial_laws
from mrpipe.fitting.weighting import weighting
from tests.dampers.planted import SET_C, bench_test, set_c_campaign
from tests.dampers.test_forms import LAWS, NUMBERS

REDUNDANT = frozenset(
    {
        "bouc-wen-free",
        "creeping-yield",
        "eyring-spring",
        "gamota-filisko",
        "herschel-bulkley-spring",
        "logarithmic-yield",
        "lugre",
        "modified-bouc-wen",
        "power-yield",
    }
)
"""Forms whose numbers a few sines determine only together."""


def problem_of(tests, form="bouc-wen", *, orders=(3, 1), **choices):
    recordings = bench_recordings(tests, **choices)
    base = base_form(form)
    laws = polynomial_laws(base, distinct_levels(recordings), *orders)
    return form_problem(recordings, base_of(recordings, base, laws))


@pytest.fixture(scope="module")
def campaign():
    return smooth_motion(set_c_campaign())


@pytest.fixture(scope="module")
def fitted(campaign):
    training = [test for test in campaign if test.role == "training"]
    return fit_form(problem_of(training), drive_unit="A")


@pytest.mark.planted
def test_set_c_comes_back_within_three_percent(fitted):
    z_max = np.sqrt(SET_C["A"] / (SET_C["gamma"] + SET_C["beta"]))
    found = fitted.model.parameters
    for letter, alpha in zip("abcd", SET_C["alpha"], strict=True):
        assert found[f"yield_force_{letter}"] == pytest.approx(alpha * z_max, rel=0.03)
    for letter, c0 in zip("ab", SET_C["c0"], strict=True):
        assert found[f"c0_{letter}"] == pytest.approx(c0, rel=0.03)
    assert found["yield_displacement"] == pytest.approx(z_max / SET_C["A"], rel=0.03)
    assert found["eta"] == pytest.approx(SET_C["eta"], rel=0.03)
    thesis = thesis_parameters(fitted.model, SET_C["A"])
    assert thesis["gamma"] == pytest.approx(SET_C["gamma"], rel=0.03)
    assert thesis["beta"] == pytest.approx(SET_C["beta"], rel=0.03)


@pytest.mark.property
@pytest.mark.parametrize("unstable", ["above", "on both sides"])
def test_a_value_beside_which_the_damper_is_unstable_does_not_end_the_fit(campaign, unstable):
    """A run that overflows had made the Jacobian infinite, and the fit ended with an error of linear algebra."""
    problem = problem_of(campaign[:2], orders=(1, 0))
    start = start_of(problem, {}, [])
    w = weighting(problem)

    def solved(theta):
        found = solve(problem, theta, w)
        outside = theta[0] > start[0] if unstable == "above" else theta[0] != start[0]
        return replace(found, residual=np.full_like(found.residual, np.inf)) if outside else found

    logarithmic = np.array([parameter.logarithmic for _, parameter in problem.searched])
    space = Space(solved, *problem.bounds(), logarithmic)
    rows = space.jacobian(start, solve(problem, start, w).residual)
    assert np.isfinite(rows).all() and np.any(rows[1] != 0.0)
    assert np.any(rows[0] != 0.0) == (unstable == "above")


@pytest.mark.planted
def test_the_error_on_unseen_tests_is_that_of_the_noise(campaign, fitted):
    held_out = [test for test in campaign if test.role == "validation"]
    raw = score_tests(fitted.model, held_out, raw_force=True)
    errors = [np.sqrt(score.squared_error / score.samples) for score in raw]
    # the force noise planted is 2 N; displacement noise adds to it at reversals
    assert 1.9 < np.sqrt(np.mean(np.square(errors))) < 2.6
    assert pool(score_tests(fitted.model, held_out)).fit_percent > 98.5


@pytest.mark.planted
def test_standard_errors_cover_what_was_planted(fitted):
    assert fitted.at_bound == ()
    z_max = np.sqrt(SET_C["A"] / (SET_C["gamma"] + SET_C["beta"]))
    truth = {
        "yield_displacement": z_max / SET_C["A"],
        "eta": SET_C["eta"],
        "c0_a": SET_C["c0"][0],
        "c0_b": SET_C["c0"][1],
        "yield_force_a": SET_C["alpha"][0] * z_max,
        "yield_force_c": SET_C["alpha"][2] * z_max,
    }
    for name, value in truth.items():
        error = fitted.standard_error(name)
        assert 0.0 < error < 0.1 * value
        assert abs(fitted.model.parameters[name] - value) < 4.0 * error + 0.005 * value
    assert np.isnan(fitted.standard_error("exponent"))
    pairs = {frozenset(pair[:2]) for pair in fitted.correlated()}
    assert frozenset(("yield_force_c", "yield_force_d")) in pairs


@pytest.mark.planted
def test_nelder_mead_of_the_thesis_ends_where_least_squares_does(campaign, fitted):
    training = [test for test in campaign if test.role == "training"][::2]
    problem = problem_of(training, maximum_samples=3000)
    simplex = fit_form(problem, FitMethod("nelder-mead", starts=1), drive_unit="A")
    squares = fit_form(problem, FitMethod(starts=1), drive_unit="A")
    assert simplex.training_nrmse == pytest.approx(squares.training_nrmse, rel=1e-3)
    for name in ("yield_displacement", "eta", "gamma_share"):
        assert simplex.model.parameters[name] == pytest.approx(squares.model.parameters[name], rel=0.03)


@pytest.mark.planted
@pytest.mark.parametrize("form", sorted(set(NUMBERS) - REDUNDANT))
def test_every_form_finds_itself(form):
    """Recover planted numbers from exact motion: a test of the fits, not of differentiation."""
    fit = fit_form(
        problem_of(planted_tests(form), form, orders=(1, 1), maximum_samples=4000, raw_force=True), drive_unit="A"
    )
    assert fit.training_nrmse < 3e-3
    for name, value in NUMBERS[form].items():
        if name == "yield_displacement" and "growth" in NUMBERS[form]:
            # the fit gives it at another reference force, which follows from the tests
            ratio = fit.model.parameters["reference_force"] / NUMBERS[form]["reference_force"]
            value *= ratio ** NUMBERS[form]["growth"]
        if name in fit.names:
            assert fit.model.parameters[name] == pytest.approx(value, rel=0.05), name
    for name, value in LAWS.items():
        assert fit.model.parameters[name] == pytest.approx(value, rel=0.05), name


@pytest.mark.planted
@pytest.mark.parametrize("form", sorted(REDUNDANT))
def test_forms_with_redundant_numbers_reach_the_noise(form):
    problem = problem_of(planted_tests(form)[:3], form, orders=(1, 1), maximum_samples=4000, raw_force=True)
    fit = fit_form(problem, FitMethod(starts=1), drive_unit="A")
    # along the ridge of the two springs in series the search ends before the noise
    assert fit.training_nrmse < (0.01 if form == "gamota-filisko" else 5e-3)


def planted_tests(form):
    damper = DamperModel(form, {**LAWS, **NUMBERS[form]}, "A")
    rows = [(5e-3, 0.8, 0.0), (10e-3, 1.0, 2.0), (5e-3, 2.0, 2.0), (10e-3, 1.8, 0.0)]
    tests = []
    for place, (amplitude, frequency, current) in enumerate(rows):

        def force(x, v, u, times):
            return damper.force(x, v, np.gradient(v, times), u, 1e-3)

        test = bench_test(f"{place}", "training", amplitude, frequency, current, force, noise=(0.0, 0.05), seed=place)
        omega = 2 * np.pi * frequency
        position, speed = amplitude * np.sin(omega * test.time_s), amplitude * omega * np.cos(omega * test.time_s)
        tests.append(replace(test, displacement_m=position, velocity_m_s=speed))
    return tests


@pytest.mark.property
@given(st.integers(0, 3), st.lists(st.floats(0.0, 10.0), min_size=4, max_size=4), st.floats(0.5, 10.0))
def test_bernstein_coefficients_above_zero_keep_a_polynomial_above_zero(order, coefficients, limit):
    share = np.linspace(0.0, 1.0, 30)
    chosen = np.array(coefficients[: order + 1])
    value = np.sum([c * b for c, b in zip(chosen, bernstein(share, order), strict=True)], axis=0)
    assert value.min() >= 0.0
    powers = bernstein_to_power(order, limit) @ chosen
    np.testing.assert_allclose(np.polynomial.polynomial.polyval(share * limit, powers), value, atol=1e-9)


@pytest.mark.oracle
def test_projected_coefficients_are_those_of_non_negative_least_squares():
    from scipy.optimize import nnls

    rng = np.random.default_rng(7)
    columns = rng.normal(size=(5, 400)) * np.array([1.0, 100.0, 0.01, 3.0, 1e3])[:, None]
    low, high = np.zeros(5), np.full(5, np.inf)
    for weights in ([1.0, 2.0, 3.0, 4.0, 5.0], [1.0, -2.0, 3.0, -0.1, 0.5]):
        target = np.array(weights) @ columns + rng.normal(size=400)
        found, fixed = bounded_solution(columns @ columns.T, columns @ target, low, high)
        expected = nnls(columns.T, target)[0]
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)
        np.testing.assert_array_equal(fixed, expected == 0.0)


@pytest.mark.property
def test_the_fit_predicts_what_its_damper_gives(campaign, fitted):
    tests = [test for test in campaign if test.role == "training"][:4]
    force = np.concatenate(
        [fitted.model.force(t.displacement_m, t.velocity_m_s, t.acceleration_m_s2, t.drive, t.dt) for t in tests]
    )
    np.testing.assert_allclose(predict(fitted.fit, bench_recordings(tests)), force, rtol=1e-9, atol=1e-7)


@pytest.mark.planted
@pytest.mark.parametrize("form", ["bouc-wen-stiffness", "bingham-spring", "modified-bouc-wen", "eyring-spring"])
def test_a_coupled_form_predicts_what_its_damper_gives(form):
    tests = planted_tests(form)[1:3]
    problem = problem_of(tests, form, orders=(0, 0), maximum_samples=4000, raw_force=True)
    fit = fit_form(problem, FitMethod(starts=1, iterations=12), drive_unit="A")
    force = np.concatenate(
        [fit.model.force(t.displacement_m, t.velocity_m_s, t.acceleration_m_s2, t.drive, t.dt) for t in tests]
    )
    error = predict(fit.fit, bench_recordings(tests, raw_force=True)) - force
    assert np.sqrt(np.mean(error**2) / np.mean(force**2)) < 2e-3


@pytest.mark.property
def test_orders_follow_the_levels_of_drive(campaign):
    constant = [test for test in campaign if np.ptp(test.drive) == 0.0]
    recordings = bench_recordings(constant)
    form = base_form("bouc-wen")
    assert distinct_levels(recordings) == 3
    assert [law.order for law in polynomial_laws(form, 3, 3, 1)] == [2, 1]
    assert not base_of(recordings, form, [LawShape()] * 2).lag_known
    one = bench_recordings([test for test in constant if test.drive[0] == 4.0])
    assert [law.order for law in polynomial_laws(form, distinct_levels(one), 3, 1)] == [0, 0]
    assert distinct_levels(bench_recordings(campaign)) > 3


@pytest.mark.property
@pytest.mark.parametrize(
    ("shape", "levels"),
    [(lambda t: np.sin(2.0 * t) > 0.0, 2), (lambda t: np.floor(2.999 * np.abs(np.sin(t))), 3), (np.abs, None)],
)
def test_a_drive_that_steps_between_levels_determines_no_more_than_these(campaign, shape, levels):
    # two levels do not determine a cubic law, although the lag passes through all drives between them
    recordings = bench_recordings(campaign)
    time = np.arange(len(recordings.drive)) * 0.004
    drive = np.asarray(shape(time), dtype=np.float64)
    noise = 0.005 * np.max(drive) * np.random.default_rng(3).standard_normal(len(drive))
    found = distinct_levels(replace(recordings, drive=drive + noise))
    assert found == levels if levels else found > 10
    orders = [law.order for law in polynomial_laws(base_form("bouc-wen"), found, 3, 1)]
    assert orders == [min(3, (levels or 9) - 1), 1]


@pytest.mark.property
def test_a_lag_that_cannot_be_told_is_assumed(campaign):
    constant = [test for test in campaign if np.ptp(test.drive) == 0.0 and test.role == "training"]
    fit = fit_form(problem_of(constant), FitMethod(starts=1, assumed_eta=70.0), drive_unit="A")
    assert fit.model.parameters["eta"] == 70.0
    assert "eta" not in fit.names


@pytest.mark.property
def test_a_window_holds_the_cycles_asked_for(campaign):
    test = replace(campaign[0], cycles=np.array([100, 300, 500, 700]))
    assert fit_window(test, 2) == slice(0, 500)
    assert fit_window(test, 0) == slice(None)
    assert fit_window(replace(test, excitation="random"), 2) == slice(None)


@pytest.mark.property
def test_thinned_recordings_keep_motion_forces_and_gaps(campaign):
    whole = bench_recordings(campaign[:3])
    thin = thinned(whole, len(whole.force) // 4)
    stride = round(thin.dt[0] / whole.dt[0])
    np.testing.assert_array_equal(thin.force[:100], whole.force[: 100 * stride : stride])
    assert not np.any(
        thin.used & ~whole.used[np.concatenate([np.arange(a, b, stride) for a, b in pairs(whole.starts)])]
    )
    assert thin.starts[-1] == len(thin.force)


def pairs(starts):
    return itertools.pairwise(starts)


@pytest.mark.property
def test_stretches_split_every_test(campaign):
    recordings = bench_recordings(campaign[:2])
    block = blocks_of(recordings)
    for first, last in pairs(recordings.starts):
        used = recordings.used[first:last]
        assert len(np.unique(block[first:last][used])) == 20
    assert len(np.unique(block)) == 40
