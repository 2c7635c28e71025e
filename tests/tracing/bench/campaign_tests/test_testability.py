"""Effects whose needs a campaign does not meet are named as untestable, for every kind of need."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from mrpipe.effects.contract import Effect, Needs
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.recordings import Recordings
from mrpipe.tracing.bench.campaign_tests.testability import effects_by_testability, unmet_needs

RATE = 500.0


def recordings(*tests: tuple[str, float, float, float, bool]) -> Recordings:
    """Return tests of (shape, amplitude [m], frequency [Hz], duration [s], whether the drive steps)."""
    parts = []
    for shape, amplitude, frequency, duration, steps in tests:
        phase = 2.0 * np.pi * frequency * np.arange(int(duration * RATE)) / RATE
        x = amplitude * (np.sin(phase) if shape == "sine" else 2.0 / np.pi * np.arcsin(np.sin(phase)))
        v = np.gradient(x, 1.0 / RATE)
        drive = np.where(np.sin(3.0 * phase) > 0.0, 2.0, 1.0) if steps else np.full(len(x), 2.0)
        parts.append((x, v, np.gradient(v, 1.0 / RATE), drive))
    x, v, a, drive = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    lengths = [len(part[0]) for part in parts]
    count, n = len(tests), len(x)
    noise = np.full(count, 1e-6)
    return Recordings(
        x, v, a, drive, 100.0 * np.sign(v), np.cumsum([0, *lengths]), np.full(count, 1.0 / RATE),
        tuple(f"t{k}" for k in range(count)), np.repeat(np.arange(count), lengths), np.ones(n, dtype=bool),
        noise, noise, noise, np.zeros(count), np.zeros(count), np.array([1.0 / test[2] for test in tests]),
        np.full(count, 40.0), np.full(count, 40.0), np.zeros(count), np.zeros(count), np.zeros(count),
        np.full(count, 1.0 / RATE),
    )  # fmt: skip


RICH = recordings(
    ("sine", 0.010, 1.0, 25.0, False), ("sine", 0.005, 2.0, 5.0, True), ("triangle", 0.008, 0.5, 6.0, False)
)
POOR: dict[Needs, Recordings] = {
    "varying-drive": recordings(("sine", 0.010, 1.0, 25.0, False), ("sine", 0.005, 2.0, 5.0, False)),
    "varying-speed": recordings(("triangle", 0.010, 1.0, 25.0, True), ("triangle", 0.005, 2.0, 5.0, False)),
    "several-frequencies": recordings(("sine", 0.010, 1.0, 25.0, True), ("sine", 0.005, 1.0, 5.0, False)),
    "several-positions": recordings(("sine", 0.010, 1.0, 25.0, True), ("sine", 0.010, 2.0, 5.0, False)),
    "long-tests": recordings(("sine", 0.010, 1.0, 6.0, True), ("sine", 0.005, 2.0, 5.0, False)),
}


@pytest.mark.property
def test_every_kind_of_need_is_looked_at() -> None:
    assert set(POOR) == set(get_args(Needs))
    assert unmet_needs(RICH) == {}


@pytest.mark.planted
@pytest.mark.parametrize("need", POOR)
def test_an_unmet_need_makes_the_effect_untestable_and_says_what_to_record(need: Needs) -> None:
    assert list(unmet_needs(POOR[need])) == [need]
    effect = replace(next(iter(damper_effects().values())), needs=(need,))
    library: dict[str, Effect] = {"own": effect, "other": replace(effect, needs=())}
    able, reasons = effects_by_testability(POOR[need], library)
    assert list(able) == ["other"]
    assert reasons["own"].startswith("untestable: ")
    assert "record" in reasons["own"]
    assert effects_by_testability(RICH, library) == (library, {})
