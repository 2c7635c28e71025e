"""Effects scale with the laws of the drive that the fit itself finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.dampers.laws import constant_law
from mrpipe.dampers.library import base_form
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, predict, start_of
from mrpipe.fitting.kernel import FORCE_AT, run_recordings
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import record_tests
from mrpipe.fitting.reference import with_own_laws, with_settled_laws
from mrpipe.fitting.start import base_of, best_fit, distinct_levels, first_problem, polynomial_laws
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted


@pytest.fixture(scope="module")
def misled() -> Fit:
    """Return a fit of a damper with pinching, whose dip is a share of the same force at every level of the drive."""
    recordings = record_tests([test for test in campaign("pinching") if test.role == "training"], rate_hz=250.0)
    form = base_form("bouc-wen")
    base = base_of(recordings, form, polynomial_laws(form, distinct_levels(recordings), 3, 1))
    plain = best_fit(first_problem(recordings, base), starts=1, iterations=6)
    effect = damper_effects()["pinching"]
    reference = (constant_law(recordings.force_rms), plain.laws[1])
    problem = replace(plain.problem, terms=(Term(effect, effect.form("gaussian")),), reference=reference)
    return fit(problem, start_of(problem, plain.base_values, [{}]), iterations=8)


def _differ(found: Fit) -> float:
    """Return by how much the damper that is written differs from the fit, as a share of the RMS force."""
    recordings = found.problem.recordings
    written = run_recordings(found.chain(), recordings)[FORCE_AT]
    difference = (written - predict(found, recordings))[recordings.used]
    return float(np.std(difference) / recordings.force_rms)


def test_the_damper_that_is_written_is_the_one_that_was_fitted(misled: Fit) -> None:
    own = with_own_laws(misled)
    assert _differ(misled) > 0.01
    assert _differ(own) < 0.002


def test_a_share_of_the_yield_force_fits_better_at_every_level(misled: Fit) -> None:
    own = with_own_laws(misled)
    assert own.cost < 0.7 * misled.cost


def test_without_effects_only_the_reference_changes(misled: Fit) -> None:
    bare = fit(replace(misled.problem, terms=()), misled.theta[:-1], iterations=1)
    own = with_own_laws(bare)
    assert own.theta is bare.theta
    assert own.problem.reference[0](1.0) == pytest.approx(own.laws[0](1.0))


def test_laws_that_have_settled_do_not_change_in_a_further_fit(misled: Fit) -> None:
    settled = with_settled_laws(misled)
    assert settled.cost < 1.02 * with_own_laws(misled).cost
    again = with_settled_laws(settled)
    assert again.cost == pytest.approx(settled.cost, rel=0.02)
    assert _differ(settled) < 0.002


def test_laws_settle_only_if_an_effect_depends_on_them(misled: Fit) -> None:
    bare = fit(replace(misled.problem, terms=()), misled.theta[:-1], iterations=1)
    assert with_settled_laws(bare) is bare
