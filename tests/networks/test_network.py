"""The network's layout, and that it survives being stored."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.networks import FeatureSpec, Network, lagged, read_network, write_network
from mrpipe.networks.network import averaged


def random_network(sizes: tuple[int, ...], seed: int = 0, *, biases: bool = True) -> Network:
    rng = np.random.default_rng(seed)
    spec = FeatureSpec(("velocity", "drive"), sizes[0] // 2 - 1, False, 200.0, "force")
    pairs = list(zip(sizes[1:], sizes[:-1], strict=True))
    return Network(
        weights=tuple(rng.normal(size=pair) for pair in pairs),
        biases=tuple(rng.normal(size=out) if biases else np.zeros(out) for out, _ in pairs),
        input_scale=rng.uniform(0.5, 2.0, sizes[0]),
        input_shift=rng.normal(size=sizes[0]),
        output_scale=120.0,
        output_shift=-3.0,
        features=spec,
        feature_minimum=np.full(sizes[0], -1.0),
        feature_maximum=np.full(sizes[0], 1.0),
        has_biases=biases,
    )


@pytest.mark.literature
@pytest.mark.parametrize(("biases", "count"), [(False, 90), (True, 103)])
def test_thesis_network_has_the_known_number_of_parameters(biases: bool, count: int) -> None:
    network = random_network((8, 6, 6, 1), biases=biases)
    assert network.architecture == "8-6-6-1"
    assert network.parameters == count


@pytest.mark.oracle
def test_predict_is_the_formula_of_the_thesis_written_out() -> None:
    network = random_network((4, 3, 2, 1))
    row = np.array([0.3, -0.2, 1.5, 0.7])
    signal = [(row[i] - network.input_shift[i]) / network.input_scale[i] for i in range(4)]
    for layer in range(3):
        matrix, bias = network.weights[layer], network.biases[layer]
        sums = [sum(matrix[o, i] * signal[i] for i in range(len(signal))) + bias[o] for o in range(len(bias))]
        signal = [np.tanh(value) for value in sums] if layer < 2 else sums
    assert network.predict(row[None, :])[0] == pytest.approx(signal[0] * 120.0 - 3.0, rel=1e-12)


@pytest.mark.property
def test_steady_network_is_the_network_whose_past_equals_the_present() -> None:
    network = random_network((8, 6, 6, 1))
    present = np.random.default_rng(3).normal(size=(20, 2))
    steady = network.steady()
    assert steady.architecture == "2-6-6-1" and steady.features.past_values == 0
    np.testing.assert_allclose(steady.predict(present), network.predict(np.repeat(present, 4, axis=1)), rtol=1e-10)
    assert steady.outside_training_range(np.array([[0.0, 0.9], [0.0, 1.5]])) == 0.5
    assert steady.steady() is steady


@pytest.mark.property
@pytest.mark.parametrize("sizes", [(8, 6, 6, 1), (4, 5, 1), (4, 1)])
def test_an_averaged_network_gives_the_mean_of_its_members(sizes: tuple[int, ...]) -> None:
    first = random_network(sizes, 1)
    others = [random_network(sizes, seed) for seed in (2, 3)]
    members = [first, *(replace(first, weights=item.weights, biases=item.biases) for item in others)]
    network = averaged(members)
    rows = np.random.default_rng(4).normal(size=(30, sizes[0]))
    np.testing.assert_allclose(
        network.predict(rows), np.mean([item.predict(rows) for item in members], axis=0), rtol=1e-10
    )
    assert network.layers == (sizes[0], *(3 * count for count in sizes[1:-1]), 1)
    assert network.hidden_of_members == sizes[1:-1] and network.members == 3
    assert averaged([first]) is first


@pytest.mark.property
def test_zeros_between_members_are_no_parameters() -> None:
    one = random_network((8, 6, 6, 1), 1, biases=False)
    two = random_network((8, 6, 6, 1), 2, biases=False)
    assert averaged([one, replace(one, weights=two.weights)]).parameters == 2 * one.parameters


@pytest.mark.property
@given(st.integers(0, 5), st.integers(1, 3), st.integers(6, 40), st.booleans())
@settings(deadline=None, max_examples=40)
def test_lagged_rows_hold_present_then_past_values(past: int, count: int, length: int, absolute: bool) -> None:
    channels = [1000.0 * index - np.arange(length) for index in range(count)]
    rows = lagged(channels, past, absolute=absolute)
    assert rows.shape == (length - past, count * (past + 1))
    for row in range(len(rows)):
        expected = [channel[row + past - lag] for channel in channels for lag in range(past + 1)]
        np.testing.assert_array_equal(rows[row], np.abs(expected) if absolute else expected)


@pytest.mark.property
def test_labels_name_the_columns_in_their_order() -> None:
    spec = FeatureSpec(("velocity", "drive"), 1, False, 200.0, "force", past_target=True)
    assert spec.labels == ("velocity(k)", "velocity(k-1)", "drive(k)", "drive(k-1)", "force(k-1)")
    assert spec.width == 5


@pytest.mark.property
def test_a_network_comes_back_bit_for_bit(tmp_path: Path) -> None:
    network = averaged([random_network((8, 6, 6, 1), seed=3)] * 2)
    with ArtifactWriter.create(tmp_path / "net.h5", Provenance("train-forward")) as artifact:
        write_network(artifact, "network", network)
    again = read_network(Artifact(tmp_path / "net.h5"), "network")
    assert again.features == network.features and again.members == network.members == 2
    features = np.random.default_rng(1).normal(size=(50, 8))
    assert again.predict(features).tobytes() == network.predict(features).tobytes()
    for old, new in zip(network.weights + network.biases, again.weights + again.biases, strict=True):
        assert old.tobytes() == new.tobytes()


@pytest.mark.property
def test_rows_beyond_the_training_range_are_counted() -> None:
    network = random_network((8, 6, 6, 1))
    features = np.zeros((10, 8))
    features[:3, 5] = 1.5
    features[3, 0] = -1.03
    assert network.outside_training_range(features) == pytest.approx(0.3)
    assert network.outside_training_range(features, margin=0.0) == pytest.approx(0.4)
