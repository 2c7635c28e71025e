"""Differences between validation tests and training tests: gain, lag, offset, range of motion and drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.campaigns.plausibility import Finding
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.recordings import Recordings
from mrpipe.signals.error_size import rms
from mrpipe.tracing.bench.residuals.crossvalidation import left_out_residual
from mrpipe.tracing.bench.residuals.nuisances import SessionGain
from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.verdict import Difference
from mrpipe.words import in_percent

LAGS = 41
"""Numerical technique: number of lags on the grid; the best lag is refined by a parabola."""

RANGES = {"displacement": "amplitude", "velocity": "speed", "drive": "drive"}
"""Channel -> kind of difference if a test exceeds the range of the training tests."""


@dataclass(frozen=True)
class Agreement:
    """Relation of measured and simulated force on one test: measured(t) = gain * simulated(t - lag) + offset.

    Attributes
    ----------
    name
        Name of the test.
    rms_n
        RMS of the measured, offset-free force [N].
    error_n
        RMS of measured minus simulated force [N].
    rest_n, corrected_n
        RMS error over the rest of the record, which was not used for the estimate [N]: without correction, and after
        correction of gain, lag and offset, which are estimated from the first part.
    gain, lag_s, offset_n
        Estimates from the first part of the record [1, s, N].
    """

    name: str
    rms_n: float
    error_n: float
    rest_n: float
    corrected_n: float
    gain: float
    lag_s: float
    offset_n: float

    @property
    def error(self) -> float:
        """RMS error over RMS force [1]."""
        return self.error_n / max(self.rms_n, 1e-12)


def first_parts(recordings: Recordings, share: float) -> BoolArray:
    """Return the samples in the first part of each record, among those that are compared, shape (n,) of bool."""
    found = np.zeros(len(recordings.force), dtype=np.bool_)
    for test in range(recordings.tests):
        own = np.flatnonzero(recordings.used & (recordings.test == test))
        found[own[: int(share * len(own))]] = True
    return found


def agreements(
    recordings: Recordings, measured: FloatArray, simulated: FloatArray, rules: ValidationRules
) -> tuple[Agreement, ...]:
    """Return how measured and simulated force [N], shape (n,), agree on each test."""
    first = first_parts(recordings, rules.first_part)
    found = []
    for test, name in enumerate(recordings.names):
        own = recordings.used & (recordings.test == test)
        early, late = np.flatnonzero(own & first), np.flatnonzero(own & ~first)
        if len(early) < LAGS or len(late) < LAGS:
            continue
        piece = slice(int(recordings.starts[test]), int(recordings.starts[test + 1]))
        time, force = recordings.time[piece], simulated[piece]
        longest = rules.lag_periods * _mean_period(recordings, piece)
        gain, lag, offset = _relation(time, force, recordings.time[early], measured[early], longest)
        predicted = gain * np.interp(recordings.time[late] - lag, time, force) + offset
        found.append(
            Agreement(
                name,
                rms(measured[own]),
                rms((measured - simulated)[own]),
                rms((measured - simulated)[late]),
                rms(measured[late] - predicted),
                gain,
                lag,
                offset,
            )
        )
    return tuple(found)


def _relation(
    time: FloatArray, simulated: FloatArray, at: FloatArray, measured: FloatArray, longest_s: float
) -> tuple[float, float, float]:
    """Return gain, lag [s] and offset [N] of least squared error; the lag is between -`longest_s` and `longest_s`."""

    def solved(lag: float) -> tuple[float, float, float]:
        shifted = np.interp(at - lag, time, simulated)
        centred = shifted - np.mean(shifted)
        gain = float(centred @ measured) / max(float(centred @ centred), 1e-300)
        offset = float(np.mean(measured) - gain * np.mean(shifted))
        return float(np.mean((measured - gain * shifted - offset) ** 2)), gain, offset

    lags = np.linspace(-longest_s, longest_s, LAGS)
    errors = np.array([solved(lag)[0] for lag in lags])
    best = int(np.argmin(errors))
    lag = float(lags[best])
    if 0 < best < LAGS - 1:
        left, middle, right = errors[best - 1 : best + 2]
        curve = left - 2.0 * middle + right
        if curve > 0.0:
            lag += float(0.5 * (left - right) / curve * (lags[1] - lags[0]))
    if solved(0.0)[0] <= solved(lag)[0]:
        lag = 0.0
    _, gain, offset = solved(lag)
    return gain, lag, offset


def _mean_period(recordings: Recordings, piece: slice) -> float:
    x, v = recordings.displacement[piece], recordings.velocity[piece]
    return float(2.0 * np.pi * np.std(x) / max(float(np.std(v)), 1e-12))


def training_agreements(found: Fit, folds: int, rules: ValidationRules, *, jobs: int = 1) -> tuple[Agreement, ...]:
    """Return the agreement of every training test with a fit without this test."""
    recordings, root = found.problem.recordings, found.problem.root_weight
    left = left_out_residual(found, folds, jobs=jobs)
    error = np.divide(left, root, out=np.zeros_like(root), where=root > 0.0)
    measured = recordings.force - found.test_offsets[recordings.test]
    seen = replace(recordings, used=recordings.used & (left != 0.0))
    return agreements(seen, measured, measured - error, rules)


@dataclass(frozen=True)
class Comparison:
    """Result of the comparison of validation tests with training tests.

    Attributes
    ----------
    differences
        Differences between the validation tests and the training tests.
    comparable
        Samples within the range of the training tests, of tests without a difference of gain, lag or offset, shape
        (n,).
    accounted
        Share of the squared error beyond noise that occurs in tests with a difference.
    corrected
        NRMSE of all validation tests after correction of gain, lag and offset of the odd ones; None if no test is odd.
    """

    differences: tuple[Difference, ...]
    comparable: BoolArray
    accounted: float
    corrected: float | None


def compare(
    validation: Recordings,
    measured: FloatArray,
    simulated: FloatArray,
    floor: FloatArray,
    known: Recordings,
    trained: Sequence[Agreement],
    faults: Mapping[str, Finding],
    rules: ValidationRules,
) -> Comparison:
    """Compare the validation tests with the training tests.

    Parameters
    ----------
    validation, measured, simulated
        Validation tests, their offset-free force and the simulated one [N], shape (n,).
    floor
        Standard deviation of the force that noise explains [N], shape (n,).
    known
        The training tests.
    trained
        Agreement of each training test with a fit without this test.
    faults
        Known faults of validation tests, by the name of the test.
    rules
        Decision thresholds.
    """
    typical = float(np.median([item.error for item in trained])) if trained else 0.0
    high = float(np.quantile([item.error for item in trained], rules.worst_share)) if trained else 0.0
    used, squares = validation.used, (measured - simulated) ** 2
    comparable = used.copy()
    kinds: dict[str, list[tuple[str, float]]] = {}
    known_faults: list[Difference] = []
    odd_squares, corrected_squares = 0.0, 0.0
    corrections = False
    whole = float(np.sum((squares - floor**2)[used]))
    for item in agreements(validation, measured, simulated, rules):
        own = used & (validation.test == validation.names.index(item.name))
        noise = rms(floor[own])
        expected = max(typical * item.rms_n, noise)
        if item.error_n <= rules.odd_ratio * max(high * item.rms_n, noise):
            corrected_squares += float(np.sum(squares[own]))
            continue
        inside = own & covered_samples(validation, known, rules)
        fault = faults.get(item.name)
        causes = _causes(item, trained, expected, rules)
        ranges = _ranges(validation, known, own, inside, squares, expected, rules) if not (causes or fault) else []
        if fault:
            known_faults.append(_fault(fault, item))
        if causes:
            corrections = True
            corrected_squares += item.corrected_n**2 * int(np.count_nonzero(own))
        else:
            corrected_squares += float(np.sum(squares[own]))
        if causes or fault:
            comparable &= ~own
        elif ranges:
            comparable &= ~(own & ~inside)
        if causes or ranges or fault:
            odd_squares += float(np.sum((squares - floor**2)[own]))
        for kind, value in [] if fault else [*causes, *ranges]:
            kinds.setdefault(kind, []).append((item.name, value))
    power = float(np.sum(measured[used] ** 2))
    return Comparison(
        (*known_faults, *(_difference(kind, found, validation.tests) for kind, found in kinds.items())),
        comparable,
        odd_squares / whole if whole > 0.0 else 0.0,
        float(np.sqrt(corrected_squares / max(power, 1e-300))) if corrections else None,
    )


def with_session(
    compared: Comparison, session: SessionGain | None, validation: Recordings, floor: float, rules: ValidationRules
) -> Comparison:
    """Return a comparison with the gain of a session, if that gain accounts for most of the error beyond noise.

    The gain of a single record may lie within the scatter of the training tests, while the common gain of several
    records does not.

    Parameters
    ----------
    compared
        Comparison of single tests.
    session
        Gain that several validation tests share; None if there is none.
    validation
        Validation tests.
    floor
        NRMSE that noise alone causes.
    rules
        Decision thresholds.
    """
    if session is None:
        return compared
    share = (session.without**2 - session.with_it**2) / max(session.without**2 - floor**2, 1e-300)
    if share < rules.accounts or (compared.differences and compared.accounted >= rules.accounts):
        return compared
    odd = np.isin(validation.test, [validation.names.index(name) for name in session.tests])
    difference = _difference("gain", [(name, session.value) for name in session.tests], validation.tests)
    return Comparison((difference,), validation.used & ~odd, min(share, 1.0), session.with_it)


def _fault(finding: Finding, item: Agreement) -> Difference:
    """Return a known fault as a difference; its value is the gain of the test."""
    return Difference(finding.name, (item.name,), item.gain, "1", f"{item.name}: {finding.sentence}")


def _causes(
    item: Agreement, trained: Sequence[Agreement], expected: float, rules: ValidationRules
) -> list[tuple[str, float]]:
    """Return gain, lag and offset of an odd test, if correcting them removes most of its error."""
    excess = item.rest_n**2 - expected**2
    if excess <= 0.0 or item.rest_n**2 - item.corrected_n**2 < rules.accounts * excess:
        return []
    found = []
    for kind, value, neutral, least in (
        ("gain", item.gain, 1.0, rules.deviation),
        ("lag", item.lag_s, 0.0, 0.0),
        ("offset", item.offset_n, 0.0, rules.deviation * item.rms_n),
    ):
        name = {"gain": "gain", "lag": "lag_s", "offset": "offset_n"}[kind]
        others = np.array([getattr(other, name) for other in trained]) if trained else np.array([neutral])
        distance = abs(value - float(np.median(others)))
        if distance > max(rules.spreads * float(np.std(others)), least, 1e-9):
            found.append((kind, value))
    return found


def _ranges(
    validation: Recordings,
    known: Recordings,
    own: BoolArray,
    inside: BoolArray,
    squares: FloatArray,
    expected: float,
    rules: ValidationRules,
) -> list[tuple[str, float]]:
    """Return the ranges of the training tests that an odd test exceeds, if its error occurs outside of them."""
    beyond = own & ~inside
    if np.count_nonzero(beyond) < rules.outside * np.count_nonzero(own):
        return []
    outside_excess = float(np.sum(squares[beyond] - expected**2))
    if outside_excess < rules.accounts * float(np.sum(squares[own] - expected**2)):
        return []
    found = []
    for channel, kind in RANGES.items():
        share = float(np.mean(~_within(validation, known, channel, rules)[own]))
        if share > rules.outside:
            found.append((kind, share))
    return found


def covered_samples(other: Recordings, known: Recordings, rules: ValidationRules) -> BoolArray:
    """Return the samples of `other` whose motion and drive the known tests cover, shape (n of other,)."""
    inside = np.ones(len(other.force), dtype=np.bool_)
    for channel in RANGES:
        inside &= _within(other, known, channel, rules)
    return inside


def _within(other: Recordings, known: Recordings, channel: str, rules: ValidationRules) -> BoolArray:
    have, ask = getattr(known, channel), getattr(other, channel)
    margin = rules.margin * float(np.ptp(have))
    inside = (ask >= np.min(have) - margin) & (ask <= np.max(have) + margin)
    if channel == "drive":
        inside &= _near_a_level(ask, known, rules)
    return np.asarray(inside)


def _near_a_level(drive: FloatArray, known: Recordings, rules: ValidationRules) -> BoolArray:
    """Return the samples with a drive near a level of the training tests; all if their drive varies within a test."""
    pieces = [known.drive[a:b] for a, b in zip(known.starts[:-1], known.starts[1:], strict=True)]
    largest = max(float(np.max(np.abs(known.drive))), 1e-12)
    if any(float(np.ptp(piece)) > rules.level * largest for piece in pieces):
        return np.ones(len(drive), dtype=np.bool_)
    levels = np.unique(np.round([float(np.mean(piece)) / largest for piece in pieces], 3)) * largest
    distance = np.min(np.abs(drive[:, None] - levels[None, :]), axis=1)
    return np.asarray(distance <= rules.level * largest)


_WORDS = {
    "gain": ("the measured force is {0:.3g} times the simulated one", "1"),
    "lag": ("the measured force is {0:.3g} s later than the simulated one", "s"),
    "offset": ("the measured force has an offset of {0:.3g} N that the training tests do not have", "N"),
    "drive": ("{1} of the samples have a drive that no training test has", "1"),
    "amplitude": ("{1} of the samples lie beyond the displacements of the training tests", "1"),
    "speed": ("{1} of the samples lie beyond the velocities of the training tests", "1"),
}


def _difference(kind: str, found: Sequence[tuple[str, float]], tests: int) -> Difference:
    names = tuple(name for name, _ in found)
    value = float(np.median([value for _, value in found]))
    words, unit = _WORDS[kind]
    where = "all validation tests" if len(names) == tests > 1 else ", ".join(names)
    session = " (another session)" if len(names) == tests > 1 and kind in ("gain", "lag", "offset") else ""
    return Difference(kind, names, value, unit, f"{where}: {words.format(value, in_percent(value))}{session}")
