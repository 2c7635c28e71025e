"""One channel of a strong-motion record, whatever the form of its file."""

from __future__ import annotations

from dataclasses import dataclass

from mrpipe.artifacts import FloatArray


@dataclass(frozen=True)
class StrongMotion:
    """Acceleration of one channel.

    Attributes
    ----------
    name
        Number and place or direction as the header gives them, such as `3: 90 Deg`.
    acceleration_m_s2
        Shape (n,).
    interval_s
        Sampling interval [s].
    vertical
        Whether the header calls the channel vertical.
    start_s
        Start of the record [s] from a fixed day on; None where the header states none.
    """

    name: str
    acceleration_m_s2: FloatArray
    interval_s: float
    vertical: bool
    start_s: float | None = None
