import numpy as np
import pytest

from mrpipe.structures import (
    Frame,
    complex_modes,
    floor_position,
    frame_from_parameter_set,
    frequency_response,
    shear_frame,
    state_space,
    storey_position,
)


def one_floor(zeta=0.05):
    return shear_frame([2.0], [200.0], zeta)


@pytest.mark.property
def test_frequency_response_is_that_of_the_state_space():
    frame = frame_from_parameter_set("thesis")
    space = state_space(frame, floor_position(5, 3))
    C, D = space.absolute_acceleration()
    omega = np.array([3.0, 8.0, 30.0, 100.0])
    for column, shaker in ((0, 0), (1, 3)):
        direct = np.array([C @ np.linalg.solve(1j * w * np.eye(10) - space.A, space.B) + D for w in omega])[
            :, :, column
        ]
        np.testing.assert_allclose(direct, frequency_response(frame, omega, shaker_floor=shaker), rtol=1e-8)


@pytest.mark.literature
def test_exact_damping_of_the_viscous_law_on_the_first_floor():
    thesis = frame_from_parameter_set("thesis")
    # the figures leave the frame's own damping (0.003) out
    frame = Frame(thesis.mass, np.zeros((5, 5)), thesis.stiffness)
    assert complex_modes(frame, damping=650.0).damping_ratios[0] == pytest.approx(0.154, abs=5e-4)
    assert complex_modes(frame, damping=538.0).damping_ratios[0] == pytest.approx(0.160, abs=5e-4)


@pytest.mark.property
def test_device_across_a_storey_adds_to_that_storey():
    frame = shear_frame([1.0, 1.0, 1.0], [100.0, 100.0, 100.0], 0.01)
    stiffer = shear_frame([1.0, 1.0, 1.0], [100.0, 150.0, 100.0], 0.01)
    w = storey_position(3, 2)
    np.testing.assert_allclose(frame.stiffness + 50.0 * np.outer(w, w), stiffer.stiffness)
