"""The damper in a structure: tracing of closed-loop tests like bench tests, and compliance of a flexible brace.

A brace stretches with the force, so that the rod of the damper moves less than the floor: rod = floor - compliance x
force. The elongation is computed from the measured force, after a low-pass, because its noise would otherwise be
differentiated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns.model import Campaign
from mrpipe.effects.contract import Effect
from mrpipe.fitting.engine import Fit, predict
from mrpipe.fitting.recordings import enough_tests, record_tests
from mrpipe.signals.error_size import rms
from mrpipe.signals.filters import butterworth_lowpass
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import prepare_campaign
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.rules import BraceRules

STRETCH_HARMONICS = 30.0
"""Numerical technique: cut-off of the force before the elongation is computed, in multiples of the mean frequency of
the motion. The force of a damper that switches between levels has harmonics far above the motion.
"""

OF_RATE = 0.3
"""Numerical technique: highest cut-off frequency, as a share of the sampling rate."""

SEARCHED_CYCLES = 9.0
"""Numerical technique: cycles of motion of each test with which the compliance is searched; more only cost time."""

JUDGED_CYCLES = 32.0
"""Numerical technique: cycles of motion of each validation test with which the errors are computed."""

PIECES = 12
"""Numerical technique: least number of pieces into which closed-loop tests are cut."""

SHARES = (0.01, 0.03, 0.08, 0.2, 0.4)
"""Numerical technique: compliances that are tried first, in multiples of stroke over RMS force."""

WORSE = 1.5
"""Numerical technique: the search stops at a compliance whose mean squared error is this multiple of the least one."""

RESOLUTION, LEAST_RESOLVED = 0.05, 0.005
"""Numerical technique: relative spacing at which the search ends, and the least compliance that it refers to."""


@dataclass(frozen=True)
class BraceFinding:
    """The compliance of least error of a spring between floor and damper.

    Attributes
    ----------
    compliance_m_n, interval
        Compliance of least error and its interval [m/N].
    rigid, chi_square, noise
        Mean squared error with a rigid brace, with this one, and of noise alone [N^2].
    nrmse_before, nrmse_after
        NRMSE on validation tests with a rigid brace and with this one.
    """

    compliance_m_n: float
    interval: tuple[float, float]
    rigid: float
    chi_square: float
    noise: float
    nrmse_before: float
    nrmse_after: float

    @property
    def share(self) -> float:
        """Share of the recoverable residual that it explains."""
        return (self.rigid - self.chi_square) / max(self.rigid - self.noise, 1e-12)

    def strong(self, rules: BraceRules) -> bool:
        """Return whether the brace explains so much that an effect of the damper must explain as much by itself."""
        return self.share > rules.strong_share and self.nrmse_after < rules.better * self.nrmse_before


def prepared_loops(campaign: Campaign, rules: BraceRules | None = None) -> list[PreparedTest]:
    """Return closed-loop tests, given as a bench campaign, after the same preparation as bench tests.

    Tests whose RMS rod motion is below `rules.least_motion` times its noise are skipped, because they carry no
    information on the damper. They are kept if no training test or no validation test would remain.
    """
    least = (rules or BraceRules()).least_motion
    noises = {
        item.name: (
            float(item.details.get("displacement_noise_m", 0.0)),
            float(item.details.get("displacement_noise_band_hz", 0.0)),
        )
        for item in campaign.recordings
    }
    tests = [
        replace(item.test, displacement_noise_m=noise, displacement_noise_band_hz=band)
        for item in prepare_campaign(campaign, PreparationOptions()).tests
        for noise, band in [noises.get(item.test.name, (0.0, 0.0))]
    ]
    moved = [test for test in tests if np.std(test.displacement_m) > least * test.displacement_noise_m]
    whole = {test.role == "validation" for test in moved} == {True, False}
    return moved if whole else tests


def trace_damper(
    tests: Sequence[PreparedTest],
    effects: Mapping[str, Effect],
    declared: Sequence[Effect],
    options: TracingOptions,
    *,
    rng: np.random.Generator,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Tracing:
    """Trace the residual of the damper on prepared closed-loop tests, as on a bench.

    Closed-loop campaigns have few long tests, bench campaigns many short ones. The long tests are cut into pieces, so
    that forms can be tried on some of the pieces, and the tracing takes no longer than on a bench.
    """
    training = enough_tests([item for item in tests if item.role != "validation"], PIECES)
    judged = [item for item in tests if item.role == "validation"]
    return trace_campaign([*training, *judged], effects, declared, options, rng=rng, jobs=jobs, progress=progress)


def find_brace(
    tests: Sequence[PreparedTest],
    options: TracingOptions,
    declared: Sequence[Effect],
    rules: BraceRules | None = None,
) -> BraceFinding:
    """Search the compliance of a brace; the base model is fitted again for each compliance.

    Parameters
    ----------
    tests
        Prepared closed-loop tests.
    options
        Options of the fit of the base model.
    declared
        Effects of the damper that the campaign declares.
    rules
        Decision thresholds; their defaults if None.
    """
    rules = rules or BraceRules()
    training = enough_tests([item for item in tests if item.role != "validation"])
    validation = [item for item in tests if item.role == "validation"]
    force = float(np.sqrt(np.mean(np.concatenate([item.force_n for item in training]) ** 2)))
    stroke = max(0.5 * float(np.ptp(item.displacement_m)) for item in training)
    unit = stroke / force
    period = float(np.median([mean_period(item) for item in training]))
    tried: dict[float, Fit] = {}

    def error(share: float) -> float:
        recordings = record_tests(
            [_moved(item, share * unit, period) for item in training],
            rate_hz=options.fit_rate_hz,
            longest_s=SEARCHED_CYCLES * period,
        )
        base = declared_base(
            recordings, options.model, options.yield_order, options.viscosity_order, options.form_files
        )
        baseline = fit_baseline(recordings, base, declared)
        noise.append(baseline.noise)
        tried[share] = baseline.fit
        # errors in newtons are compared, because the weights depend on the compliance
        return _mean_square(baseline.fit)

    noise: list[float] = []
    values = {0.0: error(0.0)}
    for share in SHARES:
        values[share] = error(share)
        if values[share] > WORSE * min(values.values()):
            break
    for _ in range(4):
        ordered = sorted(values)
        best = min(values, key=lambda share: values[share])
        place = ordered.index(best)
        for other in (ordered[max(place - 1, 0)], ordered[min(place + 1, len(ordered) - 1)]):
            middle = 0.5 * (best + other)
            if middle not in values and abs(other - best) > RESOLUTION * max(best, LEAST_RESOLVED):
                values[middle] = error(middle)
    best = min(values, key=lambda share: values[share])
    near = [share for share in values if values[share] < rules.equivalent * values[best]]
    scale = noise[0] / max(tried[0.0].chi_square, 1e-12) * values[0.0]
    errors = [
        _nrmse(tried[share], [_moved(item, share * unit, period) for item in validation], options, period)
        for share in (0.0, best)
    ]
    return BraceFinding(
        best * unit, (min(near) * unit, max(near) * unit), values[0.0], values[best], scale, errors[0], errors[1]
    )


def mean_period(test: PreparedTest) -> float:
    """Return the mean period of the motion of a test [s], from the RMS of displacement and velocity."""
    return float(2.0 * np.pi * np.std(test.displacement_m) / max(float(np.std(test.velocity_m_s)), 1e-12))


def _moved(test: PreparedTest, compliance: float, period: float) -> PreparedTest:
    """Return a test with the motion of the rod of a damper behind a brace."""
    if compliance == 0.0:
        return test
    rate = test.sampling_rate_hz
    cutoff = min(STRETCH_HARMONICS / period, OF_RATE * rate)
    stretch = compliance * butterworth_lowpass(test.force_raw_n, cutoff, rate)
    displacement = test.displacement_m - stretch
    velocity = np.gradient(displacement, test.dt)
    return replace(
        test,
        displacement_m=displacement,
        displacement_raw_m=test.displacement_raw_m - stretch,
        velocity_m_s=velocity,
        acceleration_m_s2=np.gradient(velocity, test.dt),
    )


def _in_newtons(found: Fit) -> FloatArray:
    used = found.problem.root_weight > 0.0
    return np.asarray(found.residual[used] / found.problem.root_weight[used])


def _mean_square(found: Fit) -> float:
    return float(np.mean(_in_newtons(found) ** 2))


def _nrmse(found: Fit, tests: Sequence[PreparedTest], options: TracingOptions, period: float) -> float:
    recordings = record_tests(tests, rate_hz=options.fit_rate_hz, longest_s=JUDGED_CYCLES * period)
    error = recordings.force - predict(found, recordings)
    sums = np.bincount(recordings.test, weights=error) / np.bincount(recordings.test)
    error = error - sums[recordings.test]
    return rms(error[recordings.used]) / recordings.force_rms
