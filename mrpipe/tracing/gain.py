"""Gain of an effect: on tests left out of its fit, and on validation tests against a ceiling."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Gain:
    """Reduction of the error by an effect, on tests left out of its fit.

    Attributes
    ----------
    share
        Share of the squared error that the effect removes, cross-validated.
    interval
        95 % interval of the share, by block bootstrap.
    """

    share: float
    interval: tuple[float, float]

    @property
    def significant(self) -> bool:
        """Whether the interval lies above zero."""
        return self.interval[0] > 0.0


def recovered_share(before: float, after: float, ceiling: float) -> float:
    """Return the share by which the squared error beyond a ceiling falls from `before` to `after`, 0 to 1."""
    able = before**2 - min(ceiling, after) ** 2
    return float(min(1.0, max(0.0, (before**2 - after**2) / able))) if able > 0.0 else 0.0
