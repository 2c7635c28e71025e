"""The compiled simulation of modes: exact for constant laws, and with the law of the amplitude it is given."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.amplitude.kernel import simulate_modes
from mrpipe.signals.discretisation import discretise_first_order

pytestmark = pytest.mark.property

DT, SIZE = 0.02, 600
OMEGA, ZETA = np.array([6.0, 15.0]), np.array([0.01, 0.03])


def _simulated(
    forces: np.ndarray, laws: np.ndarray, *, total: bool = False, initial: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    start = np.zeros((forces.shape[1], 2)) if initial is None else initial
    displacement, acceleration, amplitude = np.empty_like(forces), np.empty_like(forces), np.empty(len(forces))
    simulate_modes(forces, DT, laws, total, start, displacement, acceleration, amplitude)
    return displacement, acceleration, amplitude


def _laws(softening: float, growth: float, reference: float = 0.01) -> np.ndarray:
    return np.column_stack([OMEGA, ZETA, np.full(2, softening), np.full(2, growth), np.full(2, reference)])


def test_with_constant_laws_it_is_the_exact_step() -> None:
    forces = np.random.default_rng(1).standard_normal((SIZE, 2))
    displacement, acceleration, _ = _simulated(forces, _laws(0.0, 0.0))
    for mode, (omega, zeta) in enumerate(zip(OMEGA, ZETA, strict=True)):
        A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])
        step, now, after = discretise_first_order(A, np.array([[0.0], [1.0]]), DT)
        state = np.zeros(2)
        for k in range(SIZE):
            assert displacement[k, mode] == pytest.approx(state[0], abs=1e-9)
            expected = forces[k, mode] - 2.0 * zeta * omega * state[1] - omega**2 * state[0]
            assert acceleration[k, mode] == pytest.approx(expected, abs=1e-7)
            if k + 1 < SIZE:
                state = step @ state + now[:, 0] * forces[k, mode] + after[:, 0] * forces[k + 1, mode]


def test_the_frequency_of_a_free_motion_follows_its_amplitude() -> None:
    forces = np.zeros((SIZE, 2))
    laws = _laws(0.1, 0.0)
    laws[:, 1] = 1e-6
    initial = np.array([[0.01, 0.0], [0.0, 0.0]])
    displacement = _simulated(forces, laws, initial=initial)[0][:, 0]
    crossings = DT * np.flatnonzero(np.diff(np.sign(displacement)) != 0)
    omega = np.pi / np.mean(np.diff(crossings))
    # at the reference amplitude ln(1 + A/A_0) = ln 2
    assert omega == pytest.approx(OMEGA[0] * 2.0**-0.1, rel=5e-3)


def test_the_amplitude_of_the_whole_motion_counts_where_it_is_asked_for() -> None:
    forces, initial = np.zeros((SIZE, 2)), np.array([[1e-6, 0.0], [0.03, 0.0]])
    laws = _laws(0.2, 0.0)
    laws[:, 1] = 1e-5
    own = _simulated(forces, laws, initial=initial)[0][:, 0]
    whole, _, amplitude = _simulated(forces, laws, total=True, initial=initial)
    crossings = [np.flatnonzero(np.diff(np.sign(item)) != 0).size for item in (own, whole[:, 0])]
    # the small mode feels the large one only through the amplitude of the whole motion
    assert crossings[1] < 0.85 * crossings[0]
    assert amplitude[0] == pytest.approx(np.hypot(1e-6, 0.03))


def test_laws_that_hardly_change_are_the_limit_of_constant_laws() -> None:
    forces = np.random.default_rng(2).standard_normal((SIZE, 2))
    initial = np.array([[0.01, 0.0], [0.0, 0.02]])
    constant = _simulated(forces, _laws(0.0, 0.0), initial=initial)
    # one mode of each kind shows that a constant mode does not take the values of its neighbour
    mixed = _laws(0.0, 0.0)
    mixed[1, 2:4] = 1e-13
    for expected, found in zip(constant, _simulated(forces, mixed, initial=initial), strict=True):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
