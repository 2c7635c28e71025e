"""The effects that rigs plant: no effect at strength zero, the wanted share of the force, and known limits."""

import numpy as np
import pytest

from benchmarks.rigs import effects as fx
from benchmarks.rigs.damper import draw_rig, respond, scaled, share_of
from benchmarks.rigs.effects import EFFECTS, OUTSIDE
from benchmarks.rigs.motion import Test, motion_of

pytestmark = pytest.mark.property

TESTS = (
    Test("1", "training", "sine", 1.0, 1.0, "constant", 1.0),
    Test("2", "training", "triangle", 0.9, 1.0, "steps", 1.0),
    Test("3", "training", "random", 0.9, 1.0, "steps", 1.0),
)
DRAWS = np.array([0.5, -1.0, 1.2])


def rig_and_motions(names, base="dahl", seed=5):
    rig = draw_rig(base, names, np.random.default_rng(seed), 2.0)
    scales = rig.scales
    motions = [
        motion_of(
            test, number, seed, stroke=scales.stroke, speed=scales.speed, frequency=rig.frequency_hz,
            drive=scales.drive, duration_s=2.0, step_s=1 / 20_000.0,
        )
        for number, test in enumerate(TESTS)
    ]  # fmt: skip
    return rig, motions


@pytest.mark.parametrize("name", EFFECTS + OUTSIDE)
def test_strength_zero_is_no_effect(name):
    rig, motions = rig_and_motions((name,))
    clean, _ = rig_and_motions(())
    rig = type(rig)(**{**clean.__dict__, "planted": (rig.planted[0].with_strength(0.0),)})
    for motion, draw in zip(motions, DRAWS, strict=True):
        expected = respond(clean, motion)
        np.testing.assert_allclose(respond(rig, motion, draw), expected, atol=1e-9 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", EFFECTS + OUTSIDE)
def test_strength_is_scaled_to_a_share_of_the_force(name):
    rig, motions = rig_and_motions((name,))
    found = scaled(rig, 0, 0.05, motions, DRAWS)
    assert share_of(found, 0, motions, DRAWS) == pytest.approx(0.05, rel=0.03)


def test_remanence_changes_nothing_at_constant_drive():
    rig, motions = rig_and_motions(("remanence",))
    clean = type(rig)(**{**rig.__dict__, "planted": ()})
    expected = respond(clean, motions[0])
    np.testing.assert_allclose(respond(rig, motions[0]), expected, atol=1e-6 * np.max(np.abs(expected)))


def test_play_takes_half_the_gap_from_each_end_of_the_damper_motion():
    gap, h, n = 0.002, 1e-5, 200_000
    v = 0.01 * 2 * np.pi * np.cos(2 * np.pi * np.arange(n) * h)
    codes, values = np.array([fx.BACKLASH]), np.array([[gap, 60.0, 0, 0, 0, 0.0]])
    memory, x = np.zeros((1, fx.MEMORY)), np.zeros(n)
    for k in range(1, n):
        x[k] = x[k - 1] + h * fx.damper_speed(codes, values, memory, v[k], h)
    last = x[n // 2 :]
    assert np.ptp(last) == pytest.approx(0.02 - gap, rel=0.03)


def test_memory_of_order_one_half_grows_with_the_root_of_the_frequency():
    h = 1e-4
    numbers, rates = np.array([1.0, 1.0, 1.0, 0, 0, 0]), fx.FRACTIONAL_RATES
    gains = []
    for w in (8.0, 32.0):
        time = np.arange(round(6 * 2 * np.pi / w / h)) * h
        own = np.zeros(fx.MEMORY)
        force = np.array([fx._fractional(numbers, own, rates, x, 0.7, h) for x in np.sin(w * time)])
        half = force.size // 2
        gains.append(np.sqrt(np.mean(force[half:] ** 2)))
    # four times the frequency: twice the force
    assert gains[1] / gains[0] == pytest.approx(2.0, rel=0.15)


def test_every_planted_law_is_described():
    assert set(fx.LAWS) == set(EFFECTS + OUTSIDE)
