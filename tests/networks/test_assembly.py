"""The training history: joins, decimation, windows, storage."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.networks.assembly import (
    cut,
    decimation_factor,
    drive_range,
    join,
    read_history,
    rows_at,
    samples,
    window_starts,
    without_aliases,
    write_history,
)
from mrpipe.networks.network import FeatureSpec, lagged
from tests.networks.rig import bench_history, bench_test, bench_tests


@pytest.mark.literature
def test_table_2_1_makes_182_000_rows() -> None:
    """19 sets, five frequencies, ten cycles at 200 Hz: the 182 000 rows that the issue speaks of."""
    frequencies = (0.5, 1.0, 1.27, 1.8, 2.2)
    one_set = join([bench_test(f"{f}", f, 1.0, cycles=10) for f in frequencies], cycles=10, sampling_rate_hz=200.0)
    assert 19 * one_set.samples == pytest.approx(182_000, rel=0.003)


@pytest.mark.property
def test_tests_are_joined_at_upward_zero_crossings() -> None:
    tests = bench_tests()
    history = join(tests, cycles=3, sampling_rate_hz=200.0)
    assert history.names == tuple(test.name for test in tests)
    displacement = history.channels["displacement"]
    for start in history.starts[:-1]:
        # the crossing lies within the millisecond of the record before the first sample
        speed = history.channels["velocity"][start]
        assert 0.0 <= displacement[start] <= 1.01e-3 * speed
    assert history.largest_jump("displacement") <= 1.05
    assert sum(history.drive_varies) == 4  # half-sine of 2 and 4 A; a half-sine of 0 A is constant


@pytest.mark.property
def test_a_held_drive_is_no_measure_of_a_jump() -> None:
    """Real set points reach the history with rounding errors: a step of 2 A over one of 1e-15 A said nothing."""
    history = join([bench_test(f"{u}", 1.0, u) for u in (1.0, 3.0)], cycles=3, sampling_rate_hz=200.0)
    assert history.largest_jump("drive") == 0.0


@pytest.mark.property
def test_only_steady_cycles_are_kept() -> None:
    test = bench_test("one", 1.0, 2.0, cycles=5)
    start, stop = cut(test, 2)
    assert (start, stop) == (int(test.cycles[-3]), int(test.cycles[-1]))
    assert stop - start == pytest.approx(2000, abs=2)
    assert cut(test, 99) == (int(test.cycles[0]), int(test.cycles[-1]))


@pytest.mark.property
@given(st.floats(1.0, 60.0), st.floats(130.0, 480.0), st.integers(0, 6))
@settings(deadline=None, max_examples=25)
def test_decimation_passes_what_the_rate_can_carry_and_stops_the_rest(low: float, high: float, phase: int) -> None:
    time = np.arange(4000) / 1000.0
    wanted = np.sin(2.0 * np.pi * low * time + phase)
    alias = np.sin(2.0 * np.pi * high * time)
    inner = slice(60, -60)
    passed = without_aliases(wanted, 5)[::5][inner]
    np.testing.assert_allclose(passed, wanted[::5][inner], atol=0.01)
    assert np.max(np.abs(without_aliases(alias, 5)[::5][inner])) < 0.01


@pytest.mark.property
def test_decimation_keeps_level_and_slope_to_the_ends() -> None:
    line = 3.0 + 0.01 * np.arange(500)
    np.testing.assert_allclose(without_aliases(line, 5), line, atol=1e-9)


@pytest.mark.property
@pytest.mark.parametrize(("native", "wanted", "factor"), [(1000.0, 200.0, 5), (3004.8, 500.0, 6), (100.0, 200.0, 1)])
def test_the_nearest_whole_factor_is_used(native: float, wanted: float, factor: int) -> None:
    assert decimation_factor(native, wanted) == factor


@pytest.mark.property
def test_no_window_reaches_across_a_join() -> None:
    history = bench_history()
    spec = FeatureSpec(("velocity", "drive"), 3, False, 200.0, "force")
    rows = samples(history, spec)
    assert len(rows.target) == history.samples - 3 * len(history.names)
    for index in range(len(history.names)):
        mine = rows.test == index
        alone = lagged([history.record(index, "velocity"), history.record(index, "drive")], 3)
        np.testing.assert_array_equal(rows.features[mine], alone)
        np.testing.assert_array_equal(rows.target[mine], history.record(index, "force")[3:])
    np.testing.assert_array_equal(history.channels["force"][rows.sample], rows.target)


@pytest.mark.property
def test_past_output_comes_last_and_lags_by_one() -> None:
    history = bench_history()
    spec = FeatureSpec(("velocity",), 2, False, 200.0, "force", past_target=True)
    places = window_starts(history, 2)
    features, target = rows_at(history, spec, places)
    assert features.shape[1] == spec.width == 5
    inside = np.diff(places, prepend=-1) == 1
    np.testing.assert_array_equal(features[inside, 3], history.channels["force"][places[inside] - 1])
    np.testing.assert_array_equal(target, history.channels["force"][places])


@pytest.mark.property
def test_absolute_values_for_the_inverse() -> None:
    history = bench_history()
    rows = samples(history, FeatureSpec(("velocity", "force"), 1, True, 200.0, "drive"))
    assert rows.features.min() >= 0.0
    signed = samples(history, FeatureSpec(("velocity", "force"), 1, False, 200.0, "drive"))
    np.testing.assert_array_equal(rows.features, np.abs(signed.features))


@pytest.mark.property
def test_a_history_comes_back_and_can_be_taken_apart(tmp_path: Path) -> None:
    history = bench_history()
    with ArtifactWriter.create(tmp_path / "training.h5", Provenance("assemble")) as artifact:
        write_history(artifact, "training", history)
    again = read_history(Artifact(tmp_path / "training.h5"), "training")
    assert again.names == history.names
    assert again.drive_varies == history.drive_varies
    for name, values in history.channels.items():
        assert again.channels[name].tobytes() == values.tobytes()
    part = again.select([3, 1])
    np.testing.assert_array_equal(part.record(0, "force"), history.record(3, "force"))
    np.testing.assert_array_equal(part.record(1, "force"), history.record(1, "force"))


@pytest.mark.property
def test_drive_range_is_that_of_the_campaign() -> None:
    assert drive_range(bench_history()) == pytest.approx(4.0, abs=0.01)


@pytest.mark.property
def test_tests_of_unlike_rates_are_refused() -> None:
    from dataclasses import replace

    one, other = bench_test("one", 1.0, 0.0), bench_test("other", 1.0, 1.0)
    with pytest.raises(ValueError, match="one rate"):
        join([one, replace(other, sampling_rate_hz=500.0)], cycles=2, sampling_rate_hz=200.0)
