"""The sweep: candidates, resuming, choice and verdicts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.networks.candidates import Candidate, Grid
from mrpipe.networks.findings import choose, findings, score
from mrpipe.networks.held_out import extreme_motions, folds, motions, splits
from mrpipe.networks.options import SweepOptions
from mrpipe.networks.sweep import Outcome, _kept, sweep
from mrpipe.networks.sweep_cost import predicted_costs
from tests.networks.rig import bench_history

CENTRE = Candidate(("velocity",), 3, (6, 6), False)
STATES = (("velocity",), ("displacement",), ("velocity", "displacement"))
GRID = Grid(STATES, (0, 1, 2, 3), (1, 2), (3, 6), (False, True), CENTRE)
TINY = SweepOptions(
    starts=2, screen_rows=300, screen_iterations=8, refined=2, refine_rows=500, refine_iterations=5, held_out_rows=300
)


@pytest.mark.property
def test_star_varies_one_thing_and_full_takes_all() -> None:
    star, full = GRID.candidates("star"), GRID.candidates("full")
    assert star[0] == full[0] == CENTRE
    assert len(full) == len(set(full)) == 3 * 4 * 4 * 2
    assert set(star) <= set(full)
    for candidate in star:
        pairs = zip(
            (candidate.states, candidate.past_values, candidate.hidden, candidate.biases),
            (CENTRE.states, CENTRE.past_values, CENTRE.hidden, CENTRE.biases),
            strict=True,
        )
        assert sum(one != other for one, other in pairs) <= 1


@pytest.mark.literature
def test_labels_and_sizes_of_known_networks() -> None:
    assert CENTRE.label == "v,i | 3 past | 8-6-6-1"
    assert CENTRE.parameters == 90
    assert replace(CENTRE, biases=True).parameters == 103
    assert replace(CENTRE, hidden=(12, 6)).layers == (8, 12, 6, 1)  # P5


@pytest.mark.property
def test_outcomes_do_not_depend_on_jobs_or_on_who_else_is_tried() -> None:
    history = bench_history()
    candidates = GRID.candidates("star")[:4]
    alone = sweep(history, candidates[:2], TINY, 5, jobs=1)
    among = sweep(history, candidates[:2], TINY, 5, jobs=2)
    for one, other in zip(alone.outcomes, among.outcomes, strict=True):
        assert one.screened.tobytes() == other.screened.tobytes()
        assert one.refined.tobytes() == other.refined.tobytes()
    assert all(set(names) < set(history.names) for names in alone.held_out)


@pytest.mark.property
def test_an_interrupted_sweep_goes_on_where_it_was(tmp_path: Path) -> None:
    history = bench_history()
    candidates = GRID.candidates("star")[:4]
    undisturbed = sweep(history, candidates, TINY, 5)

    def interrupt(fraction: float, text: str = "") -> None:
        if "screened 3" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(history, candidates, TINY, 5, cache=tmp_path, progress=interrupt)
    kept = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert 3 <= len(kept) <= 4
    told: list[str] = []
    resumed = sweep(history, candidates, TINY, 5, cache=tmp_path, tell=told.append)
    assert f"({len(kept)} screened by an earlier run)" in told[0]
    for one, other in zip(undisturbed.outcomes, resumed.outcomes, strict=True):
        assert one.screened.tobytes() == other.screened.tobytes()
        assert one.refined.tobytes() == other.refined.tobytes()
    for name, changed in kept.items():
        assert (tmp_path / name).stat().st_mtime_ns == changed


@pytest.mark.property
@pytest.mark.parametrize("content", ["half", "empty", "garbage"])
def test_a_damaged_kept_fit_counts_as_none(tmp_path: Path, content: str) -> None:
    candidate = GRID.centre
    calls = []

    def work() -> tuple[np.ndarray, np.ndarray]:
        calls.append(1)
        return np.array([0.1]), np.array([[1.0, 2.0]])

    _kept(tmp_path, "screen-x", candidate, work)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    file.write_bytes({"half": whole[: len(whole) // 2], "empty": b"", "garbage": b"\x80\x04garbage"}[content])
    for count in (2, 2):
        errors, parameters = _kept(tmp_path, "screen-x", candidate, work)
        assert errors.tolist() == [0.1] and parameters.tolist() == [[1.0, 2.0]]
        assert len(calls) == count


@pytest.mark.property
def test_kept_fits_are_used_only_for_what_they_are(tmp_path: Path) -> None:
    history = bench_history()
    candidates = GRID.candidates("star")[:2]
    sweep(history, candidates, TINY, 5, cache=tmp_path)
    before = len(list(tmp_path.iterdir()))
    sweep(history, candidates, TINY.changed(refined=1), 5, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == before
    sweep(history, candidates, TINY.changed(screen_iterations=9), 5, cache=tmp_path)
    sweep(history, candidates, TINY, 6, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) > 2 * before


@pytest.mark.property
def test_time_left_and_cost_are_told() -> None:
    told: list[str] = []
    progress: list[str] = []
    candidates = GRID.candidates("star")[:3]
    run = sweep(
        bench_history(), candidates, TINY, 5, tell=told.append, progress=lambda _, text="": progress.append(text)
    )
    assert run.predicted_seconds > 0.0
    assert len(told) == 1
    assert "3 candidates x 2 starts: about" in told[0]
    assert all("s left" in text for text in progress)


@pytest.mark.property
def test_larger_networks_are_predicted_to_cost_more() -> None:
    candidates = [replace(CENTRE, hidden=(2,)), CENTRE, replace(CENTRE, hidden=(24, 24))]
    screening, refining = predicted_costs(
        bench_history(), candidates, TINY.changed(screen_rows=2000), np.random.default_rng(1)
    )
    assert screening[0] < screening[2]
    assert refining[0] < refining[2]


@pytest.mark.planted
def test_a_star_is_completed_by_combinations_of_what_helps() -> None:
    worst, better = 0.1, 0.05
    scores = dict.fromkeys(GRID.candidates("star"), worst)
    wide, seeing = replace(CENTRE, hidden=(6,)), replace(CENTRE, states=("velocity", "displacement"))
    assert GRID.crossings({**scores, CENTRE: better}) == []
    # an input may help larger networks only, so every set of inputs is tried with the best layers
    others = [replace(wide, states=states) for states in GRID.states if states != CENTRE.states]
    assert set(GRID.crossings({**scores, wide: better})) == set(others)
    both = replace(wide, states=seeing.states)
    assert GRID.crossings({**scores, wide: better, seeing: better})[0] == both
    biased, past = replace(CENTRE, biases=True), replace(CENTRE, past_values=2)
    every = GRID.crossings({**scores, wide: better, seeing: better, biased: better, past: better})
    assert len(every) == len(set(every)) <= GRID.most_crossings
    assert set(others) <= set(every)
    # one value an axis, none of them the centre's
    assert Grid((("displacement",),), (3,), (1,), (9,), (False,), CENTRE).most_crossings == 2
    assert not set(every) & set(scores)


@pytest.mark.property
def test_combinations_are_screened_refined_and_resumed(tmp_path: Path) -> None:
    history, star = bench_history(), GRID.candidates("star")
    crossings = (lambda scores: [replace(CENTRE, hidden=(3,), past_values=1), *list(scores)[:1]], 11)
    told: list[str] = []
    options = TINY.changed(screen_iterations=3, refine_iterations=2, refined=len(star) + 1)
    run = sweep(history, star, options, 5, crossings=crossings, cache=tmp_path, tell=told.append)
    assert "up to 11 combinations" in told[0]
    assert len(run.outcomes) == len(star) + 1
    assert run.outcomes[-1].candidate.hidden == (3,)
    assert run.outcomes[-1].is_refined
    again = sweep(history, star, options, 5, crossings=crossings, cache=tmp_path)
    assert again.seconds < run.seconds
    assert again.outcomes[-1].refined.tobytes() == run.outcomes[-1].refined.tobytes()


def outcome(candidate: Candidate, *errors: float) -> Outcome:
    values = np.array(errors)
    return Outcome(candidate, values, values)


@pytest.mark.property
def test_score_is_geometric_and_shrugs_at_one_failed_start() -> None:
    even = score(np.array([0.05, 0.05, 0.05, 0.05]))
    assert even.mean == pytest.approx(0.05)
    assert even.standard_error == pytest.approx(0.0)
    assert score(np.array([0.04, 0.04, 0.04, 4.0])).mean < 0.2


@pytest.mark.property
def test_the_smallest_within_one_standard_error_is_chosen() -> None:
    small, middle = replace(CENTRE, hidden=(3,)), CENTRE
    large = replace(CENTRE, hidden=(12, 12))
    outcomes = [
        outcome(small, 0.20, 0.21, 0.19),
        outcome(middle, 0.052, 0.053, 0.051),
        outcome(large, 0.05, 0.055, 0.045),
    ]
    assert choose(outcomes).candidate == middle
    clear = [outcome(small, 0.20, 0.21, 0.19), outcome(middle, 0.08, 0.08, 0.08), outcome(large, 0.05, 0.055, 0.045)]
    assert choose(clear).candidate == large
    unrefined = Outcome(large, np.array([0.01, 0.01]), np.full(2, np.nan))
    assert choose([outcome(middle, 0.05, 0.06), unrefined]).candidate == middle


@pytest.mark.planted
def test_a_network_that_fails_on_one_motion_is_not_chosen_for_its_size() -> None:
    small, large = replace(CENTRE, hidden=(3,)), CENTRE
    # four splits alike, and one motion at which the small network is three times worse
    outcomes = [outcome(small, 0.05, 0.05, 0.05, 0.05, 0.15), outcome(large, 0.05, 0.05, 0.05, 0.05, 0.05)]
    assert choose(outcomes).candidate == large
    # splits of different difficulty do not hide that one network is better in all of them
    hard = np.array([0.02, 0.05, 0.1, 0.2, 0.4])
    outcomes = [Outcome(small, 1.2 * hard, 1.2 * hard), Outcome(large, hard, hard)]
    assert choose(outcomes).candidate == large


@pytest.mark.property
def test_splits_leave_whole_motions_out_and_every_test_once() -> None:
    history = bench_history(frequencies=(0.5, 0.8, 1.2, 1.8))
    assert len(motions(history)) == 4
    parts = folds(history, 4, np.random.default_rng(3))
    held = [name for _, part in parts for name in part.names]
    assert sorted(held) == sorted(history.names)
    for fitted, part in parts:
        assert set(fitted.names) | set(part.names) == set(history.names)
        assert not {name.split("-")[-1] for name in fitted.names} & {name.split("-")[-1] for name in part.names}
    # few motions: records are left out; few records: each is cut
    assert len(folds(bench_history(), 3, np.random.default_rng(3))) == 3
    ((fitted, part),) = folds(history.select([0, 1]), 4, np.random.default_rng(3))
    assert fitted.names == part.names and fitted.samples > part.samples > 0


@pytest.mark.property
def test_every_second_split_leaves_out_single_tests() -> None:
    history = bench_history(frequencies=(0.5, 0.8, 1.0, 1.3, 1.8))
    found = splits(history, 0.25, 4, np.random.default_rng(3))
    motions_of = [[{name.split("-")[-1] for name in part.names} for part in pair] for pair in found]
    shared = [bool(fitted & held) for fitted, held in motions_of]
    assert shared == [False, True, False, True]


@pytest.mark.property
def test_networks_are_judged_between_the_motions_of_their_training() -> None:
    history = bench_history(frequencies=(0.5, 0.8, 1.0, 1.3, 1.8))
    groups = motions(history)
    tests_at = {name: {test for test in history.names if test.endswith(name)} for name in ("0.5Hz", "1.8Hz")}
    extreme = {history.names[index] for place in extreme_motions(history, groups) for index in groups[place]}
    assert extreme == tests_at["0.5Hz"] | tests_at["1.8Hz"]
    parts = folds(history, 3, np.random.default_rng(3))
    for fitted, part in parts:
        assert extreme <= set(fitted.names) and not extreme & set(part.names)
    assert sorted(name for _, part in parts for name in part.names) == sorted(set(history.names) - extreme)


@pytest.mark.planted
def test_verdicts_follow_from_clear_differences_only() -> None:
    base = outcome(CENTRE, 0.05, 0.051, 0.049, 0.05)
    blind = outcome(replace(CENTRE, states=("displacement",)), 0.5, 0.51, 0.49, 0.5)
    helped = outcome(replace(CENTRE, states=("displacement", "velocity")), 0.03, 0.031, 0.029, 0.03)
    vague = outcome(replace(CENTRE, states=("velocity", "acceleration")), 0.02, 0.2, 0.03, 0.05)
    fewer = outcome(replace(CENTRE, past_values=1), 0.049, 0.051, 0.05, 0.05)
    wider = outcome(replace(CENTRE, hidden=(9, 9)), 0.048, 0.049, 0.048, 0.049)
    verdicts = {item.name: item for item in findings([base, blind, helped, vague, fewer, wider], CENTRE)}
    assert verdicts["velocity"].verdict == "holds"
    assert verdicts["displacement"].verdict == "differs"
    assert verdicts["displacement"].change == pytest.approx(-0.4, abs=0.02)
    assert verdicts["acceleration"].verdict == "holds"
    assert verdicts["fewer-past"].verdict == "differs"
    assert verdicts["neurons"].verdict == "holds"
    assert verdicts["layers"].verdict == "not tested"
    assert verdicts["both"].verdict == "not tested"
