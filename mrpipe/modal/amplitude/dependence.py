"""Amplitude dependence of the modes: what was found, whether it explains the motion, and a sentence for the user."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.modal.amplitude.laws import AmplitudeModel
from mrpipe.words import in_percent

_LARGEST_SHARE = 0.5
"""Squared error that a law may leave, over the squared response and over the squared error of constant modes."""


@dataclass(frozen=True)
class AmplitudeDependence:
    """Result of the cross-validation, and the model fitted to all records.

    Attributes
    ----------
    model
        Model with the best law.
    left_out
        Name of the part left out of each fit: a test, or a part of the only test.
    constant_error, error
        Squared error over squared response of the part left out, for each fit, with constant modes and with the best
        law.
    """

    model: AmplitudeModel
    left_out: tuple[str, ...]
    constant_error: tuple[float, ...]
    error: tuple[float, ...]


def explains(constant: Sequence[float], law: Sequence[float]) -> bool:
    """Return whether a law explains the motion: most of the response, and most of what constant modes leave.

    A law that leaves an error of the size of the response describes something else than the structure, such as a
    clipped sensor.

    Parameters
    ----------
    constant, law
        Squared error over squared response of each record left out, with constant modes and with the law.
    """
    return bool(np.mean(law) < _LARGEST_SHARE * min(1.0, float(np.mean(constant))))


def amplitude_finding(result: AmplitudeDependence) -> str:
    """Return one line for the user: the change of the modes over the measured amplitudes, and the gain of the laws."""
    model = result.model
    low, high = model.laws.at(model.smallest_m), model.laws.at(model.largest_m)
    mode = int(np.argmax(np.abs(high[0] / low[0] - 1.0)))
    seen = (
        f"{omega[mode] / (2 * np.pi):.4g} Hz and {in_percent(zeta[mode], digits=2)} damping "
        f"at {1e3 * reached[mode]:.2g} mm"
        for (omega, zeta), reached in ((low, model.smallest_m), (high, model.largest_m))
    )
    before, after = (float(np.sqrt(np.mean(values))) for values in (result.constant_error, result.error))
    return (
        f"modes depend on the amplitude: mode {mode + 1} from {' to '.join(seen)}; on data left out of the fit the RMS "
        f"error falls from {100.0 * before:.0f} to {in_percent(after)} of the response"
    )
