"""Named faults of sensors and of the time base, as corrections that the stage `prepare` applies to the channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from mrpipe.fitting.engine import predict
from mrpipe.fitting.recordings import record_tests
from mrpipe.signals.faults import KnownFaults
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.verdict.summary import Tracing

GRID = 50
"""Numerical technique: points at which a line or a parabola is fitted to a law."""


@dataclass(frozen=True)
class Corrections(KnownFaults):
    """Corrections of the channels: the faults that `prepare` can correct, and the delay of the displacement.

    Attributes
    ----------
    displacement_late_s
        Delay [s] of the recorded displacement relative to force and drive (`prepare.displacement_late_s`).
    """

    displacement_late_s: float = 0.0

    @property
    def any(self) -> bool:
        """Whether there is anything to correct."""
        return self != Corrections()

    def settings(self, present: Corrections) -> dict[str, Any]:
        """Return the section `prepare` with these corrections added to the present ones."""
        total = asdict(present + self)
        late = total.pop("displacement_late_s")
        return {"displacement_late_s": late, "corrections": {key: value for key, value in total.items() if value}}

    def __add__(self, other: Corrections) -> Corrections:
        """Return the sum of both; the delay is that of `other` if it has one."""
        numbers = {
            name: getattr(self, name) + getattr(other, name)
            for name in (
                "displacement_late_s", "force_late_s", "force_per_drive_n", "force_per_drive_squared_n",
                "force_drift_n_s",
            )
        }  # fmt: skip
        names = dict.fromkeys([*self.force_offset_n, *other.force_offset_n])
        offsets = {name: self.force_offset_n.get(name, 0.0) + other.force_offset_n.get(name, 0.0) for name in names}
        return Corrections(**numbers, force_offset_n=offsets, drive_lag_s=other.drive_lag_s or self.drive_lag_s)


def corrections_of(traced: Tracing, tests: Sequence[PreparedTest]) -> Corrections:
    """Return the corrections that the named faults of sensors require.

    Parameters
    ----------
    traced
        The tracing.
    tests
        All prepared tests, so that tests which the tracing left out are corrected too.
    """
    found = Corrections()
    chosen = traced.selection.chosen
    named = {item.effect.name for item in traced.named}
    for term, values in zip(chosen.problem.terms, chosen.term_values, strict=True):
        if not term.effect.sensor or term.effect.name not in named:
            continue
        if term.effect.name == "channel-skew":
            late = float(values["skew"])
            if term.form.name in ("late-force", "filtered-force"):
                found = replace(found, force_late_s=late)
            else:
                found = replace(found, displacement_late_s=late)
        elif term.form.name == "drift":
            found = replace(found, force_drift_n_s=float(values["rate"]))
        elif term.form.name == "warming":
            found = replace(found, force_drift_n_s=_line_of(values, chosen.problem.scales.time))
        elif term.form.name == "with-drive-power":
            linear, square = _parabola_of(values, chosen.problem.scales.drive)
            found = replace(found, force_per_drive_n=linear, force_per_drive_squared_n=square)
        elif term.effect.name == "offset":
            found = replace(
                found,
                force_per_drive_n=float(values["rate"]),
                force_per_drive_squared_n=float(values.get("square", 0.0)),
                drive_lag_s=1.0 / chosen.base_values["eta"]
                if term.form.name == "with-effective-drive" and "eta" in chosen.base_values
                else 0.0,
            )
    if any(item.effect.name == "offset" and item.form == "per-test" for item in traced.named):
        found = replace(found, force_offset_n=_offsets(traced, tests))
    return found


def _line_of(values: Mapping[str, float], longest_s: float) -> float:
    """Return the slope [N/s] of the line nearest to the drift of a zero that warms up, because prepare removes lines.

    The constant part is an offset of each test, which prepare determines itself.
    """
    time = np.linspace(0.0, longest_s, GRID)
    return float(np.polyfit(time, values["rise"] * (1.0 - np.exp(-time / values["warming_time"])), 1)[0])


def _parabola_of(values: Mapping[str, float], largest_drive: float) -> tuple[float, float]:
    """Return the coefficients of drive and squared drive nearest to a power of the drive, as prepare removes them."""
    drive = np.linspace(0.0, largest_drive, GRID)
    columns = np.stack([drive, drive**2], axis=1)
    linear, square = np.linalg.lstsq(columns, values["rate"] * drive ** values["power"], rcond=None)[0]
    return float(linear), float(square)


def _offsets(traced: Tracing, tests: Sequence[PreparedTest]) -> dict[str, float]:
    """Return test -> offset [N] minus the common offset of the campaign, which prepare determines itself."""
    recordings = record_tests(tests, rate_hz=250.0)
    left = recordings.force - predict(traced.selection.chosen, recordings)
    used = recordings.used
    counts = np.maximum(np.bincount(recordings.test[used], minlength=recordings.tests), 1)
    means = np.bincount(recordings.test[used], weights=left[used], minlength=recordings.tests) / counts
    means = means - np.median(means)
    return {name: round(float(value), 4) for name, value in zip(recordings.names, means, strict=True)}
