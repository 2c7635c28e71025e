"""The public recordings: the errors that a prototype found on them, and what they ask of a model form."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrpipe.artifacts import config_directory
from mrpipe.campaigns import load_campaign
from mrpipe.dampers.library import base_form
from mrpipe.fitting.comparison import FitOptions, compare_forms
from mrpipe.fitting.form_fit import FitMethod
from mrpipe.fitting.samples import smooth_motion
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import prepare_campaign


def judged_forms(name: str, forms: tuple[str, ...]):
    campaign = load_campaign(config_directory() / "campaigns" / f"{name}.yaml")
    prepared = prepare_campaign(campaign, PreparationOptions())
    tests = smooth_motion([item.test for item in prepared.tests])
    options = FitOptions(FitMethod(starts=1), maximum_samples=15_000)
    judged = compare_forms([base_form(form) for form in forms], tests, options, keep=forms).judged
    return {item.fit.form.name: item for item in judged}


@pytest.mark.real
@pytest.mark.parametrize(("name", "bouc_wen"), [("labcontrol", 0.153), ("dyke", 0.186)])
def test_held_out_errors_are_those_of_the_prototype_and_yield_rounds_with_speed(public_data: Path, name, bouc_wen):
    judged = judged_forms(name, ("bouc-wen", "bingham", "rounded-yield"))
    found = judged["bouc-wen"].validation.nrmse
    assert found == pytest.approx(bouc_wen, rel=0.08)
    # the lack that every real recording shows: yield that rounds with velocity
    assert judged["rounded-yield"].validation.nrmse < 0.9 * found
    # without hysteresis the error is larger, although this form rounds its yield with speed, too
    assert judged["bingham"].validation.nrmse > 1.25 * found


@pytest.mark.real
def test_the_lag_of_a_voltage_driven_damper_is_told_where_the_voltage_switches(public_data: Path):
    judged = judged_forms("dyke", ("bouc-wen",))
    fit = judged["bouc-wen"].fit
    assert fit.fit.problem.base.lag_known
    # some 10 ms from command to force, as the switching recording shows to the eye
    assert 60.0 < fit.model.parameters["eta"] < 250.0
    assert fit.model.drive_unit == "V"
