"""From the options of a command to a run directory."""

from pathlib import Path

import pytest

from mrpipe.cli.options import CommonOptions
from mrpipe.cli.session import session


@pytest.mark.property
@pytest.mark.parametrize(("named", "warned"), [(False, True), (True, False)])
def test_a_run_of_another_configuration_is_named_unless_the_command_names_one(
    named: bool, warned: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--run` alone takes the default configuration, which builds the stages of the other one again."""
    kept = tmp_path / "config.yaml"
    kept.write_text("name: tower\nseed: 3\n")
    given = tmp_path / "given.yaml"
    given.write_text("name: thesis\n")
    with session(CommonOptions(config=given if named else None, run=tmp_path)) as pipeline:
        assert pipeline.run_directory == tmp_path
    said = capsys.readouterr().err
    assert (f"--config {kept}" in said and "made with the configuration tower" in said) is warned


@pytest.mark.property
def test_a_run_of_the_same_configuration_is_continued_in_silence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):
        with session(CommonOptions(run=tmp_path)):
            pass
    assert "was made with" not in capsys.readouterr().err
