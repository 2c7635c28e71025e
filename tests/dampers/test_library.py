"""Base forms by name, and those of a user's files."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.cli import run
from mrpipe.dampers.forms import biviscous
from mrpipe.dampers.library import base_forms, forms_named
from mrpipe.errors import UserError

pytestmark = pytest.mark.property


def _own(folder: Path, name: str, file: str = "own.py") -> Path:
    path = folder / file
    source = Path(biviscous.__file__).read_text(encoding="utf-8")
    path.write_text(source.replace('name="biviscous"', f'name="{name}"'), encoding="utf-8")
    return path


def test_the_forms_of_a_user_come_with_those_of_the_program(tmp_path: Path) -> None:
    own = _own(tmp_path, "own")
    assert list(forms_named(["bouc-wen"], [own])) == ["bouc-wen", "own"]
    assert list(forms_named((), [own])) == [*base_forms(), "own"]


def test_a_form_with_the_name_of_another_form_does_not_take_its_place(tmp_path: Path) -> None:
    own = _own(tmp_path, "dahl")
    with pytest.raises(UserError) as caught:
        forms_named((), [own])
    said = f"{own}: FORM, name: 'dahl' is already the name of a base form of the program"
    assert str(caught.value) == f"{said}; give this form another name"
    first, second = _own(tmp_path, "own", "first.py"), _own(tmp_path, "own", "second.py")
    with pytest.raises(UserError, match=f"second.py: FORM, name: 'own' is already .* base form of {first}"):
        forms_named((), [first, second])


@pytest.mark.parametrize(
    ("stage", "setting", "value"),
    [
        ("close-loop", "close_loop.model", "ovn"),
        ("close-loop", "close_loop.base_forms", "[ovn]"),
        ("identify-damper", "identify_damper.form", "ovn"),
        ("identify-damper", "identify_damper.compare", "[ovn]"),
    ],
)
@pytest.mark.parametrize("with_file", [True, False])
def test_an_unknown_form_is_named_with_its_line(
    stage: str, setting: str, value: str, with_file: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    section, key = setting.split(".")
    files = f"  form_files: [{_own(tmp_path, 'own')}]\n" if with_file else ""
    config = tmp_path / "rig.yaml"
    config.write_text(
        f"stages: [{stage}]\ncampaigns: {{bench: laboratory, frame: null, closed_loop: null}}\n"
        f"{section}:\n  {key}: {value}\n{files}"
    )
    assert run(["check", str(config)]) == 2
    error = capsys.readouterr().err
    assert f"{config}: line 4, {setting}" in error
    assert "no base form 'ovn'; " in error
    assert ("did you mean own?" in error) is with_file
