"""Modes whose frequency and damping depend on the amplitude: planted laws, and none where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.amplitude.dependence import amplitude_finding
from mrpipe.modal.amplitude.law_fit import find_amplitude_dependence
from mrpipe.modal.amplitude.laws import AmplitudeLaws, simulated
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.records import FrameTest
from mrpipe.modal.spectra import record_spectrum

RATE = 60.0
OMEGA = 2 * np.pi * np.array([2.0, 5.6])
ZETA = np.array([0.006, 0.008])
SHAPES = np.array([[0.6, 1.0], [1.0, -0.6]])
SHARE = np.array([1.1, 0.35])
FINE = 8


def _tower(ground, softening, start_m=None):
    """Absolute floor accelerations by small semi-implicit steps; the law of the modes is not that of the program."""
    dt = 1 / (RATE * FINE)
    times = np.arange(ground.size * FINE) * dt
    fine = np.interp(times, np.arange(ground.size) / RATE, ground)
    q, v = (np.zeros(2) if start_m is None else np.array(start_m)), np.zeros(2)
    seen = np.empty((ground.size, 2))
    for k, u in enumerate(fine):
        amplitude = np.sqrt(q**2 + (v / OMEGA) ** 2)
        level = softening * amplitude / (amplitude + 0.01)
        omega, zeta = OMEGA * (1 - 0.04 * level), ZETA * (1 + 2.0 * level)
        force = -2 * zeta * omega * v - omega**2 * q
        if k % FINE == 0:
            seen[k // FINE] = SHAPES @ force + (1 - SHAPES @ SHARE) * u
        v = v + dt * (force - SHARE * u)
        q = q + dt * v
    return seen


def _test(name, rng, size, softening, duration_s=60.0, **start):
    ground = size * rng.standard_normal(round(duration_s * RATE))
    ground[round(0.6 * ground.size) :] = 0.0
    seen = _tower(ground, softening, **start)
    seen += 0.01 * seen.std(axis=0) * rng.standard_normal(seen.shape)
    return FrameTest(name, "random", RATE, ground, seen, (False, False))


def _fit(tests):
    spectra = [record_spectrum(test, (0.5, 9.0)) for test in tests]
    return fit_modes(spectra, OMEGA, ZETA, passes=2, evaluations=10)


@pytest.fixture(scope="module")
def softened():
    rng = np.random.default_rng(3)
    tests = [_test("small", rng, 0.5, 1.0), _test("large", rng, 4.0, 1.0), _test("middle", rng, 1.5, 1.0)]
    return tests, find_amplitude_dependence(_fit(tests), tests)


@pytest.mark.planted
def test_planted_softening_is_found_and_predicts_what_was_left_out(softened):
    _, found = softened
    assert found is not None
    assert found.left_out == ("small", "large", "middle")
    assert np.mean(found.error) < 0.5 * np.mean(found.constant_error)
    # the planted law within the amplitudes of the tests
    assert found.model.laws.measure == "mode"
    for amplitude in (0.008, 0.025):
        level = amplitude / (amplitude + 0.01)
        omega, zeta = found.model.laws.at(amplitude)
        assert omega[0] == pytest.approx(OMEGA[0] * (1 - 0.04 * level), rel=0.004)
        assert zeta[0] == pytest.approx(ZETA[0] * (1 + 2.0 * level), rel=0.2)
    smallest, largest = found.model.smallest_m, found.model.largest_m
    assert np.all(smallest > 0.01 * largest) and np.all(smallest < 0.5 * largest)
    text = amplitude_finding(found)
    assert "modes depend on the amplitude: mode " in text
    # values at the amplitudes that were seen, and none that is extrapolated to no motion
    omega, zeta = found.model.laws.at(smallest)
    assert (
        f"from {omega[1] / (2 * np.pi):.4g} Hz and {100 * zeta[1]:.2g} % damping at {1e3 * smallest[1]:.2g} mm" in text
    )


@pytest.mark.planted
def test_a_test_that_begins_in_motion_is_simulated_from_there(softened):
    _, found = softened
    new = _test("new", np.random.default_rng(9), 3.0, 1.0, start_m=[0.01, -0.002])
    error = np.linalg.norm(found.model.response(new) - new.responses) / np.linalg.norm(new.responses)
    assert error < 0.15


@pytest.mark.planted
def test_a_linear_tower_has_no_amplitude_dependence():
    rng = np.random.default_rng(5)
    tests = [_test("small", rng, 0.5, 0.0), _test("large", rng, 4.0, 0.0)]
    assert find_amplitude_dependence(_fit(tests), tests) is None


@pytest.mark.property
def test_constant_laws_are_a_linear_mode():
    none = np.zeros(1)
    laws = AmplitudeLaws("mode", np.array([10.0]), np.array([0.02]), none, none, np.ones(1))
    motion = simulated(laws, np.zeros((500, 1)), 0.01, np.array([[1.0, 0.0]]))
    time = np.arange(500) * 0.01
    damped = 10.0 * np.sqrt(1 - 0.02**2)
    expected = np.exp(-0.2 * time) * (np.cos(damped * time) + 0.2 / damped * np.sin(damped * time))
    assert motion.displacement[:, 0] == pytest.approx(expected, abs=1e-12)
    assert motion.amplitude[0] == pytest.approx(1.0)
