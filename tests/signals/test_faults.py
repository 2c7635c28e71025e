"""Known faults of sensors are taken out of the force exactly as they were put in."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.signals.faults import KnownFaults, require_known

pytestmark = pytest.mark.property

RATE = 500.0
TIME = np.arange(1000) / RATE
FORCE = 100.0 * np.sin(6.0 * TIME)
DRIVE = 1.0 + 0.5 * np.sin(2.0 * TIME)


def test_offset_drift_and_share_of_the_drive() -> None:
    faults = KnownFaults(
        force_offset_n={"a": 3.0}, force_per_drive_n=2.0, force_per_drive_squared_n=0.5, force_drift_n_s=0.7
    )
    recorded = FORCE + 3.0 + 2.0 * DRIVE + 0.5 * DRIVE**2 + 0.7 * TIME
    np.testing.assert_allclose(faults.force("a", recorded, DRIVE, RATE), FORCE, atol=1e-9)
    np.testing.assert_allclose(faults.force("b", recorded, DRIVE, RATE), FORCE + 3.0, atol=1e-9)


def test_a_late_force_is_advanced() -> None:
    late = 100.0 * np.sin(6.0 * (TIME - 0.01))
    found = KnownFaults(force_late_s=0.01).force("a", late, DRIVE, RATE)
    np.testing.assert_allclose(found[50:-50], FORCE[50:-50], atol=0.05)


def test_no_fault_changes_nothing() -> None:
    np.testing.assert_allclose(KnownFaults().force("a", FORCE, DRIVE, RATE), FORCE, atol=1e-9)


def test_an_offset_of_an_unknown_test_is_refused() -> None:
    require_known(KnownFaults(force_offset_n={"a": 1.0}), ["a", "b"])
    with pytest.raises(UserError, match=r"force_offset_n: c: the campaign has no such test; one of a, b"):
        require_known(KnownFaults(force_offset_n={"c": 1.0}), ["a", "b"])
