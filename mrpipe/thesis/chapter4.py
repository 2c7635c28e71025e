"""Chapter 4, P2 and P3: limiting modes, closed forms, exact optima, misprinted formulas, Table 4.1 and P3's Table 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray
from mrpipe.control import exact, limits
from mrpipe.control.calibration import CalibrationOptions, calibrate
from mrpipe.signals.error_size import nrmse
from mrpipe.signals.kalman import continuous_kalman_gains, kinematic_kalman
from mrpipe.simulation.sensors import SensorNoise
from mrpipe.structures import Frame, floor_position
from mrpipe.thesis.bench import OMEGA, Bench, LoopRun, amplitude_of, excite, run_law
from mrpipe.thesis.claim import Missing, Outcomes, Value
from mrpipe.thesis.entries import printed_columns, printed_gains, table_id

_RATE_HZ = 1000.0


def _closed_forms(frame: Frame) -> Outcomes:
    """Return what the printed frame gives by closed forms and by exact eigenvalues."""
    gains = printed_gains()
    c, k, alpha = gains["vd"]["c_n_s_m"], gains["vdns"]["k_n_m"], gains["fdns"]["alpha_n_m"]
    w = floor_position(frame.floors)
    found = calibrate(
        frame,
        w,
        CalibrationOptions(
            source="published",
            published=gains,
            positive_stiffness_n_m=gains["vdps"]["k_n_m"],
            negative_stiffness_n_m=k,
        ),
    )
    modes, static = found.modes, limits.static_stiffness(frame, w)
    bare = exact.undamped(frame)
    vd, vdns, fdns = (dict(found.laws[law].candidates) for law in ("vd", "vdns", "fdns"))
    best, best_alpha = vd["exact"].c_n_s_m, fdns["exact"].alpha_n_m
    by = "printed frame with the signs of its mode matrix corrected"
    values = {
        "B6": modes.omega_0,
        "B7": modes.omega_inf,
        "B8": modes.nu,
        "A4c": [modes.omega_0, modes.omega_inf, modes.nu],
        "A8a": static,
        "A8b": static,
        "A8c": exact.exact_damping(bare, w, modes, gains["vdns"]["c_n_s_m"], k).unstable_pole,
        "A8d": 4000.0 / static,
        "A8e": -static,
        "A9a": vd["closed-form"].c_n_s_m,
        "A9b": vd["closed-form-thesis"].c_n_s_m,
        "A9c": best,
        "B9": [vd["closed-form"].c_n_s_m, vd["closed-form-thesis"].c_n_s_m, best],
        "A11a": limits.attainable_damping(modes),
        "B10": limits.attainable_damping(modes),
        "A9d": [exact.exact_damping(bare, w, modes, value, 0.0).damping_ratio for value in (c, best)],
        "A10a": vdns["closed-form"].c_n_s_m,
        "A10b": vdns["closed-form"].c_n_s_m,
        "A10c": vdns["closed-form-thesis"].c_n_s_m,
        "A11b": limits.attainable_damping(modes, k),
        "A11c": limits.optimal_friction(modes),
        "A11d": limits.attainable_damping_friction(modes),
        "A11e": [best_alpha, exact.exact_friction(bare, w, modes, best_alpha).damping_ratio],
        "B11": exact.exact_friction(frame, w, modes, alpha).damping_ratio,
        "P2-0.62": limits.optimal_friction(modes) * modes.nu,
        "P2-2.06": limits.attainable_damping_friction(modes)
        * (modes.omega_inf + modes.omega_0)
        / (modes.omega_inf - modes.omega_0),
        "P2-nu-k": modes.nu * k,
        "T4.30": limits.optimal_force_ratio(modes) * modes.nu,
    }
    return {name: Value(value, by) for name, value in values.items()} | _formulas(modes, k)


def _formulas(modes: limits.LimitingModes, k: float) -> Outcomes:
    """Return what the misprinted formulas give."""
    # (omega_inf^2 - omega_0^2)/u_0^2, the right-hand form of P2 (13) for k = 0, over its left-hand form
    right = (modes.omega_inf**2 - modes.omega_0**2) / modes.u_0**2
    left = limits.optimal_viscosity(modes)
    phase = 2.0 * np.pi * (np.arange(2000) + 0.5) / 2000
    x, v = 6e-3 * np.sin(phase), 6e-3 * modes.omega_0 * np.cos(phase)
    force = 250.0 * v + k * x
    as_printed = np.where(force < 0.0, 0.0, force)  # the second case of (4.17)
    active = float(np.mean(as_printed * v < -1e-12))
    by = "the printed formula, evaluated"
    return {
        "A12a": Value(right / left, by),
        "A12b": Value(active, by),
    }


def _kalman() -> Outcomes:
    gains = continuous_kalman_gains(20e-6, 0.1)
    k, gain = gains.k, gains.l
    # x1' = x2 + k (y - x1), x2' = l (y - x1): (5.3) as printed, without the acceleration
    s = OMEGA * 1j
    filter_matrix = np.array([[s + k, -1.0], [gain, s]])
    printed = np.linalg.solve(filter_matrix, np.array([k, gain]))[1] / s
    time = np.arange(int(20.0 * _RATE_HZ)) / _RATE_HZ
    x: FloatArray = 6e-3 * np.sin(OMEGA * time)
    v: FloatArray = 6e-3 * OMEGA * np.cos(OMEGA * time)
    _, estimated, _ = kinematic_kalman(x, -(OMEGA**2) * x, 1.0 / _RATE_HZ, gains)
    late = time > 10.0
    error = nrmse((estimated - v)[late], v[late])
    return {
        "A12e": Value([abs(printed), -np.angle(printed)], "transfer function of (5.3) as printed"),
        "A12f": Value(error, "discrete Kalman filter on sinusoidal motion"),
        "D1": Value([k, gain], "noise of 20 um and 0.1 m/s²"),
    }


def cycle_peaks(run: LoopRun) -> dict[str, float]:
    """Return the RMS over the steady cycles of the largest value of each cycle (section 4.5), by the rows of Table 4.1.

    Parameters
    ----------
    run
        Run under harmonic excitation.
    """
    response, excitation = run.response, run.excitation
    first, last = excitation.steady_s
    period = 2.0 * np.pi / excitation.frequency_rad_s
    cycle = np.floor((response.time_s - first) / period + 1e-9).astype(np.int64)
    count = round((last - first) / period)
    histories = {
        "peak_x1_m": response.displacement[:, 0],
        "peak_x5_m": response.displacement[:, -1],
        "peak_a1_m_s2": response.acceleration[:, 0],
        "peak_a5_m_s2": response.acceleration[:, -1],
    }
    return {
        name: float(np.sqrt(np.mean([np.max(np.abs(values[cycle == number])) ** 2 for number in range(count)])))
        for name, values in histories.items()
    }


def _tables(bench: Bench) -> Outcomes:
    """Return Table 4.1 and Table 1 of P3 with what chapter 4 and P3 say of them."""
    top = printed_columns("Table 4.1", "T4.1")["vd"]["peak_x5_m"]
    rig = bench.rig
    amplitude = amplitude_of(rig, top / np.sqrt(2.0))
    runs = {law: run_law(rig, law, excite(amplitude), bench.seed) for law in bench.laws if law != "vdps"}
    peaks = {law: cycle_peaks(run) for law, run in runs.items()}
    # the viscous damper of P3 is not an MR damper: its force is c times the true velocity at every instant
    linear = replace(rig, options=replace(rig.options, tracking="continuous", noise=SensorNoise()))
    peaks["viscous"] = cycle_peaks(run_law(linear, "vd", excite(amplitude), bench.seed))
    by = f"closed loop of {bench.source} at {OMEGA:g} rad/s and {amplitude:.3f} m/s²"
    found: Outcomes = {}
    for part, table in (("T4.1", "Table 4.1"), ("P3-T1", "P3 Table 1")):
        for law, rows in printed_columns(table, part).items():
            for row in rows:
                found[table_id(part, law, row)] = (
                    Value(peaks[law][row], by) if law in peaks else Missing("the network of nnc is part of a run only")
                )
    x5 = {law: rows["peak_x5_m"] for law, rows in peaks.items()}
    x1 = {law: rows["peak_x1_m"] for law, rows in peaks.items()}
    a5 = {law: rows["peak_a5_m_s2"] for law, rows in peaks.items()}
    found["F4-top"] = Value([x5["vdns"] / x5["vd"], x5["fdns"] / x5["vd"]], by)
    found["F4-damper"] = Value([x1["vdns"] / x1["vd"], x1["fdns"] / x1["vd"]], by)
    reference = "nnc" in peaks
    missing = Missing("the network of nnc is part of a run only")
    laws = ("vdns", "fdns", "nnc") if reference else ("vdns", "fdns")
    found["F4-acceleration"] = Value([a5[law] / a5["vd"] for law in laws], by)
    found["F4-nnc"] = Value(x5["nnc"] / x5["fdns"], by) if reference else missing
    found["P3-35"] = Value(1.0 - x1["nnc"] / x1["vd"], by) if reference else missing
    found["P3-30"] = Value(1.0 - x5["nnc"] / x5["vd"], by) if reference else missing
    return found


def _calibrated(artifact: Artifact | None) -> Outcomes:
    if artifact is None:
        return {"R4-limits": Missing("it needs a run (reproduce.source: run)")}
    values = [artifact.scalar(name) for name in ("omega_0", "omega_inf", "nu")]
    return {"R4-limits": Value(values, "calibration of this run")}


def chapter_4(bench: Bench, frame: Frame) -> Outcomes:
    """Return the outcomes of chapter 4, P2 and P3.

    Parameters
    ----------
    bench
        Structure, damper and controllers of the closed loop.
    frame
        The printed frame with the signs of its mode matrix corrected, for the closed forms.
    """
    return {**_closed_forms(frame), **_kalman(), **_calibrated(bench.artifact("calibrate")), **_tables(bench)}
