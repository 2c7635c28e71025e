"""Sums over tests and levels of drive, to which laws of the drive are fitted."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.fitting.drive_cells import BINS, Cells, cells_of, levels_of_tests
from mrpipe.fitting.drive_laws import fit_laws
from mrpipe.fitting.form_fit import FitMethod, fit_form
from tests.dampers.planted import SET_C, bench_test
from tests.fitting.test_form_fit import problem_of

pytestmark = pytest.mark.planted


def _cells(*currents: object) -> Cells:
    tests = [bench_test(f"t{k}", "training", 8e-3, 1.5, current, seed=k) for k, current in enumerate(currents)]
    return cells_of(fit_form(problem_of(tests, orders=(2, 1)), FitMethod(starts=1, iterations=15), drive_unit="A").fit)


def test_tests_of_the_same_drive_are_one_level() -> None:
    means = np.array([2.0, 0.0, 2.02, 4.0, 0.01])
    assert levels_of_tests(means, 4.0).tolist() == [1, 0, 1, 2, 0]


def test_each_test_at_constant_drive_is_one_cell_whose_solution_is_its_force() -> None:
    found = _cells(0.0, 2.0, 4.0, 4.0)
    assert len(found.drive) == 4 and found.levels == 3
    assert found.level.tolist() == [0, 1, 2, 2]
    assert found.drive * found.limit == pytest.approx([0.0, 2.0, 4.0, 4.0], abs=0.02)
    z_max = np.sqrt(SET_C["A"] / (SET_C["gamma"] + SET_C["beta"]))
    for drive, gram, right in zip(found.drive * found.limit, found.gram, found.right, strict=True):
        yield_force, viscosity = np.linalg.solve(gram, right)
        assert yield_force == pytest.approx(np.polynomial.polynomial.polyval(drive, SET_C["alpha"]) * z_max, rel=0.05)
        assert viscosity == pytest.approx(np.polynomial.polynomial.polyval(drive, SET_C["c0"]), rel=0.3, abs=20.0)


def test_a_varying_drive_is_sorted_into_levels() -> None:
    found = _cells(("half-sine", 4.0), 0.0)
    assert 4 < found.levels <= BINS
    assert np.all(np.diff(found.drive[np.argsort(found.level, kind="stable")]) > -0.2)
    # products are those of real signals
    assert np.all(np.linalg.eigvalsh(found.gram) > -1e-9 * np.abs(found.gram).max())
    assert np.all(found.power >= 0.0)


def test_cells_of_a_varying_drive_leave_the_error_of_the_fit() -> None:
    # the mean of a law times a signal over a test is not the law times the mean of the signal
    tests = [bench_test(f"t{k}", "training", 8e-3, 1.5, ("half-sine", 4.0), seed=k) for k in range(2)]
    found = fit_form(problem_of(tests, orders=(2, 1)), FitMethod(starts=1, iterations=15), drive_unit="A").fit
    errors = fit_laws(cells_of(found), found.problem.base.laws[:2])[0]
    assert float(np.sum(errors)) == pytest.approx(found.cost, rel=0.1)
