"""Names that are more likely absent than present become further terms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.selection.select import Selection
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict import assess as module
from mrpipe.tracing.bench.verdict.assess import with_likely_names
from mrpipe.tracing.options import TracingOptions
from tests.tracing.bench.fits import fit_with_terms, plain_fit
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted


def test_an_effect_below_the_least_probability_improves_the_model_without_a_name() -> None:
    library = {name: damper_effects()[name] for name in ("accumulator", "inertia")}
    options = TracingOptions(
        base_forms=("bouc-wen",), refits=2, bootstrap_draws=100, most_effects=1, least_probability=0.99
    )
    found = trace_campaign(campaign("accumulator"), library, [], options, rng=np.random.default_rng(1)).summary
    assert found["effects"] == []
    assert [item["name"] for item in found["further_terms"]] == ["accumulator"]
    assert found["after"]["nrmse"] < 0.6 * found["before"]["nrmse"]
    assert found["verdict_class"] == "unknown"
    assert "accumulator (probability 0.9" in found["verdict"]


def test_a_further_term_that_does_not_lower_the_error_on_validation_is_left_out() -> None:
    library = {name: damper_effects()[name] for name in ("accumulator", "inertia")}
    options = TracingOptions(
        base_forms=("bouc-wen",), refits=2, bootstrap_draws=100, most_effects=1, least_probability=0.99
    )
    planted, clean = campaign("accumulator"), campaign("none")
    tests = [b if b.role == "validation" else a for a, b in zip(planted, clean, strict=True)]
    found = trace_campaign(tests, library, [], options, rng=np.random.default_rng(1)).summary
    assert (found["effects"], found["further_terms"]) == ([], [])
    assert found["after"]["nrmse"] <= 1.01 * found["before"]["nrmse"]


def test_the_names_that_stay_are_judged_again_when_another_one_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without Stribeck friction an end stop had the probability 0.15, and was still named."""
    plain = plain_fit("accumulator")
    chosen = fit_with_terms("accumulator", ("inertia", "mass"), ("accumulator", "linear"))
    likely = [(0.9, 0.3), (0.15,), ()]

    def assess(found, case, rng, *, with_others=False, doubts=()):
        assert with_others is (len(likely) < 3)
        assert [item.confidence for item in doubts] == [0.3, 0.15][: 3 - len(likely)]
        terms = found.selection.chosen.problem.terms
        causes = [SimpleNamespace(effect=t.effect, confidence=c) for t, c in zip(terms, likely.pop(0), strict=False)]
        return SimpleNamespace(named=causes, causes=causes, further_terms_fail=False, reason=found.reason)

    monkeypatch.setattr(module, "assess", assess)
    case = SimpleNamespace(options=TracingOptions())
    named = NamedEffects(Selection(plain, 1.0, (), chosen, proven=2), (None, None), declared=0)
    kept, found = with_likely_names(named, case, np.random.default_rng(1))
    assert (kept.selection.proven, kept.gains, likely, found.named) == (0, (), [], [])
    assert "accumulator (probability 0.30), inertia (probability 0.15) lower the error" in found.reason
