"""Another base form is no effect, and an effect is named under the right base form."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.options import TracingOptions
from tests.tracing.bench.sines import sines


@functools.cache
def traced(effect: str) -> dict[str, Any]:
    options = TracingOptions(
        refits=2, bootstrap_draws=50, yield_order=2, most_effects=1, observation_filter=False,
        base_forms=("bouc-wen", "dahl", "modified-bouc-wen"),
    )  # fmt: skip
    library = {name: damper_effects()[name] for name in ("accumulator", "migration", "stribeck")}
    return trace_campaign(sines(effect), library, [], options, rng=np.random.default_rng(1)).summary


@pytest.mark.planted
def test_a_damper_of_another_published_form_has_no_effect() -> None:
    # Dahl's law looks like a late rise under the declared form
    found = traced("dahl")
    assert found["verdict_class"] == "base form"
    assert found["effects"] == []
    form = found["base_form"]
    assert form["declared"] == "bouc-wen"
    assert form["taken"] == "dahl"
    assert form["nrmse"]["dahl"] < 0.6 * form["nrmse"]["bouc-wen"]
    assert found["after"]["nrmse"] < 1.25 * found["noise_floor_nrmse"]


@pytest.mark.planted
def test_an_effect_on_a_damper_of_another_form_is_named_alone() -> None:
    found = traced("dahl+accumulator")
    assert [item["name"] for item in found["effects"]] == ["accumulator"]
    assert found["base_form"]["taken"] == "dahl"
    assert found["effects"][0]["parameters"]["stiffness"]["value"] == pytest.approx(1400.0, rel=0.15)
    assert found["after"]["nrmse"] < 1.25 * found["noise_floor_nrmse"]


@pytest.mark.planted
def test_the_declared_form_is_kept_where_no_other_is_better() -> None:
    found = traced("accumulator")
    assert [item["name"] for item in found["effects"]] == ["accumulator"]
    assert found["base_form"]["taken"] == "bouc-wen"
    assert found["verdict_class"] == "explained"
