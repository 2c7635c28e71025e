"""Residue matrices of several inputs are split into shapes and participations."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.fit.rank_one import rank_one

pytestmark = pytest.mark.property


def test_exact_products_are_recovered_and_missing_values_do_not_matter() -> None:
    rng = np.random.default_rng(3)
    shapes = rng.normal(size=(5, 2)) + 1j * rng.normal(size=(5, 2))
    shares = np.array([[1.0, 0.3], [0.4, 1.0]], dtype=np.complex128)
    residues = np.einsum("nr,kr->nkr", shapes, shares)
    residues[2, 1, 0] = np.nan
    found, errors, participations = rank_one(residues, np.full(residues.shape, 0.01))
    np.testing.assert_allclose(found, shapes, atol=1e-9)
    np.testing.assert_allclose(participations, shares, atol=1e-9)
    assert np.all(errors <= 0.01 + 1e-12) and errors[2, 0] > errors[0, 0]


def test_one_input_is_its_own_shape() -> None:
    residues = np.ones((3, 1, 2), dtype=np.complex128)
    shapes, errors, participations = rank_one(residues, np.full((3, 1, 2), 0.1))
    assert shapes.shape == errors.shape == (3, 2) and np.all(participations == 1.0)
