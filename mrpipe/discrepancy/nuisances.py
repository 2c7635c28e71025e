"""What is no physics of the damper: gains of records, and a moving average that the records went through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mrpipe.artifacts import FloatArray
from mrpipe.discrepancy.engine import Fit, fit, start_of
from mrpipe.discrepancy.recordings import Recordings

WINDOW_SHARES = (0.05, 0.1, 0.15)
LEAST_GAIN = 0.05
"""A filter, or a lag of the drive that falls otherwise than it rises, is believed in only if it takes this share of the
sum of squares."""


def record_gains(recordings: Recordings, measured: FloatArray, simulated: FloatArray) -> dict[str, float]:
    """Return for each test the factor that brings the simulated force nearest to the measured one."""
    found = {}
    for index, name in enumerate(recordings.names):
        own = recordings.used & (recordings.test == index)
        power = float(simulated[own] @ simulated[own])
        if power > 0.0:
            found[name] = float(measured[own] @ simulated[own]) / power
    return found


def observation_window(found: Fit, shares: Sequence[float] = WINDOW_SHARES) -> tuple[float, Fit]:
    """Return the moving average (as share of each test's period) that suits the records, and the fit with it.

    The share is 0 and the fit the same where none is worth it. Displacement and force went through the same filter;
    what is left of it is that the force of the filtered motion is not the filtered force.
    """
    given = len(shares) == 1
    trials = {share: _with(found, share) for share in shares}
    best = min(trials, key=lambda share: trials[share].cost)
    if given:
        return best, trials[best]
    if trials[best].cost > (1.0 - LEAST_GAIN) * found.cost:
        return 0.0, found
    width = 0.02
    for _ in range(3):
        for share in (best - width, best + width):
            if share > 0.005 and share not in trials:
                trials[share] = _with(trials[best], share)
        best = min(trials, key=lambda share: trials[share].cost)
        width *= 0.5
    return best, trials[best]


def with_lag_apart(found: Fit) -> Fit:
    """Return the fit with rates of its own for the falling drive, or the same fit where that is not worth it."""
    base = found.problem.base
    if not base.lag_known or base.lag_apart:
        return found
    problem = replace(found.problem, base=replace(base, lag_apart=True))
    values = {**found.base_values, "eta_fall": found.base_values["eta"]}
    trial = fit(problem, start_of(problem, values, found.term_values), iterations=12)
    return trial if trial.cost < (1.0 - LEAST_GAIN) * found.cost else found


def _with(found: Fit, share: float) -> Fit:
    return fit(replace(found.problem, window_share=share), found.theta, iterations=6)
