"""Sections of the report on a structure with several dampers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, figure_with_axes, label
from mrpipe.simulation.several_dampers import DampersResponse
from mrpipe.simulation.several_dampers_rig import DampersRig


def _gains(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.5g}" for name, value in values.items()) or "none"


def describe_calibration(sink: Sink, summary: Mapping[str, Any]) -> None:
    """Write the section of `calibrate`; `summary` is what the command prints."""
    rows = [
        {
            "damper": row["name"],
            "law": row["law"],
            "target mode": row["target_mode"],
            "brace [N/m]": row["brace_stiffness_n_m"] or "rigid",
            "gains alone": _gains(row["gains_alone"]),
            "gains together": _gains(row["gains"]),
            "expected amplitude [m]": row["expected_amplitude_m"],
            "residual force [N]": row["residual_force_n"],
        }
        for row in summary["dampers"]
    ]
    sink.table("dampers", pd.DataFrame(rows), "Dampers: gains for each alone and for all together.")
    together, alone = summary["together"], summary["alone"]
    modes = {
        "mode": together["modes"],
        "free [rad/s]": together["omega_free"],
        "with dampers [rad/s]": together["omega"],
        "damping ratio, gains together": together["damping_ratios"],
        "damping ratio, gains alone": alone["damping_ratios"],
    }
    sink.table(
        "modes",
        pd.DataFrame(modes),
        "Modes of the structure with all dampers, by exact complex eigenvalues. A nonlinear law counts by its linear "
        "equivalent; a law without one, such as lqg, is left out.",
    )


def describe_simulation(sink: Sink, rig: DampersRig, response: DampersResponse, summary: Mapping[str, Any]) -> None:
    """Write the section of `simulate`; `summary` is what the command prints."""
    sink.table("dampers", pd.DataFrame(summary["dampers"]), "What each damper did (SI).")
    run = {key: value for key, value in summary.items() if isinstance(value, float | int)}
    sink.table("indices", pd.DataFrame({"index": list(run), "value": list(run.values())}), "Response (SI).")
    sink.figure("histories", _histories(response), "Top displacement and damper forces.")
    sink.figure("loops", _loops(response), "Damper force against displacement and velocity.")
    names = ", ".join(f"{item.known.name} ({item.known.law})" for item in rig.dampers)
    sink.text(f"Dampers and their laws: {names}. The energy balance closes to {summary['energy_balance_error']:.1e}.")


def _histories(response: DampersResponse) -> Figure:
    figure, axes = figure_with_axes(2, 1, height=4.2)
    first = response.first
    axes[0, 0].plot(first.time_s, 1e3 * first.displacement[:, first.top], color=COLOURS[0], linewidth=0.8)
    label(axes[0, 0], "time [s]", "top displacement [mm]")
    for number, (name, own) in enumerate(response.dampers.items()):
        axes[1, 0].plot(own.time_s, own.force, color=COLOURS[number % len(COLOURS)], linewidth=0.8, label=name)
    label(axes[1, 0], "time [s]", "damper force [N]")
    axes[1, 0].legend(fontsize=7)
    return figure


def _loops(response: DampersResponse) -> Figure:
    figure, axes = figure_with_axes(1, 2, height=3.2)
    for number, (name, own) in enumerate(response.dampers.items()):
        colour = COLOURS[number % len(COLOURS)]
        step = max(1, len(own.time_s) // 4000)
        axes[0, 0].plot(
            1e3 * own.damper_displacement[::step], own.force[::step], color=colour, linewidth=0.6, label=name
        )
        axes[0, 1].plot(1e3 * own.damper_velocity[::step], own.force[::step], color=colour, linewidth=0.6)
    label(axes[0, 0], "damper displacement [mm]", "force [N]")
    label(axes[0, 1], "damper velocity [mm/s]", "force [N]")
    axes[0, 0].legend(fontsize=7)
    return figure


def describe_design(sink: Sink, summary: Mapping[str, Any]) -> None:
    """Write the section of `design`; `summary` is what the command prints."""
    best, start = summary["best"], summary["calibrated"]
    sink.text(
        f"The largest RMS top displacement over the frequency band is {1e3 * best['peak_rms_x_top_m']:.2f} mm with the "
        f"best gains and {1e3 * start['peak_rms_x_top_m']:.2f} mm with the calibrated gains."
    )
    rows = [
        {
            "damper": name,
            "law": item["law"],
            "factor": item["factor"],
            "calibrated gains": _gains(item["calibrated_gains"]),
            "best gains": _gains(item["gains"]),
        }
        for name, item in summary["dampers"].items()
    ]
    sink.table("dampers", pd.DataFrame(rows), "Gains of the dampers, searched together.")
    curves = summary["curves"]
    figure, axes = figure_with_axes(1, 1, height=3.2)
    for number, (name, curve) in enumerate(curves.items()):
        frequency = np.asarray(curve["frequency_rad_s"])
        axes[0, 0].plot(frequency, 1e3 * np.asarray(curve["rms_x_top_m"]), color=COLOURS[number], label=name)
    label(axes[0, 0], "frequency [rad/s]", "RMS top displacement [mm]")
    axes[0, 0].legend(fontsize=7)
    sink.figure("curves", figure, "Response over frequency at the largest amplitude.")
