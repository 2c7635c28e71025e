"""A named effect takes a richer form where the plain one leaves more than noise, and only there."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.tracing.options import TracingOptions
from tests.tracing.bench.rig import campaign

FORMS = ("bouc-wen", "dahl", "hyperbolic-tangent")


@functools.cache
def traced(effect: str) -> Tracing:
    options = TracingOptions(base_forms=FORMS, refits=2, bootstrap_draws=100, most_effects=1)
    library = {name: damper_effects()[name] for name in ("end-stop", "accumulator")}
    return trace_campaign(campaign(effect), library, [], options, rng=np.random.default_rng(1))


@pytest.mark.planted
def test_a_contact_of_another_power_is_followed_to_the_noise() -> None:
    summary = traced("soft-stop").summary
    (found,) = summary["effects"]
    assert (found["name"], found["form"]) == ("end-stop", "contact")
    assert found["parameters"]["exponent"]["value"] == pytest.approx(1.5, rel=0.1)
    assert found["parameters"]["free_travel"]["value"] == pytest.approx(7.5e-3, rel=0.02)
    assert summary["after"]["nrmse"] < 1.25 * summary["noise_floor_nrmse"]
    # the ranking is that of the plain forms, by which the effect was named
    assert "contact" not in {item["form"] for item in summary["candidates"]}


@pytest.mark.planted
def test_a_plain_form_that_fits_stays() -> None:
    (found,) = traced("end-stop").summary["effects"]
    assert found["name"] == "end-stop"
    assert found["form"] != "contact"
