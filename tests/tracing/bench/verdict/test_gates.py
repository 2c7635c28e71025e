"""What is required before anything is traced."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.campaign_tests.odd_tests import sort_tests
from mrpipe.tracing.bench.noise.baseline import declared_base, fit_baseline
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.bench.validation.judgement import Evidence
from mrpipe.tracing.bench.validation.on_validation import VerdictWithEvidence
from mrpipe.tracing.bench.verdict.gates import (
    errors_on_validation,
    never_yields,
    refusal_of,
    sentence_on_ties,
    verdict_on_validation,
    with_calibrated_probability,
)
from mrpipe.tracing.bench.verdict.naming import Named
from mrpipe.tracing.options import NamingRules, TracingOptions
from mrpipe.tracing.rules import ValidationRules
from mrpipe.tracing.verdict import Verdict, VerdictClass
from tests.tracing.bench.fits import plain_fit, recorded
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted


def test_a_damper_that_stays_elastic_in_all_tests_is_recognised() -> None:
    found = plain_fit("")
    assert not never_yields(found, ValidationRules())
    recordings = found.problem.recordings
    small = replace(recordings, displacement=recordings.displacement / 500.0, velocity=recordings.velocity / 500.0)
    assert never_yields(replace(found, problem=replace(found.problem, recordings=small)), ValidationRules())


def test_a_declared_form_that_fails_is_no_reason_to_trace_nothing() -> None:
    """A damper whose force follows the speed at once left 0.56 under Bouc-Wen, and nothing was traced."""
    tests = campaign("rounded")
    training, validation = recorded(tests), recorded(tests, validation=True)
    first = fit_baseline(training, declared_base(training, "bouc-wen", 2, 1))
    options = TracingOptions(base_forms=("bouc-wen", "rounded-yield"))
    found = errors_on_validation(first.fit, first.fit, first, training, validation, options)
    error = found.nrmse(found.after)

    def refusal(failed: float) -> str:
        rules = options.rules.model_copy(update={"validation": ValidationRules(failed=failed)})
        asked = options.model_copy(update={"rules": rules})
        return refusal_of(found, first, training, validation, asked, {}, 1)

    assert refusal(1.1 * error) == ""
    # the other form predicts the validation tests, so that the declared form is wrong and not the tests
    assert refusal(0.5 * error) == ""
    neither = refusal(1e-4 * error)
    assert "bouc-wen does not predict" in neither
    assert "nor does rounded-yield" in neither


def test_an_effect_that_explains_a_part_is_less_probable() -> None:
    """Half a derivative of the displacement, which the library lacks, was named migration: it removed most of it."""
    item = Named(damper_effects()["migration"], "slow-hysteresis", {}, 0.98)
    evidence = Evidence(0.05, 0.018, 0.004, 0.012, (), structured=True, effects=True)

    def confidence(kind: VerdictClass, *, chosen: bool = True, with_others: bool = False) -> float:
        judgement = VerdictWithEvidence(Verdict(kind, ""), evidence, 0.012, (0.012, 0.012), None)
        return with_calibrated_probability(
            item, judgement, NamingRules(), with_others=with_others, chosen=chosen
        ).confidence

    assert confidence("explained") > 0.9
    assert NamingRules().least_probability < confidence("partly explained") < 0.7
    # offsets are measured test by test: nothing else can be taken for them
    assert confidence("partly explained", chosen=False) > 0.9
    assert confidence("explained", with_others=True) < 0.8


def test_the_verdict_says_which_effects_the_tests_do_not_separate() -> None:
    effects = damper_effects()
    late = Named(effects["channel-skew"], "shift", {}, 0.5, ("inertia", "accumulator"))
    dry = Named(effects["stribeck"], "gaussian", {}, 0.5, ("backlash",))
    alone = Named(effects["heating"], "cooling", {}, 0.9)
    assert sentence_on_ties([alone]) == ""
    assert sentence_on_ties([late, alone]) == "these tests do not separate channel-skew from inertia and accumulator"
    assert sentence_on_ties([late, dry]).endswith("inertia and accumulator, nor stribeck from backlash")


def test_a_tie_is_part_of_the_sentence() -> None:
    """The dyke record was said to have a late force, and the inertia that it cannot exclude stood only in the JSON."""
    tests = campaign("rounded")
    training, validation = recorded(tests), recorded(tests, validation=True)
    first = fit_baseline(training, declared_base(training, "rounded-yield", 2, 1))
    options = TracingOptions()
    found = errors_on_validation(first.fit, first.fit, first, training, validation, options)
    selection = Selection(first.fit, first.noise, (), first.fit, nothing_missing=0.0)
    late = Named(damper_effects()["channel-skew"], "shift", {}, 0.5, ("inertia",))
    judgement = verdict_on_validation(found, selection, training, options, [late], True, "", sort_tests(tests), 1)
    assert judgement.verdict.sentence.endswith("; these tests do not separate channel-skew from inertia")
