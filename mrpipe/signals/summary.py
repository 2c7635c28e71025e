"""Summary of prepared tests: one row for each, and findings that several tests share on one line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mrpipe.signals.preparation import Preparation


def summarised(lines: Sequence[tuple[str, str]]) -> list[str]:
    """Return one line for each finding that several tests share, with how many they are."""
    tests: dict[str, list[str]] = {}
    for test, line in lines:
        tests.setdefault(line, []).append(test)
    return [
        f"test {names[0]}: {line}" if len(names) == 1 else f"{len(names)} tests ({names[0]}, ...): {line}"
        for line, names in tests.items()
    ]


def preparation_row(item: Preparation) -> dict[str, Any]:
    """Return the row of one prepared test: name -> value (SI)."""
    test = item.test
    return {
        "name": test.name,
        "role": test.role,
        "excitation": test.excitation,
        "duration_s": float(test.time_s.size / test.sampling_rate_hz),
        "frequency_hz": item.frequency_hz,
        "amplitude_m": item.amplitude_m,
        "cycles": max(0, int(test.cycles.size) - 1),
        "displacement_offset_m": test.displacement_offset_m,
        "force_offset_n": test.force_offset_n,
        "displacement_peak_m": float(abs(test.displacement_m).max()),
        "force_peak_n": float(abs(test.force_n).max()),
        "velocity_peak_m_s": float(abs(test.velocity_m_s).max()),
        "drive_mean": float(test.drive.mean()),
        "cutoffs_hz": {name: float(value) for name, value in item.cutoffs_hz.items()},
    }
