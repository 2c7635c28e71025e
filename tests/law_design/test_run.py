"""A small design from settings to ranking, on the frame of the thesis and damper set C."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control.assembly import ControllerFactory, calibrated_from
from mrpipe.control.calibration import CalibrationOptions, calibrate, plant_of
from mrpipe.control.gains import Gains
from mrpipe.control.law import Plant
from mrpipe.control.laws import law_named
from mrpipe.control.lqg import Weights
from mrpipe.control.settings import ControllerSettings
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.errors import UserError
from mrpipe.law_design.options import DesignSettings, MotionSettings
from mrpipe.law_design.problem import LoopOf, laws_in_the_race, scaled_force
from mrpipe.law_design.results import design_as_json
from mrpipe.law_design.run import Result, load_of, run_design
from mrpipe.law_design.uncertainty import DamperUncertainty, FrameUncertainty, draw
from mrpipe.reporting.design_words import in_lines, in_plain_words
from mrpipe.simulation.loop import LoopOptions
from mrpipe.simulation.response_curve import response_curve
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.structures import frame_from_parameter_set, natural_modes
from tests.coarse_curves import take_coarse_curves

LAWS = tuple(law_named(name) for name in ("vd", "vdns", "fdns"))
UNCERTAIN = (
    FrameUncertainty(np.full(5, 0.01), np.full(5, 3e-4)),
    DamperUncertainty(("yield_displacement",), np.array([[(2e-5) ** 2]]), 0.05),
)


@pytest.fixture(scope="module")
def plant() -> Plant:
    frame = frame_from_parameter_set("thesis")
    return plant_of(frame, np.eye(5)[0], CalibrationOptions())


@pytest.fixture(scope="module")
def rig(plant: Plant) -> Rig:
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    calibration = calibrate(plant.frame, plant.position, CalibrationOptions(), LAWS)
    calibrated = calibrated_from(calibration, Weights(), damper, amplitude_m=0.0093)
    return Rig(
        plant.frame,
        damper,
        ControllerFactory(plant.frame, damper, calibrated, ControllerSettings(inverse="model", residual_force_n=18.0)),
        LoopOptions(),
    )


def designed(rig: Rig, plant: Plant, settings: DesignSettings, identified: Rig | None = None) -> Result:
    load = load_of(settings, 0.79, (7.0, 11.5))
    return run_design(
        rig,
        plant,
        settings,
        load,
        UNCERTAIN,
        absolute=False,
        rng=np.random.default_rng(3),
        jobs=1,
        progress=lambda _, __="": None,
        identified=identified,
    )


@pytest.mark.literature
def test_the_gains_found_by_trial_and_error_are_the_minimum_over_frequency(rig: Rig, plant: Plant) -> None:
    # thesis 5.4: c = 650 N s/m of vd was found by trial and error; no printed formula gives it
    settings = DesignSettings(laws=("vd", "passive-on"), amplitude_factors=(1.0,), draws=4, grid=5, evaluations=8)
    result = designed(rig, plant, settings)
    summary = design_as_json(result, settings)
    assert summary["best"] == "vd"
    assert 600.0 <= summary["laws"]["vd"]["gains"]["c_n_s_m"] <= 700.0
    assert summary["laws"]["vd"]["probability_best"] == 1.0
    assert summary["laws"]["passive-on"]["peak_rms_x_top_m"] > 3.0 * summary["laws"]["vd"]["peak_rms_x_top_m"]
    assert summary["uncertainty"]["regret"] == 0.0
    # every design of the front is better than the next one in one quantity and worse in the other
    front = summary["pareto"]
    assert all(a["peak_rms_x_top_m"] < b["peak_rms_x_top_m"] for a, b in itertools.pairwise(front))
    assert all(a["peak_rms_a_top_m_s2"] > b["peak_rms_a_top_m_s2"] for a, b in itertools.pairwise(front))


@pytest.mark.property
def test_better_gains_stay_better_at_half_the_step_with_other_noise(rig: Rig) -> None:
    # the design of vdns without the stiffness of the thesis, confirmed under other conditions than it was found in
    peaks = {}
    for name, law, gains in (
        ("thesis", "vd", {"c_n_s_m": 650.0}),
        ("free", "vdns", {"c_n_s_m": 121.0, "k_n_m": -6424.0}),
    ):
        finer = replace(rig, options=replace(rig.options, plant_rate_hz=4000.0))
        run = LoopOf(finer, seed=99)(law, Gains(**gains))
        peaks[name] = response_curve(run, 0.79, (7.0, 11.5), CurveOptions(points=9, tolerance=2e-2)).peak("rms_x_top_m")
    assert peaks["free"] < 0.95 * peaks["thesis"]


@pytest.mark.property
def test_a_design_says_what_it_would_lose_without_the_tracing(
    rig: Rig, plant: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    take_coarse_curves(monkeypatch)
    # a residual force that nobody knew of: the traced damper is half as strong again as the identified one
    traced = replace(rig, damper=scaled_force(rig.damper, 1.5))
    settings = DesignSettings(laws=("fdns",), amplitude_factors=(1.0,), draws=0, grid=4, evaluations=4)
    result = designed(traced, plant, settings, identified=rig)
    without = result.untraced
    assert without is not None
    best = result.designed["fdns"].best
    assert without.design.gains != best.gains
    assert without.with_traced.gains == without.design.gains
    assert without.regret == without.with_traced.value / best.value - 1.0
    assert without.regret > -0.01
    summary = design_as_json(result, settings)
    assert summary["before_tracing"]["regret"] == without.regret
    assert f"{100.0 * without.regret:.1f} % above" in in_plain_words(summary)
    # the confirmation compares the best design with calibrated gains
    confirmed = summary["confirmation"]
    assert confirmed["same_law_calibrated"] == confirmed["calibrated"]
    assert confirmed["design"]["gains"] == summary["laws"]["fdns"]["gains"]
    # the command prints every law with its gains, before the conclusion
    lines = in_lines(summary)
    assert lines[1].split()[:3] == ["law", "best", "gains"]
    assert lines[2].startswith("fdns") and f"{summary['laws']['fdns']['gains']['alpha_n_m']:.4g} N/m" in lines[2]
    assert f"{1e3 * best.peaks['rms_x_top_m']:.1f}" in lines[2]
    assert any(f"{100.0 * without.regret:.1f} % above" in line for line in lines)


@pytest.mark.property
def test_draws_have_the_deviations_that_are_asked_for(rig: Rig) -> None:
    rng = np.random.default_rng(1)
    draws = [draw(rig.frame, rig.damper, *UNCERTAIN, rng) for _ in range(300)]
    omega = np.array([natural_modes(item.frame).angular_frequencies for item in draws])
    nominal = natural_modes(rig.frame).angular_frequencies
    np.testing.assert_allclose(np.std(omega / nominal, axis=0), 0.01, rtol=0.15)
    np.testing.assert_allclose(np.mean(omega / nominal, axis=0), 1.0, atol=0.002)
    assert np.std([item.force_factor for item in draws]) == pytest.approx(0.05, rel=0.15)
    assert all(item.frame.mass is rig.frame.mass for item in draws)


@pytest.mark.property
def test_mistakes_are_named(rig: Rig, plant: Plant) -> None:
    calibrated = rig.controllers.calibrated.gains
    for settings, text in (
        (DesignSettings(fixed_gains={"vdd": {}}), "vdd"),
        (DesignSettings(fixed_gains={"vd": {"alpha_n_m": 1.0}}), "alpha_n_m"),
    ):
        with pytest.raises(UserError, match=text):
            laws_in_the_race(settings, plant, calibrated)
    with pytest.raises(UserError, match="rms_x9_m"):
        load_of(DesignSettings(weights={"rms_x9_m": 1.0}), 0.79, (7.0, 9.0))
    with pytest.raises(UserError, match="band"):
        load_of(DesignSettings(), 0.79, (9.0, 7.0))


@pytest.mark.property
def test_a_motion_of_two_components_acts_in_both_directions(tmp_path: Path, plant: Plant) -> None:
    record = tmp_path / "both.csv"
    np.savetxt(record, [[0.0, 1.0, 2.0], [0.1, 3.0, 4.0]], delimiter=",")
    settings = DesignSettings(motions=(MotionSettings(file=str(record)),))
    second = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    two = replace(plant.frame, influence_y=second)
    excitation = load_of(settings, 0.79, (7.0, 9.0), two).motions[0].excitation
    np.testing.assert_array_equal(excitation.at(np.array([0.1])), [[3.0, 4.0]])
    np.testing.assert_array_equal(excitation.places[0].shape, second)
    one = load_of(settings, 0.79, (7.0, 9.0), plant.frame).motions[0].excitation
    assert not one.places
    np.testing.assert_array_equal(one.at(np.array([0.1])), [3.0])


@pytest.mark.property
def test_wind_acts_on_degrees_of_freedom(tmp_path: Path, plant: Plant, rig: Rig) -> None:
    record = tmp_path / "wind.csv"
    time = np.arange(0.0, 4.0, 0.01)
    np.savetxt(record, np.column_stack([time, 0.02 * np.sin(7.0 * time)]), delimiter=",")
    wind = MotionSettings(file=str(record), unit="kN", force_at={"floor 5": 1.0, 4: 0.5}, scale=2.0)
    excitation = load_of(DesignSettings(motions=(wind,)), 0.79, (7.0, 9.0), plant.frame).motions[0].excitation
    np.testing.assert_allclose(excitation.at(time).ravel(), 40.0 * np.sin(7.0 * time), atol=1e-9)
    (place,) = excitation.places
    np.testing.assert_array_equal(place.shape, [0.0, 0.0, 0.0, 0.5, 1.0])
    response = rig.run(rig.controller("vd"), excitation)
    assert np.ptp(response.displacement[:, -1]) > 0.0
    with pytest.raises(UserError, match=r"design\.motions\[0\]\.force_at: 'floor 9' is not a degree of freedom"):
        load_of(DesignSettings(motions=(wind.changed(force_at={"floor 9": 1.0}),)), 0.79, (7.0, 9.0), plant.frame)
