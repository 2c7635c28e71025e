"""A frozen case of the tracing benchmark, traced as a user's `close-loop` traces it.

It is the first clean case of the set at 500 Hz with regular tests and without repeats. Such a case takes the least
time, and nobody has chosen it by its outcome. The expected verdict is the truth. All other cases, which take minutes
each, are those of `make bench-tracing`; planted effects on the tests' own rigs are in `tests/tracing`.
"""

from typing import Any

import pytest

from benchmarks.rigs.cases import Case, case_of
from benchmarks.tracing import run_case

pytestmark = pytest.mark.planted

FIRST, COUNT = 9022, 1


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


@pytest.mark.parametrize("case", cases_of(("clean", "outside")))
def test_nothing_is_named_that_is_not_there(case):
    row = traced(case)
    assert row["found"] == []
    assert row["right"]
