"""Choice of the damping ratio of each mode, from free decays or from the multi-mode fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.decays.decay import DecayMethod, DecayResult, Estimate, analyse_decay
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.records import FrameTest, FrameTests, Place
from mrpipe.words import in_percent, listed, noun

_NORMAL_95 = 1.959964
LONGER_RECORDS = "; longer records, or more force on this mode, would reduce this interval"
"""End of a finding on a wide interval, where only noise is its reason."""
_WIDEST_DECAY_INTERVAL = 0.02
_WIDE_INTERVAL = 0.1
"""Half width of the 95 % interval, relative to the damping ratio, above which a finding reports it."""


def decays_of_modes(tests: FrameTests, fit: MultiModeFit) -> tuple[dict[int, DecayResult], list[str]]:
    """Return mode number (from 1) -> most certain free decay, and messages for the user."""
    results: dict[int, DecayResult] = {}
    findings = []
    for test in tests.decays:
        common, shapes = _same_sensors(test, fit)
        if common is None:
            findings.append(f"test {test.name}: none of its sensors is in a forced test; it was left out")
            continue
        result = analyse_decay(common, shapes, fit.angular_frequencies, fit.damping_ratios)
        if result is None:
            findings.append(f"test {test.name}: fewer than six peaks of a free decay exceed the noise; it was left out")
            continue
        known = results.get(result.mode)
        if known is None or result.exponential_fit.half_width < known.exponential_fit.half_width:
            results[result.mode] = result
    return results, findings


def _same_sensors(test: FrameTest, fit: MultiModeFit) -> tuple[FrameTest | None, FloatArray]:
    """Return a decay test with those sensors that the fit also has, and the shapes at them, shape (s, r)."""
    known = [Place(sensor.floor, sensor.direction) for sensor in fit.sensors]
    columns = [i for i, sensor in enumerate(test.sensors) if Place(sensor.floor, sensor.direction) in known]
    if not columns:
        return None, np.zeros((0, fit.angular_frequencies.size))
    places = tuple(Place(test.sensors[i].floor, test.sensors[i].direction) for i in columns)
    part = replace(
        test,
        responses=test.responses[:, columns],
        is_displacement=tuple(test.is_displacement[i] for i in columns),
        places=places,
    )
    return part, np.real(fit.residues[[known.index(place) for place in places]])


def pooled(first: Estimate, second: Estimate) -> Estimate:
    """Return the mean of two independent estimates, weighted by the inverse of their variances."""
    weights = np.array([1.0 / max(item.half_width, 1e-12) ** 2 for item in (first, second)])
    value = float(weights @ [first.value, second.value] / weights.sum())
    return Estimate.of(value, float(1.0 / np.sqrt(weights.sum())) / _NORMAL_95)


def choose_damping(
    sweep: tuple[Estimate, ...],
    decays: dict[int, DecayResult],
    damping_from: str,
    other: str,
    method: DecayMethod = "exponential-fit",
) -> tuple[tuple[Estimate, ...], tuple[str, ...], list[str]]:
    """Choose the damping ratio of each mode.

    Parameters
    ----------
    sweep
        Damping ratios of the multi-mode fit, one for each mode.
    decays
        Free decays by mode number from 1.
    damping_from
        `decay` to prefer free decays; otherwise the fit counts.
    other
        Name of the tests of the fit, for the source and for messages.
    method
        Method by which the damping ratio is computed from a decay.

    Returns
    -------
    Damping ratios, their sources, and messages for the user.
    """
    chosen: list[Estimate] = []
    sources: list[str] = []
    findings: list[str] = []
    for mode, second in enumerate(sweep, start=1):
        decay = decays.get(mode)
        first = decay.damping_ratio(method) if decay else None
        if first is None or damping_from != "decay":
            chosen.append(second)
            sources.append(other)
        elif first.half_width <= _WIDEST_DECAY_INTERVAL * first.value or method != "exponential-fit":
            chosen.append(first)
            sources.append("decay")
        else:
            # both are uncertain: the mean of two independent estimates, weighted by their certainty
            chosen.append(pooled(first, second))
            sources.append(f"decay and {other}")
        if chosen[-1].half_width > _WIDE_INTERVAL * chosen[-1].value:
            width = in_percent(chosen[-1].half_width / chosen[-1].value)
            findings.append(
                f"mode {mode}: the records determine the damping ratio only within +-{width} (95 % interval)"
                f"{LONGER_RECORDS}"
            )
        if first is not None:
            apart = abs(first.value - second.value)
            if apart > first.half_width + second.half_width + 0.1 * second.value:
                findings.append(f"mode {mode}: damping is {first.value:.2g} by decay, {second.value:.2g} by {other}")
    without = [str(mode) for mode in range(1, len(sweep) + 1) if mode not in decays]
    if without and decays and damping_from == "decay":
        tests = "forced tests" if other == "sweep" else f"{other} tests"
        whose = f"{noun(len(without), 'mode')} {listed(without)}, so {'its' if len(without) == 1 else 'their'} damping"
        findings.append(f"there is no free decay of {whose} comes from the {tests}")
    return tuple(chosen), tuple(sources), findings
