"""The part of the yield that needs speed, with its own dependence on the drive."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.drive import polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.plant import FORCE, build_chain, run_chain
from mrpipe.dampers.viscoplastic import dashpot_series
from mrpipe.effects.library import damper_effects
from mrpipe.effects.yielding_parts import CONTAINED, OWN_DASHPOT, with_yielding_parts

RATE = 1000.0
VALUES = {"spring_rate": 3e3, "velocity_scale": 0.01, "force": 20.0, "force_rate": 15.0, "force_square": -2.0}


def test_the_part_adds_its_own_polynomial_times_the_saturating_dashpot() -> None:
    t = np.arange(2000) / RATE
    x = 0.008 * np.sin(2 * np.pi * 1.3 * t)
    v = np.gradient(x, 1 / RATE)
    u = 1.0 + np.sin(2 * np.pi * 0.7 * t)
    base = [polynomial_coefficients([30.0, 10.0], [100.0]), hysteresis(3e-4)]
    forces = [
        run_chain(build_chain(steps), x, v, np.zeros_like(x), u, 1 / RATE)[:, FORCE]
        for steps in (base, [*base, *OWN_DASHPOT.steps(VALUES)])
    ]
    part = dashpot_series(v, np.array([0, len(v)]), np.array([1 / RATE]), 3e3, 0.01)
    assert forces[1] - forces[0] == pytest.approx((20.0 + 15.0 * u - 2.0 * u**2) * part, abs=1e-9)


def test_a_stiff_spring_rounds_the_force_with_speed_alone() -> None:
    v = 0.05 * np.sin(2 * np.pi * np.arange(1000) / 1000)
    stiff = dashpot_series(v, np.array([0, len(v)]), np.array([1e-3]), 1e6, 0.02)
    assert stiff == pytest.approx(np.tanh(v / 0.02), abs=2e-2)


def test_only_the_family_of_the_yield_gets_it_and_only_beside_forms_that_it_does_not_contain() -> None:
    library = damper_effects()
    richer = with_yielding_parts(library)
    names = [form.name for form in richer["rate-dependent-yield"].forms]
    # one law from a soft and from a stiff spring: on utfsm the soft start alone ends in a poorer optimum
    assert names[:2] == ["own-dashpot", "own-dashpot-stiff"]
    assert not set(names) & set(CONTAINED)
    assert {name: item for name, item in richer.items() if name != "rate-dependent-yield"} == {
        name: item for name, item in library.items() if name != "rate-dependent-yield"
    }
    assert with_yielding_parts({"inertia": library["inertia"]}) == {"inertia": library["inertia"]}
