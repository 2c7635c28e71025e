"""Chapter 3: the frame's mass, mode matrix, frequencies and damping."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray, load_parameter_set
from mrpipe.modal.checks import modal_coupling, wrong_signs
from mrpipe.structures import (
    Frame,
    complex_modes,
    frame_from_parameter_set,
    modal_assurance,
    natural_modes,
    shear_frame,
)
from mrpipe.thesis.claim import Claim, compare

OMEGA = [8.0, 24.2, 38.4, 49.9, 58.3]
HERTZ = [1.23, 3.83, 6.13, 8.05, 9.34]
INPUT_DAMPING = [0.0030, 0.0024, 0.0020, 0.0015, 0.0010]
_NO_SOURCE = (
    "(3.17) and (3.18) return the damping ratios that went in; neither printed list follows from anything printed"
)


def printed_shape_formula(floors: int, *, exchanged: bool) -> FloatArray:
    """Return (A1) of P2 as printed (`exchanged`) or corrected; rows are floors, columns are modes, shape (n, n)."""
    number = np.arange(1, floors + 1)
    if exchanged:
        return np.sin(np.pi * np.outer(2 * number - 1, number) / (2 * floors + 1))
    return np.sin(np.pi * np.outer(number, 2 * number - 1) / (2 * floors + 1))


def _off_band(frame: Frame) -> float:
    K = frame.stiffness
    n = frame.floors
    outside = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) > 1
    return float(np.abs(K[outside]).max() / np.abs(K).max())


def _geometry() -> list[Claim]:
    geometry = frame_from_parameter_set("geometry")
    omega = natural_modes(geometry).angular_frequencies
    return [
        compare(
            "A3a",
            3,
            "mass of a floor by the dimensions of Table 3.1 [kg]",
            5.95,
            geometry.mass[0, 0],
            0.02,
            "plate and four columns weigh more: the printed mass does not follow from the printed dimensions",
        ),
        compare(
            "A3b",
            3,
            "frequencies of Table 3.3 by the dimensions with gravity's P-delta [rad/s]",
            OMEGA,
            omega,
            0.035,
            "the dimensions fit the frequencies, the printed mass does not follow from them",
        ),
        compare(
            "A3c",
            3,
            "frequencies by the dimensions (errata row 3) [rad/s]",
            [8.18, 24.3, 38.4, 49.3, 56.5],
            omega,
            2e-3,
        ),
    ]


def _mode_matrix(frame: Frame) -> list[Claim]:
    printed = load_parameter_set("frames", "thesis-printed")
    shapes, masses = printed.values["mode_shapes"], printed.values["floor_masses"]
    elements = wrong_signs(shapes, np.diag(masses))
    mended = shapes.copy()
    for floor, mode in elements:
        mended[floor - 1, mode - 1] *= -1.0
    coupling = modal_coupling(mended, np.diag(masses))
    largest = float(np.abs(coupling - np.eye(len(masses))).max())
    uncorrected = natural_modes(frame_from_parameter_set(printed)).angular_frequencies
    omega = natural_modes(frame).angular_frequencies
    found = ", ".join(f"U{floor}{mode}" for floor, mode in elements)
    return [
        compare(
            "A4a",
            3,
            "U33, U34 of the mode matrix (3.5)",
            [0.941, 0.119],
            [mended[2, 2], mended[2, 3]],
            1e-9,
            f"the columns are orthogonal to the mass only with the sign of {found} turned "
            f"(largest coupling then {largest:.3f})",
        ),
        compare(
            "A4b",
            3,
            "omega_5 by (3.14) to (3.16) from (3.5) as printed [rad/s]",
            58.3,
            uncorrected[-1],
            3e-3,
            "the two wrong signs",
        ),
        compare("B1", 3, "omega_1 to omega_4 of the frame [rad/s]", OMEGA[:4], omega[:4], 1e-3),
        compare("B2", 3, "omega_5 of the frame [rad/s]", OMEGA[4], omega[4], 3e-3),
        compare("B3", 3, "K11, printed as inter-storey stiffness [N/m]", 9500.0, frame.stiffness[0, 0], 7e-3),
        compare(
            "B4",
            3,
            "largest element of K outside its band, over the largest of all (small, says the thesis; errata: at most)",
            0.02,
            _off_band(frame),
            0.15,
        ),
    ]


def _damping(frame: Frame) -> list[Claim]:
    zeta = complex_modes(frame).damping_ratios
    deviation = float(np.abs(zeta - INPUT_DAMPING).max())
    return [
        compare(
            "A5a",
            3,
            "damping ratios of the model, section 3.3.4",
            [0.0035, 0.0024, 0.0074, 0.0059, 0.0012],
            zeta,
            0.05,
            _NO_SOURCE,
        ),
        compare(
            "A5b",
            3,
            "damping ratios of the model, P2",
            [0.0010, 0.0040, 0.0071, 0.0055, 0.0016],
            zeta,
            0.05,
            _NO_SOURCE,
        ),
        compare(
            "B5",
            3,
            "damping ratios that went in, section 3.2.2",
            INPUT_DAMPING,
            zeta,
            0.02,
            f"largest deviation {deviation:.1e}",
        ),
    ]


def chapter_3(frame: Frame) -> list[Claim]:
    """Return the claims of chapter 3 and the appendix of P2, with the frame of the settings."""
    hertz = natural_modes(frame).frequencies_hz
    uniform = natural_modes(shear_frame(np.ones(5), np.full(5, 1000.0), 0.01)).mode_shapes
    assurance = [
        float(np.diag(modal_assurance(printed_shape_formula(5, exchanged=flag), uniform)).min())
        for flag in (True, False)
    ]
    return [
        *_geometry(),
        *_mode_matrix(frame),
        *_damping(frame),
        compare(
            "A6",
            3,
            "Table 3.3 in Hz against its rad/s [Hz]",
            HERTZ,
            hertz,
            5e-3,
            "the two rows of Table 3.3 disagree by up to 3.4 %; rad/s are the ones that the stiffness follows from",
        ),
        compare(
            "A7a",
            3,
            "smallest MAC of (A1) as printed with the modes of a uniform frame",
            1.0,
            assurance[0],
            1e-6,
            "indices i and j are exchanged",
        ),
        compare("A7b", 3, "smallest MAC of (A1) corrected, sin(pi (2i-1) j/(2n+1))", 1.0, assurance[1], 1e-6),
    ]
