"""Corrections of sensors add up, and become settings of `prepare`."""

from __future__ import annotations

import pytest

from mrpipe.tracing.bench.corrections import Corrections

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
