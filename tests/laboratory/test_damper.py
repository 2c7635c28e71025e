"""The true damper: its equations, and each planted effect does what its name says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrpipe.errors import UserError
from mrpipe.laboratory.bench import calibrated
from mrpipe.laboratory.damper import FineMotion, TrueDamper, calibrate_strength, effect_share, respond
from mrpipe.laboratory.effects import EFFECT_NAMES, FORMS, Planted, draw_hidden_effect, find_form
from tests.laboratory.conftest import motion_of

SHORT = [
    motion_of("sine", 0.01, 1.27, 3.0),
    motion_of("triangle", 0.01, 1.0, 4.0),
    motion_of("sine", 0.005, 2.2, 1.0),
    motion_of("random", 0.01, 3.0, 4.0, current="steps"),
    motion_of("sine", 0.01, 1.0, 4.0, current="half-sine"),
]


def planted(damper: TrueDamper, effect: str, form: str = "", **values: float) -> TrueDamper:
    return damper.with_effects([Planted(find_form(effect, form), values)])


def force(damper: TrueDamper, motion: FineMotion) -> np.ndarray[Any, Any]:
    return respond(damper, motion).force


def last(motion: FineMotion, seconds: float) -> slice:
    return slice(-round(seconds / motion.step_s), None)


@pytest.mark.oracle
def test_force_agrees_with_an_adaptive_solver_of_the_equations(damper: TrueDamper) -> None:
    motion = motion_of("sine", 0.01, 2.2, 4.0, current="half-sine")
    time = np.arange(motion.displacement.size) * motion.step_s
    a, b, c, d, c0, c1, A, gamma, beta, _, eta = damper.base

    def right(t: float, y: np.ndarray[Any, Any]) -> list[float]:
        v, i = np.interp(t, time, motion.velocity), np.interp(t, time, motion.current)
        z, u = y
        return [A * v - gamma * abs(v) * z * abs(z) - beta * v * z * z, -eta * (u - i)]

    until = 4000
    start = [0.0, motion.current[0]]
    y = solve_ivp(right, (0.0, time[until]), start, t_eval=time[: until + 1], rtol=1e-8, atol=1e-9, max_step=2e-3).y
    z, u = y
    expected = (a + b * u + c * u**2 + d * u**3) * z + (c0 + c1 * u) * motion.velocity[: until + 1]
    assert np.abs(force(damper, motion)[: until + 1] - expected).max() < 0.002 * np.abs(expected).max()


@pytest.mark.literature
def test_peaks_are_those_of_set_c(damper: TrueDamper) -> None:
    """Errata section C: 23 to 29 N at 0 A, 277 to 320 N at 4 A over 5 to 10 mm and 0.5 to 2.2 Hz."""
    for current, low, high in ((0.0, 23.0, 29.9), (1.0, 49.5, 65.5), (4.0, 276.0, 321.0)):
        for amplitude in (0.005, 0.010):
            for frequency in (0.5, 2.2):
                peak = np.abs(force(damper, motion_of("sine", amplitude, frequency, current))).max()
                assert low <= peak <= high or (current == 0.0 and peak < 31.1)


@pytest.mark.planted
@pytest.mark.parametrize("form", FORMS, ids=lambda form: f"{form.effect}-{form.form}")
def test_strength_is_scaled_to_its_share(damper: TrueDamper, form: Any) -> None:
    hidden = damper.with_effects([Planted(form, {}, 0.05)])
    found = calibrated(hidden, SHORT)
    assert effect_share(found, 0, SHORT) == pytest.approx(0.05, rel=0.05)


@pytest.mark.planted
def test_a_share_out_of_reach_is_told(damper: TrueDamper) -> None:
    with pytest.raises(UserError, match=r"cannot be reached"):
        calibrate_strength(damper.with_effects([Planted(find_form("delay"), {}, 0.05)]), 0, [motion_of()])


@pytest.mark.planted
@pytest.mark.parametrize("form", ["free", "held"])
def test_backlash_shifts_the_loop_by_its_gap(damper: TrueDamper, form: str) -> None:
    motion, gap = motion_of("triangle", 0.01, 0.5, 2.0), 2e-4
    cycle = slice(round(2.0 / motion.step_s), round(4.0 / motion.step_s))
    x = motion.displacement[cycle]

    def position_at_half_rise(loop: np.ndarray[Any, Any]) -> float:
        part = loop[cycle]
        level = 0.5 * part.max()
        return float(x[np.flatnonzero((part[:-1] < level) & (part[1:] >= level))[0]])

    hidden = planted(damper, "backlash", form, gap=gap)
    shift = position_at_half_rise(force(hidden, motion)) - position_at_half_rise(force(damper, motion))
    assert shift == pytest.approx(gap, rel=0.3)


@pytest.mark.planted
def test_backlash_knocks_when_it_closes(damper: TrueDamper) -> None:
    motion = motion_of()
    assert not respond(damper, motion).knock.any()
    for form in ("free", "held"):
        knocks = np.count_nonzero(respond(planted(damper, "backlash", form), motion).knock)
        assert 8 <= knocks <= 12


@pytest.mark.planted
@pytest.mark.parametrize(("form", "lag"), [("dead-time", 0.02), ("second-order", 0.02)])
def test_delay_makes_the_force_answer_a_current_late(damper: TrueDamper, form: str, lag: float) -> None:
    from dataclasses import replace

    motion = motion_of("triangle", 0.01, 0.1, 4.0)
    begin = np.flatnonzero(np.abs(motion.velocity) > 0.0039)
    begin = int(begin[begin > 8000][0]) + 400
    level = np.full(motion.current.size, 1.0)
    level[begin:] = 4.0
    step = replace(motion, current=level)

    def rise(loop: np.ndarray[Any, Any]) -> float:
        size = np.abs(loop)
        middle = 0.5 * (size[begin - 1] + size[begin + 1600])
        return float(np.flatnonzero(size[begin:] > middle)[0] * motion.step_s)

    assert rise(force(planted(damper, "delay", form, time=lag), step)) - rise(force(damper, step)) == pytest.approx(
        lag, rel=0.2
    )


@pytest.mark.planted
@pytest.mark.parametrize("form", ["relaxing", "domains"])
def test_remanence_leaves_force_after_the_current_and_none_at_constant_current(damper: TrueDamper, form: str) -> None:
    motion = motion_of("triangle", 0.01, 0.2, 4.0, current="steps", pause_s=0.6)
    falling = np.zeros(motion.current.size)
    falling[: falling.size // 2] = 4.0
    from dataclasses import replace

    step = replace(motion, current=falling)
    after = slice(round(2.6 / motion.step_s), round(2.7 / motion.step_s))
    hidden = planted(damper, "remanence", form)
    assert np.abs(force(hidden, step)[after]).mean() > 1.1 * np.abs(force(damper, step)[after]).mean()
    still = motion_of("sine", 0.01, 1.0, 2.0)
    assert np.abs(force(hidden, still) - force(damper, still)).max() < 0.02 * np.abs(force(damper, still)).max()


@pytest.mark.planted
@pytest.mark.parametrize("form", ["two-nodes", "one-node"])
def test_heating_weakens_the_damper_over_the_test(damper: TrueDamper, form: str) -> None:
    motion = motion_of("sine", 0.01, 2.2, 4.0)
    ratio = np.abs(force(planted(damper, "heating", form), motion)) / np.maximum(np.abs(force(damper, motion)), 1.0)
    moving = np.abs(motion.velocity) > 0.05
    time = np.arange(ratio.size) * motion.step_s
    early, late = ratio[moving & (time < 1.5)].mean(), ratio[moving & (time > 4.0)].mean()
    assert late < early - 0.01


@pytest.mark.planted
@pytest.mark.parametrize("form", ["yield", "force"])
def test_asymmetry_favours_one_direction(damper: TrueDamper, form: str) -> None:
    motion = motion_of()
    loop = force(planted(damper, "asymmetry", form, share=0.1), motion)[last(motion, 2.0)]
    # the viscous part of the force has no preference
    assert 1.14 < loop.max() / -loop.min() < 1.24


@pytest.mark.planted
@pytest.mark.parametrize(("effect", "form"), [("stribeck", "rational"), ("stribeck", "cusp")])
def test_stribeck_falls_with_speed(damper: TrueDamper, effect: str, form: str) -> None:
    slow, fast = motion_of("triangle", 0.01, 0.1, 2.0), motion_of("triangle", 0.01, 3.0, 2.0)
    gains = [
        np.abs(force(planted(damper, effect, form), m)).max() / np.abs(force(damper, m)).max() for m in (slow, fast)
    ]
    assert gains[0] > gains[1] + 0.05


@pytest.mark.planted
@pytest.mark.parametrize("form", ["creep", "eyring"])
def test_rate_dependent_yield_rises_with_speed(damper: TrueDamper, form: str) -> None:
    hidden = planted(damper, "rate-dependent-yield", form)
    slow, fast = motion_of("triangle", 0.01, 0.1, 2.0), motion_of("triangle", 0.01, 3.0, 2.0)
    gains = [np.abs(force(hidden, m)).max() / np.abs(force(damper, m)).max() for m in (slow, fast)]
    assert gains[0] < gains[1] - 0.05


@pytest.mark.planted
@pytest.mark.parametrize("form", ["power", "turbulent"])
def test_quadratic_drag_grows_faster_than_speed(damper: TrueDamper, form: str) -> None:
    hidden = planted(damper, "quadratic-drag", form)
    added = []
    for frequency in (0.75, 1.5):
        motion = motion_of("triangle", 0.01, frequency, 2.0)
        added.append(np.abs(force(hidden, motion) - force(damper, motion))[last(motion, 1.0)].max())
    assert 3.4 < added[1] / added[0] < 4.8


@pytest.mark.planted
@pytest.mark.parametrize("form", ["stretched-time", "slip"])
def test_migration_raises_the_force_slowly_after_reversal(damper: TrueDamper, form: str) -> None:
    motion = motion_of("triangle", 0.01, 0.5, 3.0)
    ratio = force(planted(damper, "migration", form), motion) / force(damper, motion)
    begin = round(np.flatnonzero(np.diff(np.sign(motion.velocity[12000:])) != 0)[0] + 12000)
    early, late = ratio[begin + 200 : begin + 400].mean(), ratio[begin + 3000 : begin + 3800].mean()
    assert early < late - 0.05 < 1.0


@pytest.mark.planted
@pytest.mark.parametrize("form", ["quartic", "cusp"])
def test_pinching_weakens_the_middle_of_the_stroke(damper: TrueDamper, form: str) -> None:
    motion = motion_of("sine", 0.01, 1.0, 3.0)
    ratio = np.abs(force(planted(damper, "pinching", form), motion)) / np.maximum(np.abs(force(damper, motion)), 1e-9)
    x, part = motion.displacement, slice(round(2.0 / motion.step_s), None)
    middle = ratio[part][np.abs(x[part]) < 5e-4].mean()
    outer = ratio[part][(np.abs(x[part]) > 0.006) & (np.abs(x[part]) < 0.008)].mean()
    assert middle < outer - 0.2


@pytest.mark.planted
@pytest.mark.parametrize("form", ["gas-spring", "bladder"])
def test_accumulator_is_a_spring(damper: TrueDamper, form: str) -> None:
    motion = motion_of("sine", 0.01, 0.5, 0.0)
    added = force(planted(damper, "accumulator", form, stiffness=800.0), motion) - force(damper, motion)
    slope = np.polyfit(motion.displacement, added, 1)[0]
    assert slope == pytest.approx(800.0, rel=0.15)


@pytest.mark.planted
@pytest.mark.parametrize("form", ["lagged", "plain"])
def test_inertia_follows_acceleration(damper: TrueDamper, form: str) -> None:
    motion = motion_of("sine", 0.005, 2.2, 0.0)
    added = force(planted(damper, "inertia", form, mass=8.0), motion) - force(damper, motion)
    assert np.polyfit(motion.acceleration, added, 1)[0] == pytest.approx(8.0, rel=0.05)


@pytest.mark.planted
@pytest.mark.parametrize("form", ["knee", "driver"])
def test_saturation_holds_the_force_at_high_current(damper: TrueDamper, form: str) -> None:
    hidden = planted(damper, "saturation", form)
    low, high = motion_of(level=1.0), motion_of(level=4.0)
    assert np.abs(force(hidden, low)).max() == pytest.approx(np.abs(force(damper, low)).max(), rel=0.05)
    assert np.abs(force(hidden, high)).max() < 0.8 * np.abs(force(damper, high)).max()


@pytest.mark.planted
@pytest.mark.parametrize("form", ["hertz", "rubber"])
def test_end_stop_acts_past_its_clearance_only(damper: TrueDamper, form: str) -> None:
    motion = motion_of("sine", 0.01, 1.0, 1.0)
    added = force(planted(damper, "end-stop", form, clearance=0.0085), motion) - force(damper, motion)
    past = np.abs(motion.displacement) > 0.0085
    assert np.abs(added[~past]).max() < 1e-9
    assert np.all(added[past] * motion.displacement[past] >= 0.0)
    assert np.abs(added).max() > 5.0


@pytest.mark.planted
@pytest.mark.parametrize("form", ["constant", "filter"])
def test_channel_skew_makes_the_force_channel_late(damper: TrueDamper, form: str) -> None:
    motion = motion_of("sine", 0.01, 1.0, 2.0)
    plain = force(damper, motion)
    late = force(planted(damper, "channel-skew", form, time=0.005), motion)
    moved = round(0.005 / motion.step_s)
    assert np.abs(late[moved:] - plain[:-moved])[4000:].mean() < 0.15 * np.abs(late - plain)[4000:].mean()


@pytest.mark.planted
def test_offsets_follow_test_or_drive(damper: TrueDamper) -> None:
    hidden = planted(damper, "offset", "with-drive")
    for current, expected in ((0.0, 0.0), (4.0, 3.0 * 4.0**1.2)):
        motion = motion_of(level=current)
        assert (force(hidden, motion) - force(damper, motion)).mean() == pytest.approx(expected, abs=1e-9)
    motion = motion_of()
    added = force(planted(damper, "offset", "per-test"), motion) - force(damper, motion)
    assert added.std() < 1e-9
    assert added.mean() == pytest.approx(5.0 * motion.offset_draw)


@pytest.mark.property
def test_every_name_can_be_drawn_and_is_undeclared() -> None:
    rng = np.random.default_rng(5)
    drawn = {draw_hidden_effect(rng, share=0.05).name for _ in range(400)}
    assert drawn == set(EFFECT_NAMES)
    assert not draw_hidden_effect(rng, ("unfamiliar",)).declared
    assert len(EFFECT_NAMES) == 16


@pytest.mark.golden
def test_an_unknown_effect_or_number_is_told() -> None:
    with pytest.raises(UserError, match=r"known: offset"):
        find_form("magic")
    with pytest.raises(UserError, match=r"known: gap, hardness"):
        Planted(find_form("backlash", "held"), {"gpa": 1.0})
