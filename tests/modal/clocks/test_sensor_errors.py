"""Cross-talk between sensors with different clocks: taken out, it no longer moves the poles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.clocks.delays import SensorClock, corrected
from mrpipe.modal.clocks.sensor_errors import SensorErrors
from mrpipe.modal.fit.information import weighted
from mrpipe.modal.fit.multimode import collected
from mrpipe.modal.fit.own_residues import with_own_residues
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest, Place
from mrpipe.modal.spectra import record_spectrum
from tests.modal.towers import FINE, hidden_modes, respond, sweep_force, tower_with_hidden_modes

pytestmark = pytest.mark.planted

RATE, DURATION_S = 110.0, 150.0
RNG = np.random.default_rng(550)
TOWER, SHAKER = tower_with_hidden_modes(RNG)
HIDDEN = hidden_modes(TOWER, SHAKER)[0] - 1
POLES = np.log(np.concatenate([2.0 * np.pi * TOWER.frequencies_hz, TOWER.damping_ratios]))
BAND = (0.5, 48.0)


def _measured(crosstalk: float, seed: int, drift: float) -> tuple[list[FrameTest], list[SensorClock]]:
    """Return a random test of a tower whose sensors have drifting clocks and then cross-talk, and the clocks.

    The clocks are corrected.
    """
    rng = np.random.default_rng(seed)
    dt = 1.0 / (RATE * FINE)
    force = sweep_force(TOWER, DURATION_S, dt, kind="random", rng=rng)
    forces = np.zeros((force.size, TOWER.floors))
    forces[:, SHAKER - 1] = force
    exact = respond(TOWER, forces, dt)[::FINE]
    places = tuple(Place(floor + 1) for floor in range(TOWER.floors))
    test = FrameTest("random", "random", RATE, force[::FINE], exact, (False,) * TOWER.floors, SHAKER, places=places)
    clocks = [SensorClock("random", item, 0.0, 0.0, drift=drift * rng.uniform(-1.0, 1.0)) for item in test.sensors]
    late = corrected(test, [replace(item, drift=-item.drift) for item in clocks]).responses
    mixing = np.eye(TOWER.floors) + crosstalk * rng.uniform(-1.0, 1.0, (TOWER.floors, TOWER.floors))
    seen = late @ mixing.T
    seen += 0.003 * seen.std(axis=0) * rng.standard_normal(seen.shape)
    return [corrected(replace(test, responses=seen), clocks)], clocks


def _fit(tests: list[FrameTest]) -> MultiModeFit:
    spectra = [record_spectrum(test, BAND) for test in tests]
    return collected(weighted(spectra, POLES), spectra, POLES)


def test_a_hidden_mode_has_its_damping_ratio_in_spite_of_cross_talk() -> None:
    tests, clocks = _measured(0.03, 1, 1e-4)
    shared = _fit(tests)
    before = with_own_residues(shared)
    after = with_own_residues(shared, SensorErrors(tests, clocks).removed)
    modes = TOWER.floors
    spread = [float(np.sqrt(fit.covariance[modes + HIDDEN, modes + HIDDEN])) for fit in (before, after)]
    assert spread[1] < 0.5 * spread[0]
    assert abs(np.log(after.damping_ratios[HIDDEN] / TOWER.damping_ratios[HIDDEN])) < 2.0 * spread[1]
    # the shapes remain those that the sensors show
    assert after.residues == pytest.approx(shared.residues, rel=0.05, abs=0.01 * np.abs(shared.residues).max())


@pytest.mark.parametrize(("crosstalk", "drift"), [(0.0, 1e-4), (0.03, 0.0)])
def test_nothing_is_removed_without_cross_talk_or_with_one_clock(crosstalk: float, drift: float) -> None:
    tests, clocks = _measured(crosstalk, 1, drift)
    spectra = [record_spectrum(test, BAND) for test in tests]
    found = SensorErrors(tests, clocks).removed(weighted(spectra, POLES, separate=True), POLES, spectra)
    for new, old in zip(found, spectra, strict=True):
        assert np.linalg.norm(new.responses - old.responses) <= 2e-3 * np.linalg.norm(old.responses)
        assert drift or np.array_equal(new.responses, old.responses)


def test_residues_common_to_tests_are_refused() -> None:
    tests, clocks = _measured(0.0, 1, 1e-4)
    both = [*tests, replace(tests[0], name="again")]
    spectra = [record_spectrum(test, BAND) for test in both]
    with pytest.raises(ValueError, match="separate residues"):
        SensorErrors(both, clocks).removed(weighted(spectra, POLES), POLES, spectra)
