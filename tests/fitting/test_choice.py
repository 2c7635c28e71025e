"""Which forms are fitted for the settings, and which one is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.library import base_forms
from mrpipe.errors import UserError
from mrpipe.fitting import choice
from mrpipe.fitting.settings import IdentifyDamperSettings

pytestmark = pytest.mark.property


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Replace the fits by records of what was asked for."""
    made: list[dict[str, Any]] = []

    def compare(forms: Sequence[BaseForm], tests: object, options: object, **given: Any) -> SimpleNamespace:
        del tests, options
        names = [form.name for form in forms]
        made.append({"forms": names, "keep": given["keep"], "folds": given["folds"]})
        return SimpleNamespace(judged=[SimpleNamespace(fit=SimpleNamespace(form=form)) for form in forms])

    monkeypatch.setattr(choice, "compare_forms", compare)
    monkeypatch.setattr(choice, "best_by_folds", lambda judged: judged[-1])
    return made


def test_a_named_form_is_compared_with_all_and_chosen_without_folds(calls: list[dict[str, Any]]) -> None:
    _, chosen = choice.compare_and_choose(IdentifyDamperSettings(form="dahl"), [])
    assert chosen.fit.form.name == "dahl"
    assert calls == [{"forms": list(base_forms()), "keep": ("dahl",), "folds": 0}]


def test_a_named_form_joins_those_that_are_compared(calls: list[dict[str, Any]]) -> None:
    settings = IdentifyDamperSettings(form="dahl", compare=("bingham", "bouc-wen"))
    _, chosen = choice.compare_and_choose(settings, [])
    assert chosen.fit.form.name == "dahl"
    assert calls[0]["forms"] == ["bingham", "bouc-wen", "dahl"]
    assert calls[0]["keep"] == ("bingham", "bouc-wen", "dahl")


def test_best_is_chosen_by_folds_among_those_compared(calls: list[dict[str, Any]]) -> None:
    settings = IdentifyDamperSettings(form="best", compare=("bingham", "dahl"), folds=4)
    _, chosen = choice.compare_and_choose(settings, [])
    assert chosen.fit.form.name == "dahl"
    assert calls == [{"forms": ["bingham", "dahl"], "keep": ("bingham", "dahl"), "folds": 4}]


def test_a_form_that_no_file_defines_is_a_mistake(calls: list[dict[str, Any]]) -> None:
    # with files of one's own the settings cannot check the name
    settings = IdentifyDamperSettings().model_copy(update={"form": "dahll"})
    with pytest.raises(UserError, match="dahll"):
        choice.compare_and_choose(settings, [])
    assert not calls
