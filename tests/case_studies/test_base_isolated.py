"""The base-isolated building: matrices, calibration, indices by hand, energy, superposition, laws."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from mrpipe.artifacts import FloatArray, public_data_directory
from mrpipe.case_studies.base_isolated.design import isolation_outputs
from mrpipe.case_studies.base_isolated.structure import (
    IsolatedBuilding,
    bearing_grid,
    location_matrix,
    published_building,
    surrogate_building,
)
from mrpipe.case_studies.base_isolated.study import (
    IsolationStudy,
    capacity_sensitivity,
    isolation_study,
    run_cases,
)
from mrpipe.case_studies.gains import damped_modes
from mrpipe.case_studies.indices import IsolatedResponse, base_isolated_indices
from mrpipe.case_studies.inverse import train_inverse, validated_inverse
from mrpipe.case_studies.laws import LAWS
from mrpipe.case_studies.lqg import (
    output_observer_gain,
    output_regulator_gain,
    sampled_loop_radius,
)
from mrpipe.case_studies.model import modal_model, natural_periods
from mrpipe.case_studies.motion import load_motion, spectrum_compatible_motion
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice, Controller, Response
from mrpipe.errors import UserError
from mrpipe.structures.records import GroundMotion


def study_of(building: IsolatedBuilding) -> IsolationStudy:
    return isolation_study(
        building, device=BinghamDevice(), network=None, damping_ratio=0.1, stiffness_share=0.2, lqg=LqgWeights()
    )


@pytest.fixture(scope="module")
def study() -> IsolationStudy:
    return study_of(surrogate_building())


@pytest.fixture(scope="module")
def motion() -> GroundMotion:
    return spectrum_compatible_motion(np.random.default_rng(8), duration_s=20.0)


@pytest.fixture(scope="module")
def free(study: IsolationStudy, motion: GroundMotion) -> Response:
    return study.run(motion)


def public_model() -> Path:
    folder = public_data_directory()
    if folder is None:
        pytest.skip("the public data are not there (MRPIPE_DATA)")
    return folder / "asce_base_isolated" / "STRUC.mat"


@pytest.mark.real
@pytest.mark.literature
def test_published_building() -> None:
    building = published_building(public_model())
    assert building.model.origin == "published"
    np.testing.assert_allclose(building.fixed_base_periods_s[:3], [0.897, 0.780, 0.658], rtol=2e-3)
    assert building.isolation_period_s == pytest.approx(3.11, rel=2e-3)
    assert building.isolation_damping_ratio == pytest.approx(0.030, abs=0.001)
    assert building.model.total_mass_kg == pytest.approx(20705e3, rel=1e-4)
    assert building.bearings_m.shape == (92, 2)
    # the published 3.11 s is the rigid building's: an independent eigenvalue problem of three degrees of freedom has it
    # as its second mode, because equal bearings leave the translation towards their centre free of rotation
    squared = np.linalg.eigvals(np.linalg.solve(building.model.mass[-3:, -3:], building.isolation_stiffness)).real
    rigid = np.sort(2.0 * np.pi / np.sqrt(squared))[::-1]
    np.testing.assert_allclose(building.rigid_isolation_periods_s, rigid, rtol=1e-9)
    assert rigid[1] == pytest.approx(3.11, rel=2e-3)
    np.testing.assert_allclose(building.bearings_m.mean(axis=0), [5.217, -3.457], atol=1e-3)
    # Rayleigh: the flexible building is slower in each mode; Dunkerley: not slower than both flexibilities together
    flexible = natural_periods(building.model)[:3]
    assert np.all(flexible > rigid)
    assert flexible[0] < np.hypot(rigid[0], building.fixed_base_periods_s[0])


@pytest.mark.real
@pytest.mark.oracle
def test_published_building_has_the_poles_of_the_authors_state_matrix() -> None:
    """Base and superstructure as two bodies that pull at each other, written out anew from the file."""
    struc = loadmat(public_model())["STRUC"][0, 0]
    M, K, C, m, R, H = (np.asarray(struc[key], dtype=np.float64) for key in ("M", "K", "C", "m", "R", "H"))
    k, c = 919.422 * H, 27.717 * H
    # base b, floors s on it: M (s'' + R b'') = -K s - C s',  m b'' = R'(K s + C s') - k b - c b'
    on_base = np.linalg.solve(m, np.hstack([R.T @ K, R.T @ C, -k, -c]))
    on_floors = np.linalg.solve(M, np.hstack([-K, -C, np.zeros((24, 6))])) - R @ on_base
    A = np.zeros((54, 54))
    A[:24, 24:48], A[48:51, 51:] = np.eye(24), np.eye(3)
    A[24:48], A[51:] = on_floors, on_base
    expected = np.linalg.eigvals(A)
    modal = modal_model(published_building(public_model()).model)
    ours = np.linalg.eigvals(modal.state_matrix())
    order = [np.sort_complex(poles[poles.imag > 0.0])[::-1][:6] for poles in (ours, expected)]
    np.testing.assert_allclose(order[0], order[1], rtol=1e-6)
    np.testing.assert_allclose(
        np.sort(np.abs(ours))[[0, 2, 4]], 2.0 * np.pi / np.array([3.381, 3.184, 2.672]), rtol=1e-3
    )


@pytest.mark.real
def test_published_building_under_el_centro_keeps_its_energy_and_j9() -> None:
    study = study_of(published_building(public_model()))
    motion = load_motion("elcentro", np.random.default_rng(0))
    free, cases = run_cases(study, motion, ("vd", "fdns", "lqg"))
    assert free.energy_balance_error < 5e-3
    for case in cases:
        assert case.response.energy_balance_error < 5e-3
        assert 0.0 < case.indices["J9"] <= 1.0
        assert case.indices["J6"] < 0.15, "two dampers are small against this building (errata row 20)"


@pytest.mark.planted
def test_files_that_are_no_model(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such model"):
        published_building(tmp_path / "nothing.mat")
    wrong = tmp_path / "wrong.mat"
    wrong.write_text("no MATLAB file")
    with pytest.raises(UserError, match="not what its ending says"):
        published_building(wrong)
    savemat(wrong, {"STRUC": {"M": np.eye(24), "K": np.eye(24)}})
    with pytest.raises(UserError, match=r"STRUC\.C: is not in the file"):
        published_building(wrong)
    savemat(wrong, {"STRUC": {key: np.eye(6) for key in "MKC"} | {key: np.eye(3) for key in "mH"}})
    with pytest.raises(UserError, match=r"STRUC\.M: has shape \(6, 6\)"):
        published_building(wrong)


@pytest.mark.literature
def test_surrogate_has_the_published_facts(study: IsolationStudy) -> None:
    building = study.building
    assert building.model.origin == "surrogate"
    np.testing.assert_allclose(np.sort(building.fixed_base_periods_s[:3])[::-1], [0.89, 0.78, 0.66], rtol=1e-9)
    assert building.isolation_period_s == pytest.approx(3.0, rel=1e-9)
    assert building.isolation_damping_ratio == pytest.approx(0.03, rel=1e-9)
    assert building.model.total_mass_kg == pytest.approx(20705e3, rel=1e-4)
    assert len(building.bearings_m) == 92
    assert len(np.unique(building.bearings_m, axis=0)) == 92


@pytest.mark.property
def test_location_matrix_of_bearings() -> None:
    positions = bearing_grid(np.array([-1.0, 1.0, 3.0]), np.array([-2.0, 0.0, 2.0]))
    total = np.zeros((3, 3))
    for x, y in positions:
        r = np.array([[1.0, 0.0], [0.0, 1.0], [-y, x]])
        total += r @ r.T
    np.testing.assert_allclose(location_matrix(positions), total, atol=1e-9)


@pytest.mark.literature
def test_calibration_gives_the_isolation_modes_their_damping(study: IsolationStudy) -> None:
    gains = study.gains
    omega = 2.0 * np.pi / study.building.isolation_period_s
    for c, k in (
        (gains.viscous, 0.0),
        (gains.negative_viscous, gains.negative_stiffness),
        (4.0 * gains.friction / (np.pi * omega), -gains.friction),
    ):
        _, ratios = damped_modes(study.modal, np.full(2, c), np.full(2, k))
        assert ratios[:2].min() == pytest.approx(0.1, rel=1e-6)


def complex_superposition(study: IsolationStudy, motion: GroundMotion) -> FloatArray:
    """The building alone as a sum of complex modes, each a scalar recursion in closed form; shape (n, 27)."""
    A = study.modal.state_matrix()
    B = study.modal.input_matrix(study.modal.load)
    poles, vectors = np.linalg.eig(A)
    inputs = np.linalg.solve(vectors, B.astype(complex)) @ motion.acceleration_m_s2.T
    h = motion.interval_s
    # z' = s z + g0 + (g1 - g0) t/h over each sample
    growth = np.exp(poles * h)
    first = (growth * (poles * h - 1.0) + 1.0) / (poles**2 * h)
    second = (growth - 1.0 - poles * h) / (poles**2 * h)
    state = np.zeros((len(motion.acceleration_m_s2), len(poles)), dtype=complex)
    for k in range(len(state) - 1):
        state[k + 1] = growth * state[k] + first * inputs[:, k] + second * inputs[:, k + 1]
    n = study.modal.modes
    return np.asarray((state @ vectors[:n].T).real @ study.modal.shapes.T)


@pytest.mark.oracle
def test_uncontrolled_run_is_modal_superposition(study: IsolationStudy, motion: GroundMotion, free: Response) -> None:
    expected = complex_superposition(study, motion)
    ours = free.displacement()[:: round(motion.interval_s / 0.001)]
    assert np.abs(ours - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.property
@pytest.mark.parametrize("law", LAWS)
def test_energy_j9_and_step_halving(study: IsolationStudy, motion: GroundMotion, free: Response, law: str) -> None:
    controller = study.controller(law)
    response = study.run(motion, controller)
    indices = study.indices(response, free)
    assert response.energy_balance_error < 5e-3
    assert 0.0 <= indices["J9"] <= 1.0
    finer = study.indices(study.run(motion, controller, refine=2), study.run(motion, refine=2))
    for name, value in indices.items():
        assert finer[name] == pytest.approx(value, rel=5e-3), name


@pytest.mark.property
def test_voltages_and_clipping(study: IsolationStudy, motion: GroundMotion) -> None:
    response = study.run(motion, study.controller("vdns"))
    assert response.voltages.min() >= 0.0
    assert response.voltages.max() <= 10.0
    work = np.sum(response.forces[1:] * np.diff(response.stroke(), axis=0), axis=1)
    assert -work[work < 0.0].sum() < 1e-3 * work.sum()


@pytest.mark.property
def test_active_lqg_agrees_with_the_continuous_loop(study: IsolationStudy, motion: GroundMotion) -> None:
    """Full-state feedback inside the structure's matrix bounds what the sampled observer loop may do."""
    response = study.run(motion, study.controller("lqg"))
    free = study.run(motion)
    assert np.abs(response.stroke()).max() < np.abs(free.stroke()).max()
    assert np.all(np.isfinite(response.forces))


