"""A rig of Spencer's modified Bouc-Wen model, integrated by small explicit steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from mrpipe.fitting.engine import Fit
from mrpipe.fitting.recordings import record_tests
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from tests.tracing.bench.rig import RATE, campaign

YIELD_DISPLACEMENT = 3.7e-4
NOISE = 0.3
"""Standard deviation of the noise of the force [N]."""

SERIES = 8.0
"""Viscosity of the dashpot in series over that of the inner dashpot, 50 + 75 u [N s/m]."""


@njit
def spencer(x: np.ndarray, v: np.ndarray, drive: np.ndarray, dt: float, inner: float, outer: float) -> np.ndarray:
    """Integrate the modified Bouc-Wen model by small explicit steps of z and of the inner displacement y."""
    force = np.empty_like(x)
    z, y, parts = 0.0, 0.0, 40
    for k in range(len(x)):
        strength, c0 = 20.0 + 8.0 * drive[k] + 14.0 * drive[k] ** 2, 50.0 + 75.0 * drive[k]
        c1 = SERIES * c0
        for part in range(parts):
            share = (part + 1.0) / parts
            place = x[k - 1] + share * (x[k] - x[k - 1]) if k else x[0]
            speed = v[k - 1] + share * (v[k] - v[k - 1]) if k else v[0]
            inner_speed = (strength * z + c0 * speed + inner * (place - y)) / (c0 + c1)
            slip = (speed - inner_speed) * dt / parts
            z += (slip - 0.5 * abs(slip) * z * abs(z) - 0.5 * slip * z * z) / YIELD_DISPLACEMENT
            y += inner_speed * dt / parts
        force[k] = c1 * (strength * z + c0 * v[k] + inner * (x[k] - y)) / (c0 + c1) + outer * x[k]
    return force


def spencer_tests(inner: float, outer: float) -> list[PreparedTest]:
    """Return tests of the rig with these springs [N/m] and noise of the force."""
    rng = np.random.default_rng(3)
    found = []
    for test in campaign("none"):
        force = spencer(test.displacement_m, test.velocity_m_s, test.drive, 1.0 / RATE, inner, outer)
        recorded = force + NOISE * rng.standard_normal(len(force))
        found.append(replace(test, force_n=recorded, force_raw_n=recorded))
    return found


def spencer_fit(inner: float, outer: float) -> Fit:
    """Return the weighted fit of a Bouc-Wen model to the training tests of the rig."""
    recordings = record_tests([item for item in spencer_tests(inner, outer) if item.role != "validation"], rate_hz=RATE)
    return fit_baseline(recordings, declared_base(recordings, "bouc-wen", 2, 1)).fit
