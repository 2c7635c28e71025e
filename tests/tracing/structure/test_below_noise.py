"""An effect below the noise of each line is named where all lines together show it, and nothing else does."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.base import frame_problem
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.rounds import BelowNoise, FrameSelection
from mrpipe.tracing.structure.select import select
from mrpipe.tracing.structure.trace import trace_frame
from tests.tracing.structure.rig import frame_campaign

pytestmark = pytest.mark.planted

LIBRARY = list(all_structural_effects().values())
OF_NOISE = 30.0


def noisy(campaign: Campaign) -> Campaign:
    """Return a campaign with 30 times the noise of the sensors."""
    rng = np.random.default_rng(77)
    found: list[Recording] = []
    for item in campaign.recordings:
        channels = {
            name: values + OF_NOISE * (1e-5 if "displacement" in name else 0.004) * rng.standard_normal(len(values))
            for name, values in item.channels.items()
        }
        found.append(replace(item, channels=channels))
    return replace(campaign, recordings=tuple(found))


@functools.cache
def selected(effect: str, *, most: int = 1) -> FrameSelection:
    data = frame_data(noisy(frame_campaign(effect)))
    given = frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)
    return select(given, LIBRARY, NamingRules(), most=most, rng=np.random.default_rng(1), draws=40)


def test_friction_below_the_noise_of_each_line_is_named() -> None:
    found = selected("joint-friction")
    assert found.structured and found.below_noise is not None
    assert [item.name for item in found.chosen] == ["joint-friction"]
    assert found.below_noise.alike == ("joint-friction",)
    assert found.share(found.residual) > 0.9
    (gain,) = found.gains
    assert gain.significant


def test_noise_alone_shows_no_effect() -> None:
    found = selected("clean")
    assert found.below_noise is None and found.chosen == () and not found.structured


def test_nothing_is_searched_if_no_effect_is_allowed() -> None:
    assert selected("joint-friction", most=0).below_noise is None


def test_the_verdict_says_that_the_effect_is_smaller_than_the_noise() -> None:
    data = frame_data(noisy(frame_campaign("joint-friction")))
    summary = trace_frame(data, LIBRARY, [], NamingRules(), draws=40, rng=np.random.default_rng(1)).summary
    assert summary["verdict_class"] == "explained"
    assert "smaller than the noise of each spectral line" in summary["verdict"]
    (effect,) = summary["effects"]
    assert effect["name"] == "joint-friction" and effect["confidence"] < 0.97
    assert summary["residual"]["structured"] and summary["residual"]["p_value"] < 1e-5
    assert sum(summary["residual"]["where"].values()) == pytest.approx(1.0)


def test_effects_that_explain_it_alike_are_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    found = selected("joint-friction")
    undecided = replace(
        found, chosen=(), residual=np.zeros(0), gains=(), below_noise=BelowNoise(1e3, ("impact", "yielding"))
    )
    monkeypatch.setattr("mrpipe.tracing.structure.trace.select", lambda *_, **__: undecided)
    data = frame_data(noisy(frame_campaign("joint-friction")))
    summary = trace_frame(data, LIBRARY, [], NamingRules(), draws=40, rng=np.random.default_rng(1)).summary
    assert summary["effects"] == [] and summary["verdict_class"] == "unknown"
    assert "impact and yielding explain it equally well" in summary["verdict"]
    assert summary["unexplained"]["structured"]
    assert summary["tied"]["effects"] == ["impact", "yielding"]
