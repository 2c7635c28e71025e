import numpy as np
import pytest

from mrpipe.signals.discretisation import discretise_first_order
from mrpipe.structures import floor_position, frame_from_parameter_set, frequency_response, shear_frame, state_space
from mrpipe.structures.response import band_limited_response, linear_response


@pytest.mark.property
@pytest.mark.parametrize("shaker", [0, 3])
def test_modal_steps_equal_matrix_steps(shaker):
    frame = frame_from_parameter_set("thesis")
    rng = np.random.default_rng(0)
    dt, load = 0.005, rng.standard_normal(400)
    space = state_space(frame, floor_position(5, shaker) if shaker else None)
    step, first, second = discretise_first_order(space.A, space.B[:, [1 if shaker else 0]], dt)
    start = 1e-3 * rng.standard_normal(10)
    states = [start]
    for k in range(load.size - 1):
        states.append(step @ states[-1] + first[:, 0] * load[k] + second[:, 0] * load[k + 1])
    response = linear_response(frame, load, dt, shaker_floor=shaker, initial_state=start)
    scale = np.abs(states).max()
    np.testing.assert_allclose(np.hstack([response.displacement, response.velocity]), states, atol=1e-11 * scale)


@pytest.mark.property
def test_floors_that_follow_the_ground_feel_its_acceleration():
    frame = frame_from_parameter_set("thesis")
    # far below the first mode the frame moves with the ground
    time = np.arange(200_000) * 1e-3
    ground = np.sin(0.1 * time) * np.minimum(time / 100.0, 1.0)
    response = linear_response(frame, ground, 1e-3)
    np.testing.assert_allclose(response.absolute_acceleration[-1], ground[-1], rtol=2e-3)


@pytest.mark.literature
@pytest.mark.parametrize("shaker", [0, 2])
def test_a_sine_near_a_third_of_the_sampling_rate_gives_the_response_of_the_frequency_response(shaker):
    frame = shear_frame([5.0, 6.0], [9000.0, 8000.0], 0.05)
    rate, line = 50.0, 15.0
    time = np.arange(1000) / rate
    excitation = np.sin(2 * np.pi * line * time) * np.minimum(time / 4.0, 1.0)
    found = band_limited_response(frame, excitation, 1 / rate, line, shaker_floor=shaker)
    settled = (time > 12.0) & (time < 18.0)
    basis = np.column_stack([np.sin(2 * np.pi * line * time), np.cos(2 * np.pi * line * time)])[settled]
    sine, cosine = np.linalg.lstsq(basis, found.absolute_acceleration[settled], rcond=None)[0]
    exact = frequency_response(frame, np.array([2 * np.pi * line]), shaker_floor=shaker)[0]
    np.testing.assert_allclose(sine + 1j * cosine, exact, rtol=0.005)
    # straight lines between the samples are too small by sinc^2(0.3) = 0.74
    lines = linear_response(frame, excitation, 1 / rate, shaker_floor=shaker).displacement[settled]
    assert np.abs(lines).max() < 0.8 * np.abs(found.displacement[settled]).max()
