import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import public_data_directory
from mrpipe.errors import UserError
from mrpipe.structures import (
    complex_modes,
    frame_from_modes,
    frame_from_parameter_set,
    modal_assurance,
    natural_modes,
    shear_frame,
)

OMEGA = np.array([8.0, 24.2, 38.4, 49.9, 58.3])
ZETA = np.array([0.0030, 0.0024, 0.0020, 0.0015, 0.0010])


@pytest.mark.literature
def test_thesis_frame_has_the_printed_frequencies_and_input_damping():
    frame = frame_from_parameter_set("thesis")
    omega = natural_modes(frame).angular_frequencies
    assert omega[:4] == pytest.approx(OMEGA[:4], rel=1e-3)
    assert omega[4] == pytest.approx(OMEGA[4], rel=3e-3)
    assert complex_modes(frame).damping_ratios == pytest.approx(ZETA, abs=1e-4)


@pytest.mark.literature
def test_first_element_of_stiffness_is_the_printed_inter_storey_stiffness():
    assert frame_from_parameter_set("thesis").stiffness[0, 0] == pytest.approx(9500.0, rel=7e-3)


@pytest.mark.literature
def test_elements_outside_the_band_are_small():
    stiffness = frame_from_parameter_set("thesis").stiffness
    off_band = stiffness[np.abs(np.subtract.outer(np.arange(5), np.arange(5))) > 1]
    assert np.abs(off_band).max() <= 0.02 * np.abs(np.diag(stiffness)).max()


@pytest.mark.literature
def test_limiting_frequencies_of_the_damper_at_the_first_floor():
    frame = frame_from_parameter_set("thesis")
    free = natural_modes(frame)
    from scipy.linalg import eigh

    locked = np.sqrt(eigh(frame.stiffness[1:, 1:], frame.mass[1:, 1:], eigvals_only=True)[0])
    omega = free.angular_frequencies[0]
    assert omega == pytest.approx(8.000, rel=1e-3)
    assert locked == pytest.approx(10.45, rel=6e-3)
    assert free.mode_shapes[0, 0] ** 2 / (locked**2 - omega**2) == pytest.approx(1.5404e-4, rel=2e-3)


@pytest.mark.literature
def test_printed_signs_give_a_frequency_that_no_peak_has():
    omega = natural_modes(frame_from_parameter_set("thesis-printed")).angular_frequencies
    assert omega[-1] == pytest.approx(187.0, rel=0.01)


@pytest.mark.literature
def test_dimensions_with_gravity_give_the_recomputed_frequencies():
    omega = natural_modes(frame_from_parameter_set("geometry")).angular_frequencies
    assert omega == pytest.approx([8.18, 24.3, 38.4, 49.3, 56.5], rel=2e-3)


@pytest.mark.real
@pytest.mark.golden
def test_matrices_equal_the_independent_computation():
    folder = public_data_directory()
    if folder is None or not (folder / "thesis_frame" / "frame_KU.json").is_file():
        pytest.skip("the folder thesis_frame of the public data is missing")
    reference = json.loads((folder / "thesis_frame" / "frame_KU.json").read_text())
    frame = frame_from_parameter_set("thesis")
    np.testing.assert_allclose(frame.stiffness, reference["K"], rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(frame.damping, reference["C"], rtol=1e-9, atol=1e-12)


@pytest.mark.property
@settings(max_examples=30, deadline=None)
@given(
    st.integers(2, 8).flatmap(
        lambda n: st.tuples(
            st.lists(st.floats(1.0, 20.0), min_size=n, max_size=n),
            st.lists(st.floats(1e3, 2e4), min_size=n, max_size=n),
            st.lists(st.floats(1e-3, 0.1), min_size=n, max_size=n),
        )
    )
)
def test_modes_of_a_shear_frame_give_it_back(values):
    masses, storeys, zeta = (np.array(item) for item in values)
    frame = shear_frame(masses, storeys, zeta)
    modes = natural_modes(frame)
    again = frame_from_modes(modes.mode_shapes, modes.angular_frequencies, zeta, masses)
    np.testing.assert_allclose(again.stiffness, frame.stiffness, rtol=1e-6, atol=1e-6 * frame.stiffness.max())
    np.testing.assert_allclose(again.damping, frame.damping, rtol=1e-6, atol=1e-6 * frame.damping.max())
    np.testing.assert_allclose(np.diag(modal_assurance(modes.mode_shapes, modes.mode_shapes)), 1.0)


@pytest.mark.property
def test_singular_mode_matrix_is_told_in_one_line():
    shapes = np.array([[1.0, 1.0], [2.0, 2.0]])
    with pytest.raises(UserError, match="mode matrix: is singular") as caught:
        frame_from_modes(shapes, [1.0, 2.0], [0.01, 0.01], [1.0, 1.0])
    assert "\n" not in str(caught.value)


@pytest.mark.property
def test_negative_mass_names_its_floor():
    with pytest.raises(UserError, match=r"floor 2: mass is -3 kg"):
        shear_frame([1.0, -3.0], [10.0, 10.0], 0.01)


@pytest.mark.property
def test_unknown_set_names_the_known_ones():
    with pytest.raises(UserError, match=r"no such parameter set; known sets: .*geometry, .*thesis"):
        frame_from_parameter_set("thesys")
