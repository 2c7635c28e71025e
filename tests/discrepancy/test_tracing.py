"""Planted effects, in forms that the library does not hold, are named; a clean rig and an unknown shape are not."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mrpipe.discrepancy.summary import Tracing, TracingOptions
from mrpipe.discrepancy.tracing import trace_campaign
from mrpipe.effects.library import damper_effects
from tests.discrepancy.rig import campaign


@functools.cache
def traced(effect: str) -> Tracing:
    options = TracingOptions(refits=2, bootstrap_draws=100, most_effects=1 + effect.count("+"))
    names = ("accumulator", "backlash", "channel-skew", "heating", "inertia", "remanence", "stribeck")
    library = {name: damper_effects()[name] for name in names}
    return trace_campaign(campaign(effect), library, [], options, rng=np.random.default_rng(1))


@pytest.mark.planted
@pytest.mark.parametrize("effect", ["remanence", "accumulator"])
def test_a_planted_effect_is_named_first(effect: str) -> None:
    summary = traced(effect).summary
    assert summary["residual"]["structured"]
    assert summary["effects"][0]["name"] == effect
    assert summary["candidates"][0]["name"] == effect
    assert [item["name"] for item in summary["effects"]] == [effect]
    assert summary["effects"][0]["tied_with"] == []
    assert summary["after"]["nrmse"] < 0.6 * summary["before"]["nrmse"]


@pytest.mark.planted
def test_the_stiffness_of_the_accumulator_comes_out() -> None:
    stiffness = traced("accumulator").summary["effects"][0]["parameters"]["stiffness"]
    assert stiffness["unit"] == "N/m"
    assert stiffness["value"] == pytest.approx(1400.0, rel=0.15)


@pytest.mark.planted
def test_a_clean_rig_lacks_nothing() -> None:
    summary = traced("none").summary
    assert summary["effects"] == []
    assert not summary["residual"]["structured"]
    assert not summary["unexplained"]["structured"]
    assert summary["before"]["nrmse"] < 1.25 * summary["noise_floor_nrmse"]


@pytest.mark.planted
def test_both_of_a_pair_are_named() -> None:
    summary = traced("accumulator+remanence").summary
    assert {item["name"] for item in summary["effects"]} == {"accumulator", "remanence"}
    assert summary["further_terms"] == []
    assert summary["after"]["nrmse"] < 0.4 * summary["before"]["nrmse"]


@pytest.mark.planted
@pytest.mark.parametrize("shape", ["unknown-in-time", "unknown-in-place"])
def test_a_shape_of_no_family_stays_unknown(shape: str) -> None:
    summary = traced(shape).summary
    assert summary["effects"] == []
    assert summary["residual"]["structured"]
    assert summary["unexplained"]["structured"]


@pytest.mark.property
def test_the_summary_has_what_the_contract_promises() -> None:
    summary = traced("none").summary
    keys = "model declared_effects noise_floor_nrmse before residual base_form nuisances effects candidates after"
    assert set(keys.split()) | {"ceiling", "unexplained"} <= set(summary)
    assert {"pre_yield", "post_yield", "reversal"} == set(summary["residual"]["where"])
    assert sum(summary["residual"]["where"].values()) == pytest.approx(1.0)
    assert {"gain", "channel_skew_s", "observation_filter_s"} <= set(summary["nuisances"])
