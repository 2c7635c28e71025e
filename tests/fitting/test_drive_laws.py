"""The law of the drive: which is chosen, that it holds between the levels, and that none is negative."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.dampers.drive import coefficients
from mrpipe.dampers.laws import KINDS, Law, LawShape, law_names, law_of, saturation
from mrpipe.dampers.library import base_form
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import VISCOSITY, YIELD_FORCE, build_chain, run_chain
from mrpipe.fitting.drive_laws import adequate_laws, choose_laws
from mrpipe.fitting.samples import bench_recordings
from mrpipe.fitting.start import base_of, best_fit, distinct_levels, first_problem, polynomial_laws
from tests.dampers.planted import bench_test

SHAPES = [LawShape("polynomial", k) for k in range(4)] + [LawShape("monotone", k) for k in range(6)]
SHAPES += [LawShape(kind) for kind in ("tanh", "langevin", "froehlich")]
BASE = {"yield_displacement": 4e-4, "gamma_share": 0.5, "c0_a": 60.0, "c0_b": 20.0}
TANH = Law("tanh", (15.0, 160.0, 0.5))


def recorded_at(levels, law, *, noise=0.3, exact=True):
    """Sines at constant drives of a damper whose yield force follows a law."""
    tests = []
    for place, level in enumerate(levels):
        damper = DamperModel("bouc-wen", {**BASE, "yield_force_a": float(law(level))}, "A")
        for amplitude, frequency in ((6e-3, 1.0), (9e-3, 1.7)):

            def force(x, v, u, times, damper=damper):
                return damper.force(x, v, 0.0 * x, u, 1e-3)

            seed = 10 * place + len(tests)
            test = bench_test(f"{seed}", "training", amplitude, frequency, level, force, noise=(0.0, noise), seed=seed)
            omega = 2 * np.pi * frequency
            position = amplitude * np.sin(omega * test.time_s)
            tests.append(replace(test, displacement_m=position, velocity_m_s=omega * np.roll(position, 0) * 0.0))
            tests[-1] = replace(tests[-1], velocity_m_s=amplitude * omega * np.cos(omega * test.time_s))
    return tests


def fitted(levels, law, orders=(3, 1)):
    recordings = bench_recordings(recorded_at(levels, law), maximum_samples=6000, raw_force=True)
    form = base_form("bouc-wen")
    laws = polynomial_laws(form, distinct_levels(recordings), *orders)
    return best_fit(first_problem(recordings, base_of(recordings, form, laws)), starts=1)


@pytest.mark.property
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
@given(st.lists(st.floats(0.0, 10.0), min_size=6, max_size=6), st.floats(0.5, 10.0), st.floats(0.1, 3.0))
def test_no_law_is_negative_and_monotone_laws_do_not_fall(shape, numbers, limit, scale):
    chosen = np.array(numbers[: shape.count])
    share = np.linspace(0.0, 1.0, 40)
    law = shape.law(chosen, limit, scale)
    value = chosen @ shape.basis(share, scale)
    assert value.min() >= -1e-9
    if shape.kind != "polynomial":
        assert np.diff(value).min() >= -1e-9
    np.testing.assert_allclose(law(share * limit), value, rtol=1e-6, atol=1e-7)


@pytest.mark.property
@pytest.mark.parametrize(
    "law",
    [
        TANH,
        Law("langevin", (5.0, 90.0, 0.3)),
        Law("froehlich", (5.0, 90.0, 0.3)),
        Law("polynomial", (5.0, 3.0, 2.0, 1.0, 0.5, 0.2)),
    ],
    ids=lambda law: law.kind,
)
def test_compiled_step_names_and_law_agree(law):
    drive = np.linspace(0.0, 2.0, 50)
    zero = 0.0 * drive
    wires = run_chain(build_chain([coefficients(law, law.scaled(2.0))]), zero, zero, zero, drive, 1e-3)
    np.testing.assert_allclose(wires[:, YIELD_FORCE], law(drive), rtol=1e-12)
    np.testing.assert_allclose(wires[:, VISCOSITY], 2.0 * law(drive), rtol=1e-12)
    numbers = dict(zip(law_names("yield_force", law), law.numbers, strict=True))
    np.testing.assert_allclose(law_of("yield_force", numbers, law.kind)(drive), law(drive), rtol=1e-12)


@pytest.mark.literature
@pytest.mark.parametrize("kind", KINDS[1:])
def test_saturating_functions_rise_from_nothing_to_one(kind):
    assert float(saturation(kind, 0.0)) == 0.0
    assert float(saturation(kind, 1e4)) == pytest.approx(1.0, abs=2e-4)
    slope = {"tanh": 1.0, "langevin": 1.0 / 3.0, "froehlich": 1.0}[kind]
    assert float(saturation(kind, 1e-5)) == pytest.approx(1e-5 * slope, rel=1e-4)


@pytest.mark.planted
def test_a_law_that_saturates_is_found_and_holds_between_the_levels():
    levels = (0.0, 0.25, 0.6, 1.0, 1.5, 2.0)
    choice = choose_laws(fitted(levels, TANH))
    assert choice.laws[0].saturates or choice.laws[0].kind == "monotone"
    between = np.isin(np.round(choice.drives, 3), levels, invert=True) & (choice.drives < 2.0)
    truth = TANH(choice.drives)
    assert np.max(np.abs(choice.values[0] - truth)[between] / truth[between]) < 0.05
    # the uncertainty is larger between the levels than the law errs, and largest beyond them
    assert np.all(np.abs(choice.values[0] - truth) < 4.0 * choice.deviations[0] + 0.03 * truth)
    assert choice.deviations[0][-1] >= np.median(choice.deviations[0])


@pytest.mark.planted
def test_a_straight_law_stays_straight():
    choice = choose_laws(fitted((0.0, 0.5, 1.0, 1.5, 2.0), Law("polynomial", (20.0, 50.0))))
    assert choice.laws[0] == LawShape("polynomial", 1)
    assert "linear" in choice.reason


@pytest.mark.planted
def test_four_levels_of_a_saturating_damper_hold_between_them():
    """A cubic through four such levels swings far between them where nothing holds it."""
    levels = (0.0, 0.25, 0.5, 2.0)
    found = fitted(levels, TANH)
    free = np.polynomial.polynomial.polyfit(levels, TANH(np.array(levels)), 3)
    between = np.linspace(0.6, 2.0, 15)
    swing = np.max(np.abs(np.polynomial.polynomial.polyval(between, free) / TANH(between) - 1.0))
    laws = adequate_laws(found)
    base = replace(found.problem.base, laws=laws)
    again = best_fit(replace(found.problem, base=base), starts=1)
    error = np.max(np.abs(again.laws[0](between) / TANH(between) - 1.0))
    assert np.all(again.laws[0](np.linspace(0.0, 2.0, 100)) >= 0.0)
    assert error < 0.5 * swing
