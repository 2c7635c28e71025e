"""Modes from responses alone: ambient vibration, or earthquakes without a ground channel.

pyOMA2 estimates the poles at many model orders by covariance-driven stochastic subspace identification (SSI). Poles
that keep frequency and shape over the orders form clusters, and the choice among these is that of the forced tests.
Frequency and damping are then refined by maximum likelihood, which also gives their intervals; errors of the shapes
come from leaving out one block of the record at a time (jackknife). Without the input, neither modal masses nor
participations can be known: the scale of M, C and K then comes from given masses alone.
"""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError, install_extra
from mrpipe.modal.ambient_refine import refine_by_spectra
from mrpipe.modal.lscf import PoleCandidate
from mrpipe.modal.multimode import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search import ModeSearch
from mrpipe.modal.selection import LARGEST_DAMPING, Layout, complete_set, largest_set
from mrpipe.modal.spectra import ComplexArray

_BLOCKS = 8
_PERIODS = 1.5
"""Length of the correlation functions in periods of the lowest peak."""
_MOST_BLOCK_ROWS = 80
_LEAST_BLOCK_ROWS = 20
_FREQUENCY_TOLERANCE = 0.01
_LEAST_ASSURANCE = 0.9
_LEAST_COLLINEARITY = 0.5
_LARGEST_SPREAD = 4.0
_SEGMENT_PERIODS = 40.0
_LEAST_COMMON = 0.25
_MARGIN = 1.15
_COPY_RANGE = 0.1
_COPY_ASSURANCE = 0.7


@dataclass(frozen=True)
class _Pole:
    """A pole at one model order."""

    angular_frequency: float
    damping_ratio: float
    shape: ComplexArray
    order: int


@dataclass(frozen=True)
class _Cluster:
    """Poles of several orders that are one: medians, shape turned to real, and how many orders have it."""

    angular_frequency: float
    damping_ratio: float
    shape: FloatArray
    collinearity: float
    orders: int


@dataclass(frozen=True)
class _Records:
    """Blocks of the responses, each (s, m), at the rate of the analysis."""

    blocks: tuple[FloatArray, ...]
    rate_hz: float
    block_rows: int
    high_hz: float


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep the progress bars and log lines of pyOMA2 out of the program's own output."""
    logger = logging.getLogger("pyoma2")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        logger.setLevel(level)


def _lowest_peak_hz(tests: Sequence[FrameTest], low_hz: float) -> float:
    test = tests[0]
    length = int(min(test.responses.shape[0], max(256, 40.0 / low_hz * test.sampling_rate_hz)))
    frequency, power = signal.welch(test.responses, fs=test.sampling_rate_hz, nperseg=length, axis=0)
    total = np.sum(power / power.sum(axis=0), axis=1)
    total[frequency < low_hz] = 0.0
    peaks = signal.find_peaks(total, height=0.05 * total.max())[0]
    return float(frequency[peaks[0] if peaks.size else int(np.argmax(total))])


def _common_motion_ends_hz(test: FrameTest, first_hz: float) -> float:
    """Return the frequency above which the sensors have no motion in common [Hz].

    At a resonance all sensors move together, so that the largest eigenvalue of their coherence matrix is near the
    number of sensors; noise of the sensors and local forces leave it near 1.
    """
    rate, (samples, sensors) = test.sampling_rate_hz, test.responses.shape
    length = int(min(samples / 16, _SEGMENT_PERIODS / first_hz * rate))
    values = test.responses - test.responses.mean(axis=0)
    frequency, _, segments = signal.stft(values, fs=rate, nperseg=max(length, 16), axis=0, boundary=None)
    cross = np.einsum("fit,fjt->fij", segments, segments.conj())
    size = np.sqrt(np.maximum(np.real(np.einsum("fii->fi", cross)), 1e-300))
    largest = np.linalg.eigvalsh(cross / (size[:, :, None] * size[:, None, :]))[:, -1]
    common = np.flatnonzero(largest >= 1.0 + _LEAST_COMMON * (sensors - 1))
    return _MARGIN * max(float(frequency[common[-1]]) if common.size else 0.0, 2.0 * first_hz)


