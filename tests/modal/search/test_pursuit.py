"""Search for a mode that the fit has left out: found by its residual, and nothing found where nothing is left."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search import pursuit
from mrpipe.modal.search.pursuit import HiddenPole, hidden_poles, sets_of_poles
from mrpipe.modal.spectra import record_spectrum
from mrpipe.structures import complex_modes, frame_from_parameter_set
from tests.modal.rig import Rig, random_test
from tests.modal.towers import Sensors, forced_test, hidden_modes, tower_with_hidden_modes

pytestmark = pytest.mark.planted

FRAME = frame_from_parameter_set("thesis")
TRUTH = complex_modes(FRAME)
BAND = (2.0 * np.pi * 0.8, 2.0 * np.pi * 12.0)
"""Inside that of the spectra: at their edges a pole explains what lies beyond."""


@pytest.fixture(scope="module")
def spectrum():
    test = random_test(FRAME, np.random.default_rng(4), Rig(noise=0.01, rate=100.0, sweep_s=120.0))
    return record_spectrum(test, (0.5, 13.0))


def _fit(spectrum, modes: list[int]) -> MultiModeFit:
    return fit_modes([spectrum], TRUTH.angular_frequencies[modes], TRUTH.damping_ratios[modes], passes=2, evaluations=6)


@pytest.mark.parametrize("missing", [1, 3])
def test_the_missing_mode_comes_first(spectrum, missing: int) -> None:
    fit = _fit(spectrum, [mode for mode in range(5) if mode != missing])
    first = hidden_poles(fit, BAND, 1)[0]
    assert first.angular_frequency == pytest.approx(TRUTH.angular_frequencies[missing], rel=0.01)
    assert first.gain > 100.0


def test_two_missing_modes_are_both_found_and_apart(spectrum) -> None:
    found = sorted(pole.angular_frequency for pole in hidden_poles(_fit(spectrum, [0, 2, 4]), BAND, 2))
    assert found == pytest.approx(TRUTH.angular_frequencies[[1, 3]].tolist(), rel=0.015)


def test_a_complete_fit_leaves_no_pole_of_weight(spectrum) -> None:
    complete = hidden_poles(_fit(spectrum, [0, 1, 2, 3, 4]), BAND, 3)
    partial = hidden_poles(_fit(spectrum, [0, 1, 2, 4]), BAND, 1)
    assert max((pole.gain for pole in complete), default=0.0) < 0.05 * partial[0].gain


def test_the_second_set_has_what_the_best_pole_of_a_gap_does_not_explain(spectrum, monkeypatch) -> None:
    """The remainder of a strong mode near its peak took the place of a hidden mode in the same gap (tower 312)."""
    fit = _fit(spectrum, [0, 2, 4])
    first, second, third = 2.0 * np.pi * np.array([1.29, 3.85, 7.94])
    tried = [HiddenPole(first, 0.012, 200.0), HiddenPole(1.02 * first, 0.012, 150.0), HiddenPole(second, 0.003, 100.0)]
    tried += [HiddenPole(third, 0.003, 50.0), HiddenPole(0.7 * third, 0.003, -5.0)]
    monkeypatch.setattr(pursuit, "_tried", lambda *_: tried)
    sets = [[pole.angular_frequency for pole in chosen] for chosen in sets_of_poles(fit, BAND, 2)]
    assert sets == [[first, third], [second]]
    assert [[pole.angular_frequency for pole in chosen] for chosen in sets_of_poles(fit, BAND, 1)] == [
        [first],
        [second],
    ]


def test_a_weak_mode_is_supported_because_its_shape_is_real() -> None:
    """With two parameters for each sensor, real and imaginary part, the criterion rejected this mode."""
    tower, floor = tower_with_hidden_modes(np.random.default_rng(11), most=1, weakest=0.15)
    missing = hidden_modes(tower, floor)[0] - 1
    rng = np.random.default_rng(5)
    force, seen = forced_test(tower, rng, Sensors(noise=0.1), floor, rate=50.0, duration_s=200.0, kind="random")
    test = FrameTest("random", "random", 50.0, force, seen, (False,) * tower.floors, floor)
    known = [mode for mode in range(tower.floors) if mode != missing]
    omega, zeta = 2.0 * np.pi * tower.frequencies_hz, tower.damping_ratios
    spectra = [record_spectrum(test, (0.3, 1.2 * float(tower.frequencies_hz[-1])))]
    fit = fit_modes(spectra, omega[known], zeta[known], passes=2, evaluations=6)
    [found] = hidden_poles(fit, (0.93 * omega[missing], 1.07 * omega[missing]), 3)
    assert found.angular_frequency == pytest.approx(omega[missing], rel=0.01)


@pytest.mark.oracle
def test_the_improvement_is_that_of_the_best_set_of_columns_by_least_squares() -> None:
    rng = np.random.default_rng(7)
    columns = rng.standard_normal((60, 7))
    # a column that depends on those before explains nothing and counts as no parameter
    columns[:, 5] = columns[:, 3] - 2.0 * columns[:, 4]
    columns /= np.linalg.norm(columns, axis=0)
    for weights in (np.eye(7)[3], np.eye(7)[4], np.eye(7)[6], np.zeros(7)):
        target = 4.0 * (columns @ weights)[:, None] + rng.standard_normal((60, 3))
        target[:, 2] = 0.0
        gains = []
        for count in (1, 3, 4):
            errors = [
                np.sum(np.square(target - basis @ np.linalg.lstsq(basis, target, rcond=1e-10)[0]), axis=0)[:2]
                for basis in (columns[:, :3], columns[:, : 3 + count])
            ]
            independent = np.linalg.matrix_rank(columns[:, : 3 + count]) - 3
            likelihood = 60.0 * np.sum(np.log(errors[0] / errors[1]))
            gains.append(likelihood - (2 * independent + 2) * np.log(120.0))
        assert pursuit._improvement(target, columns, 3, (1, 3, 4)) == pytest.approx(max(gains), rel=1e-9)
