"""Mistakes that make results wrong without an error anywhere: `check` names each, with the test that holds it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.campaigns.plausibility import TestArrays
from tests.campaigns.plausibility.rig import sound_tests
from tests.cli.test_check import checked, project

Change = Callable[[list[TestArrays]], list[TestArrays]]
ODD = 4
"""Place of the test that holds the mistake."""


def _each(**change: Callable[[Any], Any]) -> Change:
    return lambda tests: [
        replace(test, **{name: by(getattr(test, name)) for name, by in change.items()}) for test in tests
    ]


def _one(**change: Callable[[Any], Any]) -> Change:
    return lambda tests: [*tests[:ODD], *_each(**change)(tests[ODD : ODD + 1]), *tests[ODD + 1 :]]


def _exchanged(test: TestArrays) -> TestArrays:
    return replace(test, displacement_m=1e-3 * test.force_n, force_n=1e3 * test.displacement_m)


def _exchanged_in(only: int | None) -> Change:
    return lambda tests: [_exchanged(test) if only in (None, index) else test for index, test in enumerate(tests)]


def _held(values: np.ndarray) -> np.ndarray:
    return np.where(np.arange(values.size) // 400 == 3, values[1200], values)


def _spiked(values: np.ndarray) -> np.ndarray:
    return np.where(np.arange(values.size) == 1700, 0.5, values)


def _copied(tests: list[TestArrays]) -> list[TestArrays]:
    source = next(test for test in tests if test.role == "training")
    return [replace(source, name=test.name, role=test.role) if test.role == "validation" else test for test in tests]


def _cut(test: TestArrays) -> TestArrays:
    channels = ("time_s", "displacement_m", "drive", "force_n")
    return replace(test, **{name: getattr(test, name)[:50] for name in channels})


MISTAKES: dict[str, tuple[Change, int, str]] = {
    "mm as m": (_each(displacement_m=lambda x: 1e3 * x), 1, "correct the unit of displacement"),
    "kN as N": (_each(force_n=lambda f: 1e-3 * f), 1, "correct the unit of force"),
    "mA as A": (_each(drive=lambda i: 1e3 * i), 1, "correct the unit of drive"),
    "ms as s": (_each(time_s=lambda t: 1e3 * t), 1, "correct the unit of time"),
    "s as ms": (_each(time_s=lambda t: 1e-3 * t), 1, "correct the unit of time"),
    "one test in kN": (_one(force_n=lambda f: 1e-3 * f), 1, "test T4, force: force looks 1000 times too small"),
    "one test in mm": (_one(displacement_m=lambda x: 1e3 * x), 1, "test T4, displacement: displacement looks 1000"),
    "one drive in mA": (_one(drive=lambda i: 1e3 * i + 500.0), 1, "test T4, drive: drive looks 1000 times too large"),
    "columns exchanged": (_exchanged_in(None), 1, "displacement and force look exchanged"),
    "columns of one test": (_exchanged_in(ODD), 1, "test T4, displacement: displacement and force look exchanged"),
    "sign of one test": (_one(force_n=lambda f: -f), 1, "test T4, force: force or displacement has the opposite sign"),
    "gain of one test": (_one(force_n=lambda f: 1.4 * f), 0, "test T4, force: force is 1."),
    "dead load cell": (_one(force_n=lambda f: 0.0 * f), 1, "test T4, force: has the same value in all"),
    "dead load cell everywhere": (_each(force_n=lambda f: 0.0 * f + 37.0), 1, "force: has the same value in all"),
    "stuck displacement": (_one(displacement_m=_held), 1, "test T4, displacement: repeats one value for"),
    "saturated force": (_one(force_n=lambda f: np.clip(f, -10.0, 10.0)), 0, "test T4: force looks clipped"),
    "spike": (_one(displacement_m=_spiked), 1, "test T4, displacement: has"),
    "validation is training": (_copied, 1, "the validation error would be that of samples the model was fitted to"),
    "one drive only": (_each(drive=lambda i: 0.0 * i + 1.0), 0, "no inverse model is possible"),
    "too short": (lambda tests: [*tests[:ODD], _cut(tests[ODD]), *tests[ODD + 1 :]], 1, "test T4"),
}
"""Mistake -> what it does to the tests, the exit status of `check`, and what `check` prints."""


@pytest.mark.planted
@pytest.mark.parametrize("mistake", MISTAKES)
def test_check_names_the_mistake(mistake: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change, expected, sentence = MISTAKES[mistake]
    config = project(tmp_path, change(sound_tests(8)))
    file = tmp_path / "data" / "campaign.yaml"
    # the clock is that of the files alone, as in most laboratories
    file.write_text(re.sub(r"(?m)^sampling_rate_hz:.*\n", "", file.read_text(encoding="utf-8")), encoding="utf-8")
    status, out, _ = checked(capsys, str(config))
    assert status == expected and sentence in out, out


@pytest.mark.planted
def test_check_names_what_the_campaign_file_says_wrongly(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = checked(capsys, str(project(tmp_path, declared_effects=["backlsh"])))
    assert status == 2 and "unknown effect 'backlsh'; did you mean backlash?" in err
    status, _, err = checked(capsys, str(project(tmp_path, bench="null", frame="data")))
    assert status == 2 and "names a damper-bench campaign" in err and "name it under campaigns.bench" in err
