"""Planted effects, in forms that the library does not hold, are named; a clean rig and an unknown shape are not."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from mrpipe.dampers.forms import biviscous
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.recordings import record_tests
from mrpipe.fitting.start import best_fit, first_problem
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.noise.baseline import declared_base
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.tracing.options import TracingOptions
from tests.tracing.bench.rig import campaign

FORMS = ("bouc-wen", "dahl", "hyperbolic-tangent")


@functools.cache
def traced(effect: str) -> Tracing:
    # each base form is combined with every form of remanence, which takes most of the time of this test
    forms = FORMS[:2] if effect == "remanence" else FORMS
    options = TracingOptions(base_forms=forms, refits=2, bootstrap_draws=100, most_effects=1 + effect.count("+"))
    single = ("accumulator", "backlash", "channel-skew", "heating", "inertia", "remanence", "stribeck")
    names = ("accumulator", "backlash", "stribeck") if "+" in effect else single
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
@pytest.mark.parametrize("names", [(), ("accumulator",)])
def test_a_library_without_further_effects_ends_the_search(names: tuple[str, ...]) -> None:
    library = {name: damper_effects()[name] for name in names}
    options = TracingOptions(base_forms=("bouc-wen",), refits=2, bootstrap_draws=100, most_effects=2)
    found = trace_campaign(campaign("accumulator"), library, [], options, rng=np.random.default_rng(1)).summary
    assert [item["name"] for item in found["effects"]] == list(names)
    assert found["residual"]["structured"]
    if not names:
        assert "no effect of the library" in found["verdict"]


@pytest.mark.planted
def test_a_clean_rig_lacks_nothing() -> None:
    summary = traced("none").summary
    assert summary["effects"] == []
    assert not summary["residual"]["structured"]
    assert not summary["unexplained"]["structured"]
    assert summary["before"]["nrmse"] < 1.25 * summary["noise_floor_nrmse"]


@pytest.mark.planted
def test_both_of_a_pair_are_named() -> None:
    summary = traced("accumulator+backlash").summary
    assert {item["name"] for item in summary["effects"]} == {"accumulator", "backlash"}
    assert summary["further_terms"] == []
    assert summary["after"]["nrmse"] < 0.4 * summary["before"]["nrmse"]


@pytest.mark.planted
@pytest.mark.parametrize("shape", ["unknown-in-time", "unknown-in-place"])
def test_a_shape_of_no_family_stays_unknown(shape: str) -> None:
    summary = traced(shape).summary
    assert summary["effects"] == []
    assert summary["residual"]["structured"]
    assert summary["unexplained"]["structured"]


def traced_with(effect: str, names: tuple[str, ...], tests: list[PreparedTest] | None = None) -> Tracing:
    options = TracingOptions(base_forms=FORMS, refits=2, bootstrap_draws=100, most_effects=2)
    library = {name: damper_effects()[name] for name in names}
    return trace_campaign(tests or campaign(effect), library, [], options, rng=np.random.default_rng(1))


@pytest.mark.planted
def test_a_hysteresis_of_another_shape_is_a_base_form_and_no_effect() -> None:
    # Dahl's law under a declared exponent of 2 looks like a late rise
    summary = traced_with("dahl", ("migration", "accumulator")).summary
    assert summary["effects"] == []
    assert summary["base_form"]["taken"] == "dahl"
    assert summary["after"]["nrmse"] < 0.4 * summary["before"]["nrmse"]
    assert not summary["unexplained"]["structured"]
    assert "base form" in summary["verdict"]


@pytest.mark.planted
def test_a_stop_on_one_side_is_named_beside_another_effect() -> None:
    summary = traced_with("accumulator+end-stop", ("accumulator", "end-stop", "inertia")).summary
    found = {item["name"]: item for item in summary["effects"]}
    assert set(found) == {"accumulator", "end-stop"}
    assert found["end-stop"]["parameters"]["free_travel"]["value"] == pytest.approx(8.2e-3, rel=0.06)


@pytest.mark.planted
def test_offsets_of_tests_are_told_beside_an_unknown_rest() -> None:
    shifts = np.random.default_rng(3).normal(0.0, 40.0, 20)
    tests = [
        replace(test, force_offset_n=shift) for test, shift in zip(campaign("unknown-in-time"), shifts, strict=False)
    ]
    summary = traced_with("", ("accumulator", "offset"), tests).summary
    assert [item["name"] for item in summary["effects"]] == ["offset"]
    assert summary["unexplained"]["structured"]


@pytest.mark.planted
def test_play_under_a_rounded_yield_is_named_and_the_yield_is_the_base_form() -> None:
    options = TracingOptions(
        base_forms=("bouc-wen", "rounded-yield"), refits=2, bootstrap_draws=50, most_effects=2,
        model_error_share=0.1, fit_rate_hz=125.0,
    )  # fmt: skip
    library = {"backlash": damper_effects()["backlash"]}
    tests = campaign("rounded+wide-backlash")[1:13:2] + campaign("rounded+wide-backlash")[11:13]
    summary = trace_campaign(tests, library, [], options, rng=np.random.default_rng(1)).summary
    assert [item["name"] for item in summary["effects"]] == ["backlash"]
    assert summary["base_form"]["taken"] == "rounded-yield"
    # play and roundness of the yield trade off, so the gap is known less well than the name
    assert summary["effects"][0]["parameters"]["gap"]["value"] == pytest.approx(6e-4, rel=0.25)


@pytest.mark.property
def test_the_summary_has_what_the_contract_promises() -> None:
    summary = traced("none").summary
    keys = "model declared_effects noise_floor_nrmse before residual base_form nuisances effects candidates after"
    assert set(keys.split()) | {"ceiling", "unexplained"} <= set(summary)
    assert {"pre_yield", "post_yield", "reversal"} == set(summary["residual"]["where"])
    assert sum(summary["residual"]["where"].values()) == pytest.approx(1.0)
    assert {"gain", "channel_skew_s", "observation_filter_s"} <= set(summary["nuisances"])


@pytest.mark.property
def test_a_declared_base_form_is_no_effect() -> None:
    training = record_tests(campaign("none")[:4], rate_hz=125.0)
    base = declared_base(training, "rate-dependent-yield", 3, 1)
    assert base.name == "yielding-part"


@pytest.mark.property
def test_a_form_of_the_users_own_file_is_declared_and_carried_into_the_damper(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    source = Path(biviscous.__file__).read_text(encoding="utf-8").replace('name="biviscous"', 'name="mine"')
    path.write_text(source, encoding="utf-8")
    options = TracingOptions(form_files=(path,), model="mine")
    training = record_tests(campaign("none")[:4], rate_hz=125.0)
    base = declared_base(training, options.model, 1, 0, options.form_files)
    damper = damper_model(best_fit(first_problem(training, base), starts=1, iterations=2), "A")
    assert (damper.form, damper.form_file) == ("mine", str(path))
    assert damper.base.name == "mine"
    with pytest.raises(ValidationError, match="no base form 'mine'"):
        TracingOptions(model="mine")
