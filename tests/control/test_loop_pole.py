"""The pole that Newton's method follows is the one that small steps with all eigenvalues follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.control import exact, limits
from mrpipe.control.following import followed_pole
from mrpipe.control.lqg import Weights, frame_regulator_gain
from mrpipe.structures import floor_position, shear_frame, state_space, storey_position


def cases():
    """Random frames with modal, coupled and no damping, and a damper at a random place."""
    rng = np.random.default_rng(11)
    for _ in range(24):
        n = int(rng.integers(1, 8))
        frame = shear_frame(rng.uniform(5.0, 40.0, n), rng.uniform(1e4, 6e4, n), float(rng.choice([0.0, 0.02])))
        if rng.random() < 0.3:
            own = rng.standard_normal((n, n))
            frame = replace(frame, damping=frame.damping + 5.0 * own @ own.T)
        place = int(rng.integers(1, n + 1))
        position = floor_position(n, place) if rng.random() < 0.5 else storey_position(n, place)
        yield rng, frame, position, limits.limiting_modes(frame, position, 1)


def by_eigenvalues(matrix, start, slope):
    """Return the followed pole, and the largest real part with the whole device."""

    def upper(share):
        poles = np.linalg.eigvals(matrix(share))
        return poles[poles.imag >= -1e-9] if np.isrealobj(matrix(share)) else poles[poles.imag > 0.0]

    return followed_pole(upper, start, slope), float(np.max(upper(1.0).real))


@pytest.mark.oracle
def test_linear_devices_and_equivalents():
    for rng, frame, position, modes in cases():
        n, A = frame.floors, state_space(frame).A
        device = np.linalg.solve(frame.mass, np.outer(position, position))
        c = limits.optimal_viscosity(modes) * rng.uniform(0.05, 2.0)
        k = limits.static_stiffness(frame, position) * float(rng.choice([0.0, 0.5, -0.5, -0.9, -1.3]))
        start, H = complex(0.0, modes.omega_0), complex(k, c * modes.omega_0)

        def matrix(share, n=n, A=A, device=device, c=c, k=k):
            changed = A.copy()
            changed[n:, :n] -= share * k * device
            changed[n:, n:] -= share * c * device
            return changed

        def equivalent(share, n=n, A=A, device=device, H=H):
            changed = A.astype(complex)
            changed[n:, :n] -= share * H * device
            return changed

        target = exact.target_mode(frame, position, modes)
        pole, growth = by_eigenvalues(matrix, start, exact.pole_slope(modes, c * start + k))
        for found in (target.linear(c, k), exact.exact_damping(frame, position, modes, c, k)):
            assert found.stable == (growth < 1e-9)
            if not found.stable:
                assert found.unstable_pole == pytest.approx(growth, rel=1e-8)
            else:
                assert found.damping_ratio == pytest.approx(-pole.real / abs(pole), abs=1e-9)
        assert found.unstable_pole == pytest.approx(growth, rel=1e-6, abs=1e-9)
        pole, growth = by_eigenvalues(equivalent, start, exact.pole_slope(modes, H))
        assert target.equivalent(H).pole == pytest.approx(pole, rel=1e-9)
        assert exact.exact_equivalent(frame, position, modes, H).unstable_pole == pytest.approx(growth, abs=1e-9)


@pytest.mark.oracle
def test_state_feedback():
    for rng, frame, position, modes in cases():
        gain = frame_regulator_gain(frame, position, Weights(force=10.0 ** rng.uniform(-6.0, -3.0)))
        space = state_space(frame, position)
        start, shape = complex(0.0, modes.omega_0), modes.shape_0
        own = complex(gain @ np.concatenate([shape, start * shape])) / modes.u_0
        pole, _ = by_eigenvalues(
            lambda share, space=space, gain=gain: space.A - share * np.outer(space.B[:, 1], gain),
            start,
            exact.pole_slope(modes, own),
        )
        found = exact.target_mode(frame, position, modes).feedback(gain)
        assert found.damping_ratio == pytest.approx(-pole.real / abs(pole), abs=1e-9)


@pytest.mark.property
def test_a_search_in_a_large_structure_solves_no_eigenvalue_problem(monkeypatch):
    n = 60
    frame = exact.undamped(shear_frame([25.0] * n, [3.0e4] * n, 0.01))
    position = floor_position(n, 1)
    modes = limits.limiting_modes(frame, position)
    target = exact.target_mode(frame, position, modes)

    def refused(*_):
        raise AssertionError

    monkeypatch.setattr(np.linalg, "eigvals", refused)
    best = exact.best_gain(lambda c: exact.stable_ratio(target.linear(c, 0.0)), 4.0 * limits.optimal_viscosity(modes))
    assert best.damping_ratio == pytest.approx(limits.attainable_damping(modes), rel=0.03)
    static = limits.static_stiffness(frame, position)
    assert target.linear(best.gain, -0.99 * static).stable and not target.linear(best.gain, -1.01 * static).stable
