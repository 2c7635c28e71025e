"""The damper with its effects as a plant: forces in use, its inverse, and what a controller makes of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import inverse_table
from mrpipe.control.laws import law_named
from mrpipe.dampers.model import DamperModel, damper_from_parameter_set
from mrpipe.dampers.plant import Chain, build_chain
from mrpipe.effects.library import damper_effects
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.loop import augmented
from mrpipe.tracing.loop.augmented import ForceInUse, changed_share, force_in_use
from mrpipe.tracing.loop.recalibration import equivalent_loss, gain_factor, switch_threshold

OMEGA, STROKE, LIMIT = 8.0, 0.010, 4.0
MEMORY = {"gain": 0.5, "slip_length": 0.05, "relaxation_time": 1.0}


def motions(role: str) -> list[PreparedTest]:
    """Return sines of several amplitudes, frequencies and drives; their force does not matter."""
    time = np.arange(0.0, 4.0, 0.002)
    tests = []
    for number, (amplitude, frequency, drive) in enumerate(
        [(0.01, 1.0, 1.0), (0.006, 1.5, 3.0), (0.008, 0.7, 2.0)]
        if role == "training"
        else [(0.009, 1.2, 1.5), (0.007, 0.9, 2.5)]
    ):
        w = 2.0 * np.pi * frequency
        x, v = amplitude * np.sin(w * time), amplitude * w * np.cos(w * time)
        none, cycles = np.zeros_like(x), np.round(np.arange(0.0, 4.0 * frequency) / frequency / 0.002).astype(np.int64)
        tests.append(
            PreparedTest(
                f"{role}-{number}",
                role,
                500.0,
                time,
                x,
                v,
                -w * w * x,
                np.full_like(x, drive),
                none,
                x,
                none,
                cycles,
                "A",
            )
        )
    return tests


@pytest.fixture(scope="module")
def damper() -> DamperModel:
    return damper_from_parameter_set(load_parameter_set("dampers", "set-c"))


def with_effect(damper: DamperModel, name: str, form: str, values: dict[str, float]) -> Chain:
    return build_chain([*damper.steps(), *damper_effects()[name].form(form).steps(values)])


def in_use(chain: Chain) -> ForceInUse:
    return force_in_use(chain, LIMIT, stroke_m=STROKE, speed_m_s=0.4, omega=OMEGA, working_drive=2.0)


@pytest.mark.oracle
def test_a_damper_without_effects_gives_its_post_yield_force(damper: DamperModel) -> None:
    found = in_use(damper.chain())
    speeds, drives = np.meshgrid(found.speeds_m_s, found.drives, indexing="ij")
    expected = damper.quasi_static_force(speeds, drives)
    assert np.max(np.abs(found.force_n - expected) / expected) < 0.02


@pytest.mark.oracle
def test_its_inverse_is_that_of_the_model(damper: DamperModel) -> None:
    ours, model = in_use(damper.chain()).table(), inverse_table(damper, largest_speed_m_s=0.4)
    assert ours.forces.shape == model.forces.shape
    assert np.max(np.abs(ours.forces[10:, :] - model.forces[10:, :])) < 0.03 * model.forces.max()


@pytest.mark.property
def test_a_memory_of_the_drive_raises_the_residual_force_and_the_switch(damper: DamperModel) -> None:
    before, after = in_use(damper.chain()), in_use(with_effect(damper, "remanence", "relaxing", MEMORY))
    speed = 0.0093 * OMEGA
    assert 1.05 < after.residual_n(speed) / before.residual_n(speed) < 1.5
    ratio = switch_threshold(18.0, before, after, speed) / 18.0
    assert ratio == pytest.approx(after.residual_n(speed) / before.residual_n(speed))
    # where the drive is at its limit there is nothing larger to remember
    assert after.largest_n(np.array([speed])) == pytest.approx(before.largest_n(np.array([speed])), rel=0.01)


@pytest.mark.property
def test_a_spring_beside_the_damper_is_no_force_of_the_mean(damper: DamperModel) -> None:
    spring = with_effect(damper, "accumulator", "linear", {"stiffness": 1500.0})
    assert in_use(spring).force_n == pytest.approx(in_use(damper.chain()).force_n, abs=1.0)


@pytest.mark.property
def test_how_much_an_effect_changes(damper: DamperModel) -> None:
    tests = motions("training")
    spring = with_effect(damper, "accumulator", "linear", {"stiffness": 1500.0})
    assert changed_share(damper.chain(), damper.chain(), tests) == 0.0
    assert 0.02 < changed_share(damper.chain(), spring, tests) < 0.5


@pytest.mark.property
def test_gains_make_up_for_what_the_damper_gives_beside(damper: DamperModel) -> None:
    before = in_use(damper.chain())
    after = replace(before, force_n=before.force_n + 5.0, from_above_n=before.from_above_n + 5.0)
    for name, gains in (("vd", Gains(650.0)), ("fdns", Gains(alpha_n_m=3000.0))):
        law = law_named(name)
        assert gain_factor(law, gains, before, before, OMEGA, 0.0093) == pytest.approx(1.0, abs=1e-3)
        factor = gain_factor(law, gains, before, after, OMEGA, 0.0093)
        assert 0.5 < factor < 0.99
        wanted = equivalent_loss(law, gains, before, OMEGA, 0.0093)
        assert equivalent_loss(law, law.scaled(gains, factor), after, OMEGA, 0.0093) == pytest.approx(wanted, rel=1e-3)
    # 20 N of viscous force are less than the residual force: no gain makes up for that
    assert gain_factor(law_named("vdns"), Gains(250.0, -4500.0), before, after, OMEGA, 0.0093) == 1.0
    assert law_named("vdns").scaled(Gains(250.0, -4500.0), 2.0) == Gains(500.0, -4500.0)


@pytest.mark.planted
def test_an_inverse_that_was_trained_on_another_damper_is_replaced(damper: DamperModel) -> None:
    from mrpipe.networks.network import FeatureSpec
    from mrpipe.networks.options import TrainingOptions
    from mrpipe.networks.training import train

    tests, other = motions("training"), motions("validation")
    spec = FeatureSpec(("velocity", "force"), 3, True, 200.0, "drive")
    rng = np.random.default_rng(3)
    quick = TrainingOptions(
        architecture=(4,), biases=True, starts=1, refined_starts=1, subsample_iterations=30, iterations=5
    )
    old = train(augmented.simulated_history(damper.chain(), tests, 3.0, 200.0, rng), spec, quick, rng).network
    drag = with_effect(damper, "quadratic-drag", "square", {"drag": 4000.0})
    again = augmented.retrain_inverse(old, drag, tests, other, 3.0, rng, options=quick)
    assert again.replaced
    assert again.after_nrmse < 0.9 * again.before_nrmse
    assert again.network.layers == old.layers
