"""Laws of the drive are chosen again with the chosen model."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrpipe.dampers.laws import LawShape
from mrpipe.fitting.engine import fit, start_of
from mrpipe.tracing.bench.drive_again import with_laws_again
from mrpipe.tracing.bench.select import Selection
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def test_laws_that_were_too_simple_are_replaced() -> None:
    base = plain_fit("")
    poor = replace(base.problem.base, laws=(LawShape("polynomial", 1), LawShape("polynomial", 0)))
    problem = replace(base.problem, base=poor)
    chosen = fit(problem, start_of(problem, base.base_values, []), iterations=8)
    again = with_laws_again(Selection(base, 1.0, (), chosen), 2, 1)
    assert again.chosen.chi_square < 0.5 * chosen.chi_square
    assert again.chosen.problem.base.laws != poor.laws


def test_laws_that_suffice_are_kept() -> None:
    base = plain_fit("")
    selection = Selection(base, 1.0, (), base)
    assert with_laws_again(selection, 2, 1) is selection
