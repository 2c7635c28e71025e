"""Section of the report on the response over frequency."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from mrpipe.reporting.sink import Sink
from mrpipe.reporting.style import COLOURS, figure_with_axes, label
from mrpipe.simulation.resonance import Curves
from mrpipe.words import in_percent

STATED = ("rms_x_top_m", "rms_a1_m_s2")
"""Largest values that the text states."""


def describe(sink: Sink, law: str, curves: Curves) -> None:
    """Write the section of a stage `resonance-LAW`.

    Parameters
    ----------
    sink
        Part of the report that is written.
    law, curves
        The law, and its response curves.
    """
    nominal = curves.nominal
    sink.text(
        f"Law {law}: the loop resonates at {nominal.resonance_rad_s:.2f} rad/s, where the RMS displacement of the top "
        f"floor is {1e3 * nominal.peak('rms_x_top_m'):.1f} mm under a harmonic base acceleration of "
        f"{nominal.base_amplitude_m_s2:.3g} m/s². The largest RMS acceleration of floor 1 over the band is "
        f"{nominal.peak('rms_a1_m_s2'):.2f} m/s². The standard error of these values is "
        f"{in_percent(max(nominal.peak_error(name) / nominal.peak(name) for name in STATED), 2)} or less."
    )
    rows = pd.DataFrame(curves.as_json()["amplitudes"])
    stated = [name for name in rows if not str(name).startswith("standard_error")]
    sink.table("peaks", rows[stated], "Resonance and largest responses over the band (SI).")
    sink.figure("curve", curve_figure(curves), "Steady RMS response over frequency; the dots are the resonances.")


def curve_figure(curves: Curves) -> Figure:
    """Return top displacement and acceleration of floor 1 over frequency, one line per amplitude."""
    figure, axes = figure_with_axes(1, 2, height=2.8)
    for axis, quantity, scale, name in zip(
        axes[0],
        ("rms_x_top_m", "rms_a1_m_s2"),
        (1e3, 1.0),
        ("RMS top displacement [mm]", "RMS acceleration of floor 1 [m/s²]"),
        strict=True,
    ):
        for number, (factor, curve) in enumerate(zip(curves.factors, curves.curves, strict=True)):
            values = scale * curve.column(quantity)
            colour = COLOURS[number % len(COLOURS)]
            axis.plot(curve.frequency_rad_s, values, color=colour, label=f"{factor:g} x", linewidth=1.2)
            top = int(values.argmax())
            axis.plot(curve.frequency_rad_s[top], values[top], "o", color=colour, markersize=4)
        label(axis, "frequency [rad/s]", name)
    if len(curves.factors) > 1:
        axes[0, 0].legend(fontsize=7, title="amplitude", title_fontsize=7)
    return figure
