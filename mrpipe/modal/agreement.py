"""Modes of tests that agree: tests of a structure that changed are left out, or widen the intervals."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Progress
from mrpipe.errors import UserError
from mrpipe.modal.clocks.delays import SensorClock, corrected, expected_clocks
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.mode_finding import clock_findings, find_modes
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTests
from mrpipe.modal.search.chosen_tests import ChosenTests, training_first
from mrpipe.modal.search.forced_modes import ModeSearch
from mrpipe.modal.search.forced_modes import find_modes as search_modes
from mrpipe.modal.search.selection import Layout
from mrpipe.modal.search.sessions import (
    PolesOfTests,
    difference,
    odd_tests,
    poles_of_searches,
    poles_of_tests,
    with_reach,
    with_spread,
)


@dataclass(frozen=True)
class ModesOfTests:
    """Modes that were found in tests.

    Attributes
    ----------
    chosen, clocks, findings
        Result of :func:`~mrpipe.modal.mode_finding.find_modes`.
    poles
        Poles of each test alone; None with fewer than two forced tests.
    differ
        Whether the modes are means of tests that contradict each other.
    odd
        Names of tests that were left out because the others contradict them.
    """

    chosen: ChosenTests
    clocks: tuple[SensorClock, ...]
    findings: tuple[str, ...]
    poles: PolesOfTests | None
    differ: bool = False
    odd: tuple[str, ...] = ()


def modes_of_tests(
    tests: FrameTests, layout: Layout, options: IdentificationOptions, progress: Progress
) -> ModesOfTests:
    """Return the modes, and the poles of each forced test alone.

    Parameters
    ----------
    tests, layout, options, progress
        As for :func:`~mrpipe.modal.mode_finding.find_modes`.

    Raises
    ------
    UserError
        If no mode is found.
    """
    chosen, clocks, findings = find_modes(tests, training_first(tests.forced), layout, options, progress)
    poles = poles_of_tests(chosen.search.fit) if chosen.tests and options.modes_from == "fit" else None
    return ModesOfTests(chosen, clocks, tuple(findings), poles)


def of_agreeing_tests(
    found: ModesOfTests, tests: FrameTests, layout: Layout, options: IdentificationOptions, progress: Progress
) -> ModesOfTests | None:
    """Return the modes of the majority of tests that agree, or the means of all tests; None where all tests agree.

    Parameters
    ----------
    found
        Modes of all tests.
    tests, layout, options, progress
        As for :func:`modes_of_tests`. Tests that the majority contradicts become validation tests.

    Raises
    ------
    UserError
        If no mode is found in the tests that agree.
    """
    names = [test.name for test in found.chosen.tests]
    poles = found.poles
    apart = False
    if poles is not None and len(found.chosen.search.numbers) < layout.floors:
        # two peaks that do not overlap are two modes to a common search, and none of them fits all tests
        alone = _alone(found.chosen, tests, layout, options)
        apart = alone is not None
        names, poles = (names, poles) if alone is None else alone
    if poles is None or not poles.differ(range(len(names))):
        return None
    odd = odd_tests(poles)
    said = f"{difference(names, poles, odd)}: the structure or its temperature changed between the tests"
    if odd or apart:
        out = [names[test] for test in (odd or range(1, len(names)))]
        forced = tuple(replace(test, role="validation") if test.name in out else test for test in tests.forced)
        again = modes_of_tests(replace(tests, forced=forced), layout, options, progress)
        again = replace(again, odd=tuple(out), differ=not odd)
        if odd:
            said += f"; {'it is' if len(odd) == 1 else 'they are'} left out of the fit"
        else:
            said += f"; the modes are those of test {names[0]}, and their intervals contain each test"
            search = again.chosen.search
            if search.fit.angular_frequencies.size == poles.modes:
                again = replace(
                    again, chosen=replace(again.chosen, search=replace(search, fit=with_reach(search.fit, poles)))
                )
    else:
        search = replace(found.chosen.search, fit=with_spread(found.chosen.search.fit, poles))
        again = replace(found, chosen=replace(found.chosen, search=search), differ=True)
        said += "; the modes are means of the tests, and their intervals contain each test"
    return replace(again, findings=(*again.findings, Doubt(said)))


def _alone(
    chosen: ChosenTests, tests: FrameTests, layout: Layout, options: IdentificationOptions
) -> tuple[list[str], PolesOfTests] | None:
    """Return the names and poles of tests that show more modes alone than together; None for fewer than two."""
    found: dict[str, ModeSearch] = {}
    for test in chosen.tests:
        with suppress(UserError):
            band = (options.band_low_hz, options.band_high_hz)
            found[test.name] = search_modes((test,), layout, *band, tests.source, tests.decays)
    numbers = max((item.numbers for item in found.values()), key=len, default=())
    same = {name: item.fit for name, item in found.items() if item.numbers == numbers}
    if len(numbers) <= len(chosen.search.numbers) or len(same) < 2:
        return None
    return list(same), poles_of_searches(list(same.values()))


def without_weak_clocks(
    found: ModesOfTests,
    error: float,
    tests: FrameTests,
    layout: Layout,
    options: IdentificationOptions,
    progress: Progress,
) -> ModesOfTests | None:
    """Return the modes without delays that modes over amplitude do not distinguish from their error; None without any.

    A structure that softens has other phases at the flanks of its peaks than a linear one, which a delay explains in
    part. A delay is kept if its phase at the highest mode exceeds the error of the laws, or if the sensor has it in
    every test.

    Parameters
    ----------
    found
        Modes that were found with all delays.
    error
        RMS error over RMS response that laws over amplitude leave.
    tests, layout, options, progress
        As for :func:`modes_of_tests`.

    Raises
    ------
    UserError
        If no mode is found.
    """
    highest = float(found.chosen.search.fit.angular_frequencies[-1])
    steady = {item.sensor for item in expected_clocks(found.clocks, found.chosen.tests, found.chosen.tests)}
    kept = tuple(
        item for item in found.clocks if item.sensor in steady or highest * _largest_delay(item, tests) > error
    )
    if len(kept) == len(found.clocks):
        return None
    forced = tuple(corrected(test, kept) for test in tests.forced)
    fixed = options.model_copy(update={"clock_correction": False})
    again = modes_of_tests(replace(tests, forced=forced), layout, fixed, progress)
    return replace(again, clocks=kept, findings=(*clock_findings(kept), *again.findings))


def _largest_delay(clock: SensorClock, tests: FrameTests) -> float:
    duration = next((test.duration_s for test in tests.forced if test.name == clock.test), 0.0)
    return float(np.abs(clock.delay(np.array([0.0, clock.step_at_s, duration]))).max())
