import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.artifacts import load_parameter_set
from mrpipe.modal.matrices.tridiagonal import fit_tridiagonal
from mrpipe.structures import natural_modes, shear_frame


@pytest.mark.property
@settings(max_examples=20, deadline=None)
@given(st.integers(2, 8), st.integers(0, 10_000))
def test_storeys_of_exact_modes_come_back(floors, seed):
    rng = np.random.default_rng(seed)
    storeys = rng.uniform(3e3, 9e3, floors)
    frame = shear_frame(rng.uniform(4, 8, floors), storeys, 0.01)
    modes = natural_modes(frame)
    fit = fit_tridiagonal(frame.mass, modes.mode_shapes * rng.uniform(-3, 3, floors), modes.angular_frequencies)
    assert fit.storey_stiffnesses == pytest.approx(storeys, rel=1e-5)


@pytest.mark.property
def test_a_bound_is_kept_and_told():
    frame = shear_frame([6.0, 6.0, 6.0], [5e3, 5e3, 5e3], 0.01)
    modes = natural_modes(frame)
    fit = fit_tridiagonal(frame.mass, modes.mode_shapes, modes.angular_frequencies, bounds=(100.0, 4e3))
    assert fit.storey_stiffnesses.max() <= 4e3 * (1 + 1e-9)
    assert fit.at_bound


@pytest.mark.real
@pytest.mark.golden
def test_thesis_storeys_are_near_the_independent_fit(public_data):
    reference = json.loads((public_data / "thesis_frame" / "frame_tri.json").read_text())
    values = load_parameter_set("frames", "thesis").values
    fit = fit_tridiagonal(5.95 * np.eye(5), values["mode_shapes"], values["angular_frequencies"])
    assert fit.storey_stiffnesses == pytest.approx(reference["k_storey"], rel=0.01)
