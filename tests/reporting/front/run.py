"""A small run directory with everything that the front of the report reads."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import ArtifactWriter, Provenance
from mrpipe.reporting.facts import ReportStage, RunFacts
from mrpipe.structures import natural_modes, write_frame
from mrpipe.structures.shear_frames import shear_frame

LAWS = {"vd": (0.024, 0.13, 0.0), "passive-off": (0.069, 0.114, 0.4), "passive-on": (0.016, 0.0025, 0.0)}
EFFECT = {
    "name": "accumulator",
    "form": "linear",
    "parameters": {"stiffness": {"value": 9100.0, "unit": "N/m", "interval": [9040.0, 9160.0]}},
    "confidence": 0.97,
    "tied_with": ["end-stop"],
    "physics": "Gas spring.",
    "remedy": "Lower the gas pressure.",
}


def tracing(**changes: Any) -> dict[str, Any]:
    """Summary of `close-loop` in which an accumulator is found."""
    found = {
        "campaign": "my-rig",
        "model": "bouc-wen",
        "noise_floor_nrmse": 0.004,
        "noise_from": "sensor channels",
        "before": {"nrmse": 0.079},
        "after": {"nrmse": 0.015},
        "residual": {"structured": True},
        "base_form": {"nrmse": {"bouc-wen": 0.079, "dahl": 0.09}},
        "effects": [EFFECT],
        "candidates": [{"name": "accumulator", "form": "linear", "share": 0.94, "nrmse": 0.015}],
        "ceiling": {"nrmse": 0.013, "recovered": 0.97},
        "unexplained": {"structured": False, "share_of_residual": 0.02, "depends_on": []},
        "untestable": {},
        "tests": [{"name": "b", "nrmse_before": 0.079, "nrmse_after": 0.015}],
        "closed_loop": {"status": "skipped"},
        "corrections": {"found": False, "file": "corrections.yaml"},
        "next_tests": {"file": "next-tests.yaml", "tests": [], "decides": [], "made_already": False},
        "verdict": "accumulator: explains what is missing",
    }
    return {**found, **changes}


def run_in(directory: Path, loop: Mapping[str, Any] | None = None) -> RunFacts:
    """Write the artifacts of a run and return its facts."""
    frame = shear_frame([6.0, 6.0, 6.0], [5000.0, 5000.0, 5000.0], damping_ratios=[0.005, 0.005, 0.005])
    modes = natural_modes(frame)
    time = np.arange(0.0, 40.0, 0.01)
    omega = float(modes.angular_frequencies[0])
    ground = np.where(time < 30.0, 0.5 * np.sin(omega * time), 0.0)
    with ArtifactWriter.create(directory / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, frame)
    for law, (rms, _, _) in LAWS.items():
        with ArtifactWriter.create(directory / f"response-{law}.h5", Provenance(f"simulate-{law}")) as artifact:
            top = rms * np.sqrt(2.0) * np.sin(omega * time)
            for name, values in (("time", time), ("ground_acceleration", ground), ("force", 1e3 * top)):
                artifact.put(name, values, unit="1", dims=("time",))
            for name, values in (("desired_force", 1e3 * top), ("drive", np.abs(top)), ("damper_displacement", top)):
                artifact.put(name, values, unit="1", dims=("time",))
            artifact.put("damper_velocity", top, unit="1", dims=("time",))
            for name in ("displacement", "absolute_acceleration"):
                artifact.put(name, np.outer(top, [0.4, 0.7, 1.0]), unit="1", dims=("time", "floor"))
    with ArtifactWriter.create(directory / "close-loop.h5", Provenance("close-loop")) as artifact:
        t = np.arange(0.0, 5.0, 0.005)
        x = 0.01 * np.sin(6.0 * t)
        for name, values in (
            ("time", t),
            ("displacement", x),
            ("velocity", 0.06 * np.cos(6.0 * t)),
            ("drive", 0.0 * t),
        ):
            artifact.put(f"validation/{name}", values, unit="1", dims=("sample",))
        for name, stiffness in (("measured", 9100.0), ("before", 0.0), ("after", 9000.0)):
            force = 60.0 * np.tanh(80.0 * np.cos(6.0 * t)) + stiffness * x
            artifact.put(f"validation/{name}", force, unit="N", dims=("sample",))
        artifact.put("validation/starts", np.array([0, len(t)]), unit="1", dims=("test",))
        artifact.put_json("validation/names", ["b"])
    damper = {
        "form": "bouc-wen",
        "drive_unit": "A",
        "drive_limit": 2.0,
        "training_nrmse": 0.078,
        "validation_nrmse": 0.08,
        "parameters": {"yield_force_b": {"value": 5.411, "unit": "N/A", "standard_error": 0.2, "at_bound": True}},
    }
    frequencies = [float(value) for value in modes.angular_frequencies / (2.0 * np.pi)]
    identified = {
        "campaign": "my-frame",
        "frequencies_hz": frequencies,
        "damping_ratios": [0.005, 0.004, 0.003],
        "mode_shapes": modes.mode_shapes.tolist(),
        "frequency_intervals_hz": [[value - 0.01, value + 0.01] for value in frequencies],
        "damping_ratio_intervals": [[0.004, 0.006]] * 3,
        "mac": [1.0, 0.99, 0.98],
        "stiffness": frame.stiffness.tolist(),
    }
    prepared = {
        "campaign": "my-rig",
        "tests": [
            {
                "role": role,
                "duration_s": 30.0,
                "amplitude_m": 0.01,
                "displacement_peak_m": 0.012,
                "velocity_peak_m_s": 0.06,
                "force_peak_n": 150.0,
            }
            for role in ("training", "validation")
        ],
    }
    summaries = {"prepare": prepared, "identify-damper": damper, "identify-frame": identified}
    summaries |= {f"simulate-{law}": _simulated(law, omega) for law in LAWS}
    summaries["close-loop"] = dict(loop) if loop is not None else tracing()
    stages = [ReportStage(name, f"{name}.", [], summary, [], "", 1.0) for name, summary in summaries.items()]
    return RunFacts(directory, "my-rig", "A gas spring.", stages)


def _simulated(law: str, omega: float) -> dict[str, Any]:
    rms, damping, outside = LAWS[law]
    excitation = {"kind": "harmonic", "frequency_rad_s": omega, "steady_s": [10.0, 30.0]}
    known = {"outside_share": outside, "largest_m": 0.03, "known_largest_m": 0.01}
    return {
        "law": law,
        "rms_x_top_m": rms,
        "rms_x1_m": 0.4 * rms,
        "damping_ratio": damping,
        "excitation": excitation,
        "training_range": {"damper_model": {"outside_share": outside, "inputs": {"displacement": known}}},
    }
