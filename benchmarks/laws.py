"""Every control law over frequency: the thesis' frame with set C and with a perfect damper, and the ten-storey frame.

    python -m benchmarks.laws --results laws.jsonl [--laws vd fdns] [--structures frame ten-storey half-step]
    python -m benchmarks.laws --results laws.jsonl --table

One line of JSON per structure and law, so that an interrupted run goes on where it ended; `--table` prints Markdown.
The structure `half-step` is the thesis' frame at the accuracy of `mrpipe simulate --resonance`, with the default
frequency step and with half of it.
Gains are those of the thesis where it prints some, else the exact optimum of the calibration.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.results import append_row, read_rows
from mrpipe.artifacts import load_parameter_set
from mrpipe.case_studies.motion import spectrum_compatible_motion
from mrpipe.case_studies.ten_storey.structure import ten_storey
from mrpipe.control.assembly import ControllerFactory, calibrated_from
from mrpipe.control.calibration import CalibrationOptions, balanced_weights, calibrate, plant_of
from mrpipe.control.laws import all_laws, law_named
from mrpipe.control.lqg import Weights
from mrpipe.control.neural import ReferenceNetwork, ReferenceOptions, train_reference
from mrpipe.control.settings import ControllerSettings
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.errors import DivergedError
from mrpipe.simulation.excitation import Excitation, recorded
from mrpipe.simulation.loop import LoopOptions, Response
from mrpipe.simulation.resonance import BAND, FLATNESS, REFINEMENTS, curve_options, runner
from mrpipe.simulation.response_curve import response_curve
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.sensors import SensorNoise
from mrpipe.simulation.settings import ResonanceSettings
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.structures import Frame, frame_from_parameter_set, natural_modes
from mrpipe.thesis.gains import THESIS_GAINS

FACTORS = (0.5, 1.0, 2.0)
"""Amplitudes of the base acceleration over that at which vd moves the top of the thesis' frame by 24.3 mm RMS."""

AMPLITUDE_M_S2 = 0.768

CURVES = CurveOptions(
    points=13,
    tolerance=1e-2,
    most_cycles=160,
    frequency_tolerance=4e-3,
    refinements=REFINEMENTS,
    flatness=FLATNESS,
    standard_error=5e-3,
)
"""Response curves whose largest values have a standard error of half a per cent or less."""

EXPECTED_M = 0.02
"""Expected amplitude of the damper in the ten-storey frame."""

POINTS = ResonanceSettings().points
"""Frequencies of the default grid."""

PEAKS = ("rms_x_top_m", "rms_a1_m_s2", "rms_a_top_m_s2")
"""Quantities of the tables."""

RATE_HZ = 200.0
"""Sampling rate of the controllers."""

FRAME_DAMPING = 0.02
"""Damping ratio of the ten-storey frame in its first mode: P4's has none, and then no steady response exists."""


def reference(frame: Frame, alpha_n_m: float, amplitude_m: float) -> ReferenceNetwork:
    """Return the network of `nnc`, trained about the first mode of a frame and an expected amplitude of the damper."""
    omega = natural_modes(frame).angular_frequencies
    speed = amplitude_m * float(omega[0])
    learning = ReferenceOptions(
        alpha_n_m,
        tuple(amplitude_m * np.geomspace(0.2, 2.0, 7)),
        tuple(float(omega[0]) / (2.0 * np.pi) * np.geomspace(0.625, 1.6, 7)),
        starts=2,
        rounding_m_s=speed / 6.0,
        # frequencies above a quarter of the rate contain no motion for the network
        disturbances_rad_s=tuple(omega[1:][omega[1:] < 0.5 * np.pi * RATE_HZ]),
    )
    return train_reference(learning, np.random.default_rng(1))


@cache
def thesis_rig(network: bool) -> Rig:
    """Return the thesis' frame with set C, sensors with noise, and the exact inverse of the damper's model."""
    frame = frame_from_parameter_set("thesis")
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    published = {law: dict(gains) for law, gains in THESIS_GAINS.items()}
    weights = Weights(force=1e-4, force_noise_n=20.0)
    options = CalibrationOptions(
        source="published",
        published=published,
        positive_stiffness_n_m=2500.0,
        negative_stiffness_n_m=-4500.0,
        weights=weights,
    )
    calibration = calibrate(frame, np.eye(5)[0], options)
    trained = reference(frame, 3000.0, 0.0093).network if network else None
    known = calibrated_from(calibration, weights, damper, amplitude_m=0.0093, reference=trained)
    settings = ControllerSettings(inverse="model", residual_force_n=18.0)
    noise = SensorNoise(20e-6, 0.1)
    return Rig(frame, damper, ControllerFactory(frame, damper, known, settings), LoopOptions(noise=noise))


