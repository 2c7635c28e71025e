"""Poles of responses without a measured excitation at many model orders, by the estimators of pyOMA2.

An estimator first condenses a block of the responses into a statistic. Statistics of several blocks can be averaged, so
that the scatter of the blocks gives errors. The poles of one or of several model orders then follow from the mean.

Sources: Peeters and De Roeck (1999), Reference-based stochastic subspace identification for output-only modal analysis,
Mechanical Systems and Signal Processing 13; Peeters et al. (2004), The PolyMAX frequency-domain method, Shock and
Vibration 11.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from mrpipe.artifacts import FloatArray
from mrpipe.log_levels import errors_only
from mrpipe.modal.search.selection import LARGEST_DAMPING
from mrpipe.modal.spectra import ComplexArray

_SEGMENT_ROWS = 12
"""Length of a spectral segment, relative to that of the correlation functions of SSI."""
_LEAST_SEGMENT = 256


@dataclass(frozen=True)
class Pole:
    """A pole at one model order."""

    angular_frequency: float
    damping_ratio: float
    shape: ComplexArray
    order: int


@dataclass(frozen=True)
class Records:
    """Blocks of the responses, each (s, m), at the rate of the analysis."""

    blocks: tuple[FloatArray, ...]
    rate_hz: float
    block_rows: int
    high_hz: float


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the progress bars and log lines of pyOMA2 out of the output of mrpipe."""
    with errors_only("pyoma2"), contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
        yield


class Estimator(Protocol):
    """An estimator of poles from responses."""

    def orders(self, modes: int, sensors: int) -> range:
        """Return the model orders to try."""

    def statistic(self, block: FloatArray, records: Records) -> ComplexArray | FloatArray:
        """Return the statistic of one block of the responses, shape (s, m), from which poles are computed."""

    def poles(self, statistic: ComplexArray | FloatArray, records: Records, orders: Sequence[int]) -> list[Pole]:
        """Return the physical poles of all model orders."""


class SubspaceEstimator:
    """Covariance-driven stochastic subspace identification (SSI)."""

    def orders(self, modes: int, sensors: int) -> range:  # noqa: ARG002 - only pLSCF depends on the sensors
        """Return numbers of states."""
        return range(2 * modes, 2 * modes + 32, 2)

    def statistic(self, block: FloatArray, records: Records) -> FloatArray:
        """Return the Hankel matrix of the correlation functions, each divided by its own number of products.

        pyOMA2 divides by a smaller number, which makes the correlation functions of a short block grow with the lag.
        """
        rows = records.block_rows
        # white noise of the sensors is correlated at lag zero only
        correlation = _correlation(block, 2 * rows - 1)
        return np.vstack([np.hstack([correlation[:, :, i + j] for j in range(rows)]) for i in range(rows)])

    def poles(self, statistic: ComplexArray | FloatArray, records: Records, orders: Sequence[int]) -> list[Pole]:
        """Return the physical poles of the state matrices."""
        from pyoma2.functions import ssi

        channels = records.blocks[0].shape[0]
        with _quiet():
            _, state, output, _ = ssi.SSI_fast(statistic, records.block_rows, max(orders))
        found = []
        for order in orders:
            values, vectors = np.linalg.eig(state[order])
            poles = np.asarray(np.log(values.astype(np.complex128)) * records.rate_hz, dtype=np.complex128)
            shapes = np.asarray(output[order])[:channels] @ vectors
            found += physical(poles, shapes, order, records)
        return found


class PolyreferenceEstimator:
    """Polyreference least-squares complex frequency estimator (pLSCF, PolyMAX) on positive half spectra."""

    def orders(self, modes: int, sensors: int) -> range:
        """Return orders of the matrix polynomial; each order has as many poles as there are sensors."""
        least = max(2, -(-2 * modes // sensors))
        return range(least, least + 11)

    def statistic(self, block: FloatArray, records: Records) -> ComplexArray:
        """Return the half spectra, shape (s, s, lines): correlation functions under an exponential window.

        The correlation functions have no bias, because a taper of finite segments would add to the damping.
        """
        lags = _segment(records)
        correlation = _correlation(block, lags) * 0.01 ** (np.arange(lags) / lags)
        return np.asarray(np.fft.rfft(correlation, axis=2), dtype=np.complex128)

    def poles(self, statistic: ComplexArray | FloatArray, records: Records, orders: Sequence[int]) -> list[Pole]:
        """Return the physical poles of the matrix polynomials, without the damping of the window."""
        from pyoma2.functions import plscf

        with _quiet():
            denominators, numerators = plscf.pLSCF(statistic, 1.0 / records.rate_hz, max(orders), sgn_basf=1)
        # the window falls to a hundredth over a segment
        window = -np.log(0.01) / _segment(records) * records.rate_hz
        found = []
        for order in orders:
            state, output = plscf.rmfd2ac(denominators[order - 1], numerators[order - 1])
            values, vectors = np.linalg.eig(state)
            kept = np.abs(values) > 0.0
            poles = np.log(values[kept].astype(np.complex128)) * records.rate_hz + window
            found += physical(np.asarray(poles), np.asarray(output @ vectors[:, kept]), order, records)
        return found


ESTIMATORS: dict[str, Estimator] = {"ssi": SubspaceEstimator(), "plscf": PolyreferenceEstimator()}
"""Estimators by the name that the settings use."""


def least_samples(block_rows: int) -> int:
    """Return the least length of a block: the correlation functions reach to half of it."""
    return 4 * block_rows


def _correlation(block: FloatArray, lags: int) -> FloatArray:
    """Return the correlation functions of the sensors at lags 1 to `lags`, shape (s, s, lags), without bias."""
    sensors, samples = block.shape
    padded = next_fast_len(samples + lags, real=True)
    spectrum = np.fft.rfft(block, padded, axis=1)
    correlation = np.empty((sensors, sensors, lags))
    for reference in range(sensors):
        whole = np.fft.irfft(spectrum * spectrum[reference].conj(), padded, axis=1)
        correlation[:, reference] = whole[:, 1 : lags + 1] / (samples - np.arange(1, lags + 1))
    return correlation


def _segment(records: Records) -> int:
    shortest = min(block.shape[1] for block in records.blocks)
    wanted = max(_LEAST_SEGMENT, _SEGMENT_ROWS * records.block_rows)
    return 2 * int(min(wanted, shortest // 4) // 2)


def physical(poles: NDArray[np.complex128], shapes: NDArray[np.complex128], order: int, records: Records) -> list[Pole]:
    """Return the poles inside the band with a plausible damping ratio.

    Parameters
    ----------
    poles
        Shape (p,) [rad/s].
    shapes
        Shape (s, p).
    order
        Model order.
    records
        Records, which determine the band.
    """
    found = []
    for pole, shape in zip(poles, shapes.T, strict=True):
        omega = float(abs(pole))
        zeta = float(-pole.real / omega) if omega > 0.0 else 1.0
        inside = 0.0 < omega < 2.0 * np.pi * min(records.high_hz, 0.49 * records.rate_hz)
        if pole.imag > 0.0 and inside and 0.0 < zeta < LARGEST_DAMPING:
            found.append(Pole(omega, zeta, np.asarray(shape / np.linalg.norm(shape)), order))
    return found
