"""Of several bands the one counts whose modes survive the last fit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from mrpipe.modal.search import forced_modes
from mrpipe.modal.search.selection import Layout


@dataclass
class Band:
    """What a band shows at first, and what the last fit leaves of it; `numbers` as of a search."""

    shown: int
    left: int

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
