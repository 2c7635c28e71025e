"""Fits: planted parameters come back, and the pieces they rest on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.dampers.fit import _non_negative, fit_form
from mrpipe.dampers.form import bernstein, bernstein_to_power
from mrpipe.dampers.forms import FORMS
from mrpipe.dampers.model import DamperModel, thesis_parameters
from mrpipe.dampers.motion import motion_of
from mrpipe.dampers.samples import distinct_levels, fit_data, fit_window, scales_of, smooth_motion
from mrpipe.dampers.scoring import pool, score_tests
from tests.dampers.planted import SET_C, bench_test, set_c_campaign


@pytest.fixture(scope="module")
def campaign():
    return smooth_motion(set_c_campaign())


@pytest.fixture(scope="module")
def fitted(campaign):
    training = [test for test in campaign if test.role == "training"]
    return fit_form(FORMS["bouc-wen"], fit_data(training), scales_of(training))


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
    data, scales = fit_data(training, maximum_samples=3000), scales_of(training)
    simplex = fit_form(FORMS["bouc-wen"], data, scales, method="nelder-mead", starts=1)
    squares = fit_form(FORMS["bouc-wen"], data, scales, starts=1)
    assert simplex.training_nrmse == pytest.approx(squares.training_nrmse, rel=1e-3)
    for name in ("yield_displacement", "eta", "gamma_share"):
        assert simplex.model.parameters[name] == pytest.approx(squares.model.parameters[name], rel=0.03)


@pytest.mark.planted
@pytest.mark.parametrize(
    ("form", "planted"),
    [
        ("dahl", {"yield_displacement": 4e-4}),
        ("bingham", {"transition_velocity": 0.0}),
        (
            "rounded-yield",
            {"yield_displacement": 4e-4, "gamma_share": 0.6, "velocity_scale": 0.01, "rounded_force_a": 30.0},
        ),
        ("power-yield", {"yield_displacement": 4e-4, "gamma_share": 0.6, "velocity_exponent": 0.25}),
        ("saturating-dashpot", {"spring_rate": 3000.0, "velocity_scale": 0.02}),
        ("modified-bouc-wen", {"yield_displacement": 4e-4, "gamma_share": 0.6, "c1_a": 8e3, "k0": 900.0}),
    ],
)
def test_every_form_finds_itself(form, planted):
    numbers = {"yield_force_a": 25.0, "yield_force_b": 40.0, "c0_a": 60.0, **planted}
    if form == "power-yield":
        numbers["reference_velocity"] = 0.1
    truth = DamperModel(form, numbers)

    def force(x, v, u, times):
        return truth.force(x, v, 0.0 * x, u, 1e-3)

    tests = [
        bench_test(f"{place}", "training", amplitude, frequency, current, force, noise=(0.0, 0.05), seed=place)
        for place, (amplitude, frequency, current) in enumerate(
            [(5e-3, 0.8, 0.0), (10e-3, 1.0, 2.0), (5e-3, 2.0, 2.0), (10e-3, 1.8, 0.0)]
        )
    ]
    # exact velocities: this is a test of the fits and not of differentiation
    exact = []
    for test, (amplitude, frequency) in zip(tests, [(5e-3, 0.8), (10e-3, 1.0), (5e-3, 2.0), (10e-3, 1.8)], strict=True):
        omega = 2 * np.pi * frequency
        exact.append(
            replace(
                test,
                displacement_m=amplitude * np.sin(omega * test.time_s),
                velocity_m_s=amplitude * omega * np.cos(omega * test.time_s),
            )
        )
    scales = scales_of(exact, viscosity_order=0)
    fit = fit_form(FORMS[form], fit_data(exact, maximum_samples=4000, raw_force=True), scales, starts=2)
    assert fit.training_nrmse < 2e-3
    for name, value in planted.items():
        if name in fit.names:
            tolerance = 0.1 if name == "k0" else 0.03
            assert fit.model.parameters[name] == pytest.approx(value, rel=tolerance), name


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
    for weights in ([1.0, 2.0, 3.0, 4.0, 5.0], [1.0, -2.0, 3.0, -0.1, 0.5]):
        target = np.array(weights) @ columns + rng.normal(size=400)
        np.testing.assert_allclose(_non_negative(columns, target), nnls(columns.T, target)[0], rtol=1e-7, atol=1e-9)


@pytest.mark.property
def test_columns_times_coefficients_are_the_models_force(campaign, fitted):
    tests = [test for test in campaign if test.role == "training"][:4]
    form, scales = fitted.form, fitted.scales
    columns = form.regressors(fitted.values, motion_of(tests), scales).columns
    force = np.concatenate(
        [fitted.model.force(t.displacement_m, t.velocity_m_s, t.acceleration_m_s2, t.drive, t.dt) for t in tests]
    )
    np.testing.assert_allclose(fitted.linear @ columns, force, rtol=1e-9, atol=1e-7)


@pytest.mark.property
def test_orders_follow_the_levels_of_drive(campaign):
    constant = [test for test in campaign if np.ptp(test.drive) == 0.0]
    assert distinct_levels(constant) == 3
    scales = scales_of(constant)
    assert (scales.yield_order, scales.viscosity_order, scales.lag_known) == (2, 1, False)
    one = scales_of([test for test in constant if test.drive[0] == 4.0])
    assert (one.yield_order, one.viscosity_order) == (0, 0)
    assert scales_of(campaign).yield_order == 3


@pytest.mark.property
def test_a_lag_that_cannot_be_told_is_assumed(campaign):
    constant = [test for test in campaign if np.ptp(test.drive) == 0.0 and test.role == "training"]
    fit = fit_form(FORMS["bouc-wen"], fit_data(constant), scales_of(constant, assumed_eta=70.0), starts=1)
    assert fit.model.parameters["eta"] == 70.0
    assert "eta" not in fit.names


@pytest.mark.property
def test_a_window_holds_the_cycles_asked_for(campaign):
    test = replace(campaign[0], cycles=np.array([100, 300, 500, 700]))
    assert fit_window(test, 2) == slice(0, 500)
    assert fit_window(test, 0) == slice(None)
    assert fit_window(replace(test, excitation="random"), 2) == slice(None)


@pytest.mark.property
def test_thinned_data_keep_the_motion_and_its_forces(campaign):
    data = fit_data(campaign[:3])
    thin = data.thinned(len(data.motion.drive) // 4)
    assert thin.motion.dt == pytest.approx(4.0 * data.motion.dt, rel=0.3)
    original = {float(x): f for x, f in zip(data.motion.displacement[data.at], data.force, strict=True)}
    for place, force in zip(thin.at, thin.force, strict=True):
        assert original[float(thin.motion.displacement[place])] == pytest.approx(force)


@pytest.mark.property
def test_thinned_data_leave_gaps_alone(campaign):
    data = fit_data(campaign[:1])
    kept = data.subset(data.block % 2 == 0)
    thin = kept.thinned(len(data.motion.drive) // 4)
    stride = round(thin.motion.dt[0] / data.motion.dt[0])
    # a force that lies in a stretch that was taken out would have been made up
    assert np.isin(thin.at * stride, kept.at).mean() > 0.95
    assert 0.3 * len(thin.motion.drive) < len(thin.at) < 0.6 * len(thin.motion.drive)
