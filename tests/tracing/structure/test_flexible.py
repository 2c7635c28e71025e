"""An effect in all its forms: its variants, and what a further effect explains beyond them."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.candidates import Fitted, Placed, Surroundings, columns_of, scales_of
from mrpipe.tracing.structure.fit import Design, design_of
from mrpipe.tracing.structure.flexible import (
    gain_beyond,
    is_linear,
    linear_amplitudes,
    parts_of,
    projected_variants,
    variants,
)
from mrpipe.tracing.structure.records import frame_data
from tests.tracing.structure.rig import frame_campaign

LIBRARY = all_structural_effects()


@functools.cache
def problem() -> FrameProblem:
    data = frame_data(frame_campaign("cubic-stiffness"))
    return frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)


def design() -> Design:
    return design_of("linear-frame", problem().training)


def about() -> Surroundings:
    return Surroundings(problem().storey_stiffness)


def fitted(name: str, form: int, *numbers: float) -> Fitted:
    effect = LIBRARY[name]
    return Fitted(Placed(effect, effect.forms[form]), np.array(numbers))


def own_columns(item: Fitted) -> np.ndarray:
    return design().project([columns_of(item, record, about()) for record in design().spectra])


@pytest.mark.property
def test_the_variants_are_the_fitted_form_its_starts_and_all_other_forms() -> None:
    friction = fitted("joint-friction", 0, 3e-4)
    found = variants(friction, design())
    assert found[0] is friction
    own = [item for item in found if item.placed.form is friction.placed.form]
    starts = friction.placed.form.searched[0].start_values(scales_of(design().spectra, friction.placed))
    assert [item.numbers[0] for item in own[1:]] == list(starts)
    assert {item.placed.form.name for item in found} == {form.name for form in LIBRARY["joint-friction"].forms}


@pytest.mark.planted
def test_a_form_of_the_same_effect_explains_little_beyond_its_variants() -> None:
    """The planted stiffness has terms of third and fifth degree; a cubic one leaves an error of its form."""
    cubic, power = fitted("cubic-stiffness", 0), fitted("cubic-stiffness", 2, 4.7)
    frame = design()
    alone = gain_beyond(own_columns(cubic), own_columns(power), frame)
    beyond = gain_beyond(projected_variants([cubic], frame, about()), own_columns(power), frame)
    gained = [float(np.sum(without**2) - np.sum(with_it**2)) for without, with_it in (alone, beyond)]
    assert gained[0] > 100.0
    assert gained[1] < 0.2 * gained[0]


@pytest.mark.property
def test_an_oscillating_base_is_linear_and_one_that_lifts_is_not() -> None:
    rocking = LIBRARY["base-rocking"]
    spring, uplift = rocking.forms
    assert is_linear(Placed(rocking, spring), design(), about())
    assert not is_linear(Placed(rocking, uplift), design(), about())
    assert not is_linear(Placed(LIBRARY["yielding"], LIBRARY["yielding"].forms[0]), design(), about())
    lifting = fitted("base-rocking", 1, 40.0, 0.03, 1e-4)
    assert linear_amplitudes(lifting, design().spectra, about()).tolist() == [True, False]
    linear, nonlinear = parts_of(lifting, design(), about())
    assert len(linear) == 1 and len(nonlinear) == 1