def _records(tests: Sequence[FrameTest], layout: Layout, low_hz: float, high_hz: float) -> _Records:
    """Filter, decimate and cut the responses; a record spans the modes that a chain of floors can have."""
    rate = tests[0].sampling_rate_hz
    first = _lowest_peak_hz(tests, low_hz)
    # the highest mode of a uniform chain lies (4 n + 2)/pi above the lowest; real ones spread more
    spread = _LARGEST_SPREAD * (4.0 * layout.floors + 2.0) / np.pi
    high = high_hz or min(spread * first, 0.45 * rate, _common_motion_ends_hz(tests[0], first))
    factor = max(1, int(rate / (2.6 * high)))
    sections = signal.butter(4, max(0.5 * low_hz, 0.2 * first), btype="highpass", fs=rate, output="sos")
    per_test = max(2, round(_BLOCKS / len(tests)))
    blocks: list[FloatArray] = []
    for test in tests:
        values = signal.sosfiltfilt(sections, test.responses - test.responses.mean(axis=0), axis=0)
        if factor > 1:
            values = signal.resample_poly(values, 1, factor, axis=0)
        blocks += [np.ascontiguousarray(part.T) for part in np.array_split(values, per_test)]
    own_rate = rate / factor
    rows = int(np.clip(round(_PERIODS * own_rate / first), _LEAST_BLOCK_ROWS, _MOST_BLOCK_ROWS))
    return _Records(tuple(blocks), own_rate, rows, high)


def _hankel(block: FloatArray, rows: int) -> FloatArray:
    from pyoma2.functions import ssi

    # one lag between the two, because white noise of the sensors is correlated at lag zero only
    with _quiet():
        hankel, _ = ssi.build_hank(block[:, 1:], block[:, :-1], rows, "cov_R")
    return np.asarray(hankel, dtype=np.float64)


def _ssi_poles(hankel: FloatArray, records: _Records, orders: Sequence[int]) -> list[_Pole]:
    from pyoma2.functions import ssi

    channels = records.blocks[0].shape[0]
    highest = max(orders)
    with _quiet():
        _, state, output, _ = ssi.SSI_fast(hankel, records.block_rows, highest)
    found = []
    for order in orders:
        values, vectors = np.linalg.eig(state[order])
        poles = np.asarray(np.log(values.astype(np.complex128)) * records.rate_hz, dtype=np.complex128)
        shapes = np.asarray(output[order])[:channels] @ vectors
        found += _physical(poles, shapes, order, records)
    return found


def _physical(
    poles: NDArray[np.complex128], shapes: NDArray[np.complex128], order: int, records: _Records
) -> list[_Pole]:
    found = []
    for pole, shape in zip(poles, shapes.T, strict=True):
        omega = float(abs(pole))
        zeta = float(-pole.real / omega) if omega > 0.0 else 1.0
        inside = 0.0 < omega < 2.0 * np.pi * min(records.high_hz, 0.49 * records.rate_hz)
        if pole.imag > 0.0 and inside and 0.0 < zeta < LARGEST_DAMPING:
            found.append(_Pole(omega, zeta, np.asarray(shape / np.linalg.norm(shape)), order))
    return found


def _assurance(first: ComplexArray, second: ComplexArray) -> float:
    return float(np.abs(np.vdot(first, second)) ** 2)


def _clusters(poles: Sequence[_Pole]) -> list[_Cluster]:
    """Group poles of neighbouring frequency and equal shape, at most one of each order in a group."""
    groups: list[list[_Pole]] = []
    for pole in sorted(poles, key=lambda item: item.order, reverse=True):
        best: list[_Pole] | None = None
        for group in groups:
            centre = float(np.median([item.angular_frequency for item in group]))
            near = abs(pole.angular_frequency - centre) < _FREQUENCY_TOLERANCE * centre
            if near and _assurance(pole.shape, group[0].shape) > _LEAST_ASSURANCE:
                best = group
                break
        if best is None:
            groups.append([pole])
        elif all(item.order != pole.order for item in best):
            best.append(pole)
    return [_summary(group) for group in groups]


