"""A fitted frame with its effects, and its prediction of a record in spectral lines and in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.structure.candidates import Fitted, Surroundings, columns_of
from mrpipe.tracing.structure.fit import Base, Columns, Design, coefficients, predicted, solve
from mrpipe.tracing.structure.spectra import Spectra


@dataclass(frozen=True)
class FrameModel:
    """Linear coefficients of every storey, and effects with their amplitudes.

    Attributes
    ----------
    base
        The linear frame.
    linear
        Coefficients for each storey: of the displacements (or its drift), velocities of all floors, ground acceleration
        and its second derivative, and loads.
    chosen
        Effects with their parameters.
    amplitudes
        Amplitudes of the effects, concatenated.
    about
        Scales of the structure.
    """

    base: Base
    linear: tuple[FloatArray, ...]
    chosen: tuple[Fitted, ...]
    amplitudes: FloatArray
    about: Surroundings

    def columns(self, record: Spectra) -> Columns | None:
        """Return the columns of all effects in a record."""
        return joined([columns_of(item, record, self.about) for item in self.chosen]) if self.chosen else None

    def predict(self, record: Spectra) -> ComplexArray:
        """Return the spectral lines of the shear force of each storey, shape (n, b) [N/sqrt(Hz)]."""
        return predicted(self.base, record, self.linear, self.columns(record), self.amplitudes)


def joined(parts: Sequence[Columns]) -> Columns:
    """Return the columns of several effects, one after another."""
    return Columns(np.concatenate([item.lines for item in parts]))


def model_of(design: Design, chosen: Sequence[Fitted], about: Surroundings) -> FrameModel:
    """Solve for amplitudes and linear coefficients on the records of a design; shape parameters are kept."""
    columns, amplitudes = None, np.zeros(0)
    if chosen:
        columns = [joined([columns_of(item, record, about) for item in chosen]) for record in design.spectra]
        amplitudes = solve(design, design.project(columns)).amplitudes
    linear = coefficients(design, columns, amplitudes)
    return FrameModel(design.base, tuple(linear), tuple(chosen), amplitudes, about)


def in_time(lines: ComplexArray, record: Spectra) -> FloatArray:
    """Return lines of shape (n, b) as tapered histories in the band, shape (m, n)."""
    samples = len(record.taper)
    size = fft.next_fast_len(samples, real=True)
    full = np.zeros((len(lines), size // 2 + 1), dtype=np.complex128)
    first = round(float(record.frequencies_hz[0]) * size * record.record.dt)
    full[:, first : first + lines.shape[1]] = lines / np.sqrt(2.0 * record.record.dt / np.sum(record.taper**2))
    return np.asarray(fft.irfft(full, size, axis=1)[:, :samples].T)
