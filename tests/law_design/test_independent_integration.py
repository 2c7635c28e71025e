"""What a design says of a law, the peak of a response over frequency and its place, against another integration."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control.controller import build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import inverse_table
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.law_design.objective import Load, Objective, evaluate
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.run import accurate_curves
from mrpipe.simulation.loop import LoopOptions, simulate_law
from mrpipe.simulation.steady_state import Run
from mrpipe.structures import Frame
from tests.simulation.independent_control import Linear, Sampled
from tests.simulation.independent_loop import BoucWen, Device, integrate


@pytest.mark.oracle
def test_peak_and_resonance_of_a_law_are_those_of_an_independent_integration() -> None:
    """Law vd on two storeys with set C, integrated at the resonance of the curve and 6 % below and above it.

    The windows of the integration scatter by 0.1 %, because a period of the motion is no whole number of samples.
    """
    w, c, amplitude = np.array([1.0, 0.0]), 1000.0, 3.0
    M, K = 25.0 * np.eye(2), 3.0e4 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    squared, shapes = np.linalg.eigh(K / 25.0)
    C = 25.0 * shapes @ np.diag(2.0 * 0.01 * np.sqrt(squared)) @ shapes.T
    model = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    options = ControllerOptions(rate_hz=200.0, residual_force_n=18.0, drive_limit=4.0)

    def run_of(law: str, gains: Gains) -> Run:
        controller = build_controller(law, gains, options, inverse=inverse_table(model), position=w)
        loop = LoopOptions()
        return lambda motion: simulate_law(Frame(M, C, K), model.chain(), controller, motion, loop, position=w)

    load, objective = Load((18.0, 30.0), (amplitude,)), Objective({"rms_x_top_m": 1.0})
    curves = accurate_curves(DesignSettings(), absolute=False)
    found = evaluate(run_of, "vd", Gains(c_n_s_m=c), load, objective, curves)

    damper = BoucWen((19.92, 5.03, 20.03, -1.785), (50.0, 75.0), 3000.0, 1230.0, 1230.0, 100.0)

    def rms(omega: float) -> np.ndarray:
        """Return the RMS displacement of both floors over the last ten of 16 cycles."""
        devices = [Device(w, damper, Sampled(damper, Linear(c, 0.0), 200.0, 4.0, 18.0, 60.0, "kalman"))]
        period = 2.0 * np.pi / omega

        def ground(t: float) -> float:
            return -amplitude * (0.5 - 0.5 * np.cos(np.pi * min(t / (2.0 * period), 1.0))) * np.sin(omega * t)

        motion = integrate(M, C, K, devices, ground, 16.0 * period, rtol=1e-6, atol=1e-9)
        return np.sqrt(np.mean(motion.displacement[motion.time > 6.0 * period] ** 2, axis=0))

    below, at, above = (rms(factor * found.resonance_rad_s) for factor in (0.94, 1.0, 1.06))
    assert found.peaks["rms_x_top_m"] == pytest.approx(at[1], rel=2e-3)
    curve = found.curves[0]
    place = int(np.argmax(curve.column("rms_x_top_m")))
    assert curve.column("rms_x1_m")[place] == pytest.approx(at[0], rel=2e-3)
    assert max(below[1], above[1]) < 0.98 * at[1]
    # vertex of the parabola through the three points
    vertex = 0.06 * 0.5 * (above[1] - below[1]) / (2.0 * at[1] - above[1] - below[1])
    assert abs(vertex) < 0.01
