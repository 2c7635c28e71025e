"""Modes from responses without a measured excitation: ambient vibration, or earthquakes without a ground channel.

pyOMA2 estimates the poles at many model orders (stochastic subspace identification or pLSCF). Poles
that keep frequency and shape over the orders form clusters, and the choice among these is that of the forced tests.
Frequency and damping are then refined by maximum likelihood, which also gives their intervals; errors of the shapes
come from leaving out one block of the record at a time (jackknife). Tests with different sensors are separate set-ups,
which are merged by the sensors that they share. Without the input, neither modal masses nor participations can be
known: the scale of M, C and K then comes from given masses or from added masses.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError, install_extra
from mrpipe.modal.ambient.band import USABLE_BAND, common_motion_ends_hz, lowest_peak_hz
from mrpipe.modal.ambient.clusters import Cluster, clustered, matched, without_copies
from mrpipe.modal.ambient.poles import ESTIMATORS, Estimator, Records, least_samples
from mrpipe.modal.ambient.refine import refine_by_spectra, two_peaks
from mrpipe.modal.ambient.setup_scales import scaled_by_orthogonality, scaling_notes
from mrpipe.modal.ambient.setups import SetUp, confirmed, merge_set_ups, pooled_poles
from mrpipe.modal.ambient.stationarity import block_weights, effective_share
from mrpipe.modal.fit.lscf import PoleCandidate
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.forced_modes import ModeSearch
from mrpipe.modal.search.selection import Layout, complete_set, largest_set
from mrpipe.modal.spectra import ComplexArray

_BLOCKS = 8
_LEAST_BLOCKS = 4
"""Least number of blocks of a short record: fewer give no error of the shapes."""
_PERIODS = 1.5
"""Length of the correlation functions in periods of the lowest peak."""
_MOST_BLOCK_ROWS = 80
_LEAST_BLOCK_ROWS = 20
_LEAST_COLLINEARITY = 0.5
_LARGEST_SPREAD = 4.0
_SCALINGS = 2


def _records(tests: Sequence[FrameTest], layout: Layout, low_hz: float, high_hz: float) -> Records:
    """Filter, decimate and cut the responses; the band contains all modes that a chain of floors can have."""
    rate = tests[0].sampling_rate_hz
    first = lowest_peak_hz(tests, low_hz)
    # the highest mode of a uniform chain lies (4 n + 2)/pi above the lowest; real ones spread more
    spread = _LARGEST_SPREAD * (4.0 * layout.floors + 2.0) / np.pi
    high = high_hz or min(spread * first, USABLE_BAND * rate, common_motion_ends_hz(tests[0], first))
    factor = max(1, int(rate / (2.6 * high)))
    sections = signal.butter(4, max(0.5 * low_hz, 0.2 * first), btype="highpass", fs=rate, output="sos")
    own_rate = rate / factor
    rows = int(np.clip(round(_PERIODS * own_rate / first), _LEAST_BLOCK_ROWS, _MOST_BLOCK_ROWS))
    filtered = []
    for test in tests:
        values = signal.sosfiltfilt(sections, test.responses - test.responses.mean(axis=0), axis=0)
        filtered.append(signal.resample_poly(values, 1, factor, axis=0) if factor > 1 else values)
    whole = sum(values.shape[0] for values in filtered)
    # a short record has fewer blocks, because each of them must be longer than the correlation functions
    most = int(np.clip(whole // least_samples(rows), _LEAST_BLOCKS, _BLOCKS))
    blocks: list[FloatArray] = []
    for values in filtered:
        # blocks of all tests have about the same length, because their statistics are averaged
        count = max(-(-2 // len(tests)), round(most * values.shape[0] / whole))
        blocks += [np.ascontiguousarray(part.T) for part in np.array_split(values, count)]
    return Records(tuple(blocks), own_rate, rows, high)


def _require_length(records: Records, tests: Sequence[FrameTest], low_hz: float, source: Path) -> None:
    """Refuse tests whose blocks are too short for the correlation functions.

    Raises
    ------
    UserError
        If a block is too short.
    """
    shortest = min(block.shape[1] for block in records.blocks)
    least = least_samples(records.block_rows)
    if shortest < least:
        test = min(tests, key=lambda item: item.duration_s)
        needed = test.duration_s * (least + 1) / shortest
        peak = f"the lowest peak of the responses, at {lowest_peak_hz(tests, low_hz):.3g} Hz"
        problem = f"lasts {test.duration_s:.3g} s; {peak}, needs at least {needed:.3g} s"
        remedy = "record longer, or set identify_frame.band_low_hz just below the first mode if the peak is a drift"
        raise UserError(source, f"tests.{test.name}", problem, remedy)


def _jackknife(
    statistics: Sequence[ComplexArray | FloatArray],
    records: Records,
    estimator: Estimator,
    orders: Sequence[int],
    firm: Sequence[Cluster],
) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of (ln omega, ln zeta), shape (2r, 2r), and errors of the shapes, shape (s, r)."""
    modes, sensors = len(firm), firm[0].shape.size
    logs, shapes = [], []
    total = np.sum(np.array(statistics), axis=0)
    few = orders[:: max(1, len(orders) // 3)]
    for left_out in statistics:
        mean = (total - left_out) / (len(statistics) - 1)
        clusters = clustered(estimator.poles(mean, records, few))
        row, sheet = np.full(2 * modes, np.nan), np.full((sensors, modes), np.nan)
        for index, pole in enumerate(firm):
            match = matched(clusters, pole)
            if match is not None:
                row[index] = np.log(match.angular_frequency / pole.angular_frequency)
                row[modes + index] = np.log(match.damping_ratio / pole.damping_ratio)
                sheet[:, index] = match.shape * np.sign(match.shape @ pole.shape)
        logs.append(row)
        shapes.append(sheet)
    count = len(statistics)
    spread = np.sqrt((count - 1) * np.nanvar(np.array(logs), axis=0))
    errors = np.sqrt((count - 1) * np.nanvar(np.array(shapes), axis=0))
    return np.diag(np.nan_to_num(spread, nan=1.0) ** 2), np.nan_to_num(errors, nan=1.0)


def _as_fit(
    test: FrameTest, firm: Sequence[Cluster], covariance: FloatArray, errors: FloatArray, density: FloatArray
) -> MultiModeFit:
    """Return clusters, sorted by frequency, as a fit; shapes are scaled by the response at their frequency."""
    zeta = np.array([item.damping_ratio for item in firm])
    residues = np.column_stack([item.shape for item in firm]) * density * 2.0 * zeta
    empty: tuple[ComplexArray, ...] = ()
    return MultiModeFit(
        angular_frequencies=np.array([item.angular_frequency for item in firm]),
        damping_ratios=zeta,
        covariance=covariance,
        residues=residues.astype(np.complex128),
        residue_errors=errors * density * 2.0 * zeta,
        coherence=np.tile(np.array([item.collinearity for item in firm]), (residues.shape[0], 1)),
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
    tests: Sequence[FrameTest],
    layout: Layout,
    low_hz: float,
    high_hz: float,
    source: Path,
    method: str = "ssi",
) -> ModeSearch:
    """Return the modes that are identified from ambient tests.

    Parameters
    ----------
    tests
        Tests with the same sensors and sampling rate form a set-up. Set-ups must share sensors.
    layout
        Floors and masses.
    low_hz, high_hz
        Band [Hz]; 0 for `high_hz`: a band that follows from the lowest peak and the number of floors.
    source
        campaign.yaml, for messages.
    method
        Name in :data:`~mrpipe.modal.ambient.poles.ESTIMATORS`.

    Raises
    ------
    UserError
        If pyOMA2 is not installed, a set-up shares no sensor with the others, or no mode is found.
    """
    try:
        import pyoma2  # noqa: F401
    except ImportError as error:
        place = f"tests.{tests[0].name}"
        raise UserError(source, place, "ambient tests need pyOMA2", install_extra("ambient")) from error
    groups: dict[object, list[FrameTest]] = {}
    for test in tests:
        groups.setdefault((test.sensors, test.sampling_rate_hz), []).append(test)
    parts = tuple(tuple(group) for group in groups.values())
    found = _search(parts, layout, (low_hz, high_hz), source, ESTIMATORS[method])
    if len(found.numbers) < layout.floors and not high_hz:
        # with a soft storey or a light top the modes have a wider band than those of a uniform chain
        wide = max(common_motion_ends_hz(group[0], lowest_peak_hz(group, low_hz)) for group in parts)
        wide = min(wide, USABLE_BAND * min(group[0].sampling_rate_hz for group in parts))
        if wide > found.band_hz[1]:
            with contextlib.suppress(UserError):  # no mode in the wider band: those of the first search remain
                wider = _search(parts, layout, (low_hz, wide), source, ESTIMATORS[method])
                found = wider if len(wider.numbers) > len(found.numbers) else found
    return found


def _search(
    groups: Sequence[Sequence[FrameTest]],
    layout: Layout,
    band_hz: tuple[float, float],
    source: Path,
    estimator: Estimator,
) -> ModeSearch:
    """Return the modes of set-ups in a band."""
    set_ups, candidates, tops = [], [], []
    for group in groups:
        set_up, found, top = _set_up(group, layout, band_hz, source, estimator, alone=len(groups) == 1)
        set_ups.append(set_up)
        candidates += found
        tops.append(top)
    set_ups = confirmed(set_ups)
    merged = merge_set_ups(set_ups, source) if len(set_ups) > 1 else None
    fit = set_ups[0].fit if merged is None else merged.fit
    numbered = _numbered(fit, layout)
    notes: tuple[str, ...] = ()
    if merged is not None:
        for _ in range(_SCALINGS):  # a mode that is found in this way scales the others
            merged = replace(merged, fit=scaled_by_orthogonality(merged, list(numbered), layout))
            numbered = max(_numbered(merged.fit, layout), numbered, key=len)
        notes = scaling_notes(fit, merged.fit, list(numbered))
    if not numbered:
        raise UserError(source, "ambient tests", "no mode found", "record longer, or set identify_frame.band_high_hz")
    modes = list(numbered)
    if merged is None:
        refined = refine_by_spectra(fit.only(modes), set_ups[0].tests)
    else:
        refined = pooled_poles(merged.fit.only(modes), [
            (positions, refine_by_spectra(item.fit.only(own), item.tests))
            for item, positions, own in merged.parts(modes)
        ])  # fmt: skip
    return ModeSearch(refined, (band_hz[0], max(tops)), tuple(numbered.values()), tuple(candidates), notes)


def _numbered(fit: MultiModeFit, layout: Layout) -> dict[int, int]:
    """Return pole -> mode number (from 1): a complete set if there is one, else the largest one."""
    # copies of poles have been left out before
    chosen = complete_set(fit, layout, resolved=True)
    if chosen:
        return dict(zip(chosen, range(1, len(chosen) + 1), strict=True))
    return largest_set(fit, layout, resolved=True)


def _set_up(
    tests: Sequence[FrameTest],
    layout: Layout,
    band_hz: tuple[float, float],
    source: Path,
    estimator: Estimator,
    *,
    alone: bool,
) -> tuple[SetUp, list[PoleCandidate], float]:
    """Return the stable poles of tests with the same sensors, all candidates, and the end of the band [Hz]."""
    records = _records(tests, layout, *band_hz)
    _require_length(records, tests, band_hz[0], source)
    orders = estimator.orders(layout.modes, len(tests[0].sensors))
    weights = block_weights(records.blocks) if _share_of(tests, records) < 1.0 else np.ones(len(records.blocks))
    statistics = [
        weight * estimator.statistic(block, records) for weight, block in zip(weights, records.blocks, strict=True)
    ]
    poles = estimator.poles(np.mean(np.array(statistics), axis=0), records, orders)
    clusters = [item for item in clustered(poles) if item.angular_frequency > 2.0 * np.pi * band_hz[0]]
    most = max((item.orders for item in clusters), default=0)
    firm = [item for item in clusters if item.orders >= 0.5 * most and item.collinearity > _LEAST_COLLINEARITY]
    floors = [sensor.floor - 1 for sensor in tests[0].sensors]
    masses = np.ones(len(floors)) if layout.masses is None else layout.masses[floors]
    # with several set-ups, a pole that only one of them shows is not a mode, whatever its spectra show
    peaks = partial(two_peaks, tests, [item.pole for item in firm]) if alone else lambda *_: False
    firm, doubtful = without_copies(firm, np.sqrt(masses), peaks)
    if not firm:
        remedy = "record longer, or set identify_frame.band_high_hz"
        raise UserError(source, f"tests.{tests[0].name}", "no stable pole in an ambient test", remedy)
    covariance, errors = _jackknife(statistics, records, estimator, orders, firm)
    fit = _as_fit(tests[0], firm, covariance, errors, _response_at(tests, firm))
    found = [PoleCandidate(item.angular_frequency, item.damping_ratio, item.orders) for item in clusters]
    return SetUp(tuple(tests), fit, tuple(doubtful)), found, records.high_hz


def _share_of(tests: Sequence[FrameTest], records: Records) -> float:
    """Return the least share of a test that counts, from all sensors in the band of the analysis."""
    shares = []
    for test in tests:
        lines = np.fft.rfft(test.responses - test.responses.mean(axis=0), axis=0)
        frequency = np.fft.rfftfreq(test.responses.shape[0], 1.0 / test.sampling_rate_hz)
        inside = (frequency >= 0.5 * records.high_hz / _LARGEST_SPREAD) & (frequency <= records.high_hz)
        shares.append(effective_share(list(lines[inside].T)))
    return min(shares)


def _response_at(tests: Sequence[FrameTest], firm: Sequence[Cluster]) -> FloatArray:
    """Return the spectral amplitude of the responses at the frequency of each cluster over the median, shape (r,)."""
    test = tests[0]
    length = int(min(test.responses.shape[0], 4096))
    frequency, power = signal.welch(test.responses, fs=test.sampling_rate_hz, nperseg=length, axis=0)
    total = np.sqrt(np.sum(power, axis=1))
    floor = float(np.median(total))
    return np.array(
        [total[int(np.argmin(np.abs(2.0 * np.pi * frequency - item.angular_frequency)))] / floor for item in firm]
    )
