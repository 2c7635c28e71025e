"""Modes from free decays alone: pull-and-release tests, and decays after an excitation that was not measured.

After the release each response is a sum of decaying sinusoids. The eigensystem realisation algorithm (ERA) finds their
poles at many model orders from the block Hankel matrix of all tests. Those that repeat are candidates, and the choice
among them is that of the forced tests. Frequencies and damping ratios are then fitted to all sensors of all tests by
variable projection. The shape of a mode is the leading singular vector of its amplitudes in all tests.

Sources: Juang and Pappa (1985), An eigensystem realization algorithm for modal parameter identification and model
reduction, Journal of Guidance, Control, and Dynamics 8; Golub and Pereyra (1973), The differentiation of
pseudo-inverses and nonlinear least squares problems whose variables separate, SIAM Journal on Numerical Analysis 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import signal, stats
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.ambient.band import USABLE_BAND
from mrpipe.modal.ambient.clusters import Cluster, clustered, without_copies
from mrpipe.modal.ambient.poles import Records, physical
from mrpipe.modal.decays.decay import damped_sinusoids, decay_start
from mrpipe.modal.fit.lscf import PoleCandidate
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.forced_modes import ModeSearch
from mrpipe.modal.search.selection import Layout, complete_set, largest_set
from mrpipe.modal.spectra import ComplexArray

_SPREAD = 4.0
_PERIODS = 1.5
_LEAST_ROWS = 20
_MOST_ROWS = 80
_LEAST_PERIODS = 6.0
"""Least length of a decay in periods of its strongest line."""
_SKIPPED = 10
"""Samples after the release that the filter of the resampling changes."""
_MOST_COLUMNS = 3000
_ORDERS = 16
_FALSE_MODE = 1e-3
"""Probability that noise alone gives a mode."""
_FADED = 2.0
"""A decay ends where its energy is this multiple of that of the end of the record."""


@dataclass(frozen=True)
class _Decays:
    """Parts of the tests after the release, each (m, s), their rate, lowest peak and end of the band [Hz]."""

    parts: tuple[FloatArray, ...]
    rate_hz: float
    first_hz: float
    high_hz: float


def find_decay_modes(
    tests: Sequence[FrameTest], layout: Layout, low_hz: float, high_hz: float, source: Path
) -> ModeSearch:
    """Return the modes that free decays show.

    Parameters
    ----------
    tests
        Decay tests. Those with the sensors and the sampling rate of most of them are used.
    layout
        Floors and masses.
    low_hz, high_hz
        Band [Hz]; 0 for `high_hz`: a band that follows from the lowest peak and the number of floors.
    source
        campaign.yaml, for messages.

    Raises
    ------
    UserError
        If the decays are too short, or no mode is found.
    """
    groups: dict[object, list[FrameTest]] = {}
    for test in tests:
        groups.setdefault((test.sensors, test.sampling_rate_hz), []).append(test)
    used = max(groups.values(), key=lambda group: (len(group), len(group[0].sensors)))
    notes = tuple(
        f"test {test.name}: its sensors or its sampling rate differ from those of test {used[0].name}; it was left out"
        for test in tests
        if all(test is not other for other in used)
    )
    decays = _decays(used, layout, low_hz, high_hz, source)
    clusters = _candidates(decays, layout, low_hz)
    most = max((item.orders for item in clusters), default=0)
    firm = [item for item in clusters if item.orders >= 0.5 * most]
    firm, _ = without_copies(firm, np.ones(len(used[0].sensors)), lambda *_: False)
    found = [PoleCandidate(item.angular_frequency, item.damping_ratio, item.orders) for item in clusters]
    fit = _fitted(decays, _significant(decays, firm), used[0])
    numbered = _numbered(fit, layout) if fit is not None else {}
    if fit is None or not numbered:
        remedy = "pull at other floors, or set identify_frame.band_low_hz and identify_frame.band_high_hz"
        raise UserError(source, "free decays", "no mode found", remedy)
    band = (low_hz, decays.high_hz)
    return ModeSearch(fit.only(list(numbered)), band, tuple(numbered.values()), tuple(found), notes)


def _numbered(fit: MultiModeFit, layout: Layout) -> dict[int, int]:
    chosen = complete_set(fit, layout, resolved=True)
    if chosen:
        return dict(zip(chosen, range(1, len(chosen) + 1), strict=True))
    return largest_set(fit, layout, resolved=True)


def _decays(tests: Sequence[FrameTest], layout: Layout, low_hz: float, high_hz: float, source: Path) -> _Decays:
    """Cut the tests after their release, and reduce their rate to the band of a chain of floors.

    Raises
    ------
    UserError
        If a decay is shorter than a few periods.
    """
    rate = tests[0].sampling_rate_hz
    starts = [_release(test, low_hz) for test in tests]
    first = min(
        _lowest_peak_hz(test.responses[start:], rate, low_hz) for test, start in zip(tests, starts, strict=True)
    )
    # the highest mode of a uniform chain lies (4 n + 2)/pi above the lowest; real ones spread more
    high = high_hz or min(_SPREAD * (4.0 * layout.floors + 2.0) / np.pi * first, USABLE_BAND * rate)
    factor = max(1, int(rate / (2.6 * high)))
    parts = []
    for test, start in zip(tests, starts, strict=True):
        values = _accelerations(test, first)
        if factor > 1:
            values = signal.resample_poly(values - values[-1], 1, factor, axis=0)
            start = -(-start // factor) + _SKIPPED  # the filter mixes samples before and after the release
        part = _until_faded(values[start:], round(rate / factor / first))
        if part.shape[0] < _LEAST_PERIODS * rate / factor / first:
            place, lasts = f"tests.{test.name}", part.shape[0] * factor / rate
            problem = f"its free decay lasts {lasts:.3g} s, {lasts * first:.2g} periods of its lowest peak"
            remedy = f"record at least {_LEAST_PERIODS:g} periods ({_LEAST_PERIODS / first:.3g} s) after the release"
            raise UserError(source, place, problem, remedy)
        parts.append(part - part[-max(1, part.shape[0] // 10) :].mean(axis=0))
    return _Decays(tuple(parts), rate / factor, first, high)


def _accelerations(test: FrameTest, first_hz: float) -> FloatArray:
    """Return responses without their mean; displacements are scaled to the size of accelerations, shape (m, s)."""
    scale = np.where(test.is_displacement, -((2.0 * np.pi * first_hz) ** 2), 1.0)
    return np.asarray((test.responses - test.responses.mean(axis=0)) * scale)


def _spectrum(values: FloatArray, rate: float, low_hz: float) -> tuple[FloatArray, FloatArray]:
    """Return frequencies [Hz] and the sum of the power of all sensors, each over its total above `low_hz`."""
    # the window falls from the beginning, where a decay is strongest
    values = signal.detrend(values, axis=0) * np.hanning(2 * values.shape[0])[values.shape[0] :, None]
    power = np.abs(np.fft.rfft(values, axis=0)) ** 2
    frequency = np.fft.rfftfreq(values.shape[0], 1.0 / rate)
    # a decay that was cut, or an offset before the release, leaves power near zero
    power[frequency < max(low_hz, 4.0 * rate / values.shape[0])] = 0.0
    total = np.sum(power / np.maximum(power.sum(axis=0), 1e-300), axis=1)
    return np.asarray(frequency, dtype=np.float64), np.asarray(total)


def _lowest_peak_hz(values: FloatArray, rate: float, low_hz: float) -> float:
    """Return the frequency of the lowest clear peak of a free decay [Hz]."""
    frequency, power = _spectrum(values, rate, low_hz)
    peaks = signal.find_peaks(power, height=0.05 * power.max())[0]
    return float(frequency[peaks[0] if peaks.size else int(np.argmax(power))])


def _release(test: FrameTest, low_hz: float) -> int:
    """Return the sample from which a test vibrates freely.

    It is where the measured excitation stops, or where the energy is largest: just after the release, because no mode
    has decayed yet. For a displacement the energy is that of its change, because it is constant before the release.
    """
    rate = test.sampling_rate_hz
    # before the release a displacement is constant; the step would hide the lines
    changing = np.where(test.is_displacement, np.gradient(test.responses, axis=0), test.responses)
    frequency, power = _spectrum(changing, rate, low_hz)
    strongest = float(frequency[int(np.argmax(power))])
    period = max(8, round(rate / strongest))
    values = test.responses - test.responses.mean(axis=0)
    if test.excitation is not None and np.ptp(test.excitation) > 0.0:
        loudest = int(np.argmax(values.std(axis=0)))
        return decay_start(test, values[:, loudest], 2.0 * np.pi * strongest) + period // 4
    step = period // 8
    change = np.zeros_like(values)
    change[step:-step] = values[2 * step :] - values[: -2 * step]
    moving = np.where(test.is_displacement, change, values)
    energy = np.sum((moving / np.maximum(moving.std(axis=0), 1e-300)) ** 2, axis=1)
    return int(np.argmax(energy)) + (step if any(test.is_displacement) else max(2, period // 16))


def _until_faded(values: FloatArray, period: int) -> FloatArray:
    """Return a decay as long as its energy exceeds that of the end of the record."""
    energy = np.convolve(np.sum(values**2, axis=1), np.full(period, 1.0 / period), mode="same")
    tail = energy[-max(1, energy.size // 10) :].mean()
    # a decay that is cut while it still rings has no end
    if energy.size and tail < 0.01 * energy.max():
        below = np.flatnonzero(energy < _FADED * tail)
        return values[: int(below[0])] if below.size else values
    return values


def _candidates(decays: _Decays, layout: Layout, low_hz: float) -> list[Cluster]:
    """Return the clusters of poles that ERA finds at many model orders."""
    rows = int(np.clip(round(_PERIODS * decays.rate_hz / decays.first_hz), _LEAST_ROWS, _MOST_ROWS))
    rows = min(rows, min(part.shape[0] for part in decays.parts) // 3)
    blocks = []
    for part in decays.parts:
        columns = min(part.shape[0] - rows, _MOST_COLUMNS)
        blocks.append(np.vstack([part[i : i + columns].T for i in range(rows)]))
    # the left factor of the singular value decomposition is that of the triangular factor
    triangle = np.transpose(np.linalg.qr(np.hstack(blocks).T, mode="r"))
    left, size, _ = np.linalg.svd(triangle)
    sensors = decays.parts[0].shape[1]
    records = Records(tuple(part.T for part in decays.parts), decays.rate_hz, rows, decays.high_hz)
    poles = []
    for order in range(2 * layout.modes, 2 * layout.modes + 2 * _ORDERS, 2):
        if order > min(size.size, (rows - 1) * sensors):
            break
        observed = left[:, :order] * np.sqrt(size[:order])
        state = np.linalg.lstsq(observed[:-sensors], observed[sensors:], rcond=None)[0]
        values, vectors = np.linalg.eig(state)
        moving = np.abs(values) > 0.0
        exponents = np.log(values[moving].astype(np.complex128)) * decays.rate_hz
        poles += physical(np.asarray(exponents), observed[:sensors] @ vectors[:, moving], order, records)
    return [item for item in clustered(poles) if item.angular_frequency > 2.0 * np.pi * low_hz]


def _significant(decays: _Decays, firm: Sequence[Cluster]) -> list[Cluster]:
    """Return the candidates without those that only fit noise, the least significant one left out first.

    A wave of each test and sensor, with a frequency and a damping ratio that were searched for, reduces the misfit to
    white noise by a chi-squared variable of that many parameters; the search had as many independent frequencies as
    the record has samples.
    """
    kept = list(firm)
    while kept:
        omega, zeta = (np.array([item.pole[i] for item in kept]) for i in (0, 1))
        whole = _projected(decays, omega, zeta).residuals
        noise = np.maximum(np.std(np.vstack(whole), axis=0), 1e-300)
        freedom = 2 * sum(part.shape[1] for part in decays.parts) + 2
        samples = sum(part.shape[0] for part in decays.parts)
        gains = []
        for mode in range(len(kept)):
            rest = np.arange(len(kept)) != mode
            less = _projected(decays, omega[rest], zeta[rest]).residuals
            gains.append(
                sum(float(np.sum((a / noise) ** 2 - (b / noise) ** 2)) for a, b in zip(less, whole, strict=True))
            )
        weakest = int(np.argmin(gains))
        if samples * stats.chi2.sf(gains[weakest], freedom) < _FALSE_MODE:
            break
        kept.pop(weakest)
    return kept


@dataclass(frozen=True)
class _Projection:
    """Fit of decaying sinusoids to all tests at given poles; residuals of each test, shape (m, s)."""

    coefficients: tuple[FloatArray, ...]
    residuals: tuple[FloatArray, ...]
    inverses: tuple[FloatArray, ...]


def _projected(decays: _Decays, omega: FloatArray, zeta: FloatArray) -> _Projection:
    coefficients, residuals, inverses = [], [], []
    for part in decays.parts:
        basis = damped_sinusoids(np.arange(part.shape[0]) / decays.rate_hz, omega, zeta)
        own = np.linalg.lstsq(basis, part, rcond=None)[0]
        coefficients.append(np.asarray(own, dtype=np.float64))
        residuals.append(np.asarray(part - basis @ own, dtype=np.float64))
        inverses.append(np.asarray(np.linalg.pinv(basis.T @ basis), dtype=np.float64))
    return _Projection(tuple(coefficients), tuple(residuals), tuple(inverses))


def _fitted(decays: _Decays, firm: Sequence[Cluster], test: FrameTest) -> MultiModeFit | None:
    """Return the least-squares fit of all candidates, sorted by frequency; None without candidates."""
    if not firm:
        return None
    modes = len(firm)
    start = np.log([[item.angular_frequency for item in firm], [item.damping_ratio for item in firm]]).ravel()
    first = _projected(decays, *np.exp(start.reshape(2, modes)))
    noise = np.sqrt(np.mean(np.vstack(first.residuals) ** 2, axis=0))
    noise = np.maximum(noise, 1e-9 * max(float(np.abs(part).max()) for part in decays.parts))

    def misfit(theta: FloatArray) -> FloatArray:
        found = _projected(decays, *np.exp(theta.reshape(2, modes)))
        return np.concatenate([(item / noise).ravel() for item in found.residuals])

    reach = np.repeat([0.02, 3.0], modes)
    bounds = (start - reach, np.minimum(start + reach, np.repeat([np.inf, np.log(0.5)], modes)))
    solved = least_squares(misfit, start, bounds=bounds, x_scale="jac", diff_step=1e-5, max_nfev=30)
    omega, zeta = np.exp(solved.x.reshape(2, modes))
    covariance = _covariance(decays, solved.jac, solved.fun)
    return _as_fit(decays, omega, zeta, covariance, test)


def _covariance(decays: _Decays, slope: FloatArray, misfit: FloatArray) -> FloatArray:
    """Return the covariance of (ln omega, ln zeta), robust to noise that is correlated within a period."""
    inverse = np.linalg.pinv(slope.T @ slope)
    block = max(1, round(decays.rate_hz / decays.first_hz)) * decays.parts[0].shape[1]
    meat = np.zeros_like(inverse)
    begin = 0
    for part in decays.parts:
        scores = (slope * misfit[:, None])[begin : begin + part.size]
        begin += part.size
        sums = np.add.reduceat(scores, np.arange(0, part.size, block), axis=0)
        meat += sums.T @ sums
    robust = inverse @ meat @ inverse
    plain = inverse * float(misfit @ misfit) / max(misfit.size - slope.shape[1], 1)
    # the larger of the two errors of each pole, because few periods give an uncertain robust one
    ratio = np.sqrt(np.maximum(np.diag(robust) / np.maximum(np.diag(plain), 1e-300), 1.0))
    return np.asarray(plain * np.outer(ratio, ratio))


def _as_fit(
    decays: _Decays, omega: FloatArray, zeta: FloatArray, covariance: FloatArray, test: FrameTest
) -> MultiModeFit:
    """Return poles and shapes; a shape is scaled by the amplitude of the mode in the tests."""
    found = _projected(decays, omega, zeta)
    noise = np.sqrt(np.mean(np.vstack(found.residuals) ** 2, axis=0))
    noise = np.maximum(noise, 1e-12 * max(float(np.abs(part).max()) for part in decays.parts))
    shapes, errors, quality = [], [], []
    for mode in range(omega.size):
        place = 1 + 2 * mode
        amplitudes = np.array([own[place] - 1j * own[place + 1] for own in found.coefficients])
        units = np.sqrt([inverse[place, place] for inverse in found.inverses])
        shape, error = _shape(np.asarray(amplitudes / units[:, None], dtype=np.complex128), noise)
        # a displacement was scaled with the lowest frequency; its acceleration follows from that of the mode
        scale = np.where(test.is_displacement, (omega[mode] / (2.0 * np.pi * decays.first_hz)) ** 2, 1.0)
        shapes.append(scale * shape)
        errors.append(scale * error)
        signal_power = float(np.sum(np.abs(shape) ** 2))
        quality.append(signal_power / (signal_power + float(np.sum(error**2))))
    order = np.argsort(omega)
    both = np.concatenate([order, omega.size + order])
    sensors = len(test.sensors)
    empty: tuple[ComplexArray, ...] = ()
    damping = 2.0 * zeta[order]
    return MultiModeFit(
        angular_frequencies=omega[order],
        damping_ratios=zeta[order],
        covariance=covariance[np.ix_(both, both)],
        residues=np.array(shapes)[order].T * damping,
        residue_errors=np.array(errors)[order].T * damping,
        coherence=np.tile(np.array(quality)[order], (sensors, 1)),
        steady=empty,
        measured=empty,
        omega=(),
        excitation=empty,
        noise_variance=np.ones(sensors),
        sensors=test.sensors,
        participations=np.ones((1, omega.size), dtype=np.complex128),
        input_residues=np.full((sensors, 1, omega.size), np.nan, dtype=np.complex128),
    )


def _shape(amplitudes: ComplexArray, noise: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return the shape of a mode, turned to be as real as it can be, and its errors, shape (s,) each.

    Parameters
    ----------
    amplitudes
        In each test over their standard error for unit noise, shape (t, s).
    noise
        Standard deviation of the noise of each sensor, shape (s,).
    """
    _, size, right = np.linalg.svd(amplitudes / noise, full_matrices=False)
    shape = size[0] * right[0] * noise
    shape = shape * np.exp(-0.5j * np.angle(np.sum(shape**2)))
    # what the other singular values hold is not proportional to this shape in all tests
    freedom = max(2 * (amplitudes.shape[0] - 1) * amplitudes.shape[1], 1)
    excess = max(1.0, float(np.sum(size[1:] ** 2)) / freedom * 2.0)
    return np.asarray(shape), np.asarray(noise * np.sqrt(excess))
