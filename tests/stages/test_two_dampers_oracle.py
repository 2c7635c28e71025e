"""The bundled configuration of two dampers, stage by stage, against a loop that shares no code with the program."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import eigh
from scipy.optimize import minimize

from mrpipe.artifacts import Artifact, config_directory
from mrpipe.cli import run
from tests.simulation.independent_control import Linear, Sampled
from tests.simulation.independent_loop import Device, ModifiedBoucWen, integrate

BASE, FIFTH = np.eye(10)[0], np.eye(10)[4] - np.eye(10)[3]
STIFFNESS, STROKE, VOLTS = 2.0e6, 0.05, 10.0
"""Stiffness of law vdps [N/m], expected amplitude [m], and largest voltage of the damper of paper P4."""
CYCLES, DECAY = 2, 0.5
QUIET = ("simulate.sensors.displacement_noise_m=0", "simulate.sensors.acceleration_noise_m_s2=0")


class Tabulated(Sampled):
    """The inverse as docs/control-laws.md describes it: a table of the force after yield over speed and drive."""

    speeds, volts = np.linspace(0.0, 0.5, 101), np.linspace(0.0, VOLTS, 81)
    table: np.ndarray | None = None

    def inverse(self, speed: float, force: float) -> float:
        if self.table is None:
            # the first row is just above rest, where the series dashpot alone moves
            rows = [max(item, 1e-9) for item in self.speeds]
            self.table = np.array([[self.damper.yielded(item, u) for item in rows] for u in self.volts])
        forces = [float(np.interp(speed, self.speeds, column)) for column in self.table]
        return float(np.interp(force, forces, self.volts))


class Building:
    """The ten storeys of the file with modal damping of 1 %, and the dampers as c v + k x."""

    def __init__(self) -> None:
        held = loadmat(config_directory() / "structures" / "ten-storey-heavy.mat")
        self.M, self.K = 1e3 * held["M"], 1e3 * held["K"]
        squared, shapes = eigh(self.K, self.M)
        self.omega = np.sqrt(squared)
        weighted = self.M @ shapes
        self.C = weighted @ np.diag(2.0 * 0.01 * self.omega) @ weighted.T

    def damping_ratios(self, base: float, fifth: float, *, inherent: bool) -> np.ndarray:
        """Return the damping ratios of the modes, in the order of their frequencies."""
        C = inherent * self.C + base * np.outer(BASE, BASE) + fifth * np.outer(FIFTH, FIFTH)
        K = self.K + STIFFNESS * np.outer(FIFTH, FIFTH)
        A = np.block([[np.zeros_like(K), np.eye(10)], [-np.linalg.solve(self.M, K), -np.linalg.solve(self.M, C)]])
        poles = np.linalg.eigvals(A)
        poles = poles[poles.imag > 0.0]
        return np.asarray(-poles.real / np.abs(poles))[np.argsort(np.abs(poles))]

    def amplitude(self, base: float, fifth: float) -> float:
        """Return the ground acceleration at which the first damper to do so moves by the expected amplitude."""
        w = self.omega[0]
        dynamic = self.K + 1j * w * self.C - w**2 * self.M + 1j * w * base * np.outer(BASE, BASE)
        dynamic = dynamic + (STIFFNESS + 1j * w * fifth) * np.outer(FIFTH, FIFTH)
        x = np.linalg.solve(dynamic, -self.M @ np.ones(10))
        return float(STROKE / max(abs(BASE @ x), abs(FIFTH @ x)))


def result_of(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    status = run([*arguments, "--json", "--quiet"])
    shown = capsys.readouterr()
    assert status == 0, shown.err
    return json.loads(shown.out)  # type: ignore[no-any-return]


@pytest.mark.oracle
def test_gains_and_response_are_those_of_an_independent_loop(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the .mat file to gains, damping ratios, floors, forces, voltages and indices, without noise of the sensors.

    The loop is of second order. At 4800 steps per second the floors agree within 2e-5, single forces within 1e-3.
    """
    settings = {
        "simulate.excitation.cycles": CYCLES,
        "simulate.excitation.settling_cycles": 1,
        "simulate.excitation.decay_s": DECAY,
        "simulate.plant_rate_hz": 4800,
        "simulate.record_rate_hz": 200,
    }
    common = ["--config", "two-dampers", "--run", str(tmp_path / "run")]
    for item in (*QUIET, *(f"{key}={value}" for key, value in settings.items())):
        common += ["--set", item]
    calibrated, simulated = (result_of([stage, *common], capsys) for stage in ("calibrate", "simulate"))
    building, damper = Building(), ModifiedBoucWen()

    # calibration: the largest damping ratio of the first mode
    c = [row["gains"]["c_n_s_m"] for row in calibrated["dampers"]]
    largest = minimize(
        lambda x: -building.damping_ratios(*np.exp(x), inherent=False)[0],
        np.log(c) + np.array([0.2, -0.2]),
        method="Nelder-Mead",
        options={"xatol": 1e-6, "fatol": 1e-11},
    )
    assert building.damping_ratios(*c, inherent=False)[0] == pytest.approx(-largest.fun, rel=1e-8)
    np.testing.assert_allclose(c, np.exp(largest.x), rtol=1e-4)
    found = calibrated["together"]["damping_ratios"]
    np.testing.assert_allclose(found, building.damping_ratios(*c, inherent=True)[:3], rtol=1e-7)

    # simulation
    w, amplitude = building.omega[0], building.amplitude(*c)
    stop = CYCLES * 2.0 * math.pi / w
    switch = damper.yielded(STROKE * w, 0.0)

    def ground(t: float) -> float:
        rise = 0.5 - 0.5 * math.cos(math.pi * min(t / stop, 1.0))  # the ramp lasts two cycles
        return -amplitude * rise * math.sin(w * t) if t < stop else 0.0

    devices = [
        Device(place, damper, Tabulated(damper, law, 200.0, VOLTS, switch, 60.0, "kalman"))
        for place, law in ((BASE, Linear(c[0], 0.0)), (FIFTH, Linear(c[1], STIFFNESS)))
    ]
    expected = integrate(building.M, building.C, building.K, devices, ground, stop + DECAY, rtol=1e-7, atol=1e-10)
    artifact = Artifact(tmp_path / "run" / "response-dampers.h5")

    def difference(name: str, theirs: np.ndarray) -> float:
        ours = np.column_stack([artifact.array(f"dampers/{place}/{name}") for place in (1, 2)])
        return float((np.abs(ours - theirs)[1:].max(axis=0) / np.abs(theirs).max(axis=0)).max())

    floors = artifact.array("displacement")
    assert np.abs(floors - expected.displacement).max() < 2e-5 * np.abs(expected.displacement).max()
    assert np.any(expected.command == VOLTS) and np.any(expected.desired == 0.0), "limit and clipping matter"
    assert difference("damper_displacement", expected.stroke) < 3e-4
    assert difference("force", expected.force) < 2e-3
    assert difference("drive", expected.drive) < 4e-3
    assert difference("desired_force", expected.desired) < 3e-3

    # the summary
    assert simulated["excitation"]["base_amplitude_m_s2"] == pytest.approx(amplitude, rel=1e-6)
    late = (expected.time >= 0.5 * stop) & (expected.time < stop - 1e-9)
    rms = np.sqrt(np.mean(expected.displacement[late, -1] ** 2))
    assert simulated["rms_x_top_m"] == pytest.approx(rms, rel=2e-5)
    forces = np.sqrt(np.mean(expected.force[late] ** 2, axis=0))
    np.testing.assert_allclose([row["rms_force_n"] for row in simulated["dampers"]], forces, rtol=1e-4)
    largest_forces = np.abs(expected.force).max(axis=0)
    np.testing.assert_allclose([row["peak_force_n"] for row in simulated["dampers"]], largest_forces, rtol=1e-4)
