"""Known faults of sensors and time base, which are removed from the channels before all other processing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError


@dataclass(frozen=True)
class KnownFaults:
    """Faults that are removed before all other processing; the fields are those of `prepare.corrections`.

    They are subtracted from the recorded channels. The offsets stored with a prepared test do not contain them.

    Attributes
    ----------
    force_late_s
        Delay of the recorded force relative to displacement and drive [s].
    force_offset_n
        Test -> offset of the load cell in addition to that of the campaign [N].
    force_per_drive_n, force_per_drive_squared_n
        Offset per unit of drive, and per unit of squared drive.
    drive_lag_s
        First-order lag of the drive in these two offsets [s].
    force_drift_n_s
        Drift of the load cell in each test [N/s].
    """

    force_late_s: float = 0.0
    force_offset_n: Mapping[str, float] = field(default_factory=dict)
    force_per_drive_n: float = 0.0
    force_per_drive_squared_n: float = 0.0
    drive_lag_s: float = 0.0
    force_drift_n_s: float = 0.0

    def force(self, name: str, force: FloatArray, drive: FloatArray, rate: float) -> FloatArray:
        """Return the force [N] of a test without its faults, shape (n,)."""
        # the configuration needs this module without scipy
        from scipy import signal

        from mrpipe.signals.filters import advance

        force = advance(force, self.force_late_s, rate) - self.force_offset_n.get(name, 0.0)
        if self.force_per_drive_n or self.force_per_drive_squared_n:
            keep = float(np.exp(-1.0 / (rate * self.drive_lag_s))) if self.drive_lag_s > 0.0 else 0.0
            late = signal.lfilter([1.0 - keep], [1.0, -keep], drive, zi=np.array([keep * drive[0]]))[0]
            force = force - self.force_per_drive_n * late - self.force_per_drive_squared_n * late**2
        if self.force_drift_n_s:
            force = force - self.force_drift_n_s * np.arange(force.size) / rate
        return np.asarray(force, dtype=np.float64)


def require_known(faults: KnownFaults, names: Sequence[str]) -> None:
    """Check that the campaign has every test for which an offset is given."""
    for name in faults.force_offset_n:
        if name not in names:
            setting = "prepare.corrections.force_offset_n"
            raise UserError(setting, name, "the campaign has no such test", f"one of {', '.join(names[:8])}")
