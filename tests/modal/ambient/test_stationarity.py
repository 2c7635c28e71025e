"""Records whose excitation changes in strength."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.modal.ambient.stationarity import block_weights, effective_share
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.records import FrameTest, FrameTests, Place
from tests.modal.towers import FINE, Sensors, Tower, random_tower, respond, sample


def lines_of(strength, rng, motions=4):
    values = strength[:, None] * rng.standard_normal((strength.size, motions))
    return list(np.fft.rfft(values, axis=0)[1:-1].T)


@pytest.mark.property
def test_a_stationary_record_counts_as_a_whole_and_an_earthquake_for_its_effective_duration():
    steady = [effective_share(lines_of(np.ones(4000), np.random.default_rng(seed))) for seed in range(50)]
    assert sum(share < 1.0 for share in steady) <= 3
    time = np.arange(4000) / 4000
    strength = np.exp(-(((time - 0.3) / 0.08) ** 2)) + 0.1
    exact = np.mean(strength**2) ** 2 / np.mean(strength**4)
    shares = [effective_share(lines_of(strength, np.random.default_rng(seed))) for seed in range(20)]
    assert np.mean(shares) == pytest.approx(exact, rel=0.15)


@pytest.mark.property
def test_blocks_weigh_by_their_information():
    rng = np.random.default_rng(0)
    motion = np.cumsum(rng.standard_normal((1, 500)), axis=1)
    motion -= motion.mean()
    weak, strong, noise = block_weights([0.1 * motion, motion, 1e-3 * rng.standard_normal((1, 500))])
    # a product of two weak samples times its weight counts as much as that of strong ones
    assert 0.01 * weak == pytest.approx(strong)
    assert noise > 0.0


@pytest.mark.planted
def test_an_earthquake_without_a_ground_channel_shows_all_modes():
    """The correlation functions of the strong part alone were too short, and modes were lost."""
    pytest.importorskip("pyoma2", reason="pyOMA2 is not installed")
    rate, found, inside = 50.0, 0, 0
    for seed in (1, 2, 3):
        rng = np.random.default_rng(seed)
        slow = random_tower(np.random.default_rng(20 + seed), floors=3, damping=(0.02, 0.035))
        tower = Tower(slow.mass, 5.0 * slow.stiffness, slow.damping_ratios)
        time = np.arange(round(80.0 * rate * FINE)) / (rate * FINE)
        strength = np.minimum(time / 6.0, 1.0) ** 2 * np.exp(-0.15 * np.maximum(time - 16.0, 0.0))
        ground = strength * rng.standard_normal(time.size)
        relative = respond(tower, -np.outer(ground, tower.mass), 1.0 / (rate * FINE))
        seen = sample(tower, rng, Sensors(noise=0.003), relative + ground[:, None], ground, rate)[1]
        test = FrameTest("quake", "ambient", rate, None, seen, (False,) * 3, places=tuple(map(Place, (1, 2, 3))))
        result = identify_frame(FrameTests((), (), tower.mass, Path("planted"), (test,)))
        for mode, item in zip(result.numbers, result.frequencies, strict=True):
            truth = 2 * np.pi * tower.frequencies_hz[mode - 1]
            found += abs(item.value / truth - 1.0) < 0.04
            inside += item.low < truth < item.high
    assert found >= 8
    assert inside >= 7
