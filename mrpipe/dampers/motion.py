"""Recorded motions laid end to end, so that one compiled loop runs over all tests of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.signals.prepared import PreparedTest

Piece = tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]
"""Displacement, velocity, acceleration, drive and sampling interval of one recording."""


@dataclass(frozen=True)
class Motion:
    """What a damper goes through in several recordings.

    Attributes
    ----------
    displacement, velocity, acceleration, drive
        Shape (n,); m, m/s, m/s^2, A or V.
    starts
        Shape (tests + 1,): first sample of each recording, and n.
    dt
        Shape (tests,): sampling interval of each [s].
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    drive: FloatArray
    starts: IntArray
    dt: FloatArray

    @property
    def tests(self) -> int:
        """Number of recordings."""
        return len(self.dt)

    def test_of_sample(self) -> IntArray:
        """Return the recording that each sample belongs to, shape (n,)."""
        return np.repeat(np.arange(self.tests), np.diff(self.starts)).astype(np.int64)


def join(pieces: Sequence[Piece]) -> Motion:
    """Lay several recordings end to end."""
    lengths = [len(piece[0]) for piece in pieces]
    displacement, velocity, acceleration, drive = (
        np.ascontiguousarray(np.concatenate([piece[channel] for piece in pieces]), dtype=np.float64)
        for channel in (0, 1, 2, 3)
    )
    return Motion(
        displacement,
        velocity,
        acceleration,
        drive,
        starts=np.cumsum([0, *lengths], dtype=np.int64),
        dt=np.array([piece[4] for piece in pieces], dtype=np.float64),
    )


def motion_of(tests: Sequence[PreparedTest], windows: Sequence[slice] | None = None) -> Motion:
    """Return the motion of prepared tests, of each the whole or a window."""
    chosen = windows or [slice(None)] * len(tests)
    return join(
        [
            (
                test.displacement_m[window],
                test.velocity_m_s[window],
                test.acceleration_m_s2[window],
                test.drive[window],
                test.dt,
            )
            for test, window in zip(tests, chosen, strict=True)
        ]
    )
