"""The compiled loop: both ways of running a damper agree, and force and motion at the end of a step belong together."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control.gains import Gains
from mrpipe.dampers.drive import driver_lag_apart
from mrpipe.dampers.plant import Phase, Step, build_chain, idle_step
from mrpipe.simulation import LoopOptions, implicit_force, simulate_law
from mrpipe.simulation.parts import BOUC_WEN


@pytest.mark.property
@pytest.mark.parametrize("driver_lag_s", [0.0, 0.004])
def test_the_plain_damper_runs_as_any_chain(rig, driver_lag_s):
    """Its loop has no function pointers: a chain with a step that does nothing takes the common way."""
    damper = rig.damper
    steps = [step for step in damper.steps() if step.name != "sum"]
    common = build_chain([*steps, Step("nothing", Phase.FORCE_EFFECT, idle_step, np.zeros(0))])
    assert damper.chain().names == BOUC_WEN and common.names != BOUC_WEN
    options = LoopOptions(driver_time_constant_s=driver_lag_s)
    ours, theirs = (
        simulate_law(rig.frame, chain, rig.controller("vdns"), rig.excitation(0.7, 6), options)
        for chain in (damper.chain(), common)
    )
    np.testing.assert_allclose(ours.force, theirs.force, atol=1e-9 * np.max(np.abs(theirs.force)))


@pytest.mark.property
def test_a_driver_that_lags_apart_with_equal_rates_is_the_plain_one(rig):
    """It has the plain chain's names and one parameter more."""
    plain = rig.damper.chain()
    others = [step for step in rig.damper.steps() if step.name not in ("sum", "driver-lag")]
    eta = float(plain.parameters[0])
    apart = build_chain([driver_lag_apart(eta, eta), *others])
    assert apart.names == plain.names
    ours, theirs = (
        simulate_law(rig.frame, chain, rig.controller("vd"), rig.excitation(0.7, 4), LoopOptions())
        for chain in (apart, plain)
    )
    np.testing.assert_allclose(ours.force, theirs.force, atol=1e-9 * np.max(np.abs(theirs.force)))


@pytest.mark.property
def test_force_and_motion_at_the_end_of_a_step_belong_together(rig):
    gains = Gains(650.0, 1500.0)
    options = LoopOptions(tracking="unclipped", plant_rate_hz=2000.0, record_rate_hz=2000.0)
    found = simulate_law(rig.frame, None, rig.controller("vdps", gains), rig.excitation(0.7, 3), options)
    law = 650.0 * found.damper_velocity + 1500.0 * found.damper_displacement
    tolerance = implicit_force.TOLERANCE_N + 1e-6 * np.abs(law).max()
    np.testing.assert_allclose(found.force[1:], law[1:], atol=tolerance)


@pytest.mark.property
def test_a_force_that_jumps_lets_the_damper_stick_and_takes_energy_out(rig):
    """Coulomb friction of a clipped negative stiffness: no force is an answer at rest, so the step is bisected."""
    options = LoopOptions(tracking="continuous", plant_rate_hz=4000.0, record_rate_hz=4000.0)
    controller = rig.controller("vdns", Gains(250.0, -4500.0))
    found = simulate_law(rig.frame, None, controller, rig.excitation(0.7, 6), options)
    power = found.force * found.damper_velocity
    assert power.min() > -1e-3 * power.max()
    assert found.energy_balance_error < 1e-3
    assert np.all(np.diff(found.work_damper) > -1e-6 * found.work_damper[-1])