@cache
def ten_storey_rig(network: bool) -> Rig:
    """Return the ten-storey frame of P4 with its 1000 kN damper between the ground and the first floor."""
    model = ten_storey()
    plain = Frame(model.mass, model.damping, model.stiffness, "ten-storey")
    first = float(natural_modes(plain).angular_frequencies[0])
    frame = replace(plain, damping=2.0 * FRAME_DAMPING / first * plain.stiffness)
    damper = damper_from_parameter_set(load_parameter_set("dampers", "p4-1000kn"))
    calibration = calibrate(frame, model.devices[:, 0], CalibrationOptions())
    # as the stage calibrate does: default weights of the regulator would be out of proportion for this frame
    residual = float(damper.quasi_static_force(EXPECTED_M * first, 0.0))
    weights = balanced_weights(frame, model.devices[:, 0], calibration.modes, residual)
    trained = None
    if network:
        trained = reference(frame, calibration.laws["nnc"].gains.alpha_n_m, EXPECTED_M).network
    known = calibrated_from(calibration, weights, damper, amplitude_m=EXPECTED_M, reference=trained)
    noise = ControllerSettings(inverse="model", kalman_displacement_noise_m=1e-4, kalman_acceleration_noise_m_s2=0.05)
    return Rig(frame, damper, ControllerFactory(frame, damper, known, noise), LoopOptions())


def largest(rig: Rig, law: str, amplitude: float) -> dict[str, float] | None:
    """Return resonance and largest RMS responses over the band; None where the response grows without bound."""
    known = rig.controllers.calibrated
    controller = rig.controller(law)
    chain = rig.damper.chain()

    def run(excitation: Excitation) -> Response:
        return rig.run(controller, excitation, chain=chain, rng=np.random.default_rng(7))

    curve = response_curve(run, amplitude, (0.75 * known.omega_0, 1.6 * known.omega_0), CURVES)
    if not math.isfinite(curve.peak("rms_x_top_m")):
        return None
    return {"resonance_rad_s": curve.resonance_rad_s, **{f"peak_{name}": curve.peak(name) for name in PEAKS}}


def of_thesis_frame(law: str) -> dict[str, Any]:
    """Return the largest responses with set C and with a perfect damper at three amplitudes."""
    rig = thesis_rig("network" in law_named(law).needs)
    found: dict[str, Any] = {"set C": [largest(rig, law, factor * AMPLITUDE_M_S2) for factor in FACTORS]}
    if law_named(law).output == "force":
        perfect = replace(rig, options=LoopOptions(tracking="ideal", record_rate_hz=1000.0))
        found["ideal"] = [largest(perfect, law, factor * AMPLITUDE_M_S2) for factor in FACTORS]
    return found


def of_ten_storeys(law: str) -> dict[str, Any]:
    """Return the largest responses over frequency, and peaks and RMS under a synthetic earthquake of 0.3 g."""
    rig = ten_storey_rig("network" in law_named(law).needs)
    motion = spectrum_compatible_motion(np.random.default_rng(5))
    clock = motion.interval_s * np.arange(len(motion.acceleration_m_s2))
    excitation = recorded(clock, motion.acceleration_m_s2[:, 0])
    try:
        response = rig.run(rig.controller(law), excitation, rng=np.random.default_rng(7))
    except DivergedError:
        return {"over frequency": None, "earthquake": None}
    drift = np.diff(np.column_stack([np.zeros(len(response.time_s)), response.displacement]), axis=1)
    return {
        "over frequency": largest(rig, law, 1.0),
        "earthquake": {
            "peak_x_top_m": float(np.max(np.abs(response.displacement[:, -1]))),
            "rms_x_top_m": float(np.sqrt(np.mean(response.displacement[:, -1] ** 2))),
            "peak_drift_m": float(np.max(np.abs(drift))),
            "peak_a_m_s2": float(np.max(np.abs(response.absolute_acceleration))),
            "peak_force_n": float(np.max(np.abs(response.force))),
        },
    }


def of_half_step(law: str) -> dict[str, Any]:
    """Return the largest responses with the default frequency step and with half of it, and their standard errors."""
    rig = thesis_rig("network" in law_named(law).needs)
    modes = plant_of(rig.frame, rig.position, CalibrationOptions()).modes
    band = (BAND[0] * modes.omega_0, BAND[1] * modes.omega_inf)
    found = {}
    for name, points in (("whole", POINTS), ("half", 2 * POINTS - 1)):
        began = time.process_time()
        options = curve_options(ResonanceSettings(points=points), absolute=False)
        curve = response_curve(
            runner(rig, rig.controller(law), np.random.default_rng(3)), AMPLITUDE_M_S2, band, options
        )
        found[name] = {**curve.peaks_as_json(), "cpu_s": time.process_time() - began}
    return found


