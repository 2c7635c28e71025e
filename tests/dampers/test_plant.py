"""The chain: its force depends on state, motion and drive alone; what it cannot hold is a mistake told in one line."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.drive import driver_lag, polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.plant import CHAIN_LENGTH, SINCE_REVERSAL, SLIP, Phase, Step, build_chain, idle_step, run_chain
from mrpipe.effects.library import damper_effects
from mrpipe.errors import UserError


def _base() -> list[Step]:
    return [polynomial_coefficients([22.0], [50.0]), driver_lag(100.0), hysteresis(3.7e-4, 0.5, 2.0)]


@pytest.mark.property
def test_too_many_steps_are_a_users_mistake_in_one_line() -> None:
    steps = [Step(f"own-{k}", Phase.FORCE_EFFECT, idle_step, np.zeros(0)) for k in range(CHAIN_LENGTH)]
    with pytest.raises(UserError, match=f"a chain of {CHAIN_LENGTH + 1} steps, at most {CHAIN_LENGTH}") as caught:
        build_chain(steps)
    assert "own-3" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(build_chain(steps[:-1]).functions) == CHAIN_LENGTH


@pytest.mark.property
@pytest.mark.parametrize(
    ("effect", "form", "values"),
    [
        ("channel-skew", "late-force", {"skew": 0.03}),
        ("delay", "dead-time", {"delay": 0.15}),
        ("delay", "dead-time-and-lag", {"delay": 0.15, "lag_share": 0.05}),
    ],
)
def test_a_memory_that_is_too_short_is_no_silent_limit(effect: str, form: str, values: dict[str, float]) -> None:
    chain = build_chain([*_base(), *damper_effects()[effect].form(form).steps(values)])
    n = 200
    motion = np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n)
    run_chain(chain, *motion, 1e-3)
    with pytest.raises(UserError, match=r"looks back 0\.\d+ s, its memory of \d+ samples reaches"):
        run_chain(chain, *motion, 1e-5)


@pytest.mark.property
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.9])
def test_slip_and_time_since_the_reversal_count_from_the_instant_between_two_samples(phase: float) -> None:
    rate, omega = 250.0, 2.0 * np.pi * 3.1
    time = np.arange(500) / rate
    angle = omega * time + phase
    wires = run_chain(build_chain(_base()), np.sin(angle), omega * np.cos(angle), -(omega**2) * np.sin(angle),
                      np.zeros(500), 1.0 / rate)  # fmt: skip
    since = np.mod(angle - 0.5 * np.pi, np.pi)
    after = angle > 0.5 * np.pi
    np.testing.assert_allclose(wires[after, SINCE_REVERSAL], since[after] / omega, atol=2e-5)
    np.testing.assert_allclose(wires[after, SLIP], 1.0 - np.cos(since[after]), atol=2e-3)


@pytest.mark.property
def test_a_rest_between_two_motions_does_not_hide_the_reversal() -> None:
    v = np.array([1.0, 1.0, 0.0, 0.0, -1.0, -1.0, 0.0, -1.0])
    x = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]))]) * 1e-3
    wires = run_chain(build_chain(_base()), x, v, np.zeros(8), np.zeros(8), 1e-3)
    np.testing.assert_allclose(wires[:, SINCE_REVERSAL] / 1e-3, [0, 1, 2, 3, 1, 2, 3, 4], rtol=1e-12)
    np.testing.assert_allclose(wires[:, SLIP] / 1e-3, [0, 1, 1.5, 1.5, 0.5, 1.5, 2, 2.5], rtol=1e-12)
