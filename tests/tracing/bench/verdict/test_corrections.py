"""Corrections of sensors add up, and become settings of `prepare`."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrpipe.dampers.parameters import Scales
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.verdict.corrections import Corrections, corrections_of

pytestmark = pytest.mark.property


def test_corrections_add_to_those_that_are_present() -> None:
    present = Corrections(force_late_s=1e-3, force_offset_n={"a": 1.0}, displacement_late_s=2e-3)
    found = Corrections(force_late_s=5e-4, force_offset_n={"a": -0.5, "b": 2.0})
    section = found.settings(present)
    assert section["displacement_late_s"] == pytest.approx(2e-3)
    assert section["corrections"]["force_late_s"] == pytest.approx(1.5e-3)
    assert section["corrections"]["force_offset_n"] == {"a": 0.5, "b": 2.0}
    assert "drive_lag_s" not in section["corrections"]


def test_nothing_to_correct_is_recognised() -> None:
    assert not Corrections().any
    assert Corrections(displacement_late_s=1e-3).any


_OFFSET = damper_effects()["offset"]


@pytest.mark.parametrize("form", [item.name for item in (*_OFFSET.forms, *_OFFSET.refinements)])
def test_every_form_of_an_offset_has_a_correction(form: str) -> None:
    """Seed 50293: a load cell that warms up stopped `close-loop` with a traceback."""
    numbers = {"rate": 3.0, "square": 0.5, "power": 1.4, "rise": 6.0, "warming_time": 2.0}
    values = {item.name: numbers[item.name] for item in _OFFSET.form(form).parameters}
    scales = Scales(stroke=0.01, speed=0.1, acceleration=1.0, drive=2.0, force=100.0, time=4.0)
    problem = SimpleNamespace(terms=(Term(_OFFSET, _OFFSET.form(form)),), scales=scales)
    chosen = SimpleNamespace(problem=problem, term_values=[values], base_values={"eta": 50.0})
    named = SimpleNamespace(effect=_OFFSET, form=form)
    traced = SimpleNamespace(selection=SimpleNamespace(chosen=chosen), named=[named])
    found = corrections_of(cast(Any, traced), [])
    time, drive = np.linspace(0.0, 4.0, 20), np.linspace(0.0, 2.0, 20)
    removed = found.force_per_drive_n * drive + found.force_per_drive_squared_n * drive**2
    expected = {
        "with-drive": 3.0 * drive,
        "with-drive-squared": 3.0 * drive + 0.5 * drive**2,
        "with-effective-drive": 3.0 * drive,
        "with-drive-power": 3.0 * drive**1.4,
    }
    if form in expected:
        np.testing.assert_allclose(removed, expected[form], atol=0.05 * np.max(expected[form]))
        return
    law = 3.0 * time if form == "drift" else 6.0 * (1.0 - np.exp(-time / 2.0))
    left = law - found.force_drift_n_s * time
    assert np.std(left) < 0.35 * np.std(law)
