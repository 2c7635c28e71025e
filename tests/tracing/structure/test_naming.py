"""Where an effect of a structure acts, in words, and the values of its parameters by storey."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.structure.base import frame_problem
from mrpipe.tracing.structure.candidates import Fitted, Placed
from mrpipe.tracing.structure.fit import design_of
from mrpipe.tracing.structure.groups import groups_of
from mrpipe.tracing.structure.naming import certain_amplitudes, parameters_of, place_in_words
from mrpipe.tracing.structure.records import frame_data
from mrpipe.tracing.structure.rounds import FrameSelection, projected
from tests.tracing.structure.rig import frame_campaign

pytestmark = pytest.mark.property

ACTING = 0.3


def fitted(name: str, floor: int = 0) -> Fitted:
    effect = all_structural_effects()[name]
    form = min(effect.forms, key=lambda item: len(item.amplitudes))
    return Fitted(Placed(effect, form, floor), np.ones(len(form.searched)), ())


@pytest.mark.parametrize(
    ("name", "floor", "amplitudes", "words"),
    [
        ("joint-friction", 0, [1.0, 0.9, 0.8], "every storey"),
        ("joint-friction", 0, [0.1, 0.9, 0.0], "storey 2"),
        ("joint-friction", 0, [1.0, 0.0, 0.8], "storey 1, 3"),
        ("impact", 2, [1.0, 0.5], "floor 2"),
    ],
)
def test_storeys_with_a_large_amplitude_are_named(name: str, floor: int, amplitudes: list[float], words: str) -> None:
    assert place_in_words(fitted(name, floor), np.array(amplitudes), ACTING) == words


def test_the_typical_amplitude_is_that_of_the_acting_storeys() -> None:
    item = fitted("joint-friction")
    (parameter,) = item.placed.form.amplitudes
    found = parameters_of(item, np.array([4.0, 0.1, 5.0, 6.0]), ACTING)[parameter.name]
    assert found.value == 5.0
    assert found.by_storey == (4.0, 0.1, 5.0, 6.0)
    assert (found.interval.low, found.interval.high) == (0.1, 6.0)


def test_a_frame_with_few_storeys_has_the_largest_amplitude() -> None:
    item = fitted("joint-friction")
    (parameter,) = item.placed.form.amplitudes
    assert parameters_of(item, np.array([4.0, 0.1]), ACTING)[parameter.name].value == 4.0


def test_the_floor_of_an_effect_is_among_its_parameters() -> None:
    assert parameters_of(fitted("impact", 2), np.array([3.0, 1.0]), ACTING)["floor"].value == 2


def test_a_storey_that_hardly_yields_is_not_named_for_an_amplitude_of_noise() -> None:
    """Storey 1 yields, and the drift of storey 3 exceeds the limit in a few samples only."""
    effect = all_structural_effects()["yielding"]
    data = frame_data(frame_campaign("clean"))
    given = frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)
    design = design_of("linear-frame", given.training)
    peaks = np.max([np.abs(item.motion.drift).max(axis=1) for item in given.training], axis=0)
    item = Fitted(Placed(effect, effect.forms[0]), np.array([0.97 * peaks[2]]))
    selection = FrameSelection(
        "linear-frame", design, groups_of(design), {}, storey_stiffness=given.storey_stiffness, chosen=(item,)
    )
    norms = np.linalg.norm(projected(design, (item,), selection.about).reshape(3, -1), axis=1)
    assert norms[2] < 0.1 * norms[0]
    amplitudes = np.array([10.0, 0.0, 2.0]) / norms
    assert amplitudes[2] > 0.25 * amplitudes[0]
    assert place_in_words(item, certain_amplitudes(item, amplitudes, selection), 0.25) == "storey 1"


def test_amplitudes_that_are_all_uncertain_stay() -> None:
    item = fitted("joint-friction")
    data = frame_data(frame_campaign("clean"))
    given = frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)
    design = design_of("linear-frame", given.training)
    selection = FrameSelection("linear-frame", design, groups_of(design), {}, storey_stiffness=given.storey_stiffness)
    amplitudes = np.array([1e-9, 2e-9, 0.0])
    assert np.array_equal(certain_amplitudes(item, amplitudes, selection), amplitudes)
