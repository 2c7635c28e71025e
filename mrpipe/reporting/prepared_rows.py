"""Rows of the prepared tests for a person: usual units, and no number where a test has none."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.words import number

COLUMNS: tuple[tuple[str, str, float], ...] = (
    ("duration_s", "duration [s]", 1.0),
    ("frequency_hz", "frequency [Hz]", 1.0),
    ("amplitude_m", "amplitude [mm]", 1e3),
    ("cycles", "cycles", 0.0),
    ("drive_mean", "drive mean [{drive}]", 1.0),
    ("force_peak_n", "force peak [N]", 1.0),
    ("velocity_peak_m_s", "speed peak [m/s]", 1.0),
    ("displacement_peak_m", "displacement peak [mm]", 1e3),
    ("force_offset_n", "force offset [N]", 1.0),
    ("displacement_offset_m", "displacement offset [mm]", 1e3),
)
"""Key of a row of `prepare`, heading, and factor from SI to the unit of the heading; 0 for a count."""

OF_PERIODIC_TESTS = frozenset({"frequency_hz", "amplitude_m", "cycles"})
"""Keys without a meaning in a test whose motion is random."""

SIGNED = frozenset({"drive_mean", "force_offset_n", "displacement_offset_m"})
"""Keys whose values may be noise about zero: they have three decimals in place of significant digits."""


def to_read(stage: str, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the summary of a stage with the tests of `prepare` as a person reads them; other stages are unchanged.

    Parameters
    ----------
    stage
        Name of the stage.
    summary
        Its summary; the tests of `prepare` are rows of :func:`mrpipe.signals.summary.preparation_row`.
    """
    if stage != "prepare" or "tests" not in summary:
        return dict(summary)
    unit = str(summary.get("drive_unit") or "")
    return {**summary, "tests": [_row(test, unit) for test in summary["tests"]]}


def _row(test: Mapping[str, Any], drive_unit: str) -> dict[str, Any]:
    row: dict[str, Any] = {"test": test["name"], "role": test["role"], "motion": test["excitation"]}
    for key, heading, factor in COLUMNS:
        if key not in test or (key == "drive_mean" and not drive_unit):
            continue
        random = test["excitation"] == "random" and key in OF_PERIODIC_TESTS
        row[heading.format(drive=drive_unit)] = None if random else _cell(key, test[key], factor)
    cutoffs = test.get("cutoffs_hz", {})
    return row | {f"{name} cutoff [Hz]": number(value) for name, value in cutoffs.items()}


def _cell(key: str, value: float, factor: float) -> str:
    if factor == 0.0:
        return str(value)
    # no minus sign before a zero
    return f"{round(factor * value, 3) + 0.0:.3f}" if key in SIGNED else number(factor * value)
