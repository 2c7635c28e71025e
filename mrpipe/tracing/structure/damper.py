"""The damper seen through the structure: the tracing of a bench on closed-loop tests, and a brace that gives.

A brace stretches with the force, so the damper's rod moves less than the floor: rod = floor - compliance x force. The
measured force is used for that stretch; it must not be smoothed less than the displacement's noise asks for.
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
from mrpipe.signals.filters import butterworth_lowpass
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import prepare_campaign
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.baseline import declared_base, fit_baseline
from mrpipe.tracing.bench.summary import Tracing, TracingOptions
from mrpipe.tracing.bench.trace import trace_campaign

STRETCH_CUTOFF_HZ = 40.0
SEARCHED_S = 7.0
"""Of a long test so much is used to search the compliance."""

STRONG_SHARE = 0.5

LEAST_MOTION = 50.0
"""A test whose rod moves less than so many times the noise of its motion tells nothing of the damper but that noise."""

PIECES = 12
"""Closed-loop tests are cut into at least so many pieces."""

SHARES = (0.01, 0.03, 0.08, 0.2, 0.4)
"""Compliances tried, in strokes over RMS of force."""


@dataclass(frozen=True)
class BraceFinding:
    """What a spring between floor and damper makes of the fit.

    Attributes
    ----------
    compliance_m_n, interval
        Of least error.
    rigid, chi_square, noise
        Chi-square of a rigid brace, of this one, and of noise.
    nrmse_before, nrmse_after
        On validation tests.
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

    @property
    def strong(self) -> bool:
        """Whether it takes away so much that a damper's effect has to be as good in a single step to be named."""
        return self.share > STRONG_SHARE and self.nrmse_after < 0.8 * self.nrmse_before


def prepared_loops(campaign: Campaign) -> list[PreparedTest]:
    """Return closed-loop tests, given as a bench campaign, prepared as those of a bench are.

    Tests whose rod hardly moves are left out where others are there to learn and to judge by.
    """
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
    moved = [test for test in tests if np.std(test.displacement_m) > LEAST_MOTION * test.displacement_noise_m]
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
    """Trace the damper's residual on prepared closed-loop tests, as on a bench.

    A closed loop brings few long tests where a bench brings many short ones: they are cut, so that forms are tried on a
    share of them, and the tracing takes no longer than on a bench.
    """
    training = enough_tests([item for item in tests if item.role != "validation"], PIECES)
    judged = [item for item in tests if item.role == "validation"]
    return trace_campaign([*training, *judged], effects, declared, options, rng=rng, jobs=jobs, progress=progress)


def find_brace(tests: Sequence[PreparedTest], options: TracingOptions, declared: Sequence[Effect]) -> BraceFinding:
    """Search the compliance of a brace: the base is fitted anew for each, the weights are those of a rigid one."""
    training = enough_tests([item for item in tests if item.role != "validation"])
    validation = [item for item in tests if item.role == "validation"]
    force = float(np.sqrt(np.mean(np.concatenate([item.force_n for item in training]) ** 2)))
    stroke = max(0.5 * float(np.ptp(item.displacement_m)) for item in training)
    unit = stroke / force
    tried: dict[float, Fit] = {}

    def error(share: float) -> float:
        recordings = record_tests(
            [_moved(item, share * unit) for item in training], rate_hz=options.fit_rate_hz, longest_s=SEARCHED_S
        )
        base = declared_base(recordings, options.model, options.yield_order, options.viscosity_order)
        baseline = fit_baseline(recordings, base, declared)
        noise.append(baseline.noise)
        tried[share] = baseline.fit
        # in newtons: the weights of different compliances are not the same
        return _mean_square(baseline.fit)

    noise: list[float] = []
    values = {0.0: error(0.0)}
    for share in SHARES:
        values[share] = error(share)
        if values[share] > 1.5 * min(values.values()):
            break
    for _ in range(4):
        ordered = sorted(values)
        best = min(values, key=lambda share: values[share])
        place = ordered.index(best)
        for other in (ordered[max(place - 1, 0)], ordered[min(place + 1, len(ordered) - 1)]):
            middle = 0.5 * (best + other)
            if middle not in values and abs(other - best) > 0.05 * max(best, 0.005):
                values[middle] = error(middle)
    best = min(values, key=lambda share: values[share])
    near = [share for share in values if values[share] < 1.1 * values[best]]
    scale = noise[0] / max(tried[0.0].chi_square, 1e-12) * values[0.0]
    errors = [
        _nrmse(tried[share], [_moved(item, share * unit) for item in validation], options) for share in (0.0, best)
    ]
    return BraceFinding(
        best * unit, (min(near) * unit, max(near) * unit), values[0.0], values[best], scale, errors[0], errors[1]
    )


def _moved(test: PreparedTest, compliance: float) -> PreparedTest:
    """Return a test with the motion of the rod of a damper behind a brace."""
    if compliance == 0.0:
        return test
    rate = test.sampling_rate_hz
    stretch = compliance * butterworth_lowpass(test.force_raw_n, min(STRETCH_CUTOFF_HZ, 0.3 * rate), rate)
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


def _nrmse(found: Fit, tests: Sequence[PreparedTest], options: TracingOptions) -> float:
    recordings = record_tests(tests, rate_hz=options.fit_rate_hz, longest_s=25.0)
    error = recordings.force - predict(found, recordings)
    sums = np.bincount(recordings.test, weights=error) / np.bincount(recordings.test)
    error = error - sums[recordings.test]
    return float(np.sqrt(np.mean(error[recordings.used] ** 2))) / recordings.force_rms
