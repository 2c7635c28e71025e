"""The modes of a frame from its forced tests, from its ambient tests if none is forced, else from its free decays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.modal.ambient.clocks import synchronised
from mrpipe.modal.ambient.free_decays import find_decay_modes
from mrpipe.modal.ambient.harmonics import harmonic_findings, without_harmonics
from mrpipe.modal.ambient.modes import find_ambient_modes
from mrpipe.modal.clocks.delays import SensorClock, added
from mrpipe.modal.clocks.sensor_errors import SensorErrors
from mrpipe.modal.fit.own_residues import with_own_residues
from mrpipe.modal.loggers import aligned, far_clocks, limit_findings
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.chosen_tests import ChosenTests, choose_tests, with_clocks, without_complex
from mrpipe.modal.search.free_response import with_decays
from mrpipe.modal.search.hidden import contested, sharpened, with_missing_modes
from mrpipe.modal.search.peak_picking import pick_peaks
from mrpipe.modal.search.selection import Layout


def find_modes(
    tests: FrameTests,
    forced: tuple[FrameTest, ...],
    layout: Layout,
    options: IdentificationOptions,
    progress: Progress = no_progress,
) -> tuple[ChosenTests, tuple[SensorClock, ...], list[str]]:
    """Return the modes with the tests that determine them, the corrected clocks of sensors, and findings.

    Parameters
    ----------
    tests
        All tests of the frame.
    forced
        Forced tests, those for training first. Sensors whose clocks are far from the others are aligned before the
        search. Without forced tests, the modes come from the ambient tests, and without these from the free decays.
    layout
        Number of floors and how the sensors stand on them.
    options
        Settings of the identification.
    progress
        Called with the share that is done.

    Raises
    ------
    UserError
        If no mode is found.
    """
    progress(0.05, "poles")
    if not forced and not tests.ambient:
        search = find_decay_modes(tests.decays, layout, options.band_low_hz, options.band_high_hz, tests.source)
        return ChosenTests(search, ()), (), [*_ambient_findings(tests), *search.notes]
    if not forced:
        band = (options.band_low_hz, options.band_high_hz)
        quiet, harmonics = without_harmonics(tests.ambient, options.band_low_hz)
        ambient, corrected = synchronised(quiet, band, options)
        search = find_ambient_modes(ambient, layout, *band, tests.source, options.ambient_method)
        findings = [*_ambient_findings(tests), *harmonic_findings(harmonics)]
        findings += [*clock_findings(corrected), *search.notes]
        return ChosenTests(search, ()), corrected, findings
    far = far_clocks(forced, options.band_low_hz, options.band_high_hz) if options.clock_correction else ()
    limits = limit_findings(forced, far)
    forced = tuple(aligned(test, far) for test in forced)
    chosen, findings = choose_tests(forced, tests, layout, options)
    findings += limits
    if tests.ambient:
        findings.append("ambient tests were not used, because forced tests determine the modes better")
    clocks: tuple[SensorClock, ...] = ()
    if options.clock_correction:
        progress(0.3, "clocks")
        chosen, clocks = with_clocks(chosen, tests, layout, options)
        clocks = tuple(added(far, clocks))
        findings += clock_findings(clocks)
        chosen = ChosenTests(without_complex(chosen.search), chosen.tests)
    chosen = _completed(chosen, layout, options, progress)
    sharp = sharpened(chosen.search, chosen.tests)
    # a fit of the forced tests alone does not contain the modes that decay tests show better
    cleaning = SensorErrors(chosen.tests, clocks).removed if clocks else None
    whole = with_decays(with_own_residues(sharp.fit, cleaning), tests.decays)
    chosen = ChosenTests(replace(sharp, fit=whole), chosen.tests)
    if options.modes_from == "peak-picking" and chosen.tests:
        picked = pick_peaks(chosen.tests, chosen.search.fit, chosen.search.band_hz)
        chosen = replace(chosen, search=replace(chosen.search, fit=picked))
    return chosen, clocks, findings


def _completed(chosen: ChosenTests, layout: Layout, options: IdentificationOptions, progress: Progress) -> ChosenTests:
    """Return the modes with those of a chain of floors that have no peak, each of them contested by the tests."""
    if layout.is_chain and len(chosen.search.numbers) < layout.floors:
        progress(0.4, "hidden modes")
        more = with_missing_modes(chosen.search, chosen.tests, layout, options.band_high_hz)
        chosen = ChosenTests(more, chosen.tests)
    if layout.is_chain and len(chosen.search.numbers) == layout.floors:
        chosen = ChosenTests(contested(chosen.search, chosen.tests, layout), chosen.tests)
    return chosen


def _ambient_findings(tests: FrameTests) -> list[str]:
    given = np.isfinite(tests.floor_masses).any()
    known = "given floor masses" if given else "the added masses" if tests.with_added_masses else ""
    scale = f"the scale of M, C and K comes from {known}" if known else "and nothing gives M, C and K a scale"
    return [
        "the modes come from the responses alone, so modal masses and participations cannot be determined; " + scale
    ]


def clock_findings(clocks: Sequence[SensorClock]) -> list[str]:
    """Return a line for each test whose sensors have delays.

    Parameters
    ----------
    clocks
        The delays that were corrected.
    """
    findings = []
    for name in dict.fromkeys(item.test for item in clocks):
        own = [item for item in clocks if item.test == name]
        delays = ", ".join(_delay_text(item) for item in own)
        findings.append(f"test {name}: clocks of sensors were corrected ({delays})")
    return findings


def _delay_text(clock: SensorClock) -> str:
    text = f"floor {clock.sensor.floor}{clock.sensor.direction} {1e3 * clock.offset_s:+.2f} ms"
    if clock.drift:
        text += f" and {1e6 * clock.drift:+.1f} us/s"
    if clock.step_s:
        text += f" and {1e3 * clock.step_s:+.2f} ms from {clock.step_at_s:.3g} s"
    return text
