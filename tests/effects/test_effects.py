"""Every effect of the library meets all demands; what single effects do; files of users."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from mrpipe.dampers.drive import driver_lag, polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.library import base_form
from mrpipe.dampers.plant import CURRENT, FORCE, HYSTERESIS, YIELD_FORCE, build_chain, run_chain
from mrpipe.effects.asymmetry import direction_of
from mrpipe.effects.checks import checks_of
from mrpipe.effects.contract import EffectForm, EffectScales
from mrpipe.effects.library import all_effects, damper_effects, effects_named, load_effect_file
from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.errors import UserError

CONTRACT = [
    "offset",
    "accumulator",
    "inertia",
    "asymmetry",
    "stribeck",
    "quadratic-drag",
    "migration",
    "remanence",
    "heating",
    "backlash",
    "delay",
    "saturation",
    "pinching",
    "channel-skew",
    "end-stop",
]


def base_steps() -> list:
    return [
        polynomial_coefficients([22.0, 5.5, 22.0, -2.0], [50.0, 75.0]),
        driver_lag(100.0),
        hysteresis(3.7e-4, 0.5, 2.0),
    ]


def motion(frequency: float = 1.3, amplitude: float = 0.009, rate: float = 1000.0) -> tuple[np.ndarray, ...]:
    t = np.arange(int(3.0 * rate)) / rate
    omega = 2 * np.pi * frequency
    x = amplitude * np.sin(omega * t)
    drive = 2.0 + 1.5 * np.sin(2 * np.pi * 0.7 * t)
    return x, omega * amplitude * np.cos(omega * t), -(omega**2) * x, drive, 1.0 / rate


@pytest.mark.property
def test_the_names_of_the_contract_are_all_there() -> None:
    assert set(CONTRACT) <= set(damper_effects())


@pytest.mark.property
@pytest.mark.parametrize(("form", "rest"), [("both", {}), ("rounded", {"knee_force": 1e-9})])
def test_asymmetry_acts_on_the_spring_inside_the_damper_too(form: str, rest: dict[str, float]) -> None:
    numbers = {"yield_displacement": 3.7e-4, "gamma_share": 0.5, "c1_a": 900.0, "k0": 4000.0}
    steps = [*base_steps()[:2], *base_form("modified-bouc-wen").steps(numbers)]
    asymmetry = all_effects()["asymmetry"].form(form).steps({"share": 0.2, **rest})
    x, v, a, drive, dt = motion()
    plain, changed = (run_chain(build_chain(item), x, v, a, drive, dt)[:, FORCE] for item in (steps, steps + asymmetry))
    np.testing.assert_allclose(changed, plain + 0.2 * np.abs(plain), rtol=1e-6, atol=1e-6)


@pytest.mark.property
@pytest.mark.parametrize("name", list(damper_effects()))
def test_an_effect_meets_every_demand(name: str) -> None:
    effect = damper_effects()[name]
    checks = checks_of(effect, [*all_effects(), *all_structural_effects()])
    assert [(item.form, item.demand, item.failure) for item in checks if not item.passed] == []
    assert len({item.form for item in checks}) == 1 + len(effect.forms) + len(effect.refinements)


PURE_SHIFTS = [form for form in all_effects()["channel-skew"].forms if len(form.parameters) == 1]


@pytest.mark.property
@pytest.mark.parametrize("form", PURE_SHIFTS, ids=lambda form: form.name)
def test_a_skew_is_taken_back_over_a_quick_motion(form: EffectForm) -> None:
    # 10 ms at 2.5 Hz: a series of the displacement in its derivatives misses by more than its noise
    x, v, a, u, dt = motion(frequency=2.5)
    late = round(0.01 / dt)
    plain = run_chain(build_chain(base_steps()), x, v, a, u, dt)[:, FORCE]
    skewed = form.steps({"skew": late * dt})
    if form.name == "shift":
        found = run_chain(build_chain([*base_steps(), *skewed]), x[:-late], v[:-late], a[:-late], u[late:], dt)[
            :, FORCE
        ]
        expected = plain[late:]
    else:
        found = run_chain(build_chain([*base_steps(), *skewed]), x, v, a, u, dt)[:, FORCE][late:]
        expected = plain[:-late]
    settled = slice(len(expected) // 3, -2 * late)
    np.testing.assert_allclose(found[settled], expected[settled], atol=1e-6 * np.ptp(expected))


LIMITS = [
    # the base form of this file has no series spring: a factor of the yield force is one of the hysteretic force
    *(
        (name, "yield-force", values, plain, values)
        for name, plain, values in (
            ("asymmetry", "yield-by-direction", {"share": 0.2, "transition_velocity": 0.01}),
            ("stribeck", "stretched", {"share": 0.3, "velocity_scale": 0.02, "exponent": 1.3}),
            (
                "migration",
                "power-law",
                {"share": 0.3, "slip_length": 0.004, "power": 2.0, "reversal_speed": 1e-6},
            ),
            ("pinching", "flat", {"depth": 0.3, "width": 0.002, "middle": 0.001, "exponent": 3.0}),
        )
    ),
    (
        "migration",
        "power-law-fast-reversals",
        {"share": 0.3, "slip_length": 0.004, "power": 2.0, "reversal_speed": 1e-6},
        "power-law",
        {"share": 0.3, "slip_length": 0.004, "power": 2.0},
    ),
    (
        "migration",
        "yield-force-time",
        {"share": 0.3, "rise_time": 0.1, "exponent": 0.8, "reversal_speed": 1e-6},
        "stretched-time",
        {"share": 0.3, "rise_time": 0.1, "exponent": 0.8},
    ),
    *(
        (
            "asymmetry",
            "yield-by-sharp-direction",
            {"share": 0.2, "transition_velocity": 0.01, "sharpness": sharpness},
            "yield-by-direction",
            {"share": 0.2, "transition_velocity": 0.01},
        )
        for sharpness in (2.0, 2.001)
    ),
    *(
        (
            "heating",
            form,
            {"loss": 0.02, "cooling_time": 2.0, "curvature": 0.0, "viscosity_exponent": 1.0},
            "cooling",
            {"loss": 0.02, "cooling_time": 2.0},
        )
        for form in ("curved", "curved-yielded")
    ),
    ("saturation", "soft-driver", {"inverse_limit": 0.4, "exponent": 200.0}, "driver", {"inverse_limit": 0.4}),
    (
        "delay",
        "dead-time-and-second-order",
        {"delay": 0.02, "filter_share": 1.0, "damping_ratio": 0.8},
        "second-order",
        {"delay": 0.02, "damping_ratio": 0.8},
    ),
    (
        "remanence",
        "fading-corner",
        {"gain": 0.8, "slip_length": 0.05, "relaxation_time": 2.0, "exponent": 400.0},
        "fading",
        {"gain": 0.8, "slip_length": 0.05, "relaxation_time": 2.0},
    ),
    (
        "remanence",
        "fading-corner",
        {"gain": 0.8, "slip_length": 0.05, "relaxation_time": 2.0, "exponent": 2.0},
        "fading-root",
        {"gain": 0.8, "slip_length": 0.05, "relaxation_time": 2.0},
    ),
    (
        "delay",
        "dead-time-and-second-order",
        {"delay": 0.02, "filter_share": 1e-3, "damping_ratio": 0.8},
        "dead-time",
        {"delay": 0.02},
    ),
]
"""Effect, richer form with values near a limit, and the plain form to which it then reduces."""


@pytest.mark.property
@pytest.mark.parametrize("name", ["elastic-plastic", "bingham-spring", "gamota-filisko"])
def test_a_slider_behind_a_spring_yields_at_the_changed_force(name: str) -> None:
    form = base_form(name)
    values = {p.name: 1e6 for p in form.parameters} | {"exponent": 20.0, "gamma_share": 0.5}
    steps = all_effects()["asymmetry"].form("yield-force").steps({"share": 0.2, "transition_velocity": 1e-4})
    x, v, a, _, dt = motion()
    chain = build_chain([polynomial_coefficients([100.0], [0.0]), *form.steps(values), *steps])
    force = run_chain(chain, x, v, a, np.zeros_like(x), dt)[:, FORCE]
    assert (np.max(force), np.min(force)) == pytest.approx((120.0, -80.0), rel=0.01)


@pytest.mark.property
@pytest.mark.parametrize(("heated", "stiffness"), [("curved", 1e6), ("curved-yielded", 0.5e6)])
def test_heat_lowers_the_yield_force_before_the_yield_or_the_stiffness_as_well(heated: str, stiffness: float) -> None:
    form = base_form("bouc-wen-stiffness")
    warm = {"loss": 1.0, "cooling_time": 1e9, "curvature": 0.0, "viscosity_exponent": 0.0}
    # the force falls as 100 N/(1 + 100 x), so that it is halved after 10 mm; then the motion turns
    dt, half, slow = 1e-4, 10_000, 1e-2
    v = np.concatenate([np.full(half, slow), np.full(400, -slow)])
    x, zero = np.cumsum(v) * dt, np.zeros_like(v)
    chain = build_chain(
        [
            polynomial_coefficients([100.0], [0.0]),
            *form.steps({"initial_stiffness": 1e6, "gamma_share": 0.5}),
            *all_effects()["heating"].form(heated).steps(warm),
        ]
    )
    force = run_chain(chain, x, v, zero, zero, dt)[:, FORCE]
    yielded = force[half - 1]
    assert yielded == pytest.approx(50.0, rel=0.02)
    # beta = gamma: the force falls with the initial stiffness until it passes zero
    below = np.flatnonzero((force[half:] > 0.2 * yielded) & (force[half:] < 0.8 * yielded)) + half
    slope = np.polyfit(x[below], force[below], 1)[0]
    assert slope == pytest.approx(stiffness, rel=0.05)


@pytest.mark.property
def test_the_direction_is_odd_bounded_and_sharper_with_its_sharpness() -> None:
    ratios = np.array([0.0, 0.1, 0.5, 1.0, 3.0, 50.0])
    soft, root, hard = (np.array([direction_of(r, 1.0, m) for r in ratios]) for m in (1.0, 2.0, 12.0))
    np.testing.assert_allclose(soft, ratios / (1.0 + ratios))
    np.testing.assert_allclose(root, ratios / np.hypot(1.0, ratios))
    np.testing.assert_allclose(hard, np.minimum(ratios, 1.0), atol=0.06)
    assert [direction_of(-r, 1.0, 3.0) for r in ratios] == [-direction_of(r, 1.0, 3.0) for r in ratios]
    # a sharpness of three is close to a hyperbolic tangent
    assert max(abs(direction_of(r, 1.0, 3.0) - math.tanh(r)) for r in np.linspace(0.0, 5.0, 200)) < 0.035


@pytest.mark.property
@pytest.mark.parametrize(("name", "richer", "values", "plain", "reduced"), LIMITS, ids=lambda item: str(item)[:30])
def test_a_richer_form_contains_the_plain_one(
    name: str, richer: str, values: dict[str, float], plain: str, reduced: dict[str, float]
) -> None:
    effect, (x, v, a, u, dt) = all_effects()[name], motion()
    both = [effect.form(form).steps(numbers) for form, numbers in ((richer, values), (plain, reduced))]
    found, known = (run_chain(build_chain([*base_steps(), *steps]), x, v, a, u, dt)[:, FORCE] for steps in both)
    without = run_chain(build_chain(base_steps()), x, v, a, u, dt)[:, FORCE]
    assert np.std(found - known) < 0.02 * np.std(known - without)


@pytest.mark.property
@pytest.mark.parametrize(
    "name", [form.name for form in (*all_effects()["remanence"].forms, *all_effects()["remanence"].refinements)]
)
def test_noise_about_a_drive_of_zero_does_not_end_the_remanence(name: str) -> None:
    form = all_effects()["remanence"].form(name)
    x, v, a, _, dt = motion()
    scales = EffectScales(stroke=0.009, speed=0.07, acceleration=0.6, drive=2.0, force=100.0, time=3.0)
    values = {p.name: p.start_values(scales)[-1] for p in form.parameters} | {"gain": 0.5}
    drive = np.where(np.arange(len(x)) < len(x) // 3, 2.0, 0.0)
    noise = 1e-3 * (-1.0) ** np.arange(len(x))
    chain = build_chain([*base_steps(), *form.steps(values)])
    plain, noisy = (run_chain(chain, x, v, a, u, dt)[:, CURRENT] for u in (drive, drive + noise))
    assert np.max(np.abs(noisy - plain)) < 0.02 * np.max(plain)


@pytest.mark.property
def test_the_gap_is_lost_motion() -> None:
    form = damper_effects()["backlash"].form("held")
    x, v, a, drive, dt = motion()
    from mrpipe.dampers.plant import DISPLACEMENT

    chain = build_chain([*base_steps(), *form.steps({"gap": 2e-4})])
    damper = run_chain(chain, x, v, a, drive, dt)[:, DISPLACEMENT]
    assert np.ptp(damper[1000:]) == pytest.approx(np.ptp(x) - 2e-4, rel=1e-6)


@pytest.mark.property
def test_a_file_of_ones_own_is_loaded(tmp_path: Path) -> None:
    source = Path(damper_effects.__code__.co_filename).with_name("quadratic_drag.py").read_text(encoding="utf-8")
    own = tmp_path / "my_drag.py"
    own.write_text(
        source.replace('name="quadratic-drag"', 'name="my-drag"').replace("cache=True", "cache=False"), encoding="utf-8"
    )
    assert load_effect_file(own).name == "my-drag"
    assert list(effects_named(["inertia"], [own])) == ["inertia", "my-drag"]


@pytest.mark.property
def test_what_is_wrong_with_a_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        load_effect_file(tmp_path / "none.py")
    (tmp_path / "empty.py").write_text("x = 1\n", encoding="utf-8")
    with pytest.raises(UserError, match="EFFECT"):
        load_effect_file(tmp_path / "empty.py")
    of_structure = tmp_path / "impact.py"
    of_structure.write_text("from mrpipe.effects.structural.impact import EFFECT\n")
    with pytest.raises(UserError, match="EFFECT: is an effect of a structure, and this is the tracing of a damper"):
        load_effect_file(of_structure)
    with pytest.raises(UserError, match=r"did you mean inertia\?"):
        effects_named(["inertja"])


@pytest.mark.property
@pytest.mark.parametrize("name", ["yield-force", "power-law-fast-reversals"])
def test_a_reversal_moves_particles_once_the_flow_is_fast_enough(name: str) -> None:
    form = all_effects()["migration"].form(name)
    values = {"share": 0.5, "slip_length": 0.001, "power": 2.0, "reversal_speed": 0.02}
    x, v, a, _, dt = motion()
    wires = run_chain(build_chain([*base_steps(), *form.steps(values)]), x, v, a, np.zeros_like(x), dt)
    plain = run_chain(build_chain(base_steps()), x, v, a, np.zeros_like(x), dt)
    if name == "yield-force":
        found = wires[:, YIELD_FORCE] / 22.0
    else:
        # the factor of the hysteretic force, known where this force is not zero
        known = np.flatnonzero(np.abs(plain[:, HYSTERESIS]) > 0.1)
        added = (wires[known, FORCE] - plain[known, FORCE]) / (22.0 * plain[known, HYSTERESIS])
        found = 1.0 + np.interp(np.arange(len(v)), known, added)
    late = np.arange(len(v)) > 1000
    # until the speed is reached the yield force stays as it was before the reversal, then it begins anew
    assert np.min(found[late & (np.abs(v) < 0.005)]) > 1.4
    assert np.min(found[late]) < 1.35
    # while the motion slows down nothing changes back
    slowing = late & (v * a < 0.0) & (np.abs(v) < 0.01)
    assert np.min(found[slowing]) > 1.4


@pytest.mark.property
def test_a_mass_that_changes_with_the_drive_is_never_negative() -> None:
    """A negative mass that grows with the drive had been named for a shape that the library does not hold."""
    form = next(form for form in damper_effects()["inertia"].forms if form.name == "mass-with-drive")
    assert {parameter.name: parameter.lower for parameter in form.parameters} == {"mass": 0.0, "mass_rate": 0.0}
