"""Training: split by record, starts, determinism, folding of the whitened basis."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from mrpipe.networks.assembly import samples
from mrpipe.networks.evaluation import judge
from mrpipe.networks.held_out import hold_out, training_data
from mrpipe.networks.network import FeatureSpec
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.scaling import channel_blocks, scaling_of
from mrpipe.networks.training import initial_parameters, to_network, train
from tests.networks.rig import bench_history, bench_test

FORWARD = FeatureSpec(("velocity", "drive"), 3, False, 200.0, "force")
INVERSE = FeatureSpec(("velocity", "force"), 3, True, 200.0, "drive")
QUICK = TrainingOptions(
    architecture=(6, 6),
    biases=True,
    starts=3,
    refined_starts=2,
    subsample_rows=2000,
    subsample_iterations=60,
    iterations=30,
)


@pytest.mark.property
def test_the_split_is_by_record_and_spans_the_forces() -> None:
    history = bench_history()
    fitted, held = hold_out(history, 0.3, np.random.default_rng(0))
    assert set(fitted.names) | set(held.names) == set(history.names)
    assert not set(fitted.names) & set(held.names)
    assert len(held.names) == round(0.3 * len(history.names))
    forces = [np.sqrt(np.mean(held.record(index, "force") ** 2)) for index in range(len(held.names))]
    everything = [np.sqrt(np.mean(history.record(index, "force") ** 2)) for index in range(len(history.names))]
    assert min(forces) < np.median(everything) < max(forces)


@pytest.mark.property
def test_a_single_record_gives_its_end_away() -> None:
    history = bench_history().select([2])
    fitted, held = hold_out(history, 0.25, np.random.default_rng(0))
    whole = history.channels["force"]
    np.testing.assert_array_equal(np.concatenate([fitted.channels["force"], held.channels["force"]]), whole)
    assert len(held.channels["force"]) == pytest.approx(0.25 * len(whole), abs=1)
    assert fitted.starts[-1] == len(fitted.channels["force"])


@pytest.mark.property
@pytest.mark.parametrize("normalisation", ["maximum", "range", "standard"])
def test_normalisation_does_what_it_says(normalisation: str) -> None:
    rows = samples(bench_history(), FORWARD)
    scaling = scaling_of(rows.features, rows.target, FORWARD, normalisation, whitened=False)  # type: ignore[arg-type]
    inputs = scaling.inputs(rows.features)
    for block in channel_blocks(FORWARD):
        assert len(set(scaling.input_scale[block])) == 1
        if normalisation == "maximum":
            assert np.max(np.abs(inputs[block])) == pytest.approx(1.0)
            assert np.all(scaling.input_shift[block] == 0.0)
        elif normalisation == "range":
            assert (inputs[block].min(), inputs[block].max()) == (pytest.approx(-1.0), pytest.approx(1.0))
        else:
            assert np.std(inputs[block]) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.property
def test_whitened_inputs_are_uncorrelated_and_the_basis_folds_away() -> None:
    data = training_data(bench_history(), FORWARD, QUICK.held_out_share, np.random.default_rng(0))
    every = samples(bench_history(), FORWARD)
    inputs = data.scaling.inputs(every.features)
    moments = inputs @ inputs.T / inputs.shape[1]
    np.testing.assert_allclose(moments - np.diag(np.diag(moments)), 0.0, atol=1e-5)
    problem = data.problem((8, 6, 6, 1), True)
    parameters = np.random.default_rng(1).uniform(-0.5, 0.5, problem.size)
    network = to_network(parameters, data, (6, 6), True)
    direct = problem.output(parameters) * data.scaling.output_scale + data.scaling.output_shift
    np.testing.assert_allclose(network.predict(data.fit_rows.features), direct, atol=1e-6)


@pytest.mark.golden
@pytest.mark.parametrize("biases", [False, True])
def test_forward_network_learns_the_bench(biases: bool) -> None:
    history = bench_history()
    trained = train(history, FORWARD, QUICK.changed(biases=biases), np.random.default_rng(1), jobs=2)
    judged = judge(trained.network, history, bench_history("validation", (1.2,)))
    assert trained.network.architecture == "8-6-6-1"
    assert trained.network.has_biases is biases
    assert judged.pooled.nrmse < 0.12
    assert judged.linear.nrmse > 0.4
    assert judged.regimes["post_yield"].nrmse < judged.regimes["pre_yield"].nrmse


@pytest.mark.property
def test_the_result_depends_on_the_seed_and_not_on_the_jobs() -> None:
    history = bench_history()
    one = train(history, INVERSE, QUICK, np.random.default_rng(2), jobs=1)
    two = train(history, INVERSE, QUICK, np.random.default_rng(2), jobs=3)
    other = train(history, INVERSE, QUICK, np.random.default_rng(3), jobs=1)
    for first, second in zip(one.network.weights, two.network.weights, strict=True):
        assert first.tobytes() == second.tobytes()
    assert one.held_out == two.held_out
    assert one.network.weights[0].tobytes() != other.network.weights[0].tobytes()


@pytest.mark.property
def test_the_best_start_on_the_held_out_records_is_kept() -> None:
    trained = train(bench_history(), FORWARD, QUICK.changed(refined_starts=1), np.random.default_rng(4))
    refined = [start for start in trained.starts if np.isfinite(start.refined_held_out_nrmse)]
    assert len(refined) == 1
    assert refined[0].held_out_nrmse == min(start.held_out_nrmse for start in trained.starts)
    assert refined[0].refined_held_out_nrmse <= refined[0].held_out_nrmse * 1.05
    assert trained.iterations == refined[0].iterations == len(trained.path) - 1 or trained.iterations < len(
        trained.path
    )


@pytest.mark.property
def test_training_without_held_out_records_or_second_phase() -> None:
    options = QUICK.changed(held_out_share=0.0, iterations=0)
    trained = train(bench_history(), FORWARD, options, np.random.default_rng(5))
    assert trained.held_out == ()
    assert all(np.isnan(start.refined_held_out_nrmse) for start in trained.starts)
    assert trained.path[-1] < 0.5 * trained.path[0]


@pytest.mark.property
def test_the_second_phase_can_learn_the_held_out_records_and_average_starts() -> None:
    history = bench_history()
    options = QUICK.changed(biases=True, refine_on="every", refined_rows=1500)
    one = train(history, INVERSE, options, np.random.default_rng(7))
    two = train(history, INVERSE, options.changed(averaged=2), np.random.default_rng(7))
    # the held-out records chose between the starts all the same
    assert one.held_out and one.held_out == two.held_out
    assert [start.held_out_nrmse for start in one.starts] == [start.held_out_nrmse for start in two.starts]
    assert one.network.architecture == "8-6-6-1" and two.network.architecture == "8-12-12-1"
    held = hold_out(history, options.held_out_share, np.random.default_rng(7))[1]
    assert held.names == one.held_out
    rows = samples(held, INVERSE)
    errors = {
        name: float(np.sqrt(np.mean((trained.network.predict(rows.features) - rows.target) ** 2)))
        for name, trained in {
            "every": one,
            "fitted": train(history, INVERSE, QUICK.changed(biases=True), np.random.default_rng(7)),
        }.items()
    }
    assert errors["every"] < errors["fitted"]


@pytest.mark.filterwarnings("ignore:lbfgs failed to converge")
@pytest.mark.oracle
@pytest.mark.parametrize("biases", [False, True])
def test_a_start_from_scikit_learn_is_its_network(biases: bool) -> None:
    from sklearn.neural_network import MLPRegressor

    data = training_data(bench_history(), FORWARD, QUICK.held_out_share, np.random.default_rng(0))
    problem = data.problem((8, 6, 6, 1), biases, np.arange(800))
    parameters = initial_parameters(problem, np.random.default_rng(7), "perceptron")
    assert len(parameters) == problem.size
    if biases:
        seed = int(np.random.default_rng(7).integers(2**31))
        oracle = MLPRegressor(
            hidden_layer_sizes=(6, 6),
            activation="tanh",
            solver="lbfgs",
            alpha=0.0,
            max_iter=100,
            tol=1e-9,
            random_state=seed,
        )
        with pytest.warns(match="lbfgs"):
            oracle.fit(problem.inputs.T, problem.target)
        np.testing.assert_allclose(problem.output(parameters), oracle.predict(problem.inputs.T), atol=1e-9)
        assert problem.mean_square(parameters) < 0.2 * np.mean(problem.target**2)


@pytest.mark.property
def test_the_training_range_is_kept_with_the_network() -> None:
    history = bench_history()
    trained = train(history, FORWARD, QUICK.changed(starts=1, iterations=0), np.random.default_rng(6))
    assert trained.network.outside_training_range(samples(history, FORWARD).features) == 0.0
    from mrpipe.networks.assembly import join

    faster = join([bench_test("fast", 6.0, 2.0)], cycles=3, sampling_rate_hz=200.0)
    assert trained.network.outside_training_range(samples(faster, FORWARD).features) > 0.5


@pytest.mark.property
def test_a_perceptron_that_stops_early_gives_no_warning() -> None:
    """Filters of warnings that a thread sets do not hold for the others, so that scikit-learn's warning got out."""
    options = QUICK.changed(initial="perceptron", starts=2, refined_starts=1, subsample_iterations=2, iterations=0)
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        train(bench_history(), FORWARD, options, np.random.default_rng(6), jobs=2)
    assert [str(item.message)[:60] for item in given] == []


@pytest.mark.golden
def test_the_route_of_the_thesis_learns_the_bench() -> None:
    """A perceptron of scikit-learn, then MINPACK's Levenberg-Marquardt; two layers of six, without biases."""
    options = QUICK.changed(initial="perceptron", method="minpack", biases=False, starts=2, refined_starts=1)
    trained = train(bench_history(), FORWARD, options, np.random.default_rng(1))
    judged = judge(trained.network, bench_history(), bench_history("validation", (1.2,)))
    assert trained.network.architecture == "8-6-6-1" and not trained.network.has_biases
    assert judged.pooled.nrmse < 0.15 < 0.4 < judged.linear.nrmse
