"""Error figures, regimes, baseline, free run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.linear_model import LinearRegression
from sklearn.metrics import r2_score

from mrpipe.networks.assembly import samples
from mrpipe.networks.evaluation import (
    REGIMES,
    by_test,
    error_figures,
    free_run,
    judge,
    linear_baseline,
    regimes_of,
    travel_since_reversal,
    yield_travel,
)
from mrpipe.networks.network import FeatureSpec, Network
from tests.networks.rig import bench_history

FORWARD = FeatureSpec(("velocity", "drive"), 3, False, 200.0, "force")


def linear_network(weights: np.ndarray, spec: FeatureSpec) -> Network:
    """Return a network without hidden layer: output = weights . features."""
    return Network(
        weights=(weights[None, :],),
        biases=(np.zeros(1),),
        input_scale=np.ones(len(weights)),
        input_shift=np.zeros(len(weights)),
        output_scale=1.0,
        output_shift=0.0,
        features=spec,
        has_biases=False,
    )


@pytest.mark.oracle
@given(st.integers(0, 10_000), st.floats(0.01, 3.0))
@settings(deadline=None, max_examples=30)
def test_error_figures_are_the_usual_ones(seed: int, noise: float) -> None:
    rng = np.random.default_rng(seed)
    measured = rng.normal(size=50) + 0.3
    estimated = measured + noise * rng.normal(size=50)
    figures = error_figures(measured, estimated)
    assert figures.r2 == pytest.approx(r2_score(measured, estimated), rel=1e-9, abs=1e-12)
    rms = np.sqrt(np.mean((estimated - measured) ** 2))
    assert figures.rms == pytest.approx(rms)
    assert figures.nrmse == pytest.approx(rms / np.sqrt(np.mean(measured**2)))
    assert figures.fit_percent == pytest.approx(100.0 * (1.0 - rms / np.std(measured)))


@pytest.mark.property
def test_figures_of_nothing_and_of_a_constant_are_not_invented() -> None:
    assert np.isnan(error_figures(np.zeros(0), np.zeros(0)).nrmse)
    constant = error_figures(np.full(10, 2.0), np.full(10, 2.2))
    assert constant.nrmse == pytest.approx(0.1)
    assert np.isnan(constant.r2)
    assert np.isnan(error_figures(np.zeros(10), np.full(10, 0.1)).nrmse)


@pytest.mark.property
def test_travel_starts_anew_at_each_reversal() -> None:
    phase = np.linspace(0.0, 4.0 * np.pi, 4001)
    displacement, velocity = 5.0 * np.sin(phase), np.cos(phase)
    travel = travel_since_reversal(displacement, velocity, np.array([0, 4001]))
    assert np.isinf(travel[:500]).all()
    later = slice(510, None)
    assert travel[later].min() < 0.01
    assert travel[later].max() == pytest.approx(10.0, rel=1e-3)


@pytest.mark.planted
def test_the_yield_travel_of_the_rig_is_found() -> None:
    """From z = -1 to 0 the rig needs 1/q, from 0 to nine tenths atanh(0.9)/q, with q = 3000/1.104 1/m: 0.91 mm."""
    stiffness = 3000.0 / np.sqrt(3000.0 / 2460.0)
    expected = (1.0 + np.arctanh(0.9)) / stiffness
    assert yield_travel(bench_history()) == pytest.approx(expected, rel=0.25)


@pytest.mark.property
def test_every_sample_has_one_regime_and_each_occurs() -> None:
    history = bench_history()
    regime = regimes_of(history, 0.9e-3)
    assert set(np.unique(regime)) == {0, 1, 2}
    against = history.channels["force"] * history.channels["velocity"] < 0.0
    assert not against[regime == REGIMES.index("pre_yield")].any()
    assert against[regime == REGIMES.index("reversal")].all()
    fast = np.abs(history.channels["velocity"]) > 0.8 * np.abs(history.channels["velocity"]).max()
    assert np.mean(regime[fast] == 2) > 0.95


@pytest.mark.oracle
def test_linear_baseline_is_linear_regression() -> None:
    training, judged = samples(bench_history(), FORWARD), samples(bench_history("validation", (1.27,)), FORWARD)
    # scikit-learn drops directions below 1e-6 of the largest: it gets the features on one scale
    scale = np.abs(training.features).max(axis=0)
    oracle = LinearRegression().fit(training.features / scale, training.target)
    ours = linear_baseline(training, judged)
    np.testing.assert_allclose(ours, oracle.predict(judged.features / scale), rtol=1e-6, atol=1e-6)


@pytest.mark.property
def test_judgement_splits_into_tests_and_kinds_of_drive() -> None:
    history = bench_history("validation")
    rng = np.random.default_rng(0)
    network = linear_network(rng.normal(size=8), FORWARD)
    judged = judge(network, bench_history(), history)
    assert judged.constant.samples + judged.varying.samples == judged.pooled.samples == len(judged.estimated)
    assert sum(item.samples for item in judged.regimes.values()) == judged.pooled.samples
    assert sum(figures.samples for _, figures in judged.tests) == judged.pooled.samples
    pooled = sum(figures.rms**2 * figures.samples for _, figures in judged.tests) / judged.pooled.samples
    assert judged.pooled.rms == pytest.approx(np.sqrt(pooled))
    assert len(judged.test_rows("N")) == len(history.names)
    name, figures = by_test(history, judged.samples, judged.estimated)[2]
    mine = judged.samples.test == 2
    assert name == history.names[2]
    assert figures == error_figures(judged.samples.target[mine], judged.estimated[mine])


@pytest.mark.property
def test_a_constant_drive_has_an_error_in_amperes_and_no_relative_one() -> None:
    history = bench_history("validation")
    judged = judge(linear_network(np.ones(8), FORWARD), bench_history(), history)
    rows = {row["test"]: row for row in judged.test_rows("A", span=4.0)}
    for name, varies in zip(history.names, history.drive_varies, strict=True):
        row = rows[name]
        assert "NRMSE" not in row and "fit [%]" not in row
        assert row["RMS error [% of range]"] == pytest.approx(25.0 * float(row["RMS error [A]"]))
        assert np.isfinite(float(row["R2 (varying drive)"])) == varies


@pytest.mark.property
def test_free_run_feeds_the_output_back() -> None:
    history = bench_history()
    spec = replace(FORWARD, past_values=2, past_target=True)
    weights = np.array([300.0, 0.0, -20.0, 5.0, 0.0, 0.0, 0.6, 0.2])
    network = linear_network(weights, spec)
    ours = free_run(network, history)
    for index in (0, 7):
        velocity, drive = history.record(index, "velocity"), history.record(index, "drive")
        expected = history.record(index, "force").copy()
        for k in range(2, len(expected)):
            inputs = [velocity[k], velocity[k - 1], velocity[k - 2], drive[k], drive[k - 1], drive[k - 2]]
            expected[k] = weights @ np.array([*inputs, expected[k - 1], expected[k - 2]])
        np.testing.assert_allclose(ours[history.starts[index] : history.starts[index + 1]], expected, rtol=1e-9)


@pytest.mark.property
def test_free_run_without_feedback_is_one_step() -> None:
    history = bench_history()
    network = linear_network(np.random.default_rng(1).normal(size=8), FORWARD)
    rows = samples(history, FORWARD)
    np.testing.assert_allclose(free_run(network, history)[rows.sample], network.predict(rows.features), rtol=1e-9)
