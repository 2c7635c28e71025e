"""A channel that is stuck is found; a coarsely resolved force that rests on a plateau is not called stuck."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from mrpipe.campaigns.plausibility import compare_tests
from mrpipe.campaigns.plausibility.stuck import find_stuck_displacement, find_stuck_force
from tests.campaigns.plausibility.rig import sound_tests

TIME = np.arange(6000) / 1000.0
DRIVE = np.full(TIME.size, 1.0)


def _friction(seed: int, step_n: float, noise_n: float, *, random: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement [m] and force [N] of a friction damper whose force is resolved in steps of `step_n`."""
    rng = np.random.default_rng(seed)
    if random:
        band = butter(2, [0.3, 3.0], "bandpass", fs=1000.0, output="sos")
        motion = sosfiltfilt(band, rng.standard_normal(TIME.size))
        displacement = 3e-3 * motion / np.std(motion)
    else:
        displacement = 5e-3 * np.sin(2.0 * np.pi * TIME + rng.uniform(0.0, 6.0))
    velocity = np.gradient(displacement, 1e-3)
    force = 100.0 * np.tanh(velocity / 2e-3) + 20.0 * velocity + noise_n * rng.standard_normal(TIME.size)
    return displacement + 2e-6 * rng.standard_normal(TIME.size), np.round(force / step_n) * step_n


@pytest.mark.planted
@pytest.mark.parametrize("random", [False, True])
def test_a_coarsely_resolved_plateau_is_not_stuck(random: bool) -> None:
    found = []
    for seed in range(5):
        for step in (0.5, 2.0, 10.0):
            for noise in (0.0, 0.3):
                displacement, force = _friction(seed, step, noise, random=random)
                found.append(find_stuck_force(force, displacement, DRIVE))
    assert found == [None] * 30


@pytest.mark.planted
@pytest.mark.parametrize("step", [1e-6, 0.5, 2.0, 10.0])
def test_a_stuck_force_is_found_at_any_resolution(step: float) -> None:
    for seed in range(6):
        displacement, force = _friction(seed, step, 0.3)
        begin = 1000 + 97 * seed
        force[begin : begin + 700] = force[begin]
        found = find_stuck_force(force, displacement, DRIVE)
        assert found is not None
        # a plateau at the same value may make the stretch longer
        assert found.first <= begin and begin + 700 <= found.first + found.samples <= begin + 1300


@pytest.mark.planted
@pytest.mark.parametrize("step", [0.0, 1e-5, 1e-4])
def test_a_stuck_displacement_is_found_and_turning_points_are_not(step: float) -> None:
    displacement, force = _friction(1, 0.1, 0.3)
    if step:
        displacement = np.round(displacement / step) * step
    assert find_stuck_displacement(displacement, force) is None
    displacement[1500:1900] = displacement[1500]
    found = find_stuck_displacement(displacement, force)
    assert found is not None and 400 <= found.samples <= 420


@pytest.mark.planted
def test_a_sound_campaign_with_a_coarse_load_cell_gives_no_finding() -> None:
    tests = [replace(item, force_n=np.round(item.force_n / 5.0) * 5.0) for item in sound_tests(10)]
    assert [item.line for item in compare_tests(tests)] == []


@pytest.mark.planted
@pytest.mark.parametrize("drive", [0.0, 1.0])
def test_a_force_without_any_motion_is_not_stuck(drive: float) -> None:
    """A test whose displacement and drive are zero ended with a traceback."""
    force = _friction(1, 0.5, 0.3)[1]
    force[1000:1700] = force[1000]
    assert find_stuck_force(force, np.zeros(TIME.size), np.full(TIME.size, drive)) is None
