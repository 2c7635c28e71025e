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
from mrpipe.tracing.bench.verdict import unnamed_reason
from mrpipe.tracing.options import NamingRules

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


def selected(share: float, ground: float = 101.0) -> Selection:
    def fit(left: float) -> Any:
        return SimpleNamespace(chi_square=left)

    chosen, base, other = fit(ground - share * (ground - 1.0)), fit(101.0), fit(ground)
    rounds = ((Candidate("asymmetry", chosen, share, {}),),)
    return Selection(base, 1.0, rounds, chosen, 1, other if ground != 101.0 else None)


@pytest.mark.property
@pytest.mark.parametrize("ground", [101.0, 11.0])
def test_an_effect_must_recover_half_of_what_the_base_form_leaves(ground: float) -> None:
    # what another base form recovers is not counted for the effect
    assert unnamed_reason(selected(0.45, ground), NamingRules()) != ""
    assert unnamed_reason(selected(0.55, ground), NamingRules()) == ""
