"""The tower in wind: kernel, gains, positions, indices by hand, LQG."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.case_studies.indices import WIND_FLOORS, WindResponse, wind_indices
from mrpipe.case_studies.laws import LAWS
from mrpipe.case_studies.lqg import output_observer_gain
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice, Controller, simulate
from mrpipe.case_studies.wind.design import CORRELATION_S, SENSOR_DENSITY, wind_outputs
from mrpipe.case_studies.wind.load import WindLoad, synthetic_wind
from mrpipe.case_studies.wind.structure import HEIGHT_M, WIDTH_M, Tower, place_device, surrogate_tower
from mrpipe.case_studies.wind.study import WindStudy, wind_response, wind_sensitivity, wind_study
from mrpipe.errors import UserError
from mrpipe.signals.discretisation import discretise_first_order


@pytest.fixture(scope="module")
def tower() -> Tower:
    return surrogate_tower()


@pytest.fixture(scope="module")
def load() -> WindLoad:
    return synthetic_wind(np.random.default_rng(4), 76, HEIGHT_M, WIDTH_M, duration_s=60.0)


def study_at(tower: Tower, load: WindLoad, position: str, dampers: float) -> WindStudy:
    placed = place_device(tower, position, floor=40, arm_m=21.0, mass_kg=500e3, frequency_ratio=0.99)  # type: ignore[arg-type]
    return wind_study(
        tower, placed, load, device=BinghamDevice(), network=None, stiffness_share=0.5, tuned_mass_kg=500e3,
        lqg=LqgWeights(displacement=1000.0, acceleration=10.0, force_n=1e6, interval_s=0.001), dampers=dampers,
    )  # fmt: skip


@pytest.fixture(scope="module")
def ground(tower: Tower, load: WindLoad) -> WindStudy:
    return study_at(tower, load, "ground", 1.0)


@pytest.fixture(scope="module")
def outrigger(tower: Tower, load: WindLoad) -> WindStudy:
    return study_at(tower, load, "outrigger", 8.0)


@pytest.mark.oracle
def test_uncontrolled_run_is_modal_superposition(ground: WindStudy) -> None:
    modal, load = ground.reference, ground.load
    forces = load.forces_n @ modal.load.T
    alone = np.empty_like(forces)
    for mode, omega in enumerate(modal.angular_frequencies):
        A = np.array([[0.0, 1.0], [-(omega**2), -modal.damping[mode, mode]]])
        step, now, after = discretise_first_order(A, np.array([[0.0], [1.0]]), load.interval_s)
        state = np.zeros(2)
        alone[0, mode] = 0.0
        for k in range(len(forces) - 1):
            state = step @ state + now[:, 0] * forces[k, mode] + after[:, 0] * forces[k + 1, mode]
            alone[k + 1, mode] = state[0]
    expected = alone @ modal.shapes.T
    ours = ground.uncontrolled.displacement()[:: round(load.interval_s / 0.01)]
    assert np.abs(ours - expected).max() < 1e-6 * np.abs(expected).max()
    assert ground.uncontrolled.energy_balance_error < 5e-3


@pytest.mark.literature
def test_a_damper_at_the_ground_sees_next_to_nothing(ground: WindStudy) -> None:
    """Errata row 20: some 3e-4 of the top motion, and no index but those of the damper moves."""
    response = ground.run(ground.controller("vd"))
    indices = ground.indices(response)
    top = ground.uncontrolled.displacement()[:, 75]
    stroke = ground.uncontrolled.displacement()[:, 0]
    assert 1e-4 < np.std(stroke) / np.std(top) < 1e-3
    assert indices["J5"] < 1e-3
    for name in ("J1", "J2", "J3", "J4", "J7", "J8", "J9", "J10"):
        assert indices[name] == pytest.approx(1.0, abs=0.01), name


@pytest.mark.property
@pytest.mark.parametrize("law", LAWS)
def test_energy_and_step_halving_at_the_ground(ground: WindStudy, law: str) -> None:
    controller = ground.controller(law)
    response = ground.run(controller)
    assert response.energy_balance_error < 5e-3
    finer = ground.indices(ground.run(controller, refine=2))
    for name, value in ground.indices(response).items():
        assert finer[name] == pytest.approx(value, rel=5e-3, abs=1e-6), name


@pytest.mark.property
@pytest.mark.parametrize("law", ["vd", "vdns", "passive-on"])
def test_energy_on_the_outrigger(outrigger: WindStudy, law: str) -> None:
    response = outrigger.run(outrigger.controller(law))
    assert response.energy_balance_error < 5e-3
    assert outrigger.indices(response)["J3"] < 0.95, "here dampers matter"


@pytest.mark.property
@pytest.mark.parametrize("law", ["vdns", "fdns", "lqg-clipped"])
def test_step_halving_on_the_outrigger(outrigger: WindStudy, law: str) -> None:
    """Here the damper holds its rod at each reversal, and the sign of what is left of its velocity is rounding."""
    controller = outrigger.controller(law)
    coarse, finer = (outrigger.indices(outrigger.run(controller, refine=refine)) for refine in (1, 2))
    for name, value in coarse.items():
        assert finer[name] == pytest.approx(value, rel=5e-3), name


@pytest.mark.planted
def test_more_dampers_on_the_outrigger_matter_more(outrigger: WindStudy) -> None:
    sweep = wind_sensitivity(outrigger, "passive-on", (2.0, 4.0, 8.0))
    assert sweep[2.0]["J3"] > sweep[4.0]["J3"] > sweep[8.0]["J3"]


@pytest.mark.property
def test_gains_stay_within_the_dampers(outrigger: WindStudy) -> None:
    gains, best = outrigger.gains, outrigger.optimum
    assert 0.0 < gains.capacity_share < 1.0
    assert gains.viscous == pytest.approx(best.viscous * gains.capacity_share)
    response = outrigger.run(outrigger.controller("vd"))
    assert np.abs(response.desired).max() < 1.2 * 8.0 * 1e6


@pytest.mark.planted
def test_tuned_mass_with_its_damper_works(tower: Tower, load: WindLoad) -> None:
    study = study_at(tower, load, "tuned-mass", 0.1)
    assert study.modal.modes == 24
    assert not study.modal.classical
    ideal = Controller("kelvin", "active", viscous=study.optimum.viscous)
    response = study.run(ideal)
    assert response.energy_balance_error < 5e-3
    indices = study.indices(response)
    assert indices["J2"] < 1.0
    assert indices["J5"] > 0.5, "the stroke of a tuned mass is of the order of the top motion"
    assert study.optimum.damping_ratio > 0.03


@pytest.mark.oracle
def test_lqg_loop_in_the_kernel_is_the_joint_linear_system(outrigger: WindStudy) -> None:
    """The kernel's observer and plant against the same recursion written out with matrices."""
    from mrpipe.signals.discretisation import discretise_first_order, discretise_zero_order

    modal, observer = outrigger.modal, outrigger.observer
    loads = outrigger.load.forces_n[:41]
    interval, ratio = outrigger.load.interval_s, 50
    ours = simulate(modal, loads, interval, outrigger.controller("lqg"), ratio=ratio)
    dt = interval / ratio
    A = modal.state_matrix()
    step, now, after = discretise_first_order(A, modal.input_matrix(modal.load), dt)
    pulse = discretise_zero_order(A, modal.input_matrix(modal.devices), dt)[1]
    n = A.shape[0]
    z, estimate, force = np.zeros(n), np.zeros(n), np.zeros(1)
    fine = np.stack([np.interp(np.arange(2001) * dt, np.arange(41) * interval, row) for row in loads.T], axis=1)
    for k in range(2000):
        y = observer.measure @ z - observer.measure_force @ force
        wanted = observer.feedback @ estimate
        estimate = observer.step @ estimate - observer.step_force @ force + observer.gain @ y
        force = wanted
        z = step @ z + now @ fine[k] + after @ fine[k + 1] - pulse @ force
    assert ours.forces[-1, 0] == pytest.approx(force[0], rel=1e-6)
    np.testing.assert_allclose(ours.positions[-1], z[: modal.modes], rtol=1e-6, atol=1e-9 * np.abs(z).max())


