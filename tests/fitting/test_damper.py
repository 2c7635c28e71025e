"""A fit becomes a damper that gives the force of the fit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.form_fit import FitMethod, FormFit, fit_form
from tests.dampers.planted import bench_test
from tests.fitting.test_form_fit import problem_of

pytestmark = pytest.mark.planted


@pytest.fixture(scope="module")
def fitted() -> FormFit:
    """Return a fit to tests of set C at constant drive, which do not determine the lag of the driver."""
    tests = [
        bench_test(f"t{place}", "training", 8e-3, 1.5, level, seed=place) for place, level in enumerate((0.0, 2.0, 4.0))
    ]
    return fit_form(problem_of(tests, orders=(2, 1)), FitMethod(starts=1, iterations=15), drive_unit="A")


def test_the_numbers_of_form_and_laws_are_those_of_the_fit(fitted: FormFit) -> None:
    found = damper_model(fitted.fit, "A")
    assert found.form == "bouc-wen" and found.drive_unit == "A" and found.effects == ()
    assert {name: found.parameters[name] for name in fitted.fit.base_values} == fitted.fit.base_values
    first = fitted.fit.laws[0]
    assert [found.parameters[f"yield_force_{letter}"] for letter in "abc"] == pytest.approx(list(first.numbers))
    assert found.drive_limit == pytest.approx(4.0) and found.stroke_m == pytest.approx(8e-3, rel=0.01)


def test_a_lag_that_the_tests_do_not_determine_is_assumed_or_left_out(fitted: FormFit) -> None:
    assert damper_model(fitted.fit, "A", assumed_eta=70.0).parameters["eta"] == 70.0
    assert "eta" not in damper_model(fitted.fit, "A", assumed_eta=math.inf).parameters


def test_the_damper_gives_the_planted_force(fitted: FormFit) -> None:
    found = damper_model(fitted.fit, "A", assumed_eta=math.inf)
    truth = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    speed = np.array([0.02, 0.05, 0.07])
    for drive in (0.0, 2.0, 4.0):
        assert found.quasi_static_force(speed, drive) == pytest.approx(truth.quasi_static_force(speed, drive), rel=0.04)
