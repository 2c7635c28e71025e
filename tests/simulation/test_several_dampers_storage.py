"""Indices and histories of a structure with several dampers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.artifacts.plain import plain
from mrpipe.simulation import Excitation, harmonic
from mrpipe.simulation.several_dampers import DampersResponse
from mrpipe.simulation.several_dampers_rig import DampersRig
from mrpipe.simulation.several_dampers_storage import response_summary, write_dampers_response
from tests.simulation.test_several_dampers_rig import rig_of

pytestmark = pytest.mark.property

EXCITATION = harmonic(0.4, 15.0, cycles=12, settling_cycles=6, ramp_cycles=2.0, decay_s=1.0)
Ran = tuple[DampersRig, DampersResponse, Excitation]


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Ran:
    rig = rig_of(tmp_path_factory.mktemp("rig"))
    return rig, rig.run(EXCITATION, rng=np.random.default_rng(1)), EXCITATION


def test_each_damper_has_its_own_indices_and_the_run_those_of_the_floors(ran: Ran) -> None:
    rig, response, excitation = ran
    summary: dict[str, Any] = plain(response_summary(rig, response, excitation))
    json.dumps(summary, allow_nan=False)
    rows = summary["dampers"]
    assert [(row["name"], row["law"]) for row in rows] == [("low", "vd"), ("damper 2", "fdns")]
    for row, own in zip(rows, response.dampers.values(), strict=True):
        assert row["peak_force_n"] == pytest.approx(np.abs(own.force).max())
        assert row["peak_damper_displacement_m"] == pytest.approx(np.abs(own.damper_displacement).max())
        assert 0.0 < row["rms_force_n"] < row["peak_force_n"]
        assert row["drive_unit"] == "A"
    assert summary["rms_x_top_m"] > summary["rms_x1_m"] > 0.0
    assert not {"rms_force_n", "clipped_share", "energy_damper_j"} & set(summary)
    assert summary["energy_balance_error"] < 5e-3


def test_histories_read_back_with_units(ran: Ran, tmp_path) -> None:
    rig, response, _ = ran
    with ArtifactWriter.create(tmp_path / "response.h5", Provenance("simulate-dampers")) as artifact:
        write_dampers_response(artifact, rig, response)
    read = Artifact(tmp_path / "response.h5")
    assert np.array_equal(read.array("displacement"), response.first.displacement)
    for place, (name, own) in enumerate(response.dampers.items(), start=1):
        assert np.array_equal(read.array(f"dampers/{place}/force"), own.force)
        assert np.array_equal(read.array(f"dampers/{place}/drive"), own.drive)
        assert read.attributes(f"dampers/{place}")["name"] == name
    assert read.attributes("dampers/1/drive")["unit"] == "A"
    assert not np.array_equal(read.array("dampers/1/force"), read.array("dampers/2/force"))