@pytest.mark.planted
def test_more_dampers_matter_more(study: IsolationStudy, motion: GroundMotion) -> None:
    sweep = capacity_sensitivity(study, motion, "vd", (1.0, 3.0, 9.0))
    assert sweep[1.0]["J3"] > sweep[3.0]["J3"] > sweep[9.0]["J3"]
    assert sweep[1.0]["J6"] < sweep[9.0]["J6"]


@pytest.mark.planted
def test_unknown_law_is_told(study: IsolationStudy) -> None:
    with pytest.raises(UserError, match="not a law of the base-isolated building"):
        study.controller("vdps2")


@pytest.mark.literature
def test_indices_by_hand() -> None:
    time = np.array([0.0, 1.0, 2.0])
    ones = np.ones((3, 2))
    free = IsolatedResponse(
        time_s=time,
        base_shear_n=np.array([[3.0, 4.0], [0.0, 0.0], [0.0, 1.0]]),
        storey_shear_n=2.0 * ones,
        base_displacement_m=np.array([[[0.0, 2.0]], [[0.0, 0.0]], [[0.0, 0.0]]]),
        drift=np.array([[[0.1, 0.0]], [[0.0, 0.2]], [[0.0, 0.0]]]),
        floor_acceleration_m_s2=np.array([[[6.0, 8.0]], [[0.0, 0.0]], [[0.0, 0.0]]]),
        device_force_n=np.zeros((3, 2)),
        device_velocity_m_s=np.zeros((3, 2)),
        device_work_j=0.0,
        ground_velocity_m_s=ones,
    )
    controlled = replace(
        free,
        base_shear_n=np.array([[-2.0, 0.0], [-2.0, 0.0], [-2.0, 0.0]]),
        storey_shear_n=ones,
        base_displacement_m=0.5 * free.base_displacement_m,
        drift=0.25 * free.drift,
        floor_acceleration_m_s2=0.3 * free.floor_acceleration_m_s2,
        device_force_n=np.array([[0.6, 0.8], [0.0, 0.0], [0.0, 0.0]]),
        device_work_j=3.0,
    )
    indices = base_isolated_indices(controlled, free)
    expected = {"J1": 0.4, "J2": 0.5, "J3": 0.5, "J4": 0.25, "J5": 0.3, "J6": 0.5, "J7": 0.5, "J8": 0.3, "J9": 0.75}
    assert indices == pytest.approx(expected)


