"""Chapter 3: mass, mode matrix, frequencies and damping of the frame, as printed and as the run identified it."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray, load_parameter_set
from mrpipe.modal.decays.decay import linear_envelope, logarithmic_envelope
from mrpipe.modal.search.checks import modal_coupling, wrong_signs
from mrpipe.modal.storage import off_band_share
from mrpipe.structures import (
    Frame,
    complex_modes,
    frame_from_parameter_set,
    modal_assurance,
    natural_modes,
    read_frame,
    shear_frame,
)
from mrpipe.thesis.bench import Bench
from mrpipe.thesis.claim import Missing, Outcomes, Value

_RUN = ("R3-omega", "R3-damping", "R3-k11", "F3-band", "F3-sinusoid", "F3-point-to-point", "F3-exponential")


def shape_formula(floors: int, *, exchanged: bool) -> FloatArray:
    """Return (A1) of P2 as printed (`exchanged`) or corrected, a row a floor, a column a mode, shape (n, n)."""
    number = np.arange(1, floors + 1)
    if exchanged:
        return np.sin(np.pi * np.outer(2 * number - 1, number) / (2 * floors + 1))
    return np.sin(np.pi * np.outer(number, 2 * number - 1) / (2 * floors + 1))


def _geometry() -> Outcomes:
    geometry = frame_from_parameter_set("geometry")
    omega = natural_modes(geometry).angular_frequencies
    by = "dimensions of Table 3.1"
    return {"A3a": Value(geometry.mass[0, 0], by), "A3b": Value(omega, by), "A3c": Value(omega, by)}


def _mode_matrix(frame: Frame) -> Outcomes:
    printed = load_parameter_set("frames", "thesis-printed")
    shapes, masses = printed.values["mode_shapes"], printed.values["floor_masses"]
    elements = wrong_signs(shapes, np.diag(masses))
    corrected = shapes.copy()
    for floor, mode in elements:
        corrected[floor - 1, mode - 1] *= -1.0
    coupling = modal_coupling(corrected, np.diag(masses))
    largest = float(np.abs(coupling - np.eye(len(masses))).max())
    turned = ", ".join(f"U{floor}{mode}" for floor, mode in elements)
    said = (
        f"the columns are orthogonal to the mass only with the sign of {turned} changed "
        f"(largest coupling then {largest:.3f})"
    )
    uncorrected = natural_modes(frame_from_parameter_set(printed)).angular_frequencies
    omega = natural_modes(frame).angular_frequencies
    by = "printed frequencies, mass and mode matrix with the signs corrected"
    return {
        "A4a": Value([corrected[2, 2], corrected[2, 3]], "signs that make the modes orthogonal to the mass", said),
        "A4b": Value(uncorrected[-1], "printed frequencies, mass and mode matrix"),
        "B1": Value(omega[:4], by),
        "B2": Value(omega[4], by),
        "B3": Value(frame.stiffness[0, 0], by),
        "B4": Value(off_band_share(frame.stiffness), by),
    }


def _printed_frame(frame: Frame) -> Outcomes:
    by = "printed frequencies, mass, damping and mode matrix with the signs corrected"
    zeta = complex_modes(frame).damping_ratios
    uniform = natural_modes(shear_frame(np.ones(5), np.full(5, 1000.0), 0.01)).mode_shapes
    assurance = [
        float(np.diag(modal_assurance(shape_formula(5, exchanged=flag), uniform)).min()) for flag in (True, False)
    ]
    return {
        **{name: Value(zeta, by) for name in ("A5a", "A5b", "B5")},
        "A6": Value(natural_modes(frame).frequencies_hz, "row in rad/s of Table 3.3"),
        "A7a": Value(assurance[0], "modes of a uniform frame"),
        "A7b": Value(assurance[1], "modes of a uniform frame"),
    }


def _identified(artifact: Artifact) -> Outcomes:
    by = "frame that the run identified"
    frame = read_frame(artifact)
    shapes = artifact.array("modes/shapes")
    formula = shape_formula(len(shapes), exchanged=False)[:, : shapes.shape[1]]
    assurance = np.diag(modal_assurance(shapes, formula))
    found: Outcomes = {
        "R3-omega": Value(artifact.array("modes/angular_frequency"), by),
        "R3-damping": Value(artifact.array("modes/damping_ratio"), by),
        "R3-k11": Value(frame.stiffness[0, 0], by),
        "F3-band": Value(off_band_share(frame.stiffness), by),
        "F3-sinusoid": Value(
            float(assurance.min()), by, "MAC by mode: " + ", ".join(f"{value:.3f}" for value in assurance)
        ),
    }
    if "mode_1" not in (artifact.members("decays") if "decays" in artifact.members() else []):
        return found
    time, peak = artifact.array("decays/mode_1/peak_time"), artifact.array("decays/mode_1/peak")
    rows = {row["mode"]: row for row in artifact.json("summary")["decays"]}
    by = "decay test of mode 1 of this run"
    found["F3-point-to-point"] = Value(
        rows[1]["point_to_point"]["value"] / rows[1]["logarithmic_decrement"]["value"], by
    )
    straight, curved = linear_envelope(time, peak), logarithmic_envelope(time, peak)
    found["F3-exponential"] = Value(curved.rms_error / straight.rms_error, by)
    return found


def chapter_3(bench: Bench, frame: Frame) -> Outcomes:
    """Return the outcomes of chapter 3 and the appendix of P2.

    Parameters
    ----------
    bench
        Structure, damper and controllers of the run.
    frame
        The printed frame with the signs of its mode matrix corrected.
    """
    artifact = bench.artifact("identify-frame")
    run = _identified(artifact) if artifact is not None else {}
    reason = "the run has no such decay test" if run else "it needs a run (reproduce.source: run)"
    return {
        **{name: Missing(reason) for name in _RUN},
        **_geometry(),
        **_mode_matrix(frame),
        **_printed_frame(frame),
        **run,
    }
