"""Effects are ranked by what they take off the residual that the model itself cannot absorb."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.selection.screen import screen, tangent_of
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def test_the_planted_effect_is_ranked_first() -> None:
    effects = [damper_effects()[name] for name in ("accumulator", "stribeck", "inertia", "quadratic-drag")]
    ranked = screen(plain_fit("accumulator"), [Term(effect, form) for effect in effects for form in effect.forms])
    assert ranked[0].term.effect.name == "accumulator"
    assert ranked[0].gain > 0.8
    others = [item.gain for item in ranked if item.term.effect.name != "accumulator"]
    assert max(others) < 0.5 * ranked[0].gain


def test_what_the_model_can_absorb_is_not_counted() -> None:
    found = plain_fit("accumulator")
    tangent = tangent_of(found)
    size = float(np.linalg.norm(tangent.residual))
    assert np.max(np.abs(tangent.basis @ tangent.residual)) < 1e-6 * size
    np.testing.assert_allclose(tangent.basis @ tangent.basis.T, np.eye(len(tangent.basis)), atol=1e-6)
