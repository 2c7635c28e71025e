"""What the process of a stage sends is what happened there."""

from __future__ import annotations

import pytest

from mrpipe.errors import DivergedError, MrpipeError, UserError
from mrpipe.pipeline.stage_process import _portable

pytestmark = pytest.mark.property


class _Refuses(Exception):
    """Cannot be copied: it is made of two texts and keeps one."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first} and {second}")


class _RefusesOnPurpose(MrpipeError, _Refuses):
    """The same, of this program."""


@pytest.mark.parametrize("error", [UserError("a.csv", "", "is empty", "give rows"), DivergedError("at 3 s")])
def test_an_error_of_the_program_is_copied_without_its_traceback(error: Exception) -> None:
    copy = _portable(error)
    assert (type(copy), str(copy)) == (type(error), str(error))
    assert not hasattr(copy, "__notes__")


def test_a_fault_keeps_its_traceback() -> None:
    try:
        raise KeyError("missing")
    except KeyError as error:
        copy = _portable(error)
    assert type(copy) is KeyError
    assert 'raise KeyError("missing")' in copy.__notes__[0]


def test_an_error_that_cannot_be_copied_keeps_its_name_and_text() -> None:
    assert (type(_portable(_Refuses("one", "two"))), str(_portable(_Refuses("one", "two")))) == (
        RuntimeError,
        "_Refuses: one and two",
    )
    copy = _portable(_RefusesOnPurpose("one", "two"))
    assert (type(copy), str(copy)) == (MrpipeError, "one and two")
