"""The verdicts on frame, command and damper become one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrpipe.campaigns.model import Recording
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.structure.parts import OF_PART, Part, command_part, merged

pytestmark = pytest.mark.property

EFFECTS = all_structural_effects()
RATE = 200.0


def _part(name: str, *effects: str, structured: bool = False) -> Part:
    summary: dict[str, Any] = dict.fromkeys(OF_PART)
    summary |= {
        "effects": [{"name": effect} for effect in effects],
        "verdict": f"{' and '.join(effects) or 'nothing'}",
        "unexplained": {"structured": structured, "of": name},
    }
    return Part(name, summary)


def test_the_part_that_names_an_effect_comes_first() -> None:
    found = merged([_part("frame"), _part("command", structured=True), _part("damper", "remanence")])
    assert found["part"] == "damper"
    assert found["effects"] == [{"name": "remanence"}]
    assert found["verdict"] == "damper: remanence; command: nothing; frame: nothing"
    assert list(found["parts"]) == ["frame", "command", "damper"]
    assert set(found["parts"]["frame"]) == set(OF_PART)


def test_tied_effects_of_a_part_that_is_not_the_first_are_kept() -> None:
    tied = {"effects": ["impact", "yielding"], "separating_tests": []}
    frame = Part("frame", {**_part("frame", structured=True).summary, "tied": tied})
    found = merged([frame, _part("damper", "remanence")])
    assert found["part"] == "damper" and found["tied"] == tied == found["parts"]["frame"]["tied"]
    assert merged([_part("frame")])["tied"] is None


def test_effects_of_all_parts_are_listed() -> None:
    found = merged([_part("frame", "impact"), _part("command", "controller-delay")])
    assert [item["name"] for item in found["effects"]] == ["impact", "controller-delay"]
    assert found["part"] == "frame"


def test_without_a_name_the_part_that_misses_something_speaks() -> None:
    found = merged([_part("frame"), _part("damper", structured=True)])
    assert found["part"] == "damper" and found["unexplained"]["of"] == "damper"
    assert merged([_part("frame"), _part("damper")])["unexplained"]["of"] == "frame"


def _loop(delay_s: float, name: str, level: float) -> Recording:
    time = np.arange(int(20.0 * RATE)) / RATE

    def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = 8e-3 * np.sin(8.0 * t) + 2e-3 * np.sin(21.0 * t)
        return level * x, level * (0.064 * np.cos(8.0 * t) + 0.042 * np.cos(21.0 * t))

    x, v = motion(time)
    desired = 650.0 * v + 300.0 * x
    shifted = np.interp(time - delay_s, time, desired)
    drive = np.where(np.abs(shifted) > 18.0, np.sqrt(np.abs(shifted)) / 3.0, 0.0)
    channels = {"damper_displacement": x, "damper_velocity": v, "drive": drive, "desired_force": desired}
    details = {"law": "vd", "controller_rate_hz": RATE}
    return Recording(name, "training", RATE, time, channels, ((0, time.size),), "loop", details)


def _loops(delay_s: float) -> list[Recording]:
    return [_loop(delay_s, name, level) for name, level in (("a", 1.0), ("b", 0.7))]


def test_a_late_command_is_named_with_its_time() -> None:
    found = command_part(_loops(0.03), EFFECTS, ())
    assert found is not None and found.named and not found.unexplained
    (effect,) = found.summary["effects"]
    assert effect["name"] == "controller-delay" and effect["corrected_in"] == "controller"
    low, high = effect["parameters"]["time"]["interval"]
    assert 0.0 <= low <= effect["parameters"]["time"]["value"] <= high
    assert found.summary["after"]["nrmse"] < found.summary["before"]["nrmse"]
    assert found.summary["verdict"].startswith("controller-delay: explains")


def test_a_command_in_time_is_noise() -> None:
    found = command_part(_loops(0.0), EFFECTS, ())
    assert found is not None and not found.named
    assert found.summary["verdict"] == "command and motion agree" and found.summary["verdict_class"] == "noise"


def test_a_declared_delay_and_tests_without_a_command_are_not_judged() -> None:
    assert command_part(_loops(0.03), EFFECTS, ("controller-delay",)) is None
    bare = [Recording("a", "training", RATE, np.arange(10) / RATE, {"damper_displacement": np.zeros(10)}, ((0, 10),))]
    assert command_part(bare, EFFECTS, ()) is None
