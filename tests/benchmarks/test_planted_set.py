"""A frozen set of cases of the tracing benchmark, traced as a user's `close-loop` traces them.

The seeds are consecutive, so nobody has chosen the cases by their outcome. The expected verdict is the truth.
"""

from typing import Any

import pytest

from benchmarks.rigs.cases import Case, case_of
from benchmarks.tracing import run_case

pytestmark = pytest.mark.planted

FIRST, COUNT = 9000, 2


def cases_of(kinds: tuple[str, ...]) -> list[Any]:
    chosen = [case for case in map(case_of, range(FIRST, FIRST + COUNT)) if case.kind in kinds]
    return [
        pytest.param(case, id="-".join([str(case.seed), case.base, *(case.planted or ("clean",))])) for case in chosen
    ]


def traced(case: Case) -> dict[str, Any]:
    row = run_case(case)
    if row["error"]:
        pytest.fail(row["error"])
    return row


# two classes, because the suite gives each class to one process
class TestCleanRigs:
    @pytest.mark.parametrize("case", cases_of(("clean", "outside")))
    def test_nothing_is_named_that_is_not_there(self, case):
        row = traced(case)
        assert row["found"] == []
        assert row["right"]


class TestPlantedEffects:
    @pytest.mark.parametrize("case", cases_of(("single", "pair")))
    def test_the_planted_effect_is_named_first(self, case):
        row = traced(case)
        assert row["right"], f"named {row['found']}: {row['verdict']}"
