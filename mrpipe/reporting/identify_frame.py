"""Section of the report: mass, damping, stiffness and modes of the frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from mrpipe.modal.identification import FrameIdentification
from mrpipe.modal.spectra import averaged_responses
from mrpipe.reporting import modal as figures
from mrpipe.reporting.sink import Sink


@dataclass(frozen=True)
class IdentifiedFrame:
    """Results of `identify-frame` for the report.

    Attributes
    ----------
    identification
        The frame with its tests and checks.
    summary
        The summary that the stage prints.
    segment_s
        Length of the segments of the averaged spectra [s].
    """

    identification: FrameIdentification
    summary: Mapping[str, Any]
    segment_s: float


def describe(sink: Sink, result: IdentifiedFrame) -> None:
    """Write the section of `identify-frame` of the report."""
    found, values = result.identification, result.summary
    count, frequencies = len(found.numbers), values["frequencies_hz"]
    sink.text(
        f"{count} modes between {frequencies[0]:.3g} and {frequencies[-1]:.3g} Hz. {method_in_words(bool(found.tests))}"
    )
    sink.table("modes", pd.DataFrame(figures.mode_rows(values)), "Modes with 95 % intervals.")
    if found.clocks:
        sink.table("clocks", pd.DataFrame(values["clocks"]), "Delays of sensors that were corrected.")
    if found.candidates:
        sink.figure(
            "stabilisation",
            figures.stabilisation(values["stabilisation"], frequencies),
            "Stabilisation: in how many model orders a pole appears; lines: modes of the structure.",
        )
    if found.frame is not None:
        figures.matrix_tables(sink, found.frame)
    if found.in_frequency is not None:
        averaged = averaged_responses(found.tests[0], result.segment_s)
        sink.figure(
            "frequency-responses",
            figures.frequency_responses(found.in_frequency, averaged, found.band_hz),
            "Frequency responses: measured (leakage taken out), of M, C and K, and coherence of the averaged spectra.",
        )
    names = found.degrees_of_freedom
    shapes = figures.mode_shapes(found.mode_shapes, frequencies, names=names)
    sink.figure("mode-shapes", shapes, figures.shapes_caption(names))
    law = values["amplitude_dependence"]
    if law is not None:
        rows = [
            {
                "mode": mode,
                "amplitude [mm]": 1e3 * item["amplitudes_m"][mode - 1],
                "frequency [Hz]": item["frequencies_hz"][mode - 1],
                "damping [%]": 100.0 * item["damping_ratios"][mode - 1],
            }
            for mode in range(1, count + 1)
            for item in law["at_amplitudes"]
        ]
        sink.table(
            "amplitude",
            pd.DataFrame(rows),
            "Frequencies and damping ratios over the amplitude at the sensor that moves most; M, C and K are those of "
            "constant modes.",
        )
    if found.decays:
        decays = [found.decays[mode] for mode in sorted(found.decays)]
        sink.figure("decays", figures.decays(decays), "Free decays, exponential fit and peak-to-peak damping.")
    if found.in_time:
        text = "Measured and simulated response of a forced test."
        sink.figure("verification", figures.verification(found.in_time[0]), text)


def method_in_words(forced: bool) -> str:
    """Return how modes and damping were found."""
    if forced:
        return (
            "Poles are fitted to all sensors of all tests at once, including the transients at both ends of each "
            "record. Damping comes from free decays where there are any, and from the forced tests as a second, "
            "independent method."
        )
    return (
        "Poles come from the responses alone, without the excitation, and frequency and damping of each mode "
        "from maximum likelihood. Damping comes from free decays where there are any."
    )
