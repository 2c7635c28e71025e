"""Where an effect of a structure acts, in words, and the values of its parameters by storey."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.structure.candidates import Fitted, Placed
from mrpipe.tracing.structure.naming import parameters_of, place_in_words

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
