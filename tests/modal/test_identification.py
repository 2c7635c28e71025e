"""Errors of mode shapes in the rows of the structure."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.identification import errors_of_rows


@pytest.mark.property
def test_errors_follow_the_scale_of_the_shapes_and_leave_out_rows_without_a_sensor() -> None:
    shapes = np.array([[0.5, 1.0], [1.0, -0.4]])
    measured = np.array([[-3.0, 20.0], [0.0, -8.0]])
    errors = np.array([[0.06, 0.4], [np.inf, 0.2]])
    found = errors_of_rows(shapes, measured, errors)
    np.testing.assert_allclose(found[:, 1], [0.02, 0.01])
    np.testing.assert_allclose(found[0, 0], 0.01)
    assert np.isnan(found[1, 0])
