"""Each demand on an effect file catches the fault that it is for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from mrpipe.artifacts import FloatArray
from mrpipe.cli import run
from mrpipe.dampers.plant import FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step, build_chain
from mrpipe.effects.checks import checks_of
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape, strength
from mrpipe.effects.file_checks import check_file
from mrpipe.effects.library import all_effects, damper_effects
from mrpipe.effects.trials import SIZES, motion_of, tried_twice
from mrpipe.errors import UserError

EXAMPLE = Path(__file__).resolve().parents[2] / "docs/examples/seal_squeeze.py"


@njit(STEP_SIGNATURE)
def linear(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    wire[FORCE] += parameters[0] * wire[VELOCITY]


@njit(STEP_SIGNATURE)
def squared(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    wire[FORCE] += parameters[0] ** 2 * wire[VELOCITY]


@njit(STEP_SIGNATURE)
def shifted(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    wire[FORCE] += parameters[0] * wire[VELOCITY] if parameters[0] != 0.0 else 1.0


@njit(STEP_SIGNATURE)
def remembering(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    parameters[0] += wire[VELOCITY]
    wire[FORCE] += parameters[0]


@njit(STEP_SIGNATURE)
def beyond(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    state[0] = wire[VELOCITY]
    wire[FORCE] += parameters[0] * state[0]


@njit(STEP_SIGNATURE)
def dividing(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    wire[FORCE] += parameters[0] * wire[VELOCITY] / abs(wire[VELOCITY])


@njit(STEP_SIGNATURE)
def growing(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    wire[FORCE] += parameters[0] * wire[VELOCITY] * np.exp(1e4 * abs(wire[VELOCITY]))


def driving(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    wire[FORCE] += parameters[0] * wire[VELOCITY]


NUMBER = amplitude("number", "N*s/m", "force per speed", "force/speed")
FORM = EffectForm("plain", "F = c v", (NUMBER,), lambda values: _one(linear)(values), {"number": 0}, dissipative=True)
GOOD = Effect(
    "own", "a viscous force", "oil", "change the oil", "own", "force", (FORM,),
    separated_by={"offset": Separation("constant drives", ("constants",))},
)  # fmt: skip


def _one(function: object, sign: float = 1.0, states: int = 0):  # type: ignore[no-untyped-def]
    def steps(values: Values) -> list[Step]:
        return [Step("one", Phase.FORCE_EFFECT, function, np.array([sign * values["number"]]), states)]

    return steps


def _with(**changes: object) -> Effect:
    return replace(GOOD, forms=(replace(FORM, **changes),))  # type: ignore[arg-type]


def _searched(unit: str = "s", low: float = 0.1, high: float = 10.0, start: float = 1.0, scale: str = "one") -> Effect:
    return _with(parameters=(NUMBER, shape("time", unit, "a time", scale, low, high, (start,))))


FAULTS = {
    "text": (replace(GOOD, physics=" "), "empty: physics"),
    "needs": (replace(GOOD, needs=("wind",)), "unknown needs: wind (known: varying-drive,"),  # type: ignore[arg-type]
    "rival": (replace(GOOD, separated_by={"ofset": Separation("x")}), "unknown effects: ofset (did you mean offset?)"),
    "kind": (
        replace(GOOD, separated_by={"offset": Separation("x", ("kick",))}),  # type: ignore[arg-type]
        "kick (against offset)",
    ),
    "prose": (replace(GOOD, separated_by={"offset": "constant drives"}), "no Separation"),  # type: ignore[dict-item]
    "no form": (replace(GOOD, forms=()), "there is no form"),
    "names": (replace(GOOD, forms=(FORM, FORM)), "used twice: plain"),
    "unit": (_searched(unit="furlonk"), "'furlonk' is not a unit"),
    "scale": (_searched(scale="size"), "'size' is not a product of"),
    "order": (_searched(low=3.0, high=2.0), "is not below the upper bound"),
    "start": (_searched(start=20.0), "starts outside the bounds"),
    "logarithm": (_searched(low=-1.0), "must be above 0"),
    "strength": (
        _with(parameters=(NUMBER, strength("share", "1", "a share", "one", 0.1, 1.0, 0.2))),
        "0 must lie within its bounds",
    ),
    "amplitude": (_with(amplitude_steps={}), "amplitude_steps names []"),
    "place": (_with(amplitude_steps={"number": 3}), "one of the 1 steps"),
    "not compiled": (_with(steps=_one(driving)), "is not compiled"),
    "no list": (_with(steps=lambda values: None), "list of Step"),
    "too many": (_with(steps=lambda values: 20 * _one(linear)(values)), "too many for a chain"),
    "failing": (_with(steps=lambda values: {}["x"]), "KeyError: 'x'"),
    "beyond": (_with(steps=_one(beyond)), "beyond its memory (state_size 0"),
    "remembering": (_with(steps=_one(remembering)), "writes into its parameters"),
    "not finite": (_with(steps=_one(growing)), "not finite in motion"),
    "dividing by 0": (_with(steps=_one(dividing)), "ZeroDivisionError"),
    "without effect": (_with(steps=_one(linear, 0.0)), "the force stays the same"),
    "left over": (_with(steps=_one(shifted)), "the force changes by 1 N"),
    "not linear": (_with(steps=_one(squared)), "differs from twice the force"),
    "feeding": (_with(steps=_one(linear, -1.0)), "feeds"),
}  # fmt: skip


@pytest.mark.property
def test_a_sound_effect_meets_all() -> None:
    assert [item.failure for item in checks_of(GOOD, list(all_effects())) if not item.passed] == []


@pytest.mark.planted
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_and_named(fault: str) -> None:
    effect, words = FAULTS[fault]
    failures = [item.failure for item in checks_of(effect, list(all_effects())) if not item.passed]
    assert len(failures) == 1, failures
    assert words in failures[0]
    assert "\n" not in failures[0]


@pytest.mark.planted
def test_a_step_that_remembers_outside_its_state_is_seen_where_it_is_done_twice() -> None:
    for function, equal in ((linear, True), (remembering, False)):
        first, again = tried_twice(
            build_chain([*SIZES[0].base, *_one(function)({"number": 1.0})]), SIZES[0], motion_of(SIZES[0])
        )
        assert (first == again) is equal


@pytest.mark.property
def test_the_free_play_of_a_joint_depends_on_its_state_alone() -> None:
    steps = damper_effects()["backlash"].form("free").steps({"gap": 1e-3})
    first, again = tried_twice(build_chain([*SIZES[0].base, *steps]), SIZES[0], motion_of(SIZES[0]))
    assert first == again


@pytest.mark.property
def test_the_example_of_the_documentation_meets_every_demand(capsys: pytest.CaptureFixture[str]) -> None:
    # the second time its compiled steps come from the cache
    assert run(["check-effect", str(EXAMPLE)]) == 0
    capsys.readouterr()
    assert run(["check-effect", str(EXAMPLE), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["passed"]
    assert (document["effect"], document["rig"], document["forms"]) == ("seal-squeeze", "damper", ["proportional"])
    page = EXAMPLE.parents[1] / "write-an-effect.md"
    assert EXAMPLE.read_text(encoding="utf-8") in page.read_text(encoding="utf-8")


@pytest.mark.planted
def test_an_unmet_demand_ends_with_status_1_and_a_missing_file_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.py"
    own.write_text(EXAMPLE.read_text(encoding="utf-8").replace("parameters[0] * abs(", "-parameters[0] * abs("))
    assert run(["check-effect", str(own)]) == 1
    captured = capsys.readouterr()
    assert "FAILED  proportional: No energy is fed in" in captured.out
    assert "1 of 13 demands are not met" in captured.err
    assert run(["check-effect", str(own), "--json"]) == 1
    assert not json.loads(capsys.readouterr().out)["passed"]
    assert run(["check-effect", str(tmp_path / "none.py")]) == 2
    assert "no such file" in capsys.readouterr().err


@pytest.mark.property
def test_a_file_of_a_structure_and_one_without_effect(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text("from mrpipe.effects.structural.impact import EFFECT\n")
    effect, checks = check_file(own)
    assert [item.failure for item in checks if not item.passed] == [
        "'impact' is already the name of an effect of the program"
    ]
    assert effect.name == "impact"
    own.write_text("EFFECT = 3\n")
    with pytest.raises(UserError, match="EFFECT: is of the type int; define EFFECT"):
        check_file(own)
