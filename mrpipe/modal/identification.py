"""Result of the identification of a frame: matrices, modes, intervals and checks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.amplitude.dependence import AmplitudeDependence
from mrpipe.modal.clocks.delays import SensorClock
from mrpipe.modal.decays.decay import DecayResult, Estimate
from mrpipe.modal.fit.lscf import PoleCandidate
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.matrices.tridiagonal import TridiagonalFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.verification import FrequencyVerification, TimeVerification
from mrpipe.structures import Frame


@dataclass(frozen=True)
class GivenShapes:
    """Mode shapes to use instead of the measured ones, shape (n, n), and their name for messages."""

    shapes: FloatArray
    name: str = ""


@dataclass(frozen=True)
class FrameIdentification:
    """Result of the identification, for n floors and r modes.

    Attributes
    ----------
    frame
        M, C, K; None if the data determine modes only.
    frequencies
        Natural angular frequencies with intervals [rad/s].
    damping
        Damping ratios that were used for C, with intervals.
    damping_source
        For each mode `decay`, `sweep`, or `decay and sweep` if the decay is uncertain.
    sweep_damping
        Damping ratios of the multi-mode fit of the forced tests: the second method.
    mode_shapes
        Shape (n, r), largest element of a mode +1; NaN at floors at which it is not determined. With several
        directions: one row per sensor.
    mac
        Shape (r, r): MAC of measured shapes with the modes of the frame (with themselves without a frame).
    decays
        At most one decay per mode (the most certain one); modes without a decay are missing.
    fit, tridiagonal, in_time, in_frequency
        Intermediate results for the artifact and the report; None or empty without a frame.
    phase_scatter
        Shape (n,): largest imaginary part of the residues of a mode over the largest residue.
    tests
        The forced tests, those of the fit first; all are simulated for verification.
    band_hz
        Band of the fit.
    findings
        Messages for the user, one line each.
    doubts
        Findings that make it doubtful whether the structure is right.
    numbers
        Mode number (from 1) of each mode.
    clocks
        Delays of the sensors that were corrected.
    candidates
        The stabilisation chart: poles that appear at several model orders.
    degrees_of_freedom
        Name of each row of `mode_shapes`.
    masses, mass_intervals
        Shape (n,) and (n, 2) [kg]; nan where unknown.
    amplitude, amplitude_in_time
        Amplitude-dependent modes and their simulation of each forced test; None and empty if constant modes predict as
        well.
    shape_errors
        Standard errors of the measured rows of `mode_shapes`, in their scale, shape (n, r); nan at rows that no sensor
        measures.
    """

    frame: Frame | None
    frequencies: tuple[Estimate, ...]
    damping: tuple[Estimate, ...]
    damping_source: tuple[str, ...]
    sweep_damping: tuple[Estimate, ...]
    mode_shapes: FloatArray
    mac: FloatArray
    decays: dict[int, DecayResult]
    fit: MultiModeFit
    tridiagonal: TridiagonalFit | None
    in_time: tuple[TimeVerification, ...]
    in_frequency: FrequencyVerification | None
    phase_scatter: FloatArray
    tests: tuple[FrameTest, ...]
    band_hz: tuple[float, float]
    findings: tuple[str, ...]
    numbers: tuple[int, ...]
    clocks: tuple[SensorClock, ...]
    candidates: tuple[PoleCandidate, ...]
    degrees_of_freedom: tuple[str, ...]
    masses: FloatArray
    mass_intervals: FloatArray
    amplitude: AmplitudeDependence | None = None
    amplitude_in_time: tuple[TimeVerification, ...] = ()
    doubts: tuple[str, ...] = ()
    shape_errors: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))


def errors_of_rows(mode_shapes: FloatArray, measured: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the errors of measured shapes in the scale of the shapes of the structure; nan where nothing is measured.

    Parameters
    ----------
    mode_shapes
        Shapes of the structure, shape (n, r).
    measured, errors
        Shape (n, r) in any scale; an infinite error at rows without a sensor.
    """
    known = np.isfinite(errors)
    sizes = [np.linalg.norm(np.where(known, shapes, 0.0), axis=0) for shapes in (mode_shapes, measured)]
    return np.where(known, errors * (sizes[0] / np.maximum(sizes[1], 1e-300)), np.nan)
