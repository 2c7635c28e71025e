"""Part of the reports on the 1000 kN damper: its force diagram and the validation of its neural inverse."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mrpipe.case_studies.inverse import AMPLITUDE_M, FREQUENCY_HZ, ValidatedInverse, bingham_force
from mrpipe.case_studies.run import BinghamDevice
from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, MEASURED, figure_with_axes, label
from mrpipe.words import in_percent

VOLTAGES = (2.0, 4.0, 6.0)
"""Levels of the command in Figure 6.1 (a) [V]; the thesis prints them in A."""


def inverse_errors(inverse: ValidatedInverse | None) -> dict[str, Any]:
    """Return the entries of the summary on the neural inverse; None where the formula is used."""
    return {
        "neural_inverse_nrmse": None if inverse is None else inverse.held_out_nrmse,
        "neural_inverse_validation_nrmse": None if inverse is None else inverse.nrmse,
    }


def describe_device(sink: Sink, device: BinghamDevice, inverse: ValidatedInverse | None) -> None:
    """Write the figures of one damper.

    Parameters
    ----------
    sink
        Section of the report.
    device
        The damper.
    inverse
        Neural inverse of the device; None if the formula is used.
    """
    sink.figure(
        "force-diagram",
        force_diagram(device),
        f"Force of one damper at constant voltages, sine of {AMPLITUDE_M:g} m at {FREQUENCY_HZ:g} Hz (Figure 6.1 (a)).",
    )
    if inverse is not None:
        sink.figure(
            "inverse-validation",
            inverse_figure(inverse),
            "Voltage that the neural inverse estimates from velocity and force, and the voltage that gave this force. "
            f"The error is {in_percent(inverse.nrmse, digits=2)} of the RMS voltage (Figure 6.1 (b)).",
        )


def force_diagram(device: BinghamDevice) -> Figure:
    """Return force against displacement and against velocity at constant voltages."""
    figure, axes = figure_with_axes(1, 2, width=8.0, height=3.2)
    # the force jumps at each reversal; samples are so dense that the jump is drawn as a vertical line
    phase = np.linspace(0.0, 2.0 * np.pi, 2001)
    displacement = AMPLITUDE_M * np.sin(phase)
    velocity = AMPLITUDE_M * 2.0 * np.pi * FREQUENCY_HZ * np.cos(phase)
    for colour, voltage in zip(COLOURS, VOLTAGES, strict=False):
        force = bingham_force(device, velocity, np.full_like(velocity, voltage)) * 1e-3
        axes[0, 0].plot(displacement * 1e3, force, color=colour, linewidth=0.9, label=f"{voltage:g} V")
        axes[0, 1].plot(velocity, force, color=colour, linewidth=0.9, label=f"{voltage:g} V")
    axes[0, 0].legend(fontsize=7)
    label(axes[0, 0], "displacement [mm]", "force [kN]")
    label(axes[0, 1], "velocity [m/s]", "force [kN]")
    return figure


def inverse_figure(inverse: ValidatedInverse) -> Figure:
    """Return the voltage and its estimate against time."""
    figure, axes = figure_with_axes(1, 1, width=9.0, height=3.0)
    axis = axes[0, 0]
    axis.plot(inverse.time_s, inverse.voltage_v, color=MEASURED, linewidth=2.0, alpha=0.6, label="given")
    axis.plot(inverse.time_s, inverse.estimate_v, color=COLOURS[0], linewidth=0.8, label="neural inverse")
    axis.legend(fontsize=7)
    label(axis, "time [s]", "voltage [V]")
    return figure
