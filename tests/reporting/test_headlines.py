"""One line for each result."""

from __future__ import annotations

import pytest

from mrpipe.reporting.headlines import headline, in_brief, weak_network
from tests.reporting.front.run import tracing


@pytest.mark.property
def test_a_network_far_worse_than_the_damper_model_is_named_with_both_errors() -> None:
    found = {
        "train-forward": {"validation_nrmse": 0.43},
        "identify-damper": {"validation_nrmse": 0.127, "form": "dahl"},
    }
    text = weak_network(found)
    assert "43 % of the RMS force" in text and "3.4 times" in text and "dahl (13 %)" in text
    assert weak_network({**found, "train-forward": {"validation_nrmse": 0.15}}) == ""
    assert weak_network({"train-forward": {"validation_nrmse": 0.43}}) == ""
    assert weak_network({}) == ""


@pytest.mark.property
def test_a_weak_network_is_explained_by_its_tests_and_by_the_past_it_sees() -> None:
    network = {
        "validation_nrmse": 0.37, "constant_drive_nrmse": 0.1, "varying_drive_nrmse": 0.59, "training_tests": 11,
        "training_tests_with_varying_drive": 1, "past_values": 3, "sampling_rate_hz": 200.0, "yield_time_s": 0.13,
    }  # fmt: skip
    damper = {"validation_nrmse": 0.127, "form": "dahl"}
    text = weak_network({"train-forward": network, "identify-damper": damper})
    assert (
        "59 % in tests whose drive changes and 10 % in the others. The drive changes in only 1 of 11 training" in text
    )
    assert "sees 15 ms of the past" in text and "takes about 130 ms" in text
    enough = {**network, "past_values": 20, "varying_drive_nrmse": 0.12}
    text = weak_network({"train-forward": enough, "identify-damper": damper})
    assert text.endswith("dahl (13 %). Use the damper model for predictions.")


@pytest.mark.property
def test_the_command_that_applies_corrections_is_complete() -> None:
    lines = in_brief("close-loop", tracing(corrections={"found": True, "file": "corrections.yaml"}))
    (line,) = [line for line in lines if "corrections" in line]
    assert "mrpipe prepare --settings RUN/corrections.yaml, and the same --config or --campaign" in line
    assert not any("corrections" in line for line in in_brief("close-loop", tracing()))


@pytest.mark.property
def test_an_exchanged_base_form_without_effects_is_in_the_line() -> None:
    """It had said `no known effect explains the residual: NRMSE 0.212 before, 0.00445 after`."""
    form = {"declared": "bouc-wen", "taken": "dahl", "nrmse": {}}
    left = {"structured": True, "share_of_residual": 0.00025, "depends_on": []}
    unknown = tracing(base_form=form, effects=[], unexplained=left)
    assert "no known effect explains what the base form dahl leaves" in headline("close-loop", unknown)
    assert any("0.025 % of the squared residual" in line for line in in_brief("close-loop", unknown))
    done = tracing(base_form=form, effects=[])
    assert "no effect is missing with the base form dahl in place of bouc-wen" in headline("close-loop", done)


@pytest.mark.property
def test_a_relative_acceleration_is_called_relative() -> None:
    """The table of the laws has absolute accelerations, so the two must not share a name."""
    summary = {"rms_x_top_m": 0.0243, "rms_x1_m": 0.00617, "rms_a1_m_s2": 0.816, "damping_ratio": 0.127}
    assert "a1 0.816 m/s² relative to the ground" in headline("simulate-vd", summary)


@pytest.mark.property
def test_stages_that_read_data_say_so_in_words() -> None:
    recorded = {"campaign": "x", "tests": 190, "samples": 2415546, "duration_s": 2415.5}
    prepared = {"campaign": "rig", "test_count": 14, "sampling_rate_hz": 1000.0, "drive_unit": "A"}
    swept = {"candidates": 31, "choice": "v,i | 4 past | 10-12-1"}
    assert headline("record-bench", recorded) == "190 tests, 40 min"
    assert headline("prepare", prepared) == "campaign rig: 14 tests at 1000 Hz, drive in A"
    assert headline("sweep", swept) == "of 31 networks, v,i | 4 past | 10-12-1 is chosen"


@pytest.mark.golden
def test_open_questions_of_one_kind_are_one_sentence() -> None:
    asked = ["inertia or accumulator", "whether there is delay", "inertia or end-stop", "whether there is remanence"]
    wanted = {"tests": [{}, {}], "file": "next-tests.yaml", "decides": [{"decides": item} for item in asked]}
    line = in_brief("close-loop", tracing(next_tests=wanted))[-1]
    assert line == (
        "2 tests in next-tests.yaml would decide inertia or accumulator, end-stop; whether there is delay or remanence"
    )


@pytest.mark.property
def test_the_line_of_a_tracing_names_an_exchanged_base_form_and_determined_numbers_first() -> None:
    parameters = {
        "gas_length": {"value": 0.5, "unit": "m", "interval": [0.104, 2.416]},
        "stiffness": {"value": 3534.0, "unit": "N/m", "interval": [3501.0, 3567.0]},
    }
    form = {"declared": "bouc-wen", "taken": "rounded-yield", "nrmse": {}}
    found = tracing(base_form=form, effects=[{**tracing()["effects"][0], "parameters": parameters}])
    assert headline("close-loop", found).startswith("accumulator with the base form rounded-yield in place of bouc-wen")
    line = next(line for line in in_brief("close-loop", found) if line.startswith("effect"))
    assert "stiffness 3.53e+03 N/m, gas length 0.5 m (not well determined)" in line
    assert headline("close-loop", tracing()).startswith("accumulator: ")


@pytest.mark.property
def test_tied_effects_are_in_the_line() -> None:
    left = {"structured": True, "share_of_residual": 1.0, "depends_on": []}
    tied = {"effects": ["impact", "yielding"], "separating_tests": []}
    assert "impact and yielding explain the residual equally well" in headline(
        "close-loop", tracing(effects=[], unexplained=left, tied=tied)
    )


@pytest.mark.property
def test_the_line_of_a_design_states_the_best_law_or_the_gains_of_all_dampers() -> None:
    laws = {"fdns": {"peak_rms_x_top_m": 0.02}, "vd": {"peak_rms_x_top_m": 0.03}}
    line = headline("design", {"best": "fdns", "laws": laws})
    assert line == "best law fdns: largest rms x_top over frequency 20 mm (others: vd 30 mm)"
    together = {
        "dampers": {"base": {}, "roof": {}},
        "best": {"peak_rms_x_top_m": 0.51},
        "calibrated": {"peak_rms_x_top_m": 0.52},
        "improvement": 0.0115,
    }
    line = headline("design", together)
    assert line == (
        "gains of base and roof together: largest rms x_top over frequency 510 mm, with the calibrated gains 520 mm"
    )
