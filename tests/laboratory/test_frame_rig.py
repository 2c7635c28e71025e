"""The shaken frame: exact against another integrator, sensors, planted effects of the structure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns import load_campaign, write_campaign
from mrpipe.errors import UserError
from mrpipe.laboratory.effects import Planted
from mrpipe.laboratory.frame_rig import calibrated_structure, decay_ground, record_frame, shake, sweep_ground
from mrpipe.laboratory.options import FrameRig
from mrpipe.laboratory.sealing import write_scales
from mrpipe.laboratory.structure import (
    FRAME_EFFECT_NAMES,
    FRAME_FORMS,
    TrueStructure,
    assemble,
    draw_frame_effect,
    find_frame_form,
    random_frame,
)
from mrpipe.structures import frame_from_parameter_set, natural_modes
from mrpipe.structures.response import linear_response

RIG = FrameRig(sweep_s=40.0, sweeps=1, random_s=0.0)
SHORT = RIG.changed(decay_acceleration_m_s2=1.5)


@pytest.fixture(scope="module")
def structure() -> TrueStructure:
    return TrueStructure(frame_from_parameter_set("thesis"))


@pytest.mark.oracle
def test_linear_frame_agrees_with_modal_steps(structure: TrueStructure) -> None:
    ground = sweep_ground(RIG, 0.5, 12.0, 1.3)
    displacement, acceleration = shake(assemble(structure, RIG.step_s), ground, RIG)
    expected = linear_response(structure.frame, ground, RIG.step_s)
    assert np.abs(displacement - expected.displacement[:: RIG.fine_steps]).max() < 1e-9
    assert np.abs(acceleration - expected.absolute_acceleration[:: RIG.fine_steps]).max() < 1e-7


@pytest.mark.literature
@pytest.mark.parametrize("mode", [2, 4])
def test_a_decay_falls_with_the_damping_ratio_of_its_mode(structure: TrueStructure, mode: int) -> None:
    """Damping ratios of section 3.2.2: 0.0024 and 0.0015."""
    ground = decay_ground(SHORT, structure, mode, np.random.default_rng(1))
    _, acceleration = shake(assemble(structure, SHORT.step_s), ground, SHORT)
    frequency = float(natural_modes(structure.frame).frequencies_hz[mode - 1])
    free = acceleration[-round(30.0 * SHORT.sampling_rate_hz) :, 0]
    size = round(3.0 * SHORT.sampling_rate_hz)
    levels = np.log([np.sqrt(np.mean(free[k * size : (k + 1) * size] ** 2)) for k in range(9)])
    slope = -np.polyfit(3.0 * np.arange(9), levels, 1)[0]
    assert slope / (2.0 * np.pi * frequency) == pytest.approx({2: 0.0024, 4: 0.0015}[mode], rel=0.03)


@pytest.mark.golden
def test_sensors_speak_volts_and_the_campaign_knows_their_scale(structure: TrueStructure, tmp_path: Path) -> None:
    record = record_frame(structure, RIG, np.random.default_rng(2))
    write_campaign(
        tmp_path, campaign="f", rig="shear-frame", sampling_rate_hz=RIG.sampling_rate_hz,
        channels=record.channels, tests=record.tests, extra={"frame": {"floor_masses_kg": [5.95] * 5}},
    )  # fmt: skip
    write_scales(tmp_path, record.scales)
    campaign = load_campaign(tmp_path)
    assert campaign.floor_masses_kg == (5.95,) * 5
    kinds = [(test.kind, test.details.get("mode")) for test in campaign.recordings]
    assert kinds == [("sweep", None), *(("free-decay", mode) for mode in range(1, 6))]
    sweep = campaign.recordings[0]
    volts = record.tests[0].columns["ch1"]
    assert np.abs(sweep.channels["ground_acceleration"] - 9.81 * volts).max() < 1e-12
    ground = sweep_ground(RIG, 0.4 * 8 / 2 / np.pi, 1.3 * 9.3, 8 / 2 / np.pi)
    assert sweep.channels["ground_acceleration"].std() == pytest.approx(ground.std(), rel=0.1)
    assert {name for name in sweep.channels if "displacement" in name} == {f"floor_displacement_{i}" for i in (1, 2, 5)}


@pytest.mark.property
@pytest.mark.parametrize("floors", [3, 8])
def test_frames_of_any_height_are_recorded(floors: int) -> None:
    structure = TrueStructure(random_frame(np.random.default_rng(floors), floors))
    record = record_frame(structure, RIG.changed(sweep_s=20.0), np.random.default_rng(1))
    assert len(record.tests) == 1 + floors
    assert sum(name.startswith("floor_acceleration") for name in record.channels) == floors
    assert all(np.isfinite(list(test.columns.values())).all() for test in record.tests)


@pytest.mark.planted
@pytest.mark.parametrize("form", FRAME_FORMS[:-1], ids=lambda form: form.form)
def test_effects_of_the_structure_change_its_response(structure: TrueStructure, form: object) -> None:
    rig = RIG.changed(fine_steps=20, sweep_acceleration_m_s2=0.15)
    ground = sweep_ground(rig, 0.5, 5.0, 1.3)
    plain, _ = shake(assemble(structure, rig.step_s), ground, rig)
    hidden = structure.with_effects([Planted(form)])  # type: ignore[arg-type]
    changed, _ = shake(assemble(hidden, rig.step_s), ground, rig)
    share = np.sqrt(np.mean((changed - plain) ** 2) / np.mean(plain**2))
    if form.effect == "brace-flexibility":  # type: ignore[attr-defined]
        # without a damper there is nothing to be flexible for, but its small mass
        assert share < 0.5
    else:
        assert 0.01 < share < 3.0


@pytest.mark.planted
def test_joint_friction_ends_a_decay_and_cubic_stiffness_raises_the_frequency(structure: TrueStructure) -> None:
    rig = RIG.changed(fine_steps=10)
    ground = decay_ground(rig, structure, 1, np.random.default_rng(1))
    plain, _ = shake(assemble(structure, rig.step_s), ground, rig)
    for form in ("dahl", "smooth"):
        rubbing = structure.with_effects([Planted(find_frame_form("joint-friction", form), {"force": 0.2})])
        stopped, _ = shake(assemble(rubbing, rig.step_s), ground, rig)
        assert np.abs(stopped[-1000:, -1]).max() < 0.2 * np.abs(plain[-1000:, -1]).max()
    hard = structure.with_effects([Planted(find_frame_form("cubic-stiffness", "root"))])
    impulse = np.zeros(round(20.0 / rig.step_s))
    impulse[10:60] = 10.0
    soft_run, hard_run = (shake(assemble(item, rig.step_s), impulse, rig)[0][:, -1] for item in (structure, hard))
    crossings = [np.count_nonzero(np.diff(np.sign(run - run.mean())) != 0) for run in (soft_run, hard_run)]
    assert crossings[1] > crossings[0]


@pytest.mark.planted
def test_impact_stops_the_floor_at_its_clearance(structure: TrueStructure) -> None:
    rig = RIG.changed(fine_steps=20, sweep_acceleration_m_s2=0.15)
    ground = sweep_ground(rig, 0.5, 5.0, 1.3)
    bumper = structure.with_effects([Planted(find_frame_form("impact"), {"clearance": 0.004, "stiffness": 2e7})])
    free, _ = shake(assemble(structure, rig.step_s), ground, rig)
    held, _ = shake(assemble(bumper, rig.step_s), ground, rig)
    assert np.abs(free[:, 0]).max() > 0.007
    # the bumper gives by what its stiffness needs to turn the floor round
    assert np.abs(held[:, 0]).max() < 0.0055


@pytest.mark.property
def test_rigid_limits_of_brace_and_base_are_the_plain_frame(structure: TrueStructure) -> None:
    ground = sweep_ground(RIG, 0.5, 12.0, 1.3)
    plain, _ = shake(assemble(structure, RIG.step_s), ground, RIG)
    stiff = Planted(find_frame_form("base-rocking"), {"compliance": 1e-9, "uplift_angle": 1.0})
    rigid, _ = shake(assemble(structure.with_effects([stiff]), RIG.step_s), ground, RIG)
    assert np.abs(rigid - plain).max() < 2e-3 * np.abs(plain).max()


@pytest.mark.property
def test_every_effect_of_a_frame_can_be_drawn() -> None:
    rng = np.random.default_rng(1)
    assert {draw_frame_effect(rng).name for _ in range(100)} == set(FRAME_EFFECT_NAMES)
    with pytest.raises(UserError, match=r"known: joint-friction"):
        find_frame_form("ghosts")


@pytest.mark.planted
@pytest.mark.parametrize("effect", ["joint-friction", "cubic-stiffness", "impact", "base-rocking"])
def test_strength_of_a_frame_effect_is_scaled_to_its_share(structure: TrueStructure, effect: str) -> None:
    rig = RIG.changed(sweep_acceleration_m_s2=0.15)
    hidden = structure.with_effects([Planted(find_frame_form(effect), {}, 0.10)])
    found = calibrated_structure(hidden, rig)
    frequencies = natural_modes(structure.frame).frequencies_hz
    ground = sweep_ground(rig, 0.4 * frequencies[0], 1.2 * frequencies[2], frequencies[0])
    plain, changed = (shake(assemble(item, rig.step_s), ground, rig)[1] for item in (structure, found))
    assert np.sqrt(np.mean((changed - plain) ** 2) / np.mean(plain**2)) == pytest.approx(0.10, rel=0.05)


@pytest.mark.golden
def test_a_share_of_what_needs_a_damper_is_refused(structure: TrueStructure) -> None:
    hidden = structure.with_effects([Planted(find_frame_form("controller-delay"), {}, 0.10)])
    with pytest.raises(UserError, match=r"shows with a damper only"):
        calibrated_structure(hidden, RIG)
