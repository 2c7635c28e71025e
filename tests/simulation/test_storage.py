"""The artifact of a response says what each of its columns is."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.control import kernel
from mrpipe.simulation import storage


@pytest.mark.golden
def test_every_signal_of_the_controller_has_a_name_and_a_unit(tmp_path: Path) -> None:
    named = {name: np.zeros(5) for name in storage._HISTORIES} | {name: np.zeros((5, 2)) for name in storage._FLOORS}
    commands = np.arange(3 * kernel.COMMAND_SIZE, dtype=float).reshape(3, kernel.COMMAND_SIZE)
    response = SimpleNamespace(**named, drive=np.zeros(5), commands=commands, command_time_s=np.zeros(3))
    path = tmp_path / "response.h5"
    with ArtifactWriter.create(path, Provenance("simulate-vd")) as artifact:
        storage.write_response(artifact, cast(Any, response), "V")
    columns = Artifact(path).json("command_columns")
    assert Artifact(path).array("commands").shape == (3, len(columns))
    by_name = {item["name"]: (index, item["unit"]) for index, item in enumerate(columns)}
    assert by_name["drive"] == (kernel.COMMAND_DRIVE, "V")
    assert by_name["desired_force_before_clipping"] == (kernel.COMMAND_UNCLIPPED, "N")
    assert by_name["drive_of_inverse"] == (kernel.COMMAND_INVERSE, "V")
    assert by_name["fault"][0] == kernel.COMMAND_FAULT == len(columns) - 1
