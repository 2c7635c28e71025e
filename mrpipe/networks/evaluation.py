"""Errors of a network: pooled, by test and by regime, in comparison with a linear model."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.networks.assembly import History, Samples, samples
from mrpipe.networks.network import Network
from mrpipe.signals.reversals import last_reversal
from mrpipe.words import in_percent

REGIMES = ("pre_yield", "reversal", "post_yield")
"""The regimes of :func:`regimes_of`, in the order of their numbers."""


@dataclass(frozen=True)
class ErrorFigures:
    """Error of an estimate of a signal.

    Attributes
    ----------
    nrmse
        Ratio of the RMS error to the RMS of the signal, over all samples.
    fit_percent
        100 (1 - |e| / |signal - mean|).
    r2
        Coefficient of determination.
    rms
        RMS of the error in the unit of the signal.
    samples
        Number of samples.
    """

    nrmse: float
    fit_percent: float
    r2: float
    rms: float
    samples: int


def error_figures(measured: FloatArray, estimated: FloatArray) -> ErrorFigures:
    """Return the error figures of an estimate, both arrays of shape (n,); NaN where they are not defined."""
    nan = float("nan")
    if not len(measured):
        return ErrorFigures(nan, nan, nan, nan, 0)
    error = estimated - measured
    square = float(error @ error)
    size = float(measured @ measured)
    spread = float(np.sum((measured - measured.mean()) ** 2))
    # a constant signal has no spread beyond rounding
    moves = spread > 1e-12 * max(size, 1e-300)
    return ErrorFigures(
        nrmse=float(np.sqrt(square / size)) if size > 0.0 else nan,
        fit_percent=100.0 * (1.0 - float(np.sqrt(square / spread))) if moves else nan,
        r2=1.0 - square / spread if moves else nan,
        rms=float(np.sqrt(square / len(measured))),
        samples=len(measured),
    )


def travel_since_reversal(displacement: FloatArray, velocity: FloatArray, starts: IntArray) -> FloatArray:
    """Return the distance [m] moved since the velocity last changed sign, shape (n,), starting at 0 in each test.

    The travel before the first reversal of a test is unknown and taken as infinite.
    """
    travel = np.empty(len(displacement))
    for first, last in pairwise(starts):
        own = displacement[first:last]
        turned = last_reversal(velocity[first:last] > 0.0)
        travel[first:last] = np.where(turned > 0, np.abs(own - own[turned]), np.inf)
    return travel


def yield_travel(history: History) -> float:
    """Return the travel after reversal [m] at which the force has on average reached nine tenths of its level.

    The force in the direction of motion, over the 95th percentile of each test, is averaged in bins of travel; its
    level is the median over the bins beyond a fifth of the largest travel. The pre-yield region ends there.
    """
    travel = travel_since_reversal(history.channels["displacement"], history.channels["velocity"], history.starts)
    scale = np.ones(history.samples)
    for index in range(len(history.names)):
        part = slice(int(history.starts[index]), int(history.starts[index + 1]))
        size = float(np.percentile(np.abs(history.channels["force"][part]), 95)) if part.stop > part.start else 0.0
        scale[part] = size if size > 0.0 else 1.0
    along = history.channels["force"] * np.sign(history.channels["velocity"]) / scale
    steady = ~np.repeat(np.array(history.drive_varies, dtype=bool), np.diff(history.starts))
    usable = np.isfinite(travel) & (steady if steady.any() else True)
    if not usable.any():
        return 0.0
    longest = float(np.percentile(travel[usable], 99))
    edges = np.linspace(0.0, longest, 201)
    bins = np.digitize(travel[usable], edges) - 1
    count = np.bincount(bins, minlength=201)[:200]
    total = np.bincount(bins, along[usable], minlength=201)[:200]
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    level = float(np.nanmedian(mean[40:]))
    reached = np.flatnonzero(mean >= 0.9 * level)
    return float(edges[reached[0] + 1]) if len(reached) else longest


def yield_time(history: History, yield_travel_m: float) -> float:
    """Return the time [s] that the mean speed of some tests needs for the travel from a reversal to yield.

    The force of a hysteresis depends on this part of the past. A network sees `past_values` samples of it.
    """
    speed = float(np.mean(np.abs(history.channels["velocity"]))) if history.samples else 0.0
    return yield_travel_m / speed if speed > 0.0 else 0.0


def regimes_of(history: History, yield_travel_m: float) -> IntArray:
    """Return the regime of each sample, a number into :data:`REGIMES`.

    Reversal: the force still has the direction of the motion before the reversal. Pre-yield: the force has the new
    direction, but the travel since the reversal is below `yield_travel_m`. Post-yield: all other samples.
    """
    travel = travel_since_reversal(history.channels["displacement"], history.channels["velocity"], history.starts)
    against = history.channels["force"] * history.channels["velocity"] < 0.0
    early = travel < yield_travel_m
    regime = np.full(history.samples, 2, dtype=np.int64)
    regime[early] = 0
    regime[early & against] = 1
    return regime


def by_regime(measured: FloatArray, estimated: FloatArray, regime: IntArray) -> dict[str, ErrorFigures]:
    """Return the error figures of each regime."""
    return {
        name: error_figures(measured[regime == number], estimated[regime == number])
        for number, name in enumerate(REGIMES)
    }


def by_test(history: History, rows: Samples, estimated: FloatArray) -> list[tuple[str, ErrorFigures]]:
    """Return the error figures of each test."""
    return [
        (name, error_figures(rows.target[rows.test == index], estimated[rows.test == index]))
        for index, name in enumerate(history.names)
    ]


def linear_baseline(training: Samples, judged: Samples) -> FloatArray:
    """Return the estimates of an affine model of the same features, which is fitted to `training` by least squares."""
    design = np.column_stack([training.features, np.ones(len(training.target))])
    scale = np.maximum(np.abs(design).max(axis=0), 1e-300)
    coefficients = np.linalg.lstsq(design / scale, training.target, rcond=1e-10)[0] / scale
    return np.asarray(judged.features @ coefficients[:-1] + coefficients[-1])


def free_run(network: Network, history: History) -> FloatArray:
    """Return the estimate in a free run, with past outputs of the network instead of measured ones, shape (n,).

    All tests are computed at the same time. The first `past_values` samples of each test are the measured ones.
    """
    spec = network.features
    past = spec.past_values
    lengths = np.diff(history.starts)
    longest = int(lengths.max())
    steps = np.minimum(np.arange(longest)[None, :], lengths[:, None] - 1) + history.starts[:-1, None]
    channels = np.stack([history.channels[name][steps] for name in spec.channels])
    output = history.channels[spec.target][steps].copy()
    if spec.absolute:
        channels, output = np.abs(channels), np.abs(output)
    for step in range(past, longest):
        window = slice(step, step - past - 1 if step > past else None, -1)
        features = [channel[:, window] for channel in channels]
        if spec.past_target and past:
            features.append(output[:, window][:, 1:])
        output[:, step] = network.predict(np.concatenate(features, axis=1))
    return np.concatenate([output[index, :length] for index, length in enumerate(lengths)])


def judge_free_run(network: Network, history: History) -> ErrorFigures | None:
    """Return the errors of :func:`free_run`, or None for a network without past outputs among its inputs."""
    if not network.features.past_target:
        return None
    return error_figures(history.channels[network.features.target], free_run(network, history))


@dataclass(frozen=True)
class Judgement:
    """Assessment of a network on the validation tests.

    Attributes
    ----------
    samples, estimated
        Validation rows, and estimates of their targets, shape (n,).
    training, pooled, linear
        Error figures on the training tests, on the validation tests, and on the validation tests for a linear model of
        the same inputs.
    constant, varying
        Error figures on the validation tests with constant and with varying drive.
    regimes, varying_regimes
        Error figures by regime, of all validation tests and of those with varying drive.
    tests
        Error figures of each validation test.
    yield_travel_m
        Travel at the end of the pre-yield regime, computed from the training tests [m].
    negative_share
        Share of estimates below zero (by more than a hundredth of the largest target).
    outside_training_range
        Share of validation rows beyond the range of the training set.
    test_varies
        Whether the drive varies within each validation test.
    """

    samples: Samples
    estimated: FloatArray
    training: ErrorFigures
    pooled: ErrorFigures
    linear: ErrorFigures
    constant: ErrorFigures
    varying: ErrorFigures
    regimes: dict[str, ErrorFigures]
    varying_regimes: dict[str, ErrorFigures]
    tests: list[tuple[str, ErrorFigures]]
    yield_travel_m: float
    negative_share: float
    outside_training_range: float
    test_varies: tuple[bool, ...]

    @property
    def finding(self) -> str:
        """Message on the validation tests for the user; empty if there is none."""
        share = self.outside_training_range
        outside = "of the validation samples lie outside the training range"
        return f"{in_percent(share, 1)} {outside}" if share > 0.01 else ""

    def rows(self, unit: str, span: float | None = None) -> list[dict[str, str | float | int]]:
        """Return the table of errors, one row for each group of samples.

        Parameters
        ----------
        unit
            Unit of the target.
        span
            Range of the target. Where it is given (drive of an inverse network) errors are also shown as a share of it,
            and relative errors are left out for groups whose target is constant within each test: the RMS of a drive
            of 0 A is not a measure of the error.
        """
        groups = [
            ("all", self.pooled),
            ("linear model, all", self.linear),
            ("constant drive", self.constant),
            ("varying drive", self.varying),
            *((name.replace("_", "-"), figures) for name, figures in self.regimes.items()),
            *((f"varying drive, {name.replace('_', '-')}", figures) for name, figures in self.varying_regimes.items()),
        ]
        return [
            {"samples of": name, **_row(figures, unit, span, varies=name != "constant drive")}
            for name, figures in groups
            if figures.samples
        ]

    def test_rows(self, unit: str, span: float | None = None) -> list[dict[str, str | float | int]]:
        """Return the table of errors of each test; the arguments are those of :meth:`rows`."""
        varies = dict(zip((name for name, _ in self.tests), self.test_varies, strict=True))
        return [{"test": name, **_row(figures, unit, span, varies=varies[name])} for name, figures in self.tests]


def _row(figures: ErrorFigures, unit: str, span: float | None, *, varies: bool) -> dict[str, str | float | int]:
    nan = float("nan")
    row: dict[str, str | float | int] = {f"RMS error [{unit}]": figures.rms}
    if span is None:
        row |= {"NRMSE": figures.nrmse, "fit [%]": figures.fit_percent, "R2": figures.r2}
    else:
        row |= {"RMS error [% of range]": 100.0 * figures.rms / span if span > 0.0 else nan}
        row |= {"R2 (varying drive)": figures.r2 if varies else nan}
    return {**row, "samples": figures.samples}


def judge(network: Network, training: History, validation: History) -> Judgement:
    """Assess a network on the validation history; the training history gives the linear model and the yield travel."""
    spec = network.features
    fitted, rows = samples(training, spec), samples(validation, spec)
    estimated = network.predict(rows.features)
    travel = yield_travel(training)
    regime = regimes_of(validation, travel)[rows.sample]
    varies = np.array(validation.drive_varies, dtype=bool)[rows.test]
    floor = 0.01 * float(np.max(np.abs(fitted.target))) if len(fitted.target) else 0.0
    return Judgement(
        samples=rows,
        estimated=estimated,
        training=error_figures(fitted.target, network.predict(fitted.features)),
        pooled=error_figures(rows.target, estimated),
        linear=error_figures(rows.target, linear_baseline(fitted, rows)),
        constant=error_figures(rows.target[~varies], estimated[~varies]),
        varying=error_figures(rows.target[varies], estimated[varies]),
        regimes=by_regime(rows.target, estimated, regime),
        varying_regimes=by_regime(rows.target[varies], estimated[varies], regime[varies]),
        tests=by_test(validation, rows, estimated),
        yield_travel_m=travel,
        negative_share=float(np.mean(estimated < -floor)) if len(estimated) else 0.0,
        outside_training_range=network.outside_training_range(rows.features),
        test_varies=tuple(validation.drive_varies),
    )
