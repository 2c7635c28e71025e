"""Ranking of the laws over a frequency band: at each loop's own resonance, not at one frequency."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control import ControllerOptions, Gains, build_controller, inverse_table
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.simulation import LoopOptions, harmonic
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.structures import frame_from_parameter_set
from mrpipe.thesis.gains import THESIS_GAINS
from mrpipe.tracing.loop.band import Band, amplitude_of, best_way, curves_of, rank_over_band
from mrpipe.tracing.loop.comparison import Arrangement, Bench, simulated_runs
from mrpipe.tracing.loop.study import laws_to_compare

LAWS = ("vd", "passive-on")


@pytest.mark.literature
def test_a_locked_damper_ranks_last_over_the_band_though_it_is_best_at_the_free_frequency() -> None:
    # thesis 5.5.1 takes its values at the actual resonance of each loop
    frame = frame_from_parameter_set("thesis")
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    inverse, options = inverse_table(damper), ControllerOptions(residual_force_n=18.0)

    way = Arrangement(
        damper.chain(),
        lambda run: build_controller(run.law, THESIS_GAINS.get(run.law, Gains()), options, inverse=inverse),
    )
    bench = Bench(frame, np.eye(5)[0], LoopOptions(), 0, 0.02)
    runs = simulated_runs(harmonic(0.79, 8.0, cycles=20, settling_cycles=10), LAWS)
    band = Band((6.5, 12.0), amplitude_of(runs[0]))
    assert band.amplitude_m_s2 == pytest.approx(0.79, rel=0.02)
    curves = curves_of(runs, {law: {"before": way} for law in LAWS}, bench, band, jobs=2)
    found = rank_over_band(curves, band, ("before",))
    assert found["ranking"]["before"] == ["vd", "passive-on"]
    at_one_frequency = {law: np.interp(8.0, c["before"].frequency_rad_s, c["before"].column("rms_x_top_m"))
                        for law, c in curves.items() if c["before"] is not None}  # fmt: skip
    assert at_one_frequency["passive-on"] < at_one_frequency["vd"]


def curve(peak: float) -> ResponseCurve:
    return ResponseCurve(1.0, np.array([8.0]), np.full((1, 5), peak), np.zeros((1, 5)), np.array([True]))


@pytest.mark.property
def test_a_renewed_controller_must_be_clearly_better() -> None:
    assert best_way({"nothing": curve(0.030), "inverse": curve(0.0299)}) == "nothing"
    assert best_way({"nothing": curve(0.030), "inverse": curve(0.029)}) == "inverse"
    assert best_way({"nothing": None, "inverse": curve(0.029)}) == "inverse"


@pytest.mark.property
def test_a_loop_that_grows_has_no_rank() -> None:
    made: dict[str, dict[str, ResponseCurve | None]] = {
        "vd": {"before": curve(0.03), "after": curve(0.04)},
        "lqg": {"before": None, "after": curve(0.03)},
    }
    found = rank_over_band(made, Band((6.0, 12.0), 1.0), ("before", "after"))
    assert found["ranking"] == {"before": ["vd"], "after": ["lqg", "vd"]}
    assert "diverged" in found["over_band"]["laws"][1]["before"]
    assert not found["ranking_changes"]


@pytest.mark.property
def test_the_laws_that_the_run_simulates_are_compared() -> None:
    available = ["vd", "vdns", "lqg"]
    assert laws_to_compare((), ("prepare", "simulate-vdns", "simulate-nnc"), available) == ["vdns"]
    assert laws_to_compare(("lqg",), ("simulate-vdns",), available) == ["lqg"]
    assert laws_to_compare((), ("prepare",), available) == available
