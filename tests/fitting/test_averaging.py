"""Moving averages over a share of a period."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.fitting.averaging import moving_average

pytestmark = pytest.mark.property

DT, PERIOD, SIZE = 0.002, 0.8, 2000
TIME = DT * np.arange(SIZE)


def _recordings(*periods: float) -> SimpleNamespace:
    count = len(periods)
    starts = SIZE * np.arange(count + 1)
    return SimpleNamespace(tests=count, period_s=np.array(periods), dt=np.full(count, DT), starts=starts)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5])
def test_a_sine_shrinks_by_the_gain_of_the_window(share: float) -> None:
    sine = np.sin(2.0 * np.pi * TIME / PERIOD)
    found = moving_average(sine[None], _recordings(PERIOD), share)[0]  # type: ignore[arg-type]
    inside = slice(int(share * PERIOD / DT), -int(share * PERIOD / DT))
    assert found[inside] == pytest.approx(np.sinc(share) * sine[inside], abs=1e-4)


def test_a_straight_line_stays_inside_and_the_window_may_be_a_fraction_of_samples() -> None:
    line = 3.0 * TIME
    # a window of 2.5 samples
    found = moving_average(line[None], _recordings(PERIOD), 2.5 * DT / PERIOD)[0]  # type: ignore[arg-type]
    assert found[2:-2] == pytest.approx(line[2:-2])


def test_tests_do_not_mix_and_a_test_without_a_period_is_left_alone() -> None:
    step = np.concatenate([np.zeros(SIZE), np.ones(SIZE), np.linspace(0.0, 5.0, SIZE)])
    columns = np.stack([step, 2.0 * step])
    found = moving_average(columns, _recordings(PERIOD, PERIOD, 0.0), 0.3)  # type: ignore[arg-type]
    assert found == pytest.approx(columns)
    assert columns is not found
