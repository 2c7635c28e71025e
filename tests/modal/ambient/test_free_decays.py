"""Modes from free decays alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests, Place
from tests.modal.towers import Tower, random_tower

RATE = 100.0
HERE = Path("planted")


def released(tower, rng, force, *, duration_s=40.0, before_s=2.0, noise=0.01, displacement=False):
    """A test in which static forces on the floors, shape (n,) [N], are released."""
    clock = np.arange(round(duration_s * RATE)) / RATE
    omega = 2 * np.pi * tower.frequencies_hz
    held = np.linalg.solve(tower.stiffness, np.asarray(force, dtype=float))
    start = tower.shapes.T @ (tower.mass * held)
    poles = -tower.damping_ratios * omega + 1j * omega * np.sqrt(1 - tower.damping_ratios**2)
    # displacement q0 and no velocity at the release
    waves = start * (-poles.conj() / (poles - poles.conj()))
    motion = np.exp(np.outer(clock, poles))
    modal = 2 * np.real(motion * waves * (1.0 if displacement else poles**2))
    rest = np.tile(held if displacement else np.zeros(tower.floors), (round(before_s * RATE), 1))
    seen = np.vstack([rest, modal @ tower.shapes.T])
    seen = seen + noise * seen[len(rest) : len(rest) + 200].std(axis=0) * rng.standard_normal(seen.shape)
    seen += 0.1 * seen.std()
    places = tuple(Place(floor) for floor in range(1, tower.floors + 1))
    return FrameTest("pull", "free-decay", RATE, None, seen, (displacement,) * tower.floors, places=places)


def identified(tower, tests, **options):
    return identify_frame(FrameTests((), tuple(tests), tower.mass, HERE), IdentificationOptions(**options))


@pytest.mark.planted
@pytest.mark.parametrize(("displacement", "before_s"), [(False, 2.0), (False, 0.0), (True, 2.0)])
def test_pull_and_release_tests_give_all_modes_with_intervals_that_contain_them(displacement, before_s):
    rng = np.random.default_rng(4)
    tower = random_tower(rng, floors=3, damping=(0.008, 0.015))
    forces = ([0, 0, 400.0], [400.0, 0, -200.0])
    noise = 2e-3 if displacement else 0.01
    tests = [released(tower, rng, force, displacement=displacement, before_s=before_s, noise=noise) for force in forces]
    result = identified(tower, tests)
    assert [item.value / (2 * np.pi) for item in result.frequencies] == pytest.approx(tower.frequencies_hz, rel=1e-3)
    assert [item.value for item in result.damping] == pytest.approx(tower.damping_ratios, rel=0.05)
    estimates = zip(result.frequencies, 2 * np.pi * tower.frequencies_hz, strict=True)
    assert sum(item.low < truth < item.high for item, truth in estimates) >= 2
    for own, true in zip(result.mode_shapes.T, tower.shapes.T, strict=True):
        assert (own @ true) ** 2 / (own @ own) / (true @ true) > 0.999
    assert result.damping_source == ("decay",) * 3
    assert result.frame.stiffness == pytest.approx(tower.stiffness, abs=0.01 * np.abs(tower.stiffness).max())
    assert not any("left out" in line for line in result.findings)


@pytest.mark.planted
def test_noise_does_not_become_a_mode():
    """A pull at the top of a tower with a weak second mode, and a force that does not excite it."""
    tower = random_tower(np.random.default_rng(6), floors=2, damping=(0.01, 0.011))
    held = tower.stiffness @ tower.shapes[:, 0]  # the static force that deflects the first mode alone
    test = released(tower, np.random.default_rng(7), 400.0 * held / np.abs(held).max(), noise=0.02)
    result = identified(tower, [test])
    assert [item.value / (2 * np.pi) for item in result.frequencies] == pytest.approx(
        tower.frequencies_hz[:1], rel=1e-3
    )
    assert result.numbers == (1,)


@pytest.mark.property
def test_a_decay_of_a_few_periods_is_refused():
    tower = Tower(np.array([100.0]), np.array([[100.0 * (2 * np.pi) ** 2]]), np.array([0.01]))
    test = released(tower, np.random.default_rng(1), [50.0], duration_s=4.0, noise=1e-3)
    with pytest.raises(UserError, match=r"tests.pull: its free decay lasts .* record at least 6 periods"):
        identified(tower, [test])
