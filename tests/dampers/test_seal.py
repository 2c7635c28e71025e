"""Friction of the seals."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.library import base_form
from mrpipe.dampers.plant import FORCE, build_chain, run_chain
from mrpipe.dampers.seal import seal_friction
from tests.dampers.test_forms import DRIVE, motion

FRICTION, STICKS = 40.0, 2e-4
DT = 1e-3


@pytest.mark.property
def test_the_friction_opposes_the_motion_and_reverses_within_twice_the_sticking_displacement() -> None:
    _, x, v = motion(DT)
    chain = build_chain([seal_friction({"seal_friction": FRICTION, "seal_displacement": STICKS})])
    force = run_chain(chain, x, v, np.zeros_like(x), np.full_like(x, DRIVE), DT)[:, FORCE]
    assert np.max(np.abs(force)) == pytest.approx(FRICTION)
    reversals = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    last = np.concatenate([[0], reversals])[np.searchsorted(reversals, np.arange(len(x)))]
    slipped = np.abs(x - x[last]) > 2.0 * STICKS
    assert slipped.any()
    np.testing.assert_allclose(force[slipped], FRICTION * np.sign(x - x[last])[slipped])


@pytest.mark.property
@pytest.mark.parametrize("form", ["eyring-spring", "herschel-bulkley-spring"])
def test_a_damper_that_was_written_before_the_friction_was_added_has_none(form: str) -> None:
    values = {"spring_stiffness": 1e6, "velocity_scale": 0.01, "velocity_exponent": 0.8, "reference_velocity": 0.3}
    step = base_form(form).steps(values)[base_form(form).amplitude_steps["seal_friction"]]
    assert step.name == "seal-friction"
    assert step.parameters[0] == 0.0
