"""Errors of domain functions about settings name the file and the line of the setting."""

from __future__ import annotations

import pytest

from mrpipe.config.loader import load_config
from mrpipe.config.located import located
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

CONFIG = """\
name: tower
structure:
  storeys:
    - {mass_kg: 1000.0, stiffness_n_m: 2.0e6}
  degrees_of_freedom: [ground]
"""


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "tower.yaml"
    file.write_text(CONFIG)
    return file


def test_a_key_of_a_section_is_named_with_its_line(path):
    error = located(UserError("structure", "degrees_of_freedom[0]", "is called ground", "rename it"), load_config(path))
    assert str(error) == f"{path}: line 5, structure.degrees_of_freedom[0]: is called ground; rename it"


def test_an_entry_of_a_list_is_named_with_its_own_line(path):
    path.write_text(CONFIG.replace("[ground]", "\n    - deck\n    - ground"))
    error = located(UserError("structure", "degrees_of_freedom[1]", "is called ground", "rename it"), load_config(path))
    assert str(error).startswith(f"{path}: line 7, structure.degrees_of_freedom[1]: is called ground")


def test_a_file_with_the_name_of_a_section_is_no_setting(path, monkeypatch):
    monkeypatch.chdir(path.parent)
    (path.parent / "structure.py").write_text("")
    error = UserError("structure.py", "EFFECT", "is missing", "define EFFECT")
    assert located(error, load_config(path)) is error


def test_a_place_that_is_no_key_is_named_after_the_section(path):
    error = located(UserError("structure", "damper of floor 2", "has no brace", "give one"), load_config(path))
    assert str(error) == f"{path}: line 2, structure, damper of floor 2: has no brace; give one"


@pytest.mark.parametrize("name", ["no.at2", "roof", "storeys[7]"])
def test_a_name_that_looks_like_a_key_is_not_one(path, name):
    error = located(UserError("simulate.excitation.file", name, "there is no such file", "name one"), load_config(path))
    assert str(error) == f"{path}: simulate.excitation.file, {name}: there is no such file; name one"


def test_a_setting_that_the_file_lacks_has_no_line(path):
    error = located(UserError("calibrate", "target_mode", "is 4", "it is 1 to 2"), load_config(path))
    assert str(error) == f"{path}: calibrate.target_mode: is 4; it is 1 to 2"


def test_a_setting_of_an_option_is_named_with_the_option(path):
    loaded = load_config(path, ["calibrate.target_mode=4"])
    error = located(UserError("calibrate", "target_mode", "is 4", "it is 1 to 2"), loaded)
    assert str(error) == "--set: calibrate.target_mode: is 4; it is 1 to 2"


@pytest.mark.parametrize("source", ["data/campaign.yaml", "damper", "--law"])
def test_other_errors_stay_as_they_are(path, source):
    error = UserError(source, "force", "is constant", "measure at two currents")
    assert located(error, load_config(path)) is error
