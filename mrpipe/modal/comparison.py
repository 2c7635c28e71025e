"""Comparison of the identified structure with its forced tests, for constant and amplitude-dependent modes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Progress
from mrpipe.modal.amplitude.dependence import AmplitudeDependence, amplitude_finding
from mrpipe.modal.amplitude.law_fit import find_amplitude_dependence
from mrpipe.modal.matrices.rigid_floors import rigid_response
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.chosen_tests import ChosenTests
from mrpipe.modal.verification import (
    POOR_FIT_PERCENT,
    FrequencyVerification,
    TimeVerification,
    compare_in_time,
    misfit_findings,
    verify_in_frequency,
    verify_in_time,
)
from mrpipe.structures import Frame


@dataclass(frozen=True)
class Comparison:
    """Agreement between the identified structure and its forced tests.

    Attributes
    ----------
    tests
        The forced tests.
    in_time, in_frequency
        Comparison of the structure with each test, and with the frequency responses; empty and None without matrices.
    amplitude, amplitude_in_time
        Amplitude-dependent modes and their simulation of each test; None and empty if constant modes predict as well.
    """

    tests: tuple[FrameTest, ...]
    in_time: tuple[TimeVerification, ...] = ()
    in_frequency: FrequencyVerification | None = None
    amplitude: AmplitudeDependence | None = None
    amplitude_in_time: tuple[TimeVerification, ...] = ()


def compare_with_tests(
    frame: Frame | None,
    shown: tuple[FrameTest, ...],
    chosen: ChosenTests,
    positions: Mapping[str, tuple[float, float]] | None,
    options: IdentificationOptions,
    progress: Progress,
    unlike: Collection[str] = (),
) -> tuple[Comparison, list[str]]:
    """Return how well the structure predicts the forced tests, and findings.

    Parameters
    ----------
    frame
        Identified structure; None if the data determine modes only.
    shown
        All forced tests; empty where the modes come from ambient tests.
    chosen
        The modes, and the tests that determine them.
    positions
        Positions of the sensors on rigid floors; None for one direction.
    options, progress
        Settings of the identification, and what is called with the share that is done.
    unlike
        Names of tests of a structure in another state, which need not be reproduced.
    """
    if not shown:
        return Comparison(shown), []
    fit, band = chosen.search.fit, chosen.search.band_hz
    # beyond its highest mode the frame carries no information on a flexible support
    inside = (band[0], min(band[1], 1.15 * float(fit.angular_frequencies[-1]) / (2.0 * np.pi)))
    result, findings = Comparison(shown), []
    if frame is not None:
        result = replace(result, in_time=tuple(_verified(frame, test, inside, positions) for test in shown))
    # errors of picked modes are those of the lines of the spectrum; a law over amplitude would only explain these
    if options.amplitude_dependence and options.modes_from == "fit":
        progress(0.85, "amplitude")
        # a clipped sensor makes the motion look smaller than it is
        used = [test for test in chosen.tests if test.excitation is not None and not test.is_clipped]
        amplitude = find_amplitude_dependence(fit, used) if used else None
        if amplitude is not None:
            findings.append(amplitude_finding(amplitude))
            in_time = tuple(compare_in_time(amplitude.model.response(test), test, inside) for test in shown)
            result = replace(result, amplitude=amplitude, amplitude_in_time=in_time)
    # the synthesised frequency responses are those of one direction
    if frame is not None and positions is None:
        findings = [*_misfits(frame, result, inside, unlike), *findings]
        result = replace(result, in_frequency=verify_in_frequency(frame, fit, inside))
    return result, findings


def _misfits(frame: Frame, result: Comparison, inside: tuple[float, float], unlike: Collection[str]) -> list[str]:
    """Return what explains tests that M, C and K do not reproduce, without those that laws over amplitude explain."""
    pairs = list(zip(result.tests, result.in_time, strict=True))
    explained = {item.test for item in result.amplitude_in_time if np.median(item.fit_percent) > POOR_FIT_PERCENT}
    left = [(test, item) for test, item in pairs if test.name not in explained and test.name not in unlike]
    return misfit_findings(frame, [test for test, _ in left], [item for _, item in left], inside)


def _verified(
    frame: Frame, test: FrameTest, band_hz: tuple[float, float], positions: Mapping[str, tuple[float, float]] | None
) -> TimeVerification:
    """Simulate a forced test with the identified frame; `positions`: positions of the sensors on rigid floors."""
    if positions is None:
        return verify_in_time(frame, test, band_hz)
    return compare_in_time(rigid_response(frame, test, positions, band_hz[1]), test, band_hz)
