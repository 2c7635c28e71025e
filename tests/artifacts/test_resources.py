"""Parameter sets come with value, unit and source."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.artifacts import config_directory, load_parameter_set
from mrpipe.errors import UserError

pytestmark = pytest.mark.property

SETS = sorted(
    (kind, path.stem)
    for kind in ("dampers", "frames", "structures")
    for path in (config_directory() / kind).glob("*.yaml")
)


@pytest.mark.parametrize(("kind", "name"), SETS)
def test_shipped_set_has_source_and_units(kind: str, name: str) -> None:
    parameters = load_parameter_set(kind, name)
    assert len(parameters.source) > 5
    assert set(parameters.units) == set(parameters.values) != set()


def test_unknown_set_names_the_known(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no such parameter set; known sets: .*set-c"):
        load_parameter_set("dampers", "set-z")


def test_set_of_ones_own_needs_units(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("model: bouc-wen\nsource: bench\nparameters:\n  alpha_a: {value: 3.0}\n")
    with pytest.raises(UserError, match=r"parameters\.alpha_a: has no value or no unit"):
        load_parameter_set("dampers", path)
