"""One verdict on a structure's campaign, with the arrays that the report shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.campaigns.model import Campaign
from mrpipe.effects.library import damper_effects
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.errors import UserError
from mrpipe.tracing.options import TracingOptions
from mrpipe.tracing.structure.verdict import StructureTracing, joined_data, trace_structure
from tests.tracing.structure.rig import FLOORS, MASSES, frame_campaign

pytestmark = pytest.mark.planted

OPTIONS = TracingOptions(refits=1, bootstrap_draws=50, most_effects=1)


def only_drives(campaign: Campaign) -> Campaign:
    """Return a campaign of the same tests that records the drive alone."""
    tests = tuple(replace(item, channels={"drive": np.zeros(item.time_s.size)}) for item in campaign.recordings)
    return replace(campaign, recordings=tests, floor_masses_kg=())


@pytest.fixture(scope="module")
def traced() -> StructureTracing:
    effects = {name: all_structural_effects()[name] for name in ("cubic-stiffness", "joint-friction")}
    campaign = frame_campaign("cubic-stiffness")
    return trace_structure([campaign], effects, damper_effects(), OPTIONS, rng=np.random.default_rng(1))


def test_the_verdict_is_that_of_the_frame_alone(traced: StructureTracing) -> None:
    summary = traced.summary
    assert summary["campaign"] == "own-cubic-stiffness" and list(summary["parts"]) == ["frame"]
    assert [item["name"] for item in summary["effects"]] == ["cubic-stiffness"]
    assert summary["verdict"].startswith("frame: cubic-stiffness")


def test_histories_hold_the_residual_before_and_after(traced: StructureTracing) -> None:
    before = traced.histories["validation/random-2/residual_before"]
    after = traced.histories["validation/random-2/residual_after"]
    drift = traced.histories["validation/random-2/drift"]
    assert before.values.shape == after.values.shape == drift.values.shape
    assert before.values.shape[1] == FLOORS and (before.unit, drift.unit) == ("N", "m")
    assert np.sum(after.values**2) < 0.6 * np.sum(before.values**2)


def test_the_picture_shows_the_storey_with_the_largest_residual(traced: StructureTracing) -> None:
    name, storey, time, measured, before, after = traced.shown[0]
    assert (name, storey) == ("random-2", 2)
    assert len(time) == len(measured) == len(before) == len(after)
    assert np.std(after) < np.std(before) < np.std(measured)
    assert [item[0] for item in traced.maps] == [1, 2, 3]


def test_campaigns_of_one_rig_are_joined() -> None:
    first, second = frame_campaign("clean"), frame_campaign("clean", 1)
    data = joined_data([only_drives(second), first])
    assert data.masses_kg.tolist() == MASSES.tolist()
    assert len(data.records) == len(joined_data([first]).records)
    assert len(data.loops) == len(second.recordings)
    assert len(joined_data([first, second]).records) == 2 * len(joined_data([first]).records)


def test_a_campaign_that_shows_nothing_is_refused() -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(UserError, match="no test can be judged"):
        trace_structure(
            [only_drives(frame_campaign("clean"))], all_structural_effects(), damper_effects(), OPTIONS, rng=rng
        )


def test_a_mistake_in_the_channels_is_suspected_where_nothing_explains_a_large_error() -> None:
    campaign = frame_campaign("clean")
    tests = []
    for item in campaign.recordings:
        turned = {**item.channels, "floor_acceleration_2": -item.channels["floor_acceleration_2"]}
        tests.append(replace(item, channels=turned))
    effects = {"cubic-stiffness": all_structural_effects()["cubic-stiffness"]}
    wrong = replace(campaign, recordings=tuple(tests))
    for given, suspected in ((wrong, True), (campaign, False)):
        found = trace_structure([given], effects, damper_effects(), OPTIONS, rng=np.random.default_rng(1))
        assert not found.summary["effects"]
        assert any("sign, the unit or the floor of a channel" in line for line in found.findings) == suspected
