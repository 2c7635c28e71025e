"""Chapter 2: the damper's forces, its parameters' units, the training set."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray, ParameterSet, load_parameter_set
from mrpipe.dampers.model import DamperModel, bouc_wen_limits, damper_from_parameter_set, parameter_unit
from mrpipe.thesis.claim import Claim, cannot, compare

FREQUENCIES_HZ = (0.5, 1.0, 1.27, 1.8, 2.2)
AMPLITUDES_M = (5e-3, 10e-3)
_RATE = 4000.0
_CYCLES = 3


def _motion(amplitude: float, frequency: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    time = np.arange(int(_CYCLES * _RATE / frequency)) / _RATE
    w = 2.0 * np.pi * frequency
    return amplitude * np.sin(w * time), amplitude * w * np.cos(w * time), -amplitude * w * w * np.sin(w * time)


def peak_forces(model: DamperModel, drive: float) -> FloatArray:
    """Return smallest and largest peak force [N] at constant drive over the tests of Table 2.1, shape (2,)."""
    peaks = []
    for amplitude in AMPLITUDES_M:
        for frequency in FREQUENCIES_HZ:
            x, v, a = _motion(amplitude, frequency)
            force = model.force(x, v, a, np.full(x.size, drive), 1.0 / _RATE)
            peaks.append(float(np.abs(force[-int(_RATE / frequency) :]).max()))
    return np.array([min(peaks), max(peaks)])


def _parameters(name: str) -> tuple[ParameterSet, DamperModel]:
    parameters = load_parameter_set("dampers", name)
    return parameters, damper_from_parameter_set(parameters)


def _table_2_2() -> list[Claim]:
    parameters, printed = _parameters("thesis-printed")
    limits = bouc_wen_limits(*(parameters.scalar(name) for name in ("A", "gamma", "beta", "n")))
    small = f"z_max = sqrt(A/(gamma + beta)) = {limits[0]:.4g} m only: no single change of Table 2.2 corrects both ends"
    return [
        compare(
            "A1a",
            2,
            "peak force of Table 2.2 at 0 A, 5 to 10 mm, 0.5 to 2.2 Hz [N]",
            [22.0, 30.0],
            peak_forces(printed, 0.0),
            0.1,
            small,
        ),
        compare(
            "A1b", 2, "largest peak force of Table 2.2 at 4 A [N]", 300.0, peak_forces(printed, 4.0)[1], 0.1, small
        ),
        compare("A1c", 2, "z_max of Table 2.2 (errata) [m]", 1.104, limits[0], 1e-3),
        compare(
            "A2",
            2,
            "unit of gamma and beta for n = 2",
            "1/s^2",
            parameter_unit("gamma", "A"),
            None,
            "every term of (2.2) is a velocity: gamma |v| |z| z needs 1/m2, and A has no unit",
        ),
    ]


def _set_c() -> list[Claim]:
    _, model = _parameters("set-c")
    claims = [
        compare(
            f"C{drive:g}",
            2,
            f"peak forces of damper set C at {drive:g} A (errata section C) [N]",
            expected,
            peak_forces(model, drive),
            0.03,
        )
        for drive, expected in (
            (0.0, [23.0, 29.0]),
            (1.0, [50.0, 65.0]),
            (2.0, [109.0, 134.0]),
            (3.0, [189.0, 223.0]),
            (4.0, [277.0, 320.0]),
        )
    ]
    opening = model.parameters["yield_displacement"]
    claims.append(compare("C-yield", 2, "yield displacement of set C (errata section C) [m]", 0.37e-3, opening, 0.02))
    return claims


def _signals() -> list[Claim]:
    _, velocity, _ = _motion(5e-3, 1.0)
    constant = np.zeros(velocity.size)
    # half-sine of amplitude 0 A: what set 11 prescribes
    half_sine = 0.0 * np.abs(np.sin(np.pi * np.arange(velocity.size) / _RATE))
    return [
        compare("T2.5", 2, "velocity amplitude of 5 mm at 1 Hz [m/s]", 31.4e-3, np.abs(velocity).max(), 2e-3),
        compare(
            "A21",
            2,
            "largest current by which set 11 (half-sine of 0 A) departs from set 1 [A]",
            0.0,
            np.abs(half_sine - constant).max(),
            1e-12,
            "set 11 repeats set 1; kept as printed",
        ),
    ]


def chapter_2() -> list[Claim]:
    """Return the claims of chapter 2, P1 and P5."""
    _, set_c = _parameters("set-c")
    residual = peak_forces(set_c, 0.0)
    recordings = "needs the recordings of the thesis' rig, which are not published"
    return [
        *_table_2_2(),
        *_set_c(),
        *_signals(),
        compare(
            "A22a",
            2,
            "residual force at 0 A: 18, 22, 24, 30 N are printed; range of set C [N]",
            [22.0, 30.0],
            residual,
            0.06,
            "a parameter of the controller (simulate.controller.residual_force_n), not one number",
        ),
        cannot(
            "A22b",
            2,
            "hidden neurons of the best networks: 12-6 (P5), 6-6 (P1)",
            [12.0, 6.0, 6.0, 6.0],
            f"both are printed; which is better {recordings}",
        ),
        cannot(
            "A22c",
            5,
            "rate of the controller: 500 and 200 Hz are printed [Hz]",
            [500.0, 200.0],
            "two values for one controller; both are settings (simulate.controller.rate_hz)",
        ),
        cannot("T2.6", 2, "loops and networks of Figures 2.6 to 2.24", None, recordings),
    ]
