"""Chapter 5: Table 5.1, what the thesis says of the closed loop, and the checks of the errata page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, Progress
from mrpipe.control.limits import attainable_damping, limiting_modes
from mrpipe.simulation import amplitude_for
from mrpipe.simulation.rig import Rig
from mrpipe.thesis import table51
from mrpipe.thesis.bench import (
    LAWS,
    OMEGA,
    Bench,
    LoopRun,
    amplitude_of,
    excite,
    perfect,
    reference_rms_top_m,
    run_law,
)
from mrpipe.thesis.claim import Missing, Outcome, Outcomes, Value
from mrpipe.thesis.entries import INDICES, table_id
from mrpipe.thesis.table51 import Case

_DAMPING = "damping_ratio"
_FREQUENCY_TOLERANCE = 0.01
DELAY_S = 0.05
"""Delay of the filter of paper P5, section 4 [s]."""
C_VALUES = (450.0, 550.0, 650.0, 750.0, 850.0)
ALPHA_VALUES = (2400.0, 2700.0, 3000.0, 3300.0, 3600.0)


def _response_indices(artifact: Artifact) -> Mapping[str, Any] | str:
    """Return the indices of a response of the run, or why they are not those of Table 5.1."""
    excitation = artifact.json("excitation")
    if excitation.get("kind") != "harmonic":
        return f"the responses of this run are to {excitation.get('kind')} motion; Table 5.1 is harmonic"
    omega = float(excitation["frequency_rad_s"])
    if abs(omega / OMEGA - 1.0) > _FREQUENCY_TOLERANCE:
        return f"the responses of this run are at {omega:.2f} rad/s; the simulated column is at {OMEGA:g} rad/s"
    found = artifact.json("indices")
    assert isinstance(found, dict)
    return found


def _simulated(bench: Bench, case: Case) -> Outcomes:
    """Return the simulated column: from the responses of the run where there are some, else from the case."""
    found: Outcomes = {}
    for law in LAWS:
        artifact = bench.artifact(f"simulate-{law}")
        kept = None if artifact is None else _response_indices(artifact)
        by = f"response-{law}.h5 of this run" if kept is not None else f"{case.name}, {bench.source}"
        for row in (_DAMPING, *INDICES):
            name = table_id("T5.1s", law, row)
            if isinstance(kept, str):
                found[name] = Missing(kept)
            elif kept is not None:
                found[name] = _number(kept.get(row), by, _damping_words(case, law) if row == _DAMPING else "")
            else:
                value = case.damping[law].fit if row == _DAMPING else case.values[law][row]
                found[name] = _number(value, by, _damping_words(case, law) if row == _DAMPING else "")
    return found


def _measured(case: Case) -> Outcomes:
    """Return the measured column: the loop at the resonance of each law."""
    found: Outcomes = {}
    for law in LAWS:
        by = f"{case.name}: {case.omega[law]:.2f} rad/s, {case.base_amplitude_m_s2:.3f} m/s²"
        found[table_id("T5.1m", law, _DAMPING)] = _number(case.damping[law].fit, by, _damping_words(case, law))
        for row in INDICES:
            found[table_id("T5.1m", law, row)] = _number(case.values[law][row], by)
    return found


def _number(value: float | None, by: str, why: str = "") -> Outcome:
    return Missing("the decay has too few extrema for a damping ratio") if value is None else Value(value, by, why)


def _damping_words(case: Case, law: str) -> str:
    reading = case.damping[law]
    first = "none" if reading.first_half_period is None else f"{reading.first_half_period:.3f}"
    energy = "none" if reading.energy is None else f"{reading.energy:.3f}"
    return f"readings: first half period {first}, energy over the first period {energy}"


def _ratios(case: Case, row: str, laws: tuple[str, ...] = ("vdns", "fdns")) -> list[float]:
    return [case.values[law][row] / case.values["vd"][row] for law in laws]


def _findings(bench: Bench, cases: Mapping[str, Case]) -> Outcomes:
    """Return what the thesis says of chapter 5, from the cases."""
    plain = cases[f"{table51.PLAIN}, {table51.AT_ONE}"]
    known = [case for case in cases.values() if case.where == table51.AT_OWN]
    best = known[-1]
    by = f"{best.name}, {bench.source}"
    found: Outcomes = {
        "F5-top": Value(_ratios(best, "rms_x5_m"), by),
        "F5-top-acceleration": Value(_ratios(best, "rms_a5_m_s2"), by),
        "F5-first-floor": Value(_ratios(best, "rms_x1_m"), by),
        "F5-a1": Value(_ratios(best, "rms_a1_m_s2"), by),
        "F5-order": Value([best.values["fdns"][row] / best.values["vdns"][row] for row in INDICES], by),
        "F5-vdps-measured": Value(_ratios(best, "rms_x5_m", ("vdps",))[0], by),
        "F5-vdps-simulated": Value(_ratios(plain, "rms_x5_m", ("vdps",))[0], f"{plain.name}, {bench.source}"),
    }
    decays = {law: reading.fit for law, reading in plain.damping.items()}
    by = f"{plain.name}, {bench.source}"
    if decays["vdps"] is not None and decays["vd"] is not None:
        found["F5-vdps-damping"] = Value(decays["vdps"] / decays["vd"], by, _damping_words(plain, "vdps"))
    if decays["vdns"] is not None:
        modes = limiting_modes(bench.rig.frame, bench.rig.position)
        estimate = attainable_damping(modes, bench.rig.controllers.calibrated.gains_of("vdns").k_n_m)
        found["F5-wrong"] = Value(decays["vdns"] / estimate, by)
    extrema = np.abs(plain.damping["vdns"].extrema_m)
    if len(extrema) > 2:
        found["F5-quick"] = Value(float(extrema[2] / extrema.max()), by)
    traced = cases.get(f"{table51.TRACED}, {table51.AT_ONE}")
    if traced is not None:
        pairs = [(traced.damping[law].fit, decays[law]) for law in LAWS]
        if all(first is not None and second is not None for first, second in pairs):
            found["F5-agree"] = Value(
                [first / second for first, second in pairs if first is not None and second],
                f"free decays from {table51.AT_ONE}, {bench.source}",
            )
        errors = [table51.mean_log_error(item, "T5.1m") for item in (best, plain)]
        found["A23"] = Value(
            errors[0] / errors[1],
            f"mean log errors {errors[0]:.3f} and {errors[1]:.3f} over 15 numbers",
        )
    found |= _flat_minima(bench, plain.base_amplitude_m_s2)
    return found


def _flat_minima(bench: Bench, amplitude: float) -> Outcomes:
    by = f"peaks over frequency at {amplitude:.3f} m/s², {bench.source}"
    found: Outcomes = {}
    for name, law, gain, values in (
        ("R5-c", "vd", "c_n_s_m", C_VALUES),
        ("R5-alpha", "fdns", "alpha_n_m", ALPHA_VALUES),
    ):
        peaks = table51.peak_over_frequency(bench, law, gain, values, amplitude)
        middle = peaks[len(values) // 2]
        said = ", ".join(f"{value:g}: {1e3 * peak:.1f} mm" for value, peak in zip(values, peaks, strict=True))
        found[name] = Value(middle / min(peaks), by, said)
    return found


def _residual(run: LoopRun, drive_limit: float) -> float | None:
    """Return the median force of a run while no current flows and the damper moves [N]; None where that is rare."""
    response = run.response
    first, last = run.excitation.steady_s
    steady = (response.time_s >= first) & (response.time_s < last)
    speed = np.abs(response.damper_velocity)
    at_rest = steady & (response.drive < 0.02 * drive_limit) & (speed > 0.3 * speed[steady].max())
    return float(np.median(np.abs(response.force[at_rest]))) if np.count_nonzero(at_rest) > 50 else None


def _loop(bench: Bench) -> Outcomes:
    """Return the claims that need separate runs: clipping, residual force, delay of the filter."""
    rig = bench.rig
    amplitude = amplitude_of(rig, reference_rms_top_m())
    runs = {law: run_law(rig, law, excite(amplitude), bench.seed) for law in LAWS}
    by = f"{table51.PLAIN}, {table51.AT_ONE}, {bench.source}"
    clipped = {law: float(run.indices["clipped_share"]) for law, run in runs.items()}
    found: Outcomes = {
        "F5-clipped": Value(clipped["fdns"] / clipped["vdns"], by)
        if clipped["vdns"] > 0.0
        else Missing("vdns is never clipped in this run")
    }
    largest = float(rig.damper.quasi_static_force(0.05, rig.damper.drive_limit))
    alpha = rig.controllers.calibrated.gains_of("fdns").alpha_n_m
    # at mid-stroke the friction part acts alone
    needed = alpha * np.sqrt(2.0) * float(runs["fdns"].indices["rms_damper_displacement_m"])
    residual = rig.residual_force_n
    found["A14a"] = Value(
        needed / largest,
        by,
        f"fdns needs {needed:.0f} N of {largest:.0f} N; the residual force of {residual:.0f} N is the limit",
    )
    late = replace(
        rig.controllers, settings=rig.controllers.settings.changed(low_pass_hz=None, low_pass_delay_s=DELAY_S)
    )
    delayed = run_law(replace(rig, controllers=late), "vd", excite(amplitude), bench.seed)
    found["F2-delay"] = Value(delayed.indices["rms_x_top_m"] / runs["vd"].indices["rms_x_top_m"], by)
    if bench.traced is None:
        return found
    forces = {
        law: _residual(run_law(bench.traced, law, excite(amplitude), bench.seed), rig.damper.drive_limit)
        for law in ("vd", "vdps")
    }
    if forces["vd"] is not None and forces["vdps"] is not None:
        found["F5-residual"] = Value(
            forces["vdps"] / forces["vd"],
            f"{table51.TRACED}, {table51.AT_ONE}",
            f"{forces['vdps']:.1f} N over {forces['vd']:.1f} N while no current flows",
        )
    return found


def errata_rig(bench: Bench) -> Rig:
    """Return the loop of the errata page with a perfect damper: controller at 500 Hz, rounding of 0.019 m/s."""
    rig = bench.rig
    settings = rig.controllers.settings.changed(rate_hz=500.0, residual_force_n=0.0, low_pass_hz=None)
    controllers = replace(rig.controllers, settings=settings, ideal_rounding_m_s=0.019)
    return perfect(replace(rig, controllers=controllers))


def _errata_checks(sets: Bench) -> Outcomes:
    """Return the checks of the errata page: the printed frame with a perfect damper and with set C."""
    ideal_rig = errata_rig(sets)
    settings = sets.rig.controllers.settings.changed(friction_rounding_m_s=0.0125)
    real_rig = replace(sets.rig, controllers=replace(sets.rig.controllers, settings=settings))
    level = _linear_amplitude(sets)
    ideal = {law: run_law(ideal_rig, law, excite(level)) for law in LAWS}
    real_level = amplitude_of(real_rig, reference_rms_top_m())
    real = {law: run_law(real_rig, law, excite(real_level)) for law in LAWS}
    by_ideal, by_real = "printed frame, perfect damper", "printed frame, set C with its exact inverse"
    found: Outcomes = {"B14": Value(level, by_ideal)}
    for law in LAWS:
        values = [float(ideal[law].indices[row]) for row in INDICES]
        found[f"B-ideal-{law}"] = Value(values[: 2 if law == "fdns" else 3], by_ideal)
        if law != "fdns":
            found[f"B-ideal-{law}-a1"] = Value(values[3], by_ideal)
        values = [float(real[law].indices[row]) for row in INDICES]
        found[f"B-set-c-{law}"] = Value(values[: 2 if law == "fdns" else 4], by_real)
    x5 = {law: float(real[law].indices["rms_x5_m"]) for law in LAWS}
    a1 = {law: float(real[law].indices["rms_a1_m_s2"]) for law in LAWS}
    found["B12"] = Value(" < ".join(sorted(LAWS, key=lambda law: x5[law])), by_real)
    found["B13"] = Value(", ".join(law for law in ("vdns", "fdns") if a1[law] > a1["vd"]), by_real)
    softer = run_law(ideal_rig, "vdns", excite(level), k_n_m=-4000.0)
    found["A13a"] = Value(softer.indices["rms_x5_m"], by_ideal)
    found["A13b"] = Value(ideal["vdns"].indices["rms_x5_m"], by_ideal)
    found["B15"] = _number(ideal["vd"].indices[_DAMPING], by_ideal)
    alpha = sets.rig.controllers.calibrated.gains_of("fdns").alpha_n_m
    steady = ideal["vd"].response
    first, last = ideal["vd"].excitation.steady_s
    force = float(np.abs(steady.force[(steady.time_s >= first) & (steady.time_s < last)]).max())
    middle = alpha * np.sqrt(2.0) * float(ideal["fdns"].indices["rms_damper_displacement_m"])
    found["A14b"] = Value([middle, force], by_ideal)
    return found


def _linear_amplitude(sets: Bench) -> float:
    c = sets.rig.controllers.calibrated.gains_of("vd").c_n_s_m
    return amplitude_for(sets.rig.frame, sets.rig.position, c, OMEGA, reference_rms_top_m())


def chapter_5(bench: Bench, sets: Bench, progress: Progress) -> tuple[Outcomes, dict[str, Case]]:
    """Return the outcomes of chapter 5 and the cases that explain Table 5.1.

    Parameters
    ----------
    bench
        Structure, damper and controllers of the run.
    sets
        The printed frame with damper set C, for the checks of the errata page.
    progress
        Receives the share that is done.
    """
    cases = table51.explain(bench, progress)
    own = [case for case in cases.values() if case.where == table51.AT_OWN]
    no_tracing = Missing("it needs the damper that close-loop traces (reproduce.source: run)")
    no_reading = Missing("the decay has too few extrema")
    found: Outcomes = dict.fromkeys(("A23", "F5-agree", "F5-residual"), no_tracing)
    found |= dict.fromkeys(("F5-vdps-damping", "F5-wrong", "F5-quick"), no_reading)
    found |= _errata_checks(sets)
    found |= _simulated(bench, cases[f"{table51.PLAIN}, {table51.AT_ONE}"])
    found |= _measured(own[-1])
    found |= _findings(bench, cases)
    found |= _loop(bench)
    return found, cases
