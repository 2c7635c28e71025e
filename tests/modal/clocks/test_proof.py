"""A delay counts only if it predicts modes that were left out of its estimate."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.clocks.proof import LeftOut, parts_by_mode

LINES = 400


@pytest.mark.property
def test_each_mode_has_a_part_and_small_parts_are_joined():
    omega = np.linspace(1.0, 41.0, LINES)
    parts = parts_by_mode(omega, np.array([5.0, 20.0, 39.0]), columns=20)
    assert [part.size for part in parts] == [90, 179, 131]
    assert sorted(np.concatenate(parts)) == list(range(LINES))
    joined = parts_by_mode(omega, np.array([5.0, 20.0, 39.0]), columns=100)
    assert [part.size for part in joined] == [269, 131]


def response(where, rng):
    """A residual with a delay of 0.5 in some parts; returns the test of the delay, and residual and derivative."""
    parts = [np.arange(100 * i, 100 * (i + 1)) for i in range(4)]
    basis = np.linalg.qr(rng.standard_normal((2 * LINES, 6)))[0]
    derivative = rng.standard_normal(2 * LINES)
    delay = np.zeros(2 * LINES)
    for part in where:
        delay[np.concatenate([parts[part], parts[part] + LINES])] = 0.5
    residual = delay * derivative + 0.3 * rng.standard_normal(2 * LINES)
    columns = np.column_stack([residual, derivative])
    columns -= basis @ (basis.T @ columns)
    return LeftOut(basis, parts), columns


@pytest.mark.property
def test_a_delay_of_all_modes_is_proven_and_an_error_of_one_mode_is_not():
    rng = np.random.default_rng(1)
    proof, columns = response((0, 1, 2, 3), rng)
    assert proof.proves(proof.costs([columns]), proof.costs([columns[:, :1]]))
    for part in range(4):
        proof, columns = response((part,), rng)
        assert not proof.proves(proof.costs([columns]), proof.costs([columns[:, :1]]))


@pytest.mark.property
def test_the_cost_of_a_part_is_that_of_a_fit_to_the_others():
    proof, columns = response((0, 1, 2, 3), np.random.default_rng(2))
    rows = proof.rows[2]
    others = np.setdiff1d(np.arange(2 * LINES), rows)

    def rest(at):
        q = np.linalg.qr(proof.basis[at])[0]
        return columns[at] - q @ (q.T @ columns[at])

    training, held = rest(others), rest(rows)
    change = np.linalg.lstsq(training[:, 1:], training[:, 0], rcond=None)[0]
    expected = np.sum((held[:, 0] - held[:, 1:] @ change) ** 2)
    assert proof.costs([columns])[2] == pytest.approx(expected, rel=1e-9)