@pytest.mark.planted
def test_neural_inverse_of_the_bingham_damper(study: IsolationStudy, motion: GroundMotion, free: Response) -> None:
    inverse = validated_inverse(BinghamDevice(), train_inverse(BinghamDevice(), np.random.default_rng(4)))
    assert inverse.held_out_nrmse < 0.02 and inverse.nrmse < 0.02
    assert inverse.voltage_v.max() == pytest.approx(5.0, rel=1e-3) and inverse.time_s[-1] == pytest.approx(0.999)
    formula = study.indices(study.run(motion, study.controller("vd")), free)
    neural = replace(study, network=inverse.network)
    by_network = neural.indices(neural.run(motion, neural.controller("vd")), free)
    for name, value in formula.items():
        assert by_network[name] == pytest.approx(value, rel=0.02), name


@pytest.mark.oracle
def test_ideal_actuator_is_a_linear_dashpot(study: IsolationStudy, motion: GroundMotion) -> None:
    c = 5e6
    modal = study.modal
    inside = replace(modal, damping=modal.damping + c * modal.devices @ modal.devices.T)
    expected = replace(study, modal=inside).run(motion).displacement()
    ours = study.run(motion, Controller("kelvin", "active", viscous=c)).displacement()
    assert np.abs(ours - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.oracle
def test_lqg_of_the_building_agrees_with_python_control(study: IsolationStudy) -> None:
    """Appendix E on the 54 states of this building, output weighting with feedthrough, to 1e-9."""
    import control

    modal, weights = study.modal, LqgWeights()
    A, B = modal.state_matrix(), modal.input_matrix(modal.devices)
    regulated, measured = isolation_outputs(study.building, modal)
    Q = np.diag([weights.displacement] * 2 + [weights.acceleration] * 4)
    R = np.eye(2) / weights.force_n**2
    ours = output_regulator_gain(A, B, regulated, Q, R)
    state, cost = regulated.C.T @ Q @ regulated.C, regulated.D.T @ Q @ regulated.D + R
    cross = regulated.C.T @ Q @ regulated.D
    theirs, _, _ = control.lqr(A, B, 0.5 * (state + state.T), 0.5 * (cost + cost.T), cross)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())
    np.testing.assert_allclose(study.observer.feedback, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())
    E, Sw, Sv = modal.input_matrix(modal.load), 0.1 * np.eye(2), 1e-6 * np.eye(8)
    disturbance = E @ Sw @ E.T
    filtered, _, _ = control.lqe(A, np.eye(54), measured.C, 0.5 * (disturbance + disturbance.T), Sv)
    gain = output_observer_gain(A, E, measured, Sw, Sv)
    np.testing.assert_allclose(gain, filtered, rtol=1e-9, atol=1e-9 * np.abs(filtered).max())
    assert sampled_loop_radius(A, B, study.observer) < 1.0
