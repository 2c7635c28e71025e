"""A yield force that levels off with the drive is a law of the base form; a driver that saturates is an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.dampers.library import base_form
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.engine import Fit, fit, start_of
from mrpipe.fitting.problem import Term
from mrpipe.fitting.recordings import record_tests
from mrpipe.fitting.start import base_of, best_fit, first_problem, polynomial_laws
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.bench.rivals.law_rival import without_laws_of_drive
from mrpipe.tracing.bench.rivals.named_effects import NamedEffects
from mrpipe.tracing.bench.rivals.other_base_forms import Unseen
from mrpipe.tracing.bench.selection.select import Selection
from tests.tracing.bench.rig import hysteresis

pytestmark = pytest.mark.planted

RATE = 250.0
TIME = np.arange(int(5.0 * RATE)) / RATE


def campaign(driver: bool) -> list[PreparedTest]:
    """Return sines whose drive varies; the driver saturates sharply, or the yield force alone follows a tanh law."""
    rng = np.random.default_rng(2)
    tests = []
    for number, (size, hertz) in enumerate([(0.6, 0.8), (1.0, 1.0), (0.8, 1.3), (1.0, 1.6), (0.5, 2.0), (0.9, 1.2)]):
        phase = 2.0 * np.pi * hertz * TIME
        x = 0.01 * size * np.sin(phase)
        v = 0.02 * np.pi * hertz * size * np.cos(phase)
        drive = 1.0 + np.sin(2.0 * np.pi * (0.23 + 0.05 * number) * TIME + number)
        used = drive / (1.0 + (drive / 1.1) ** 8) ** (1.0 / 8.0) if driver else drive
        yields = 100.0 * used if driver else 150.0 * np.tanh(drive / 0.7)
        force = yields * hysteresis(x, 4e-4) + (100.0 + 300.0 * used) * v + 0.3 * rng.standard_normal(len(x))
        a = np.gradient(v, 1.0 / RATE)
        tests.append(
            PreparedTest(
                f"{number}", "training", RATE, TIME, x, v, a, drive, force, x, force, np.array([], dtype=np.int64), "A",
            )
        )  # fmt: skip
    return tests


def selected(driver: bool) -> Selection:
    """Return a selection that names saturation."""
    recordings = record_tests(campaign(driver), rate_hz=RATE, cutoff_hz=60.0)
    form = base_form("bouc-wen")
    base = base_of(recordings, form, polynomial_laws(form, 9, 3, 1))
    ground = best_fit(first_problem(recordings, base), starts=1, iterations=10)
    effect = damper_effects()["saturation"]
    fits: list[Fit] = []
    for item in effect.forms:
        problem = replace(ground.problem, terms=(Term(effect, item),))
        start = {parameter.name: 0.6 for parameter in item.searched}
        fits.append(fit(problem, start_of(problem, ground.base_values, [start]), iterations=25))
    chosen = min(fits, key=lambda item: item.chi_square)
    return Selection(ground, 1e-6, (), chosen, proven=1, ground=ground)


def outcome(driver: bool) -> tuple[Selection, Selection, str]:
    """Return the selection before and after the comparison, and the reason."""
    before = selected(driver)
    unseen = Unseen(4, 100, np.random.default_rng(3))
    after = without_laws_of_drive(NamedEffects(before, (None,), declared=0), unseen)
    assert len(after.gains) == after.selection.proven
    return before, after.selection, after.reason


def test_a_law_of_the_yield_force_that_saturates_takes_the_place_of_the_effect() -> None:
    before, after, reason = outcome(driver=False)
    assert after.chosen.problem.terms == () and after.proven == 0
    assert after.chosen.problem.base.laws[0].saturates
    assert after.chosen.chi_square < before.chosen.chi_square
    assert "levels off with the drive" in reason


def test_a_driver_that_saturates_stays_an_effect() -> None:
    before, after, reason = outcome(driver=True)
    assert after is before
    assert reason == ""
