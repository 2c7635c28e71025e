"""Ranking of the laws, what is judged of a response, and the sentences made of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.campaigns import Campaign, Recording
from mrpipe.control.controller import Gains, build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.reporting.closed_loop import band_table, law_table, response_by_law
from mrpipe.reporting.closed_loop_words import in_words
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import LoopOptions, simulate_law
from mrpipe.structures import shear_frame
from mrpipe.tracing.loop.comparison import (
    Arrangement,
    Bench,
    LoopRun,
    judged_span,
    law_rows,
    measured_runs,
    predicted,
    ranking,
    reversed_pairs,
    with_unrecorded,
)


def rows(**columns: dict[str, float]) -> list[dict[str, Any]]:
    laws = list(columns["before"])
    return [
        {"test": law, "law": law, "recorded": "measured" in columns}
        | {when: {"rms_x_top_m": values[law], "rms_a1_m_s2": 1.0} for when, values in columns.items()}
        for law in laws
    ]


BEFORE = {"vd": 0.024, "vdps": 0.032, "fdns": 0.018}


@pytest.mark.property
def test_laws_are_ranked_and_alike_ones_have_no_order() -> None:
    swapped = {"vd": 0.017, "vdps": 0.032, "fdns": 0.019}
    alike = {"vd": 0.0179, "vdps": 0.032, "fdns": 0.018}
    assert ranking(rows(before=BEFORE), "before") == ["fdns", "vd", "vdps"]
    assert reversed_pairs(rows(before=BEFORE, after=swapped), "before", "after") == [["vd", "fdns"]]
    assert reversed_pairs(rows(before=BEFORE, after=alike), "before", "after") == []


@pytest.mark.property
def test_a_response_that_grows_is_said_and_left_out_of_the_ranking() -> None:
    made = rows(before=BEFORE)
    made[0]["before"] = {"diverged": "grows"}
    assert ranking(made, "before") == ["fdns", "vdps"]
    assert law_rows(made, ("before",))[0]["before"] == {"diverged": "grows"}


@pytest.mark.property
def test_the_steady_part_of_a_harmonic_is_judged_and_all_of_an_earthquake() -> None:
    time = np.arange(0.0, 40.0, 0.01)
    harmonic = np.where((time > 1.0) & (time < 31.0), np.sin(8.0 * time), 0.0)
    first, last = judged_span(time, harmonic)
    assert first == pytest.approx(16.0, abs=0.5)
    assert last == pytest.approx(30.4, abs=0.5)
    quake = np.exp(-time / 4.0) * np.sin(8.0 * time)
    assert judged_span(time, quake)[0] < 1.0


@pytest.mark.property
def test_laws_without_recording_get_the_motions_of_the_first() -> None:
    time = np.linspace(0.0, 1.0, 11)
    run = LoopRun("vd-a", "vd", {"c_n_s_m": 650.0}, time, time, np.zeros((11, 3)), np.zeros((0, 0)), np.zeros(0))
    all_runs = with_unrecorded([run], ("vd", "lqg"))
    assert [(item.law, item.recorded) for item in all_runs] == [("vd", True), ("lqg", False)]
    assert all_runs[1].gains == {}


@pytest.mark.property
def test_words_table_and_figure_of_a_comparison() -> None:
    after, again = {"vd": 0.025, "vdps": 0.036, "fdns": 0.026}, {"vd": 0.0245, "vdps": 0.036, "fdns": 0.02}
    made = rows(before=BEFORE, after=after, recalibrated=again, measured=after)
    found = {
        "status": "3 recordings replayed",
        "plant": {"effects": ["remanence"], "left_out": {"channel-skew": "a fault of sensors: corrected in prepare"}},
        "laws": law_rows(made, ("measured", "before", "after", "recalibrated")),
        "recorded_ranking": {when: ranking(made, when) for when in ("measured", "before", "after")},
        "over_band": {
            "band_rad_s": [6.0, 13.0],
            "base_amplitude_m_s2": 0.8,
            "laws": [
                {"law": row["law"]}
                | {
                    when: {
                        "resonance_rad_s": 9.0,
                        "peak_rms_x_top_m": row[when]["rms_x_top_m"],
                        "peak_rms_a1_m_s2": 1.0,
                    }
                    for when in ("before", "after", "recalibrated")
                }
                for row in made
            ],
        },
        "ranking": {when: ranking(made, when) for when in ("before", "after", "recalibrated")},
        "ranking_changes": True,
        "reversed_pairs": reversed_pairs(made, "before", "after"),
        "ranking_agrees_with_measured": {"before": False, "after": True},
        "rms_x_top_error": {"before": 0.2, "after": 0.01},
        "controller": {
            "inverse": "retrained on the damper with its effects",
            "residual_force_before_n": 22.0,
            "residual_force_after_n": 30.0,
            "switch_force_before_n": 18.0,
            "switch_force_after_n": 24.5,
            "gain_factors": {"vd": 0.9, "fdns": 1.0},
            "renewed": {"vd": "inverse, switch", "vdps": "nothing", "fdns": "inverse, switch"},
        },
    }
    text = in_words(found)
    for part in (
        "20.0 %",
        "vd is now ahead of fdns",
        "only after",
        "24.5 N",
        "vd x 0.90",
        "fdns -23 %",
        "channel-skew",
    ):
        assert part in text
    assert law_table(found)[0]["rms_x_top measured [mm]"] == pytest.approx(25.0)
    assert band_table(found)[2]["largest rms_x_top after [mm]"] == pytest.approx(26.0)
    assert len(response_by_law(found).axes) == 2
    assert in_words({"status": "skipped: there is no identified frame"}).startswith("Closed loop skipped")


@pytest.mark.property
def test_floors_are_compared_with_their_own_sensors(tmp_path: Path) -> None:
    """A frame with torsion, floor 1 without a sensor, and a sensor across the ground motion."""
    frame = replace(
        shear_frame(np.full(6, 100.0), np.full(6, 9e5), 0.02),
        influence=np.tile([1.0, 0.0], 3),
        degrees_of_freedom=tuple(f"floor {k} {axis}" for k in range(1, 4) for axis in ("x", "turn")),
    )
    time = np.linspace(0.0, 10.0, 2001)
    base = np.sin(8.0 * time) * (time > 0.0)
    chain = damper_from_parameter_set(load_parameter_set("dampers", "set-c")).chain()
    bench = Bench(frame, np.eye(6)[0], LoopOptions(), 1, 1.0)
    off = build_controller("passive-off", Gains(), ControllerOptions())
    shaken = Excitation(10.0, lambda at: np.interp(at, time, base), (0.0, 10.0))
    whole = simulate_law(frame, chain, off, shaken, bench.options, position=bench.position)
    moved = np.column_stack([np.interp(time, whole.time_s, column) for column in whole.displacement.T])
    channels = {"time": time, "ground_acceleration": base}
    channels |= {
        f"floor_displacement_{name}": moved[:, place] for name, place in {"2_x": 2, "3_turn": 5, "3": 4}.items()
    }
    recording = Recording(
        "off", "validation", 200.0, time, channels, ((0, 2001),), "closed-loop", {"law": "passive-off"}
    )
    (run,) = measured_runs(Campaign("loop", "shear-frame", tmp_path, (recording,)), frame)
    assert run.displacement_of == (2, 4)
    found = predicted(run, Arrangement(chain, lambda _: off), bench)
    assert found["nrmse_x_top"] < 0.01
    assert found["rms_x1_m"] == pytest.approx(float(np.std(moved[1000:, 2])), rel=0.1)
