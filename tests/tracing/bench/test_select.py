"""What may be named: not corrections without a main part, not a cause that leaves most to terms without one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from mrpipe.effects.contract import EffectScales
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.problem import Term
from mrpipe.tracing.bench.select import Candidate, Selection, admissible
from mrpipe.tracing.bench.verdict import Rules, unnamed_reason

SCALES = EffectScales(stroke=0.01, speed=0.12, acceleration=1.5, drive=4.0, force=120.0, time=5.0)


def fitted(stiffness: float, curvature: float) -> Fit:
    effect = damper_effects()["accumulator"]
    term = Term(effect, effect.form("curved"))
    problem = SimpleNamespace(terms=(term,), scales=SCALES)
    values = {"stiffness": stiffness, "curvature": curvature}
    return cast(Fit, SimpleNamespace(problem=problem, term_values=[values], at_bound=()))


@pytest.mark.property
def test_a_spring_of_hardly_any_stiffness_is_no_spring() -> None:
    # over the stroke 5 N against 140 N of curvature: an even force, whatever it is
    assert not admissible(fitted(500.0, 1.4e6))
    assert admissible(fitted(500.0, 5e4))
    assert not admissible(fitted(0.0, 5e4))


def selected(first: float, all_: float, proven: int) -> Selection:
    def fit(left: float) -> Any:
        return SimpleNamespace(chi_square=left)

    def candidate(share: float) -> Candidate:
        return Candidate("asymmetry", fit(101.0 - 100.0 * share), share, {})

    rounds = ((candidate(first),), (candidate(all_),))
    return Selection(fit(101.0), 1.0, rounds, rounds[-1][0].fit, proven)


@pytest.mark.property
def test_a_cause_must_explain_enough_without_the_terms_that_name_none() -> None:
    assert unnamed_reason(selected(0.45, 0.7, proven=1), Rules()) != ""
    assert unnamed_reason(selected(0.55, 0.7, proven=1), Rules()) == ""
    assert unnamed_reason(selected(0.45, 0.7, proven=2), Rules()) == ""