@pytest.mark.oracle
def test_lqg_of_the_tower_agrees_with_python_control(outrigger: WindStudy) -> None:
    """Appendix E on the 46 states, outputs with feedthrough and noises that correlate, to 1e-9."""
    import control

    modal, load = outrigger.modal, outrigger.load
    A, B, E = modal.state_matrix(), modal.input_matrix(modal.devices), modal.input_matrix(modal.load)
    regulated, measured = wind_outputs(modal)
    Q = np.diag([1000.0] * 9 + [0.0] * 9 + [10.0] * 9)
    R = np.eye(1) / outrigger.lqg_force_n**2
    state, cost = regulated.C.T @ Q @ regulated.C, regulated.D.T @ Q @ regulated.D + R
    cross = regulated.C.T @ Q @ regulated.D
    feedback, _, _ = control.lqr(A, B, 0.5 * (state + state.T), 0.5 * (cost + cost.T), cross)
    np.testing.assert_allclose(outrigger.observer.feedback, feedback, rtol=1e-9, atol=1e-9 * np.abs(feedback).max())
    # the noises of plant and sensors correlate through the wind: the same filter of the plant without that part
    wind, noise = np.cov(load.forces_n.T) * CORRELATION_S, SENSOR_DENSITY * np.eye(18)
    both = noise + measured.F @ wind @ measured.F.T
    shift = E @ wind @ measured.F.T @ np.linalg.inv(both)
    rest = E @ wind @ E.T - shift @ both @ shift.T
    gain, _, _ = control.lqe(A - shift @ measured.C, np.eye(46), measured.C, 0.5 * (rest + rest.T), both)
    ours = output_observer_gain(A, E, measured, wind, noise)
    np.testing.assert_allclose(ours, gain + shift, rtol=1e-9, atol=1e-9 * np.abs(ours).max())


