"""A user's own effect of a structure, and files that are none."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.effects.library import all_effects
from mrpipe.effects.structural.checks import checks_of
from mrpipe.effects.structural.library import all_structural_effects, effects_of_files, structural_effects
from mrpipe.errors import UserError


@pytest.mark.property
@pytest.mark.parametrize(
    "text", ["def x(:\n", "raise RuntimeError('first\\nsecond')\n", "EFFECT = 3\n", "", "import nowhere_at_all\n"]
)
def test_a_broken_file_is_a_users_mistake_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "own.py"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        effects_of_files([path])
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.property
@pytest.mark.parametrize("name", list(all_structural_effects()))
def test_an_effect_meets_every_demand(name: str) -> None:
    checks = checks_of(all_structural_effects()[name], [*all_effects(), *all_structural_effects()])
    assert [(item.form, item.demand, item.failure) for item in checks if not item.passed] == []


@pytest.mark.property
def test_a_missing_file_is_a_users_mistake(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        effects_of_files([tmp_path / "none.py"])


@pytest.mark.property
def test_an_effect_of_a_structure_and_one_of_a_damper_are_told_apart(tmp_path: Path) -> None:
    own, damper = tmp_path / "own.py", tmp_path / "damper.py"
    own.write_text(
        "from dataclasses import replace\nfrom mrpipe.effects.structural.impact import EFFECT as I\n"
        "EFFECT = replace(I, name='own-impact')\n"
    )
    damper.write_text(
        "from dataclasses import replace\nfrom mrpipe.effects.remanence import EFFECT as R\n"
        "EFFECT = replace(R, name='own-remanence')\n"
    )
    of_structure, of_damper = effects_of_files([own, damper])
    assert of_damper == {"own-remanence": damper}
    assert set(structural_effects((), of_structure)) == {*all_structural_effects(), "own-impact"}
