"""Coarse response curves for tests of what is done with a design, not of the accuracy of its responses."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from mrpipe.law_design import run, study
from mrpipe.law_design.options import DesignSettings
from mrpipe.simulation.steady_state import CurveOptions


def take_coarse_curves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a design use few frequencies, and let a search that is coarse be the last one."""
    accurate = run.accurate_curves

    def coarse(settings: DesignSettings, *, absolute: bool) -> CurveOptions:
        return replace(
            accurate(settings, absolute=absolute),
            points=5, tolerance=0.02, frequency_tolerance=0.02, standard_error=math.inf, most_averaged_cycles=0,
        )  # fmt: skip

    monkeypatch.setattr(run, "accurate_curves", coarse)
    monkeypatch.setattr(study, "COARSE", replace(study.COARSE, points=5))