@pytest.mark.planted
def test_unknown_law_is_told(ground: WindStudy) -> None:
    with pytest.raises(UserError, match="not a law of the tower"):
        ground.controller("vdsn")


@pytest.mark.literature
def test_indices_by_hand() -> None:
    n = len(WIND_FLOORS)
    wave = np.array([1.0, -1.0, 1.0, -1.0])
    free = WindResponse(np.outer(wave, np.full(n, 2.0)), np.outer(wave, np.full(n, 4.0)), wave, wave, 0.0 * wave)
    scale = np.linspace(0.1, 0.9, n)
    controlled = WindResponse(
        displacement_m=np.outer(wave, 2.0 * scale),
        acceleration_m_s2=np.outer(wave, 4.0 * scale),
        stroke_m=0.5 * wave,
        device_velocity_m_s=np.array([1.0, 1.0, -1.0, -1.0]),
        device_force_n=np.array([3e3, 5e3, -3e3, -5e3]),
    )
    indices = wind_indices(controlled, free)
    upper, high = scale[2:8], scale[2:9]
    expected = {
        "J1": 0.8, "J2": upper.mean(), "J3": 0.9, "J4": high.mean(), "J5": 0.25, "J6": np.sqrt(17.0),
        "J7": 0.8, "J8": upper.mean(), "J9": 0.9, "J10": high.mean(), "J11": 0.25, "J12": 5.0,
    }  # fmt: skip
    assert indices == pytest.approx(expected)


@pytest.mark.property
def test_response_rows_are_the_floors(ground: WindStudy) -> None:
    response = ground.uncontrolled
    histories = wind_response(response)
    np.testing.assert_allclose(histories.displacement_m, response.displacement()[:, np.array(WIND_FLOORS) - 1])
    assert replace(histories, stroke_m=histories.stroke_m).stroke_m.shape == response.time_s.shape
