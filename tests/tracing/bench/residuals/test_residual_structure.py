"""Structure of a residual: whether there is any, on which state it depends, and where it lies."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.tracing.bench.residuals.residual_structure import dependence, location, states_of, structure_p_value
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def test_a_spring_that_the_model_lacks_depends_on_the_displacement() -> None:
    found = plain_fit("accumulator")
    states = states_of(found, found.problem.recordings)
    assert structure_p_value(found.residual, states) < 1e-6
    state, share = dependence(found.residual, states)[0]
    assert state == "displacement"
    assert share > 0.5


def test_noise_has_no_structure() -> None:
    found = plain_fit("accumulator")
    states = states_of(found, found.problem.recordings)
    noise = np.random.default_rng(2).standard_normal(len(found.residual)) * (found.residual != 0.0)
    assert structure_p_value(noise, states) > 0.01
    assert dependence(noise, states)[0][1] < 0.05


def test_shares_of_a_residual_add_up_to_one() -> None:
    found = plain_fit("accumulator")
    recordings = found.problem.recordings
    places = location(found.residual, found, recordings, states_of(found, recordings))
    assert set(places) == {"cycle", "drive", "direction", "time"}
    for name, shares in places.items():
        assert sum(shares.values()) == pytest.approx(1.0, abs=1e-6), name
