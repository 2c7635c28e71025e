"""Gain of an effect on tests left out of its fit; bench and structure compute it each in its own way."""

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
