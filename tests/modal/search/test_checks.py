import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import load_parameter_set
from mrpipe.modal.search.checks import (
    check_mode_matrix,
    modal_coupling,
    orthogonal_shapes,
    possible_sign_changes,
    reversed_finding,
    wrong_signs,
)
from mrpipe.structures import natural_modes, shear_frame

MASS = 5.95 * np.eye(5)


def printed():
    return load_parameter_set("frames", "thesis-printed").values["mode_shapes"]


@pytest.mark.literature
def test_the_two_sign_errors_of_the_printed_matrix_are_named():
    findings = check_mode_matrix(printed(), MASS)
    assert [item.kind for item in findings] == ["not-orthogonal", "wrong-sign"]
    assert findings[1].elements == ((3, 3), (3, 4))
    assert "U33 = +0.941 and U34 = +0.119" in findings[1].message


@pytest.mark.literature
def test_the_mended_matrix_is_orthogonal():
    mended = load_parameter_set("frames", "thesis").values["mode_shapes"]
    assert check_mode_matrix(mended, MASS) == []
    assert np.abs(np.triu(modal_coupling(mended, MASS), 1)).max() < 0.03


@pytest.mark.planted
@settings(max_examples=25, deadline=None)
@given(st.integers(3, 6), st.integers(0, 10_000))
def test_a_turned_sign_is_found(floors, seed):
    rng = np.random.default_rng(seed)
    frame = shear_frame(rng.uniform(4, 8, floors), rng.uniform(4e3, 8e3, floors), 0.01)
    shapes = natural_modes(frame).mode_shapes.copy()
    floor, mode = int(rng.integers(floors)), int(rng.integers(floors))
    scaled = np.abs(shapes * np.sqrt(np.diag(frame.mass))[:, None])
    if not 0.2 < scaled[floor, mode] < 0.65:
        return  # too small to matter, or so large that turning the rest of the column is as good
    shapes[floor, mode] *= -1.0
    assert wrong_signs(shapes, frame.mass) == ((floor + 1, mode + 1),)


@pytest.mark.property
@given(st.integers(2, 8), st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_mode_r_of_a_shear_frame_changes_sign_r_minus_one_times(floors, seed):
    rng = np.random.default_rng(seed)
    frame = shear_frame(rng.uniform(3, 9, floors), rng.uniform(3e3, 9e3, floors), 0.01)
    shapes = natural_modes(frame).mode_shapes
    changes = [possible_sign_changes(shape, np.zeros(floors)) for shape in shapes.T]
    assert changes == [(count, count) for count in range(floors)]


@pytest.mark.property
def test_an_uncertain_sign_leaves_the_count_open():
    assert possible_sign_changes([1.0, 0.01, 1.0], [0.0, 0.1, 0.0]) == (0, 2)
    assert possible_sign_changes([1.0, 0.01, -1.0], [0.0, 0.1, 0.0]) == (1, 1)
    assert possible_sign_changes([1.0, 0.5, 1.0], [0.0, 0.1, 0.0]) == (0, 0)


@pytest.mark.property
def test_two_equal_shapes_are_singular():
    shapes = np.array([[1.0, 1.0, 0.2], [2.0, 2.0, 0.1], [3.0, 3.0, -1.0]])
    assert [item.kind for item in check_mode_matrix(shapes, np.eye(3))] == ["singular"]


@pytest.mark.planted
def test_a_noisy_shape_is_mended_by_those_that_are_known_well():
    rng = np.random.default_rng(3)
    frame = shear_frame(rng.uniform(4, 8, 5), rng.uniform(4e3, 8e3, 5), 0.01)
    truth = natural_modes(frame).mode_shapes
    error = np.array([1e-4, 1e-4, 1e-4, 1e-4, 0.1])
    size = np.abs(truth).max(axis=0)
    noisy = truth + rng.standard_normal((5, 5)) * error * size
    mended = orthogonal_shapes(noisy, frame.mass, error)
    assert np.abs(np.triu(modal_coupling(mended, frame.mass), 1)).max() < 1e-12
    before = np.linalg.norm(noisy[:, 4] - truth[:, 4])
    after = mended[:, 4] / np.linalg.norm(mended[:, 4]) * np.linalg.norm(truth[:, 4])
    assert np.linalg.norm(after - truth[:, 4]) < 0.02 * before


@pytest.mark.literature
def test_in_the_first_mode_of_a_chain_all_floors_move_to_one_side():
    rng = np.random.default_rng(4)
    for floors in (2, 5, 8):
        frame = shear_frame(rng.uniform(1.0, 3.0, floors), rng.uniform(100.0, 900.0, floors), 0.01)
        first = natural_modes(frame).mode_shapes[:, 0]
        assert reversed_finding(first, np.full(floors, 1e-3 * first.max())) == []
        assert reversed_finding(-first, np.full(floors, 1e-3 * first.max())) == []


@pytest.mark.planted
def test_sensors_with_the_opposite_sign_are_named():
    first = natural_modes(shear_frame(np.ones(5), np.full(5, 100.0), 0.01)).mode_shapes[:, 0]
    small = np.full(5, 1e-3)
    [line] = reversed_finding(first * [1, -1, 1, 1, 1], small)
    assert line.startswith("floor 2 moves against the others") and "sign of its sensor is" in line
    [line] = reversed_finding(first * [1, 1, -1, 1, -1], small)
    assert line.startswith("floors 3 and 5 move against the others") and "their sensors are" in line
    # a sign within the error, or at a floor without a sensor, is open
    assert reversed_finding(first * [1, -1, 1, 1, 1], [1e-3, 0.2, 1e-3, 1e-3, 1e-3]) == []
    assert reversed_finding(first * [1, 0, 1, 1, 1], [1e-3, np.inf, 1e-3, 1e-3, 1e-3]) == []
