"""Modes of tests that agree: tests of a structure that changed are left out, or widen the intervals."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Progress
from mrpipe.errors import UserError
from mrpipe.modal.clocks.delays import SensorClock, corrected, expected_clocks
from mrpipe.modal.doubts import Doubt
from mrpipe.modal.matrices.exchanged import exchanged_finding, exchanged_floors
from mrpipe.modal.mode_finding import clock_findings, find_modes
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.chosen_tests import ChosenTests, training_first
from mrpipe.modal.search.forced_modes import ModeSearch
from mrpipe.modal.search.forced_modes import find_modes as search_modes
from mrpipe.modal.search.selection import Layout, all_floors_measured, floor_shapes
from mrpipe.modal.search.sessions import (
    PolesOfTests,
    difference,
    odd_tests,
    poles_of_searches,
    poles_of_tests,
    with_reach,
    with_spread,
)

_CHANGED = "the structure or its temperature changed between the tests"
_CONTAIN = "their intervals contain each test"


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
    try:
        chosen, clocks, findings = find_modes(tests, training_first(tests.forced), layout, options, progress)
    except UserError:
        # tests of two states may fit each other so badly that no sensor seems to respond
        trained = tuple(test for test in tests.forced if test.role != "validation")
        alone = _alone(trained, tests, layout, options, 0)
        if alone is None or not alone[1].differ(range(len(alone[0]))):
            raise
        return _of_some(*alone, tests, layout, options, progress)
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
    names, poles = [test.name for test in found.chosen.tests], found.poles
    number = len(found.chosen.search.numbers)
    if poles is not None and number < layout.floors:
        # two peaks that do not overlap are two modes to a common search, and none of them fits all tests
        alone = _alone(found.chosen.tests, tests, layout, options, number)
        if alone is not None and alone[1].differ(range(len(alone[0]))):
            return _of_some(*alone, tests, layout, options, progress)
    if poles is None or not poles.differ(range(len(names))):
        return None
    odd = odd_tests(poles)
    if odd:
        return _of_some(names, poles, tests, layout, options, progress)
    search = replace(found.chosen.search, fit=with_spread(found.chosen.search.fit, poles))
    said = f"{difference(names, poles, odd)}: {_CHANGED}; the modes are means of the tests, and {_CONTAIN}"
    return replace(
        found, chosen=replace(found.chosen, search=search), differ=True, findings=(*found.findings, Doubt(said))
    )


def _of_some(
    names: list[str],
    poles: PolesOfTests,
    tests: FrameTests,
    layout: Layout,
    options: IdentificationOptions,
    progress: Progress,
) -> ModesOfTests:
    """Return the modes of the majority of tests that agree, or of the first test with intervals for all."""
    odd = odd_tests(poles)
    out = [names[test] for test in (odd or range(1, len(names)))]
    forced = tuple(replace(test, role="validation") if test.name in out else test for test in tests.forced)
    again = modes_of_tests(replace(tests, forced=forced), layout, options, progress)
    again = replace(again, odd=tuple(out), differ=not odd)
    said = f"{difference(names, poles, odd)}: {_CHANGED}"
    if odd:
        said += f"; {'it is' if len(odd) == 1 else 'they are'} left out of the fit"
    else:
        search = again.chosen.search
        if search.fit.angular_frequencies.size == poles.modes:
            search = replace(search, fit=with_reach(search.fit, poles))
        again = replace(again, chosen=replace(again.chosen, search=search))
        said += f"; the modes are those of test {names[0]}, and {_CONTAIN}"
    return replace(again, findings=(*again.findings, Doubt(said)))


def _alone(
    trained: Sequence[FrameTest], tests: FrameTests, layout: Layout, options: IdentificationOptions, together: int
) -> tuple[list[str], PolesOfTests] | None:
    """Return names and poles of tests that show more modes alone than `together`; None for fewer than two."""
    found: dict[str, ModeSearch] = {}
    for test in trained if len(trained) > 1 else ():
        with suppress(UserError):
            band = (options.band_low_hz, options.band_high_hz)
            found[test.name] = search_modes((test,), layout, *band, tests.source, tests.decays)
    numbers = max((item.numbers for item in found.values()), key=len, default=())
    same = {name: item.fit for name, item in found.items() if item.numbers == numbers}
    if len(numbers) <= together or len(same) < 2:
        return None
    return list(same), poles_of_searches(list(same.values()))


def order_findings(chosen: ChosenTests, tests: FrameTests, layout: Layout, options: IdentificationOptions) -> list[str]:
    """Return a line if modes are missing because sensors are at other floors than declared; else nothing.

    With exchanged sensors the shapes contradict orthogonality and the numbers of sign changes, so that the choice among
    the poles leaves modes out. A search without these conditions gives all shapes.

    Parameters
    ----------
    chosen
        The modes that were found.
    tests, layout, options
        As for :func:`modes_of_tests`.
    """
    fit, floors = chosen.search.fit, layout.floors
    if layout.masses is None or not chosen.tests or len(chosen.search.numbers) == floors:
        return []
    if not all_floors_measured(fit, layout):
        return []
    free = Layout(floors, None, is_chain=False)
    with suppress(UserError):
        band = (options.band_low_hz, options.band_high_hz)
        every = search_modes(chosen.tests, free, *band, tests.source, tests.decays).fit
        if every.angular_frequencies.size == floors:
            places = exchanged_floors(layout.masses, *floor_shapes(every, free), every.angular_frequencies)
            return [Doubt(exchanged_finding(places))] if places else []
    return []


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
