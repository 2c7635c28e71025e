"""Backlash at the sampling rate of a fit: where the flanks meet, and what the velocity of the damper is then."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.drive import coefficients
from mrpipe.dampers.laws import constant_law
from mrpipe.dampers.library import base_form
from mrpipe.dampers.plant import DISPLACEMENT, FORCE, VELOCITY, build_chain, run_chain
from mrpipe.effects.library import damper_effects

FREQUENCY_HZ, AMPLITUDE_M, GAP_M = 3.1, 0.01, 3e-4


def _run(form: str, values: dict[str, float], rate: float) -> np.ndarray:
    """Return the wires of a damper whose force follows the speed, moved by a sine for 2 s."""
    time = np.arange(int(2.0 * rate) + 1) / rate
    omega = 2.0 * np.pi * FREQUENCY_HZ
    x, v = AMPLITUDE_M * np.sin(omega * time), omega * AMPLITUDE_M * np.cos(omega * time)
    base = base_form("rounded-yield").steps({"yield_displacement": 2e-4, "gamma_share": 0.5, "velocity_scale": 0.01})
    effect = damper_effects()["backlash"].form(form).steps(values)
    chain = build_chain([coefficients(constant_law(1.0), constant_law(10.0), constant_law(100.0)), *base, *effect])
    return run_chain(chain, x, v, -(omega**2) * x, np.zeros_like(x), 1.0 / rate)


@pytest.mark.property
@pytest.mark.parametrize(
    ("form", "values"),
    [
        ("held", {"gap": GAP_M}),
        ("worn", {"gap": GAP_M}),
        ("carried", {"gap": GAP_M, "carried_share": 0.1}),
        ("graded", {"gap": GAP_M, "spread": 0.3}),
    ],
)
def test_the_force_at_a_sample_does_not_depend_on_the_sampling_rate(form: str, values: dict[str, float]) -> None:
    # an error of one sample at every meeting of the flanks would be 10 % of the RMS force here
    exact = _run(form, values, 32000.0)[::128, FORCE]
    found = _run(form, values, 250.0)[:, FORCE]
    assert np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)) < 0.03


@pytest.mark.property
@pytest.mark.parametrize("form", ["held", "free"])
def test_the_gap_begins_at_the_turning_point_between_two_samples(form: str) -> None:
    wires = _run(form, {"gap": GAP_M}, 250.0)[250:]
    # the largest displacement of the rod is between two samples; at 250 Hz the largest sample is up to 8 um lower
    assert np.max(wires[:, DISPLACEMENT]) == pytest.approx(
        AMPLITUDE_M - 0.5 * GAP_M, abs=1e-7 if form == "held" else 2e-6
    )


@pytest.mark.property
def test_the_damper_rests_in_the_gap_and_has_the_speed_of_the_rod_outside() -> None:
    time = np.arange(501) / 250.0
    speed = 2.0 * np.pi * FREQUENCY_HZ * AMPLITUDE_M * np.cos(2.0 * np.pi * FREQUENCY_HZ * time)
    wires = _run("held", {"gap": GAP_M}, 250.0)
    moves = np.diff(wires[:, DISPLACEMENT]) != 0.0
    share = wires[1:, VELOCITY] / speed[1:]
    # the rise from 0 to 1 is at most a quarter of a step before and after the meeting of the flanks
    # and a step with a reversal begins on one flank and ends in the gap
    met = np.flatnonzero(np.diff(moves.astype(int)))
    rising = np.union1d(met, met + 1)
    steady = np.setdiff1d(np.arange(len(share)), rising)
    assert len(met) > 10
    assert set(share[steady]) <= {0.0, 1.0}
    np.testing.assert_array_equal(share[steady] == 1.0, moves[steady])