STUDIES: dict[str, Callable[[str], dict[str, Any]]] = {
    "frame": of_thesis_frame,
    "ten-storey": of_ten_storeys,
    "half-step": of_half_step,
}


def as_markdown(rows: list[dict[str, Any]]) -> str:
    """Return the three tables, with the laws in the order of `mrpipe simulate --help`."""
    known = {(row["structure"], row["law"]): row for row in rows}
    both, amplitudes, steps = [], [], []
    for law in all_laws():
        frame, tall = known.get(("frame", law)), known.get(("ten-storey", law))
        nominal = frame["set C"][FACTORS.index(1.0)] if frame else None
        row = [law, *_of_band(nominal, ".1f"), *_of_band(tall and tall["over frequency"], ".0f")]
        both.append([*row, *_of_earthquake(tall and tall["earthquake"])])
        if frame:
            amplitudes.append([law, *_over_amplitudes(frame["set C"]), *_over_amplitudes(frame.get("ideal"))])
        if ("half-step", law) in known:
            steps.append([law, *_changes(known["half-step", law])])
    peaks = ("resonance [rad/s]", "x top [mm]", "a1 [m/s2]", "a top [m/s2]")
    quake = ("x top [mm]", "drift [mm]", "acceleration [m/s2]", "force [kN]")
    head = [*(f"frame: {name}" for name in peaks), *(f"ten storeys: {name}" for name in peaks)]
    head += [f"earthquake: {name}" for name in quake]
    kinds = [f"{kind} x{factor:g} [mm]" for kind in ("set C", "ideal") for factor in FACTORS]
    changes = ["law", "top displacement", "acceleration of floor 1", "top acceleration", "largest standard error"]
    tables = [(["law", *head], both), (["law", *kinds], amplitudes), ([*changes, "processor time [s]"], steps)]
    return "\n\n".join("\n".join(_table(names, rows)) for names, rows in tables)


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows]]


def _changes(found: dict[str, Any]) -> list[str]:
    """Return how half the step changes each peak, the largest relative standard error, and the time of both curves."""
    whole, half = found["whole"], found["half"]
    changes = [abs(half[f"peak_{name}"] / whole[f"peak_{name}"] - 1.0) for name in PEAKS]
    error = max(item[f"standard_error_{name}"] / item[f"peak_{name}"] for item in (whole, half) for name in PEAKS)
    times = f"{whole['cpu_s']:.0f}, {half['cpu_s']:.0f}"
    return [*(f"{100.0 * change:.1f} %" for change in changes), f"{100.0 * error:.2f} %", times]


def _of_band(found: dict[str, float] | None, form: str) -> list[str]:
    """Return resonance, top displacement and both accelerations; dashes where the law was not run or the loop grows."""
    if found is None:
        return ["-"] * 4
    accelerations = [f"{found[f'peak_rms_{name}']:.2f}" for name in ("a1_m_s2", "a_top_m_s2")]
    return [f"{found['resonance_rad_s']:.2f}", f"{1e3 * found['peak_rms_x_top_m']:{form}}", *accelerations]


def _of_earthquake(found: dict[str, float] | None) -> list[str]:
    if found is None:
        return ["-"] * 4
    millimetres = [f"{1e3 * found[name]:.0f}" for name in ("peak_x_top_m", "peak_drift_m")]
    return [*millimetres, f"{found['peak_a_m_s2']:.2f}", f"{1e-3 * found['peak_force_n']:.0f}"]


def _over_amplitudes(found: list[dict[str, float] | None] | None) -> list[str]:
    if found is None:
        return ["-"] * len(FACTORS)
    return ["grows" if item is None else f"{1e3 * item['peak_rms_x_top_m']:.1f}" for item in found]


def main() -> None:
    """Run what is missing, or print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--laws", nargs="*", default=list(all_laws()))
    parser.add_argument("--structures", nargs="*", default=list(STUDIES), choices=list(STUDIES))
    parser.add_argument("--table", action="store_true")
    given = parser.parse_args()
    rows = read_rows(given.results)
    if given.table:
        print(as_markdown(rows))
        return
    done = {(row["structure"], row["law"]) for row in rows}
    for structure in given.structures:
        for law in given.laws:
            if (structure, law) in done:
                continue
            row = {"structure": structure, "law": law, **STUDIES[structure](law)}
            append_row(given.results, row)
            print(structure, law, flush=True)


if __name__ == "__main__":
    main()
