"""Which stages a loop needs, by its damper and its inverse."""

from __future__ import annotations

from typing import Any

import pytest

from mrpipe.config.model import config_model
from mrpipe.pipeline.loop_inputs import LOOP_INPUTS, variant_for_dampers
from mrpipe.pipeline.stage import Stage

pytestmark = pytest.mark.property

STAGE = Stage("loop", "runs", lambda _: {}, inputs=("identify-frame", "calibrate"), conditional_inputs=LOOP_INPUTS)


def _inputs(damper: str, inverse: str) -> tuple[str, ...]:
    simulate = {"damper": damper, "controller": {"inverse": inverse}}
    return STAGE.for_configuration(config_model().model_validate({"simulate": simulate})).inputs[2:]


def test_inputs_follow_from_damper_and_inverse() -> None:
    assert _inputs("set-c", "model") == ()
    assert _inputs("identified", "model") == ("identify-damper",)
    assert _inputs("identified", "network") == ("identify-damper", "train-inverse")
    assert _inputs("traced", "model") == ("identify-damper", "close-loop")


def _variant(dampers: list[dict[str, Any]], damper: str) -> Stage | None:
    structure = {"storeys": [{"mass_kg": 1.0, "stiffness_n_m": 10.0}], "dampers": dampers}
    return variant_for_dampers(
        STAGE, config_model().model_validate({"structure": structure, "calibrate": {"damper": damper}})
    )


def test_several_dampers_read_the_identified_one_only_if_one_of_them_is_it() -> None:
    first, own = {"between": [1, "ground"]}, {"between": [1, "ground"], "damper": "set-c", "name": "second"}
    assert _variant([], "identified") is None
    assert _variant([first], "set-c") is STAGE
    with_damper = ("identify-frame", "identify-damper", "calibrate")
    for dampers, damper in (([first], "identified"), ([own, {**first, "damper": "identified"}], "set-c")):
        found = _variant(dampers, damper)
        assert found is not None and found.inputs == with_damper
    found = _variant([own], "identified")
    assert found is not None and found.inputs == STAGE.inputs
