"""Single harmed tests, other sessions, faster motion, dampers that never yield: each gets its true verdict."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.options import TracingOptions
from tests.tracing.bench.rig import RATE, hysteresis
from tests.tracing.bench.sines import (
    cut,
    dead_load_cell,
    exchanged,
    harmed,
    late,
    recorded,
    scaled,
    sines,
    stuck,
)

FORMS = ("bouc-wen", "dahl")


def traced(
    tests: list[PreparedTest],
    names: tuple[str, ...] = ("accumulator", "saturation"),
    forms: tuple[str, ...] = FORMS,
) -> dict[str, Any]:
    options = TracingOptions(
        refits=2, bootstrap_draws=50, yield_order=2, most_effects=1, observation_filter=False, base_forms=forms
    )
    library = {name: damper_effects()[name] for name in names}
    return trace_campaign(tests, library, [], options, rng=np.random.default_rng(1)).summary


@pytest.mark.planted
def test_a_sound_campaign_of_the_base_form_holds_nothing_but_noise() -> None:
    found = traced(sines())
    assert found["verdict_class"] == "noise"
    assert found["effects"] == []
    assert not found["unexplained"]["structured"]
    assert found["before"]["nrmse"] == pytest.approx(found["noise_floor_nrmse"], rel=0.25)


@pytest.mark.planted
@pytest.mark.parametrize(
    ("harm", "kind", "value"),
    [
        (lambda test: scaled(test, 1e-3), "unit-decades", 1e-3),
        (lambda test: scaled(test, -1.0), "sign-reversed", -1.0),
        (lambda test: scaled(test, 1.3), "gain-differs", 1.3),
        # too little for the comparison of tests, enough for the model
        (lambda test: scaled(test, 1.1), "gain", 1.1),
        (lambda test: late(test, 0.02), "delay-differs", 1.0),
    ],
)
def test_one_harmed_validation_test_is_named(harm: Callable[..., PreparedTest], kind: str, value: float) -> None:
    found = traced(harmed(sines(), (8,), harm))
    assert found["verdict_class"] == "validation differs"
    assert found["effects"] == []
    assert [(item["kind"], item["tests"]) for item in found["validation"]["differences"]] == [(kind, ["8-validation"])]
    assert found["validation"]["differences"][0]["value"] == pytest.approx(value, rel=0.02)
    comparable = found["validation"]["comparable"]
    assert comparable["tests"] == ["6-validation", "7-validation", "9-validation"]
    assert comparable["nrmse_after"] < 1.25 * found["noise_floor_nrmse"]
    assert "8-validation" in found["verdict"]


@pytest.mark.planted
@pytest.mark.parametrize(
    ("harm", "finding"),
    [
        (lambda test: scaled(test, 1e-3), "unit-decades"),
        (lambda test: scaled(test, -1.0), "sign-reversed"),
        (lambda test: scaled(test, 1.3), "gain-differs"),
        (exchanged, "channels-exchanged"),
        (stuck, "stuck-channel"),
    ],
)
def test_one_harmed_training_test_is_left_out_and_named(harm: Callable[..., PreparedTest], finding: str) -> None:
    found = traced(harmed(sines(), (3,), harm))
    assert [(item["name"], item["test"], item["left_out"]) for item in found["findings"]] == [
        (finding, "3-training", True)
    ]
    assert found["verdict"].startswith("test 3-training is left out")
    assert found["verdict_class"] == "noise"
    assert found["effects"] == []


@pytest.mark.planted
def test_a_validation_test_that_repeats_a_training_record_is_not_judged() -> None:
    tests = sines()
    tests[9] = replace(tests[4], name="copy", role="validation")
    found = traced(tests)
    assert [(item["name"], item["left_out"]) for item in found["findings"]] == [("same-record", True)]
    assert "copy" not in [item["name"] for item in found["tests"]]


@pytest.mark.planted
def test_validation_from_another_session_is_named_with_its_gain_and_lag() -> None:
    found = traced(harmed(sines(), (6, 7, 8, 9), lambda test: late(scaled(test, 0.75), 0.02)))
    assert found["verdict_class"] == "validation differs"
    values = {item["kind"]: item["value"] for item in found["validation"]["differences"]}
    assert values == {"gain": pytest.approx(0.75, rel=0.02), "lag": pytest.approx(0.02, rel=0.05)}
    assert "session" in found["verdict"]
    assert found["effects"] == []
    assert found["validation"]["comparable"]["nrmse_corrected"] < 1.5 * found["noise_floor_nrmse"]


@pytest.mark.planted
@pytest.mark.parametrize("places", [(8,), (2, 7)])
def test_a_displacement_that_is_stuck_for_a_while_is_never_noise(places: tuple[int, ...]) -> None:
    found = traced(harmed(sines(), places, stuck))
    assert found["verdict_class"] != "noise"
    assert found["effects"] == []
    assert found["unexplained"]["structured"] or found["verdict_class"] == "validation differs"


@pytest.mark.planted
def test_a_piece_cut_out_of_two_tests_is_no_effect() -> None:
    found = traced(harmed(sines(), (2, 7), cut))
    assert found["verdict_class"] not in ("noise", "explained")
    assert found["effects"] == []


@pytest.mark.planted
def test_a_dead_load_cell_stops_the_tracing() -> None:
    found = traced(harmed(sines(), tuple(range(10)), dead_load_cell))
    assert found["verdict_class"] == "unknown"
    assert "nothing is traced" in found["verdict"]
    assert found["candidates"] == []


def at_currents(training: tuple[float, ...], validation: tuple[float, ...], faster: float = 1.0) -> list[PreparedTest]:
    """Return tests of a rig whose yield force is quadratic in the current; validation may be faster."""
    t = np.arange(int(3.0 * RATE)) / RATE
    plan = [("training", 1.0 + 0.3 * (k % 3), current) for k, current in enumerate(training)]
    plan += [("validation", faster * (1.2 + 0.2 * (k % 2)), current) for k, current in enumerate(validation)]
    return [
        recorded(f"{k}-{role}", role, 8e-3 * np.sin(2 * np.pi * frequency * t), current, k)
        for k, (role, frequency, current) in enumerate(plan)
    ]


@pytest.mark.planted
def test_validation_that_is_merely_faster_is_no_difference() -> None:
    levels = (0.0, 1.0, 2.0, 3.0)
    found = traced(at_currents(levels * 2, levels, faster=2.0))
    assert found["verdict_class"] == "noise"
    assert found["validation"]["differences"] == []


@pytest.mark.planted
def test_drives_between_those_of_the_training_are_predicted_where_the_drive_law_is_right() -> None:
    found = traced(at_currents((0.0, 1.0, 2.0, 3.0) * 2, (0.5, 1.5, 2.5, 3.0)))
    assert found["verdict_class"] == "noise"


@pytest.mark.planted
def test_drives_between_those_of_the_training_are_named_where_the_drive_law_fails() -> None:
    tests = at_currents((0.0, 1.0, 2.0, 3.0) * 2, (0.5, 1.5, 2.0, 3.0))
    # a driver with a dead zone: between the levels it gives another current than the polynomial expects
    found = traced([scaled(test, 0.7) if test.drive[0] in (0.5, 1.5) else test for test in tests])
    assert found["verdict_class"] == "validation differs"
    assert found["validation"]["differences"][0]["tests"] == ["8-validation", "9-validation"]
    assert found["validation"]["comparable"]["nrmse_after"] < 1.25 * found["noise_floor_nrmse"]


@pytest.mark.planted
def test_no_effect_is_named_where_the_model_is_worse_than_the_mean() -> None:
    """A damper with play whose yield force between the drives of the training is far from what these suggest.

    The play lowers the error of the training tests, but not that of validation tests with an NRMSE above 1.
    """
    t = np.arange(int(3.0 * RATE)) / RATE
    plan = [("training", 1.0 + 0.3 * (k % 3), current) for k, current in enumerate((0.0, 1.0, 2.0, 3.0) * 2)]
    plan += [("validation", 1.2 + 0.2 * k, current) for k, current in enumerate((0.5, 2.5))]
    tests = [
        recorded(f"{k}-{role}", role, 8e-3 * np.sin(2 * np.pi * frequency * t), current, k, "wide-backlash")
        for k, (role, frequency, current) in enumerate(plan)
    ]
    found = traced([scaled(test, 0.3) if test.role == "validation" else test for test in tests], ("backlash",))
    assert found["before"]["nrmse"] > 1.0
    assert found["effects"] == []
    assert found["verdict_class"] not in ("noise", "explained", "partly explained", "base form")
    assert "explain" not in found["verdict"]
    assert found["share_explained"] == 0.0


@pytest.mark.planted
def test_a_damper_that_never_yields_within_its_stroke_has_no_effect() -> None:
    t = np.arange(int(3.0 * RATE)) / RATE
    # the yield displacement of the rig is 0.37 mm
    tests = [
        recorded(f"{k}-{role}", role, 1e-3 * amplitude * np.sin(2 * np.pi * frequency * t), current, k, noise_n=0.1)
        for k, (role, amplitude, frequency, current) in enumerate(
            [("training", 0.1 + 0.02 * (k % 3), 1.0 + 0.4 * (k % 4), 0.5 * (k % 4)) for k in range(8)]
            + [("validation", 0.11, 1.2 + 0.3 * k, 0.5 * k) for k in range(4)]
        )
    ]
    found = traced(tests, ("accumulator", "quadratic-drag", "stribeck"))
    assert found["effects"] == []
    assert "does not yield" in found["verdict"]


@pytest.mark.planted
def test_an_effect_is_explained_only_by_its_error_on_validation_tests() -> None:
    found = traced(sines("accumulator"))
    assert found["verdict_class"] == "explained"
    assert [item["name"] for item in found["effects"]] == ["accumulator"]
    assert found["after"]["nrmse"] < 1.25 * found["noise_floor_nrmse"]
    low, high = found["ceiling"]["interval"]
    assert low < found["ceiling"]["nrmse"] < high


def without_drive(test: PreparedTest) -> PreparedTest:
    return replace(test, drive=np.zeros_like(test.drive))


def with_hum(test: PreparedTest) -> PreparedTest:
    hum = 5.0 * np.sin(2.0 * np.pi * 50.0 * test.time_s)
    return replace(test, force_n=test.force_n + hum, force_raw_n=test.force_raw_n + hum)


def at_one_drive(test: PreparedTest) -> PreparedTest:
    return replace(test, drive=np.ones_like(test.drive))


def with_force(test: PreparedTest, force: np.ndarray) -> PreparedTest:
    return replace(test, force_n=force, force_raw_n=force)


def with_dropouts(test: PreparedTest) -> PreparedTest:
    """Set the force to zero in two samples of every hundred, as a loose connector does."""
    return with_force(test, np.where(np.arange(len(test.force_n)) % 100 < 2, 0.0, test.force_raw_n))


def saturated_softly(test: PreparedTest) -> PreparedTest:
    """Bend the force towards 60 N, as an overloaded amplifier does."""
    return with_force(test, 60.0 * np.tanh(test.force_raw_n / 60.0))


def without_motion(test: PreparedTest) -> PreparedTest:
    noise = 1e-6 * np.random.default_rng(3).standard_normal(len(test.time_s))
    zero = np.zeros_like(noise)
    return replace(test, displacement_m=zero, velocity_m_s=zero, acceleration_m_s2=zero, displacement_raw_m=noise)


@pytest.mark.planted
def test_steps_of_a_coarse_load_cell_are_noise() -> None:
    coarse = [with_force(test, 4.0 * np.round(test.force_raw_n / 4.0)) for test in sines()]
    found = traced(coarse)
    assert found["verdict_class"] == "noise"
    assert found["noise_floor_nrmse"] == pytest.approx(found["before"]["nrmse"], rel=0.25)


@pytest.mark.planted
def test_a_constant_initial_stiffness_is_a_base_form_and_no_effect() -> None:
    """The yield displacement grows with the yield force: no rate dependence, and nothing that the damper lacks."""
    found = traced(stiff(), ("stribeck", "migration"), (*FORMS, "bouc-wen-stiffness", "yielding-part"))
    assert found["verdict_class"] == "base form"
    assert found["base_form"]["taken"] == "bouc-wen-stiffness"
    assert found["effects"] == []
    assert found["after"]["nrmse"] < 1.25 * found["noise_floor_nrmse"]


def stiff() -> list[PreparedTest]:
    """Return tests of a Bouc-Wen damper with 60 N/mm of initial stiffness at every current."""
    tests = []
    for number, test in enumerate(sines()):
        rng = np.random.default_rng(number)
        yield_force = 20.0 + 8.0 * test.drive[0] + 14.0 * test.drive[0] ** 2
        viscous = (50.0 + 75.0 * test.drive[0]) * test.velocity_m_s
        force = yield_force * hysteresis(test.displacement_m, yield_force / 6e4) + viscous
        tests.append(with_force(test, force + 0.3 * rng.standard_normal(len(force))))
    return tests


@pytest.mark.planted
@pytest.mark.parametrize("harm", [without_drive, at_one_drive, with_hum, with_dropouts, saturated_softly, cut])
def test_a_fault_of_the_whole_campaign_is_unknown_and_no_effect(harm: Callable[..., PreparedTest]) -> None:
    found = traced(harmed(sines(), tuple(range(10)), harm))
    assert found["verdict_class"] == "unknown"
    assert found["effects"] == []
    assert found["unexplained"]["structured"]


@pytest.mark.planted
def test_a_displacement_of_zero_stops_the_tracing() -> None:
    found = traced(harmed(sines(), tuple(range(10)), without_motion))
    assert found["verdict_class"] == "unknown"
    assert "nothing is traced" in found["verdict"]
    assert found["effects"] == []
