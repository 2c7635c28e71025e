"""Pooled errors of a damper model, and where they are not defined."""

from __future__ import annotations

import math

import pytest

from mrpipe.fitting.scoring import TestScore, pool
from mrpipe.signals.error_size import doubt_about_fit


def _score(forces: list[float], error: float) -> TestScore:
    squares = sum(item**2 for item in forces)
    return TestScore("T0", "validation", len(forces), error**2 * len(forces), squares, sum(forces))


@pytest.mark.property
def test_a_constant_force_has_no_fit_and_the_reason_is_named() -> None:
    constant = pool([_score([5.0] * 8, 0.5)])
    assert constant.nrmse == pytest.approx(0.1) and math.isnan(constant.fit_percent) and math.isnan(constant.r2)
    assert "is constant" in str(doubt_about_fit(constant.nrmse, constant.fit_percent, "force"))
    nothing = pool([_score([0.0] * 8, 0.5)])
    assert math.isnan(nothing.nrmse) and "other than zero" in str(doubt_about_fit(nothing.nrmse, math.nan, "force"))


@pytest.mark.property
def test_noise_about_a_constant_drive_is_no_change() -> None:
    noisy = pool([_score([1.0 + 1e-3 * (-1) ** index for index in range(8)], 0.05)])
    assert noisy.fit_percent < -1000.0
    assert "changes by 0.10 %" in str(doubt_about_fit(noisy.nrmse, noisy.fit_percent, "drive"))
    sound = pool([_score([1.0, -1.0, 2.0, -2.0], 0.1)])
    assert sound.fit_percent > 90.0 and doubt_about_fit(sound.nrmse, sound.fit_percent, "drive") is None
