"""The least errors of modes that noise allows: those of a closed form, and more noise gives larger ones."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.modal_bounds import least_errors
from mrpipe.modal.records import FrameTest, Place
from tests.modal.towers import FINE, Tower, respond

pytestmark = pytest.mark.oracle

RATE, DURATION_S, NOISE = 50.0, 400.0, 0.05


def _random_test(tower: Tower) -> FrameTest:
    dt = 1.0 / (RATE * FINE)
    force = np.random.default_rng(1).standard_normal(round(DURATION_S / dt))
    # the fine steps of white noise repeat over one sample, so that the samples show all of it
    force = np.repeat(force[::FINE], FINE)
    forces = np.zeros((force.size, tower.floors))
    forces[:, 0] = force
    seen = respond(tower, forces, dt)[::FINE]
    places = tuple(Place(floor + 1) for floor in range(tower.floors))
    return FrameTest("a", "random", RATE, force[::FINE], seen, (False,) * tower.floors, 1, places=places)


def test_a_single_mode_has_the_error_of_the_closed_form() -> None:
    """Under white noise half of the information on damping is lost to the amplitude, which is unknown.

    A resonance of height h is h / (1 + j d / zeta) at the relative detuning d. Its lines are df apart, so that the sum
    of its squared magnitude is pi zeta f h^2 / df. The part of the derivative by ln zeta that the amplitude does not
    explain has a quarter of it.
    """
    omega, zeta = 2.0 * np.pi * 4.0, 0.01
    tower = Tower(np.array([1.0]), np.array([[omega**2]]), np.array([zeta]))
    test = _random_test(tower)
    found = least_errors(tower, [test], NOISE)[1][0]
    samples = test.excitation.size
    frequency = np.fft.rfftfreq(samples, 1.0 / RATE)
    near = np.abs(frequency / 4.0 - 1.0) < 3.0 * zeta
    power = float(np.mean(np.abs(np.fft.rfft(test.excitation)[near]) ** 2))
    height = power / (2.0 * zeta) ** 2
    total = np.pi * zeta * 4.0 * DURATION_S * height
    variance = samples * test.responses.var() * NOISE**2 / (1.0 + NOISE**2)
    assert found == pytest.approx(np.sqrt(variance / (2.0 * 0.25 * total)), rel=0.15)


def test_errors_grow_with_noise_and_fall_with_tests() -> None:
    tower = Tower(np.array([1.0, 1.0]), np.array([[900.0, -400.0], [-400.0, 400.0]]), np.array([0.01, 0.01]))
    test = _random_test(tower)
    once = least_errors(tower, [test], NOISE)
    for first, twice in zip(once, least_errors(tower, [test, test], NOISE), strict=True):
        assert first == pytest.approx(np.sqrt(2.0) * twice)
    for first, noisy in zip(once, least_errors(tower, [test], 2.0 * NOISE), strict=True):
        assert noisy == pytest.approx(2.0 * first, rel=0.01)