def _summary(group: Sequence[_Pole]) -> _Cluster:
    reference = group[0].shape
    turned = np.mean([item.shape * np.exp(-1j * np.angle(np.vdot(reference, item.shape))) for item in group], axis=0)
    # the phase that makes the shape as real as it can be
    turned = turned * np.exp(-0.5j * np.angle(np.sum(turned**2)))
    collinearity = float(np.abs(np.sum(turned**2)) / np.sum(np.abs(turned) ** 2))
    return _Cluster(
        float(np.median([item.angular_frequency for item in group])),
        float(np.median([item.damping_ratio for item in group])),
        np.asarray(turned.real / np.linalg.norm(turned.real)),
        collinearity,
        len(group),
    )


def _without_copies(clusters: Sequence[_Cluster]) -> list[_Cluster]:
    """Return the clusters without those that repeat the shape of a more stable one nearby: high orders split a pole."""
    kept: list[_Cluster] = []
    for item in sorted(clusters, key=lambda cluster: (-cluster.orders, -cluster.collinearity)):
        near = [known for known in kept if abs(known.angular_frequency / item.angular_frequency - 1.0) < _COPY_RANGE]
        if all((known.shape @ item.shape) ** 2 < _COPY_ASSURANCE for known in near):
            kept.append(item)
    return kept


def _matched(clusters: Sequence[_Cluster], pole: _Cluster) -> _Cluster | None:
    near = [item for item in clusters if abs(item.angular_frequency / pole.angular_frequency - 1.0) < 0.03]
    same = [item for item in near if (item.shape @ pole.shape) ** 2 > 0.5]
    return max(same, key=lambda item: (item.orders, (item.shape @ pole.shape) ** 2), default=None)


