"""Of several bands the one counts whose modes survive the last fit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from mrpipe.modal.records import FrameTest
from mrpipe.modal.search import forced_modes
from mrpipe.modal.search.selection import Layout
from tests.modal.towers import Sensors, forced_test, random_tower


@dataclass
class Band:
    """What a band shows at first, and what the last fit leaves of it; `numbers` as of a search."""

    shown: int
    left: int
    certain: float = 1.0

    @property
    def fit(self):
        return self

    @property
    def numbers(self):
        return tuple(range(1, self.left + 1))


@pytest.mark.property
@pytest.mark.parametrize(
    ("bands", "best"),
    [
        # the last band showed as many, of which two stood for modes beyond its end
        ((Band(7, 7), Band(7, 5)), 0),
        ((Band(7, 7), Band(7, 7)), 1),
        ((Band(6, 4), Band(5, 5)), 1),
        ((Band(0, 0), Band(0, 0)), None),
    ],
)
def test_bands_are_compared_after_the_last_fit(monkeypatch, bands, best):
    monkeypatch.setattr(forced_modes, "largest_set", lambda fit, _: dict(enumerate(range(1, fit.shown + 1))))
    monkeypatch.setattr(forced_modes, "_incomplete", lambda item, *_: item)
    found = forced_modes._best_of_bands(bands, Layout(8, None), Path("campaign.yaml"), ())
    assert found is (None if best is None else bands[best])


@pytest.mark.property
@pytest.mark.parametrize("order", [1, -1])
def test_of_equal_sets_of_two_axes_the_one_with_certain_modes_counts(monkeypatch, order):
    """Three poles close to a missed mode represent it in one band; the other band shows the mode itself."""
    monkeypatch.setattr(forced_modes, "largest_set", lambda fit, _: dict(enumerate(range(1, fit.shown + 1))))
    monkeypatch.setattr(forced_modes, "_incomplete", lambda item, *_: item)
    monkeypatch.setattr(forced_modes, "certainty", lambda fit: np.array([fit.certain]))
    bands = (Band(8, 6, 0.9), Band(6, 6, 300.0))[::order]
    found = forced_modes._best_of_bands(bands, Layout(6, None, is_chain=False), Path("campaign.yaml"), ())
    assert found.certain == 300.0


@pytest.mark.planted
@pytest.mark.parametrize("seed", range(3))
def test_well_determined_modes_with_more_than_ten_percent_damping_are_found(seed):
    rng = np.random.default_rng(seed)
    tower = random_tower(rng, floors=3, coupling=0.0, damping=(0.11, 0.16))
    rate = 16.0 * tower.frequencies_hz[-1]
    force, seen = forced_test(tower, rng, Sensors(noise=0.01), 3, rate=rate, duration_s=400.0, kind="random")
    test = FrameTest("random", "random", rate, force, seen, (False,) * 3, 3)
    found = forced_modes.find_modes((test,), Layout(3, tower.mass), 0.1, 0.0, Path("campaign.yaml"))
    assert found.numbers == (1, 2, 3)
    assert found.fit.damping_ratios == pytest.approx(tower.damping_ratios, rel=0.05)
    assert found.fit.angular_frequencies / (2 * np.pi) == pytest.approx(tower.frequencies_hz, rel=0.01)
