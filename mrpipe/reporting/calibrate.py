"""Section of the report on the calibration of the laws."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.control import exact, limits
from mrpipe.control.calibration import Calibration
from mrpipe.control.laws import law_named
from mrpipe.control.linearisation import friction_stiffness
from mrpipe.reporting import control as figures
from mrpipe.reporting.sink import Sink
from mrpipe.structures import Frame


def describe(
    sink: Sink,
    frame: Frame,
    calibration: Calibration,
    summary: Mapping[str, Any],
    amplitude_m: float,
    map_points: int,
) -> None:
    """Write the section of `calibrate`.

    Parameters
    ----------
    sink
        Part of the report that is written.
    frame, calibration, summary
        The frame, its calibration, and the summary as `--json` prints it.
    amplitude_m
        Damper amplitude of the loops that are shown.
    map_points
        Number of points along each axis of the damping maps.
    """

    modes = calibration.modes
    locked = "no motion" if modes.is_single else f"{modes.omega_inf:.3f} rad/s"
    sink.text(
        f"Mode {modes.mode}: {modes.omega_0:.3f} rad/s free, {locked} with the damper locked, modal "
        f"flexibility {modes.nu:.4g} m/N, static stiffness at the damper {calibration.static_stiffness_n_m:.0f} N/m."
    )
    rows = [
        {"law": law, **{key: value for key, value in entry.items() if isinstance(value, float | int)}}
        for law, entry in summary["laws"].items()
    ]
    sink.table("laws", pd.DataFrame(rows), "Gains and damping of every law; friction by its equivalent.")
    sources = [
        {"law": law, "source": source, **gains}
        for law, entry in summary["laws"].items()
        for source, gains in entry["candidates"].items()
    ]
    sink.table(
        "candidates",
        pd.DataFrame(sources),
        "Gains by source: by closed form, of best exact damping and, where given, as published.",
    )
    _maps(sink, frame, calibration, map_points)
    _loops(sink, calibration, amplitude_m)


def _maps(sink: Sink, frame: Frame, calibration: Calibration, points: int) -> None:
    position = calibration.position
    modes, bare = calibration.modes, exact.undamped(frame)
    optimum = limits.optimal_viscosity(modes)
    c = np.linspace(optimum / points, 2.0 * optimum, points)
    k = np.linspace(-1.1 * calibration.static_stiffness_n_m, calibration.static_stiffness_n_m, points)
    laws = calibration.laws
    target = exact.target_mode(bare, position, modes)
    over_c = np.array([target.linear(float(value), 0.0).damping_ratio for value in c])
    estimate = np.array([limits.damping_estimate(modes, 0.0, value * modes.omega_0) for value in c])
    sink.figure(
        "viscosity",
        figures.damping_over_gain(c, over_c, estimate, _mark(calibration, "vd"), "c [N s/m]"),
        "Viscous damping.",
    )
    largest = 0.75 * limits.largest_friction(modes)
    alpha = np.linspace(largest / points, largest, points)
    H = [friction_stiffness(float(value)) for value in alpha]
    sink.figure(
        "friction",
        figures.damping_over_gain(
            alpha,
            exact.friction_map(bare, position, modes, alpha),
            np.array([limits.damping_estimate(modes, item.real, item.imag) for item in H]),
            _mark(calibration, "fdns"),
            "alpha [N/m]",
        ),
        "Friction with negative stiffness, by its equivalent.",
    )
    sink.figure(
        "map",
        figures.damping_over_gains(
            c,
            k,
            exact.damping_map(bare, position, modes, c, k),
            {law: (item.gains.c_n_s_m, item.gains.k_n_m) for law, item in laws.items() if law_named(law).linear},
            calibration.static_stiffness_n_m,
        ),
        "Exact damping over viscosity and stiffness of an unclipped device; white: statically unstable.",
    )


def _mark(calibration: Calibration, law: str) -> dict[str, tuple[float, float]]:
    """Return gain and damping ratio with which a law runs, under its name in figures; empty if it was left out."""
    if law not in calibration.laws:
        return {}
    item = calibration.laws[law]
    return {f"{law} as run": (item.gains[law_named(law).gain_names[0]], item.damping_ratio_exact)}


def _loops(sink: Sink, calibration: Calibration, amplitude_m: float) -> None:
    phase = np.linspace(0.0, 2.0 * np.pi, 721)
    x, v = amplitude_m * np.sin(phase), amplitude_m * calibration.modes.omega_0 * np.cos(phase)
    loops = {}
    for name, item in calibration.laws.items():
        demand = law_named(name).harmonic_force
        if demand is not None:
            loops[name] = (x, demand(item.gains, x, v, amplitude_m))
    sink.figure("loops", figures.law_loops(loops), "Desired force in harmonic motion.")