def _jackknife(
    hankels: Sequence[FloatArray], records: _Records, orders: Sequence[int], firm: Sequence[_Cluster]
) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of (ln omega, ln zeta), shape (2r, 2r), and errors of the shapes, shape (s, r)."""
    modes, sensors = len(firm), firm[0].shape.size
    logs, shapes = [], []
    total = np.sum(hankels, axis=0)
    few = orders[:: max(1, len(orders) // 3)]
    for left_out in hankels:
        clusters = _clusters(_ssi_poles((total - left_out) / (len(hankels) - 1), records, few))
        row, sheet = np.full(2 * modes, np.nan), np.full((sensors, modes), np.nan)
        for index, pole in enumerate(firm):
            match = _matched(clusters, pole)
            if match is not None:
                row[index] = np.log(match.angular_frequency / pole.angular_frequency)
                row[modes + index] = np.log(match.damping_ratio / pole.damping_ratio)
                sheet[:, index] = match.shape * np.sign(match.shape @ pole.shape)
        logs.append(row)
        shapes.append(sheet)
    count = len(hankels)
    spread = np.sqrt((count - 1) * np.nanvar(np.array(logs), axis=0))
    errors = np.sqrt((count - 1) * np.nanvar(np.array(shapes), axis=0))
    return np.diag(np.nan_to_num(spread, nan=1.0) ** 2), np.nan_to_num(errors, nan=1.0)


def _as_fit(
    test: FrameTest, firm: Sequence[_Cluster], covariance: FloatArray, errors: FloatArray, density: FloatArray
) -> MultiModeFit:
    """Return clusters in the form of a fit; shapes are scaled by the response at their frequency."""
    order = np.argsort([item.angular_frequency for item in firm])
    both = np.concatenate([order, order + len(firm)])
    size = density[order]
    zeta = np.array([item.damping_ratio for item in firm])[order]
    residues = np.column_stack([firm[i].shape for i in order]) * size * 2.0 * zeta
    empty: tuple[ComplexArray, ...] = ()
    return MultiModeFit(
        angular_frequencies=np.array([item.angular_frequency for item in firm])[order],
        damping_ratios=zeta,
        covariance=covariance[np.ix_(both, both)],
        residues=residues.astype(np.complex128),
        residue_errors=errors[:, order] * size * 2.0 * zeta,
        coherence=np.tile(np.array([item.collinearity for item in firm])[order], (residues.shape[0], 1)),
        steady=empty,
        measured=empty,
        omega=(),
        excitation=empty,
        noise_variance=np.ones(residues.shape[0]),
        sensors=test.sensors,
        participations=np.ones((1, len(firm)), dtype=np.complex128),
        input_residues=np.full((residues.shape[0], 1, len(firm)), np.nan, dtype=np.complex128),
    )


def find_ambient_modes(
    tests: Sequence[FrameTest], layout: Layout, low_hz: float, high_hz: float, source: Path
) -> ModeSearch:
    """Return the modes that the responses of ambient tests show.

    Parameters
    ----------
    tests
        With the same sensors and sampling rate.
    layout
        Floors and masses.
    low_hz, high_hz
        Band; 0 for `high_hz` takes a band that follows from the lowest peak and the number of floors.
    source
        campaign.yaml, for messages.

    Raises
    ------
    UserError
        If pyOMA2 is not installed, tests differ in sensors, or no mode is found.
    """
    try:
        import pyoma2  # noqa: F401
    except ImportError as error:
        place = f"tests.{tests[0].name}"
        raise UserError(source, place, "ambient tests need pyOMA2", install_extra("ambient")) from error
    if len({(test.sensors, test.sampling_rate_hz) for test in tests}) > 1:
        problem = "ambient tests differ in sensors or sampling rate"
        raise UserError(source, "tests", problem, "identify each set-up by itself, or give all the same sensors")
    records = _records(tests, layout, low_hz, high_hz)
    orders = range(2 * layout.floors, 2 * layout.floors + 32, 2)
    hankels = [_hankel(block, records.block_rows) for block in records.blocks]
    poles = _ssi_poles(np.mean(hankels, axis=0), records, orders)
    clusters = [item for item in _clusters(poles) if item.angular_frequency > 2.0 * np.pi * low_hz]
    most = max((item.orders for item in clusters), default=0)
    firm = [item for item in clusters if item.orders >= 0.5 * most and item.collinearity > _LEAST_COLLINEARITY]
    firm = _without_copies(firm)
    if not firm:
        raise UserError(source, "ambient tests", "no stable pole", "record longer, or set identify_frame.band_high_hz")
    covariance, errors = _jackknife(hankels, records, orders, firm)
    fit = _as_fit(tests[0], firm, covariance, errors, _response_at(tests, firm))
    chosen = complete_set(fit, layout)
    numbered = dict(zip(chosen, range(1, len(chosen) + 1), strict=True)) if chosen else largest_set(fit, layout)
    if not numbered:
        raise UserError(source, "ambient tests", "no mode found", "record longer, or set identify_frame.band_high_hz")
    candidates = tuple(PoleCandidate(item.angular_frequency, item.damping_ratio, item.orders) for item in clusters)
    refined = refine_by_spectra(fit.only(list(numbered)), tests)
    return ModeSearch(refined, (low_hz, records.high_hz), tuple(numbered.values()), candidates)


def _response_at(tests: Sequence[FrameTest], firm: Sequence[_Cluster]) -> FloatArray:
    """Return the spectral amplitude of the responses at the frequency of each cluster over the median, shape (r,)."""
    test = tests[0]
    length = int(min(test.responses.shape[0], 4096))
    frequency, power = signal.welch(test.responses, fs=test.sampling_rate_hz, nperseg=length, axis=0)
    total = np.sqrt(np.sum(power, axis=1))
    floor = float(np.median(total))
    return np.array(
        [total[int(np.argmin(np.abs(2.0 * np.pi * frequency - item.angular_frequency)))] / floor for item in firm]
    )
