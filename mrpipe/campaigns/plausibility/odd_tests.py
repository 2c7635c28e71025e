"""Tests whose force contradicts that of the other tests: sign, exchanged channels, unit, gain, delay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import stats

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.plausibility.agreement import Agreement, agreement, delay, fit, log_gain_of
from mrpipe.campaigns.plausibility.decades import find_decades, unit_finding
from mrpipe.campaigns.plausibility.finding import Finding, TestArrays
from mrpipe.campaigns.plausibility.reference import ReferenceMap, Slow, moving_tests

GAIN_SCATTER, PHASE_SCATTER = 0.04, 0.06
"""Standard deviations between tests of a sound rig, before any test is seen: of log(gain), and of phase [rad]."""

SMALLEST_PHASE = 0.15
"""Phase [rad] below which hysteresis that the map does not follow is a likelier cause than the clock."""

PRIOR_TESTS = 4
"""Number of tests that these prior figures are worth."""

CHANCE = 0.02
"""Probability with which a sound campaign would have one test called odd."""

MIDDLE = 2.0 / 3.0
"""Share of the other tests, closest to their median, from which their scatter is taken."""

QUANTILE, EFFICIENCY = 0.967, 0.526
"""For normal samples: half the width of this share over the standard deviation; information over that of the latter."""

POWERS = 0.29
"""Standard deviation of a power between 0 and 1: beyond the speeds of the other tests, the force of a damper may grow
with any such power of the speed."""

FACTORS = (1000.0, 1e-3)

LOOKED_AT = 4
"""So many tests with the most deviating gains are judged; the oddest is among them."""


def find_odd_tests(arrays: Sequence[TestArrays]) -> list[Finding]:
    """Return the tests that contradict the others, each with the simplest mistake that explains it.

    First the energy is looked at: a damper dissipates, so a test in which the force does negative work while it does
    positive work in the others has a reversed sign or exchanged channels. The remaining tests are compared with a force
    map that the others predict. The oddest is taken out until all that remain agree; for each odd test a wrong unit
    is tried as explanation, else its gain is reported. Tests in which nothing moves are left out.
    """
    tests = moving_tests(arrays)
    if len(tests) < 2:
        return []
    findings: list[Finding] = []
    for check in (find_decades, _against_the_work):
        findings += check(tests)
        tests = [test for test in tests if test.name not in {item.test for item in findings}]
    return findings + (_against_the_map(tests) if len(tests) > 2 else [])


def _against_the_work(tests: Sequence[Slow]) -> list[Finding]:
    """Return tests in which the force does negative work, or none, while it does positive work in the others."""
    findings = []
    works = [test.work for test in tests]
    for index, test in enumerate(tests):
        others = works[:index] + works[index + 1 :]
        work = float(np.median(others)) if others else 0.0
        if work < 0.2 or works[index] > 0.1:
            continue
        evidence = f"correlation of force and velocity {test.work:.2f}, in the other tests {work:.2f}"
        numbers = {"correlation_with_velocity": test.work, "correlation_of_others": work}
        found = _why_no_work(test, index, tests)
        if found is not None:
            name, channel, sentence, remedy = found
            findings.append(Finding(name, "error", f"{sentence} ({evidence})", remedy, test.name, channel, numbers))
    return findings


def _why_no_work(test: Slow, index: int, tests: Sequence[Slow]) -> tuple[str, str, str, str] | None:
    """Return name, channel, sentence and remedy of the mistake that best explains a test without positive work."""
    bad = {position for position, other in enumerate(tests) if other.work < 0.1} | {index}
    if len(bad) == len(tests):
        return None
    reference = ReferenceMap(tests)
    coefficients = reference.coefficients(bad)
    plain = fit(reference.normal(test), coefficients)[1]
    exchanged = fit(reference.normal(test.exchanged(reference.travel)), coefficients)[1]
    if exchanged > max(-plain, 0.5):
        sentence = f"displacement and force look exchanged: exchanged they follow the other tests ({exchanged:.2f})"
        return "channels-exchanged", "displacement", sentence, "exchange the two columns in this test"
    if test.work < -0.2:
        return (
            "sign-reversed",
            "force",
            "force or displacement has the opposite sign to the other tests",
            "correct the sign with `scale: -1` on one of the two channels in this test",
        )
    if abs(plain) < 0.3:
        return (
            "force-unrelated",
            "force",
            "force does not follow the motion as it does in the other tests",
            "check the sensors of this test and the columns that are named for it, or leave the test out",
        )
    return None


def _against_the_map(tests: Sequence[Slow]) -> list[Finding]:
    reference = ReferenceMap(tests)
    odd: list[int] = []
    while len(tests) - len(odd) > max(2, len(tests) // 2):
        worst = _oddest(reference, tests, odd)
        if worst is None:
            break
        odd.append(worst)
    findings = [_explain(reference, tests, index, odd) for index in sorted(odd)]
    sound = [index for index in range(len(tests)) if index not in odd]
    return findings + _late(reference, tests, sound)


def limit_of(others: FloatArray, prior: float, tests: int, error: float = 0.0) -> float:
    """Return the largest deviation from the middle of the others that chance explains.

    The scatter of the others is pooled with a prior (Student's t); `error` is the standard error of the figure itself.
    The scatter is taken from the two thirds of the others that lie closest to their median, because few tests at the
    edge of what was measured scatter more than all others, and because other tests may be wrong too.
    """
    distances = np.abs(others - float(np.median(others)))
    scatter = float(np.quantile(distances, MIDDLE)) / QUANTILE
    counted = EFFICIENCY * (others.size - 1)
    freedom = PRIOR_TESTS + counted
    variance = (PRIOR_TESTS * prior**2 + counted * scatter**2) / freedom
    quantile = float(stats.t.ppf(1.0 - CHANCE / (2 * tests), freedom))
    return quantile * float(np.sqrt(variance * (1.0 + 1.0 / others.size) + error**2))


def _oddest(reference: ReferenceMap, tests: Sequence[Slow], odd: Sequence[int]) -> int | None:
    """Return the test that agrees least with the others, None where all agree."""
    kept = [index for index in range(len(reference.parts)) if index not in odd]
    items = {index: agreement(reference, reference.parts[index], {*odd, index}) for index in kept}
    scores: dict[int, float] = {}
    distances: dict[int, float] = {}
    for index, item in items.items():
        correlations = [items[other].correlation for other in kept if other != index]
        if item.highest_correlation < 0.3 and float(np.median(correlations)) > 0.8:
            scores[index] = 100.0 * (1.0 - item.highest_correlation)
        elif item.correlation >= 0.5:
            related = [items[other].log_gain for other in _related(items, index)]
            distances[index] = abs(item.log_gain - float(np.median(related))) if len(related) > 1 else 0.0
    for index in sorted(distances, key=lambda index: -distances[index])[:LOOKED_AT]:
        score = _score(reference, tests, items, index, odd)
        if score > 1.0:
            scores[index] = score
    return max(scores, key=lambda index: scores[index]) if scores else None


def _related(items: Mapping[int, Agreement], index: int) -> list[int]:
    return [other for other, item in items.items() if other != index and item.correlation > 0.5]


def _score(
    reference: ReferenceMap, tests: Sequence[Slow], items: Mapping[int, Agreement], index: int, odd: Sequence[int]
) -> float:
    """Return the deviation of a test's gain over the largest that chance explains.

    The gains of the others are taken without this test, so that an odd test does not widen the scatter by which it is
    judged (externally studentised deviation).
    """
    related = _related(items, index)
    if len(related) < 2:
        return 0.0
    gains = np.array([log_gain_of(reference, other, {*odd, index, other}) for other in related])
    item = items[index]
    error = item.log_gain_error
    if gains.size < 3 or not np.isfinite(error) or not _covered(index, _all_but(items, index), tests):
        # too little to judge a gain, but decades show in any case
        error = 1.0
    usual = float(np.median([items[other].correlation for other in related]))
    by = _apart(item, float(np.median(gains)), usual)
    error = float(np.hypot(error, POWERS * _beyond(index, _all_but(items, index), tests)))
    return by / limit_of(gains, GAIN_SCATTER, len(items), error)


def _apart(item: Agreement, middle: float, usual: float) -> float:
    """Return the distance between the logarithms of a test's gain and of the gains of the others.

    An error of the prediction, such as a lag of the drive that the map does not contain, lowers both the correlation
    and the gain that least squares give. The gain therefore lies between this regression and the reverse one, whose
    logarithm is larger by -2 log(correlation) (Frisch 1934, Statistical Confluence Analysis). The part of this that the
    other tests have as well, at their `usual` correlation, does not separate the test from them.
    """
    upper = item.log_gain + 2.0 * max(float(np.log(usual / item.correlation)), 0.0)
    return max(item.log_gain - middle, middle - upper, 0.0)


def _all_but(items: Mapping[int, Agreement], index: int) -> list[int]:
    return [other for other in items if other != index]


def _covered(index: int, others: Sequence[int], tests: Sequence[Slow]) -> bool:
    """Whether the drive of a test lies between those of the others; beyond them the map extrapolates."""
    levels = [tests[other].drive_level for other in others]
    slack = 0.1 * (max(levels) - min(levels)) + 0.02 * max(levels)
    return min(levels) - slack <= tests[index].drive_level <= max(levels) + slack


def _beyond(index: int, others: Sequence[int], tests: Sequence[Slow]) -> float:
    """Return by how much the RMS velocity of a test lies beyond those of the others, as a logarithm; 0 within them."""
    speeds = [tests[other].speed_rms for other in others]
    speed = tests[index].speed_rms
    return float(max(np.log(speed / max(speeds)), np.log(min(speeds) / speed), 0.0))


def _as_fast(index: int, others: Sequence[int], tests: Sequence[Slow]) -> bool:
    """Whether the RMS velocity of a test lies between those of the others."""
    speeds = [tests[other].speed_rms for other in others]
    return min(speeds) <= tests[index].speed_rms <= max(speeds)


def _explain(reference: ReferenceMap, tests: Sequence[Slow], index: int, odd: Sequence[int]) -> Finding:
    """Name the simplest mistake that makes an odd test agree with the sound ones."""
    test = tests[index]
    without = {*odd, index}
    plain = agreement(reference, reference.parts[index], without)
    numbers = {"gain": plain.gain, "correlation": plain.correlation}
    if plain.correlation < 0.3:
        return Finding(
            name="force-unrelated",
            severity="error",
            test=test.name,
            channel="force",
            sentence="force does not follow the motion as it does in the other tests (correlation with their "
            f"prediction {plain.correlation:.2f})",
            remedy="check the sensors of this test and the columns that are named for it, or leave the test out",
            numbers=numbers,
        )
    for channel, factor in _units(reference, test, without, plain):
        return unit_finding(test, channel, factor, f"force is {plain.gain:.3g} times what they predict", numbers)
    return Finding(
        name="gain-differs",
        severity="warning",
        test=test.name,
        channel="force",
        sentence=f"force is {plain.gain:.3g} times what the other tests give for this motion and drive",
        remedy="check range and calibration of the load cell, the drive and the temperature in this test",
        numbers=numbers,
    )


def _units(reference: ReferenceMap, test: Slow, without: set[int], plain: Agreement) -> list[tuple[str, float]]:
    """Return channel and factor of the unit that brings a test closest to the others, if one does."""
    found = []
    for channel in ("force", "displacement", "drive"):
        for factor in FACTORS:
            changed = test.scaled(**{channel: factor})
            item = agreement(reference, reference.normal(changed), without)
            distance = abs(item.log_gain) + 2.0 * (1.0 - item.correlation)
            if item.correlation > 0.7 and abs(item.log_gain) < max(np.log(2.0), 0.25 * abs(plain.log_gain)):
                found.append((distance, channel, factor))
    before = abs(plain.log_gain) + 2.0 * (1.0 - plain.correlation)
    return [(channel, factor) for distance, channel, factor in sorted(found)[:1] if distance < 0.5 * before]


def _late(reference: ReferenceMap, tests: Sequence[Slow], sound: Sequence[int]) -> list[Finding]:
    """Return tests whose force comes earlier or later than in the other tests.

    Delays are compared as phases of the mean frequency, because what the map does not know of hysteresis shifts the
    force by a share of the period. This share depends on speed and drive, so only a test within the speeds and drives
    of the others is judged.
    """
    without = [index for index in range(len(tests)) if index not in sound]
    phases: dict[int, float] = {}
    errors: dict[int, float] = {}
    for index in sound:
        item = agreement(reference, reference.parts[index], {*without, index})
        if item.correlation > 0.8 and item.log_gain_error < 0.3:
            expected = reference.predict(tests[index], {*without, index})
            phases[index] = 2.0 * np.pi * tests[index].frequency_hz * delay(tests[index], expected)
            # a prediction that is wrong by this share can be wrong by this angle
            errors[index] = item.log_gain_error
    findings = []
    for index, phase in phases.items():
        others = np.array([value for other, value in phases.items() if other != index])
        company = [other for other in phases if other != index]
        if others.size < 3 or not _covered(index, company, tests) or not _as_fast(index, company, tests):
            continue
        by = phase - float(np.median(others))
        if abs(by) <= max(limit_of(others, PHASE_SCATTER, len(phases), errors[index]), SMALLEST_PHASE):
            continue
        seconds = by / (2.0 * np.pi * tests[index].frequency_hz)
        findings.append(
            Finding(
                name="delay-differs",
                severity="warning",
                test=tests[index].name,
                channel="force",
                sentence=f"force comes {1e3 * abs(seconds):.3g} ms {'later' if by > 0.0 else 'earlier'} against the "
                "displacement than in the other tests",
                remedy="check whether the channels of this test were recorded with one clock",
                numbers={"delay_s": seconds},
            )
        )
    return findings
