"""Whether a design says that its response depends on the start, and that its stiffness is beyond the static limit."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control.calibration import CalibrationOptions, plant_of
from mrpipe.control.controller import build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import inverse_table
from mrpipe.control.lqg import Weights
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.law_design.confirmation import Confirmation, OtherStarts, doubts, other_starts
from mrpipe.law_design.objective import Evaluation
from mrpipe.simulation.loop import LoopOptions, simulate_law
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.simulation.windows import QUANTITIES
from mrpipe.structures import shear_frame

FRAME, FIRST = shear_frame([25.0] * 2, [3.0e4] * 2, 0.01), np.array([1.0, 0.0])
DAMPER = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))


def evaluated(law: str, gains: Gains, omega: float, amplitude: float) -> Evaluation:
    values = np.ones((1, len(QUANTITIES)))
    curve = ResponseCurve(amplitude, np.array([omega]), values, 0.0 * values, np.array([True]))
    return Evaluation(law, gains, (curve,), {})


def started(found: Evaluation) -> OtherStarts:
    options = ControllerOptions(residual_force_n=18.0, drive_limit=4.0)
    controller = build_controller(found.law, found.gains, options, inverse=inverse_table(DAMPER), position=FIRST)
    return other_starts(
        lambda motion: simulate_law(FRAME, DAMPER.chain(), controller, motion, LoopOptions(), position=FIRST),
        found,
        CurveOptions(settling_cycles=20, most_cycles=80),
    )


@pytest.mark.property
def test_a_response_that_depends_on_its_start_is_reported() -> None:
    """Two of eight phases lead to 5.1 mm, the others to 5.6 mm (docs/design.md); law vd has one response."""
    found = started(evaluated("vdns", Gains(c_n_s_m=1426.0, k_n_m=-38.7e3), 24.1, 3.0))
    values = 1e3 * found.rms_x_top_m
    assert values.size == 8 and np.sum(values < 5.2) == 2 and np.all((values < 5.2) | (values > 5.5))
    assert found.matter
    assert "depends on its start: at 24.10 rad/s the RMS top displacement is 5.1" in found.sentence
    plain = started(evaluated("vd", Gains(c_n_s_m=1426.0), 24.1, 3.0))
    assert not plain.matter and plain.sentence == ""


@pytest.mark.property
def test_an_irregular_response_does_not_count_as_one_that_depends_on_its_start() -> None:
    values = np.array([1.0, 1.05, 1.1])
    assert OtherStarts(8.0, values, 0.02).matter
    assert not OtherStarts(8.0, values, 0.03).matter
    assert not OtherStarts(8.0, np.array([1.0, np.inf]), 0.0).matter


@pytest.mark.property
def test_a_stiffness_beyond_the_static_limit_is_reported() -> None:
    plant = plant_of(FRAME, FIRST, CalibrationOptions(weights=Weights()))
    assert plant.static_stiffness_n_m == pytest.approx(3.0e4)
    quiet = OtherStarts(24.1, np.ones(8), 0.0)

    def said(k: float, starts: OtherStarts) -> list[str]:
        design = evaluated("vdns", Gains(c_n_s_m=1426.0, k_n_m=k), 24.1, 3.0)
        return doubts(Confirmation(design, design, design, starts), plant)

    assert said(-2.9e4, quiet) == []
    (line,) = said(-3.87e4, quiet)
    assert "negative stiffness of -38700 N/m, which is beyond the static limit of -30000 N/m" in line
    assert len(said(-3.87e4, OtherStarts(24.1, np.array([1.0, 1.1]), 0.0))) == 2
