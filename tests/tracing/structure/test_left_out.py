"""Errors of training records that are left out, and the parts in which they are left out."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.left_out import folds_of, gains_of, left_out_errors
from tests.tracing.structure.test_select import problem, selected

pytestmark = pytest.mark.planted


def test_errors_of_left_out_records_fall_with_the_planted_effect() -> None:
    found, given = selected("cubic-stiffness", "joint-friction", "cubic-stiffness"), problem("cubic-stiffness")
    design = design_of(found.base, given.training[:1])
    out = given.training[1:]
    without = np.concatenate(left_out_errors(design, (), out, found.about))
    with_effect = np.concatenate(left_out_errors(design, found.chosen, out, found.about))
    assert without.shape == with_effect.shape
    assert with_effect.sum() < 0.7 * without.sum()


@pytest.mark.property
def test_the_record_with_the_largest_drift_is_never_left_out() -> None:
    found, given = selected("cubic-stiffness", "joint-friction", "cubic-stiffness"), problem("cubic-stiffness")
    folds = folds_of(found.base, given.training, found.about)
    assert folds is not None
    left = {item.record.name for part in folds.records for item in part}
    drifts = {item.record.name: float(np.std(item.motion.drift, axis=1).max()) for item in given.training}
    largest = max(drifts, key=lambda name: drifts[name])
    assert left == set(drifts) - {largest}


@pytest.mark.property
def test_one_record_cannot_be_left_out() -> None:
    found, given = selected("clean", "joint-friction", "cubic-stiffness"), problem("clean")
    assert folds_of(found.base, given.training[:1], found.about) is None
    assert gains_of(None, (), 0, np.random.default_rng(1), 10) == ()
