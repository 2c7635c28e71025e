"""Printed figures of chapter 4 and P2, corrected as the errata says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from mrpipe.control import exact, limits
from mrpipe.control.calibration import (
    CalibrationOptions,
    _force_weight,
    balanced_weights,
    calibrate,
    plant_of,
)
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.control.linearisation import (
    clipped_force,
    clipped_linear_stiffness,
    equivalent_stiffness,
    friction_stiffness,
)
from mrpipe.control.lqg import Weights
from mrpipe.control.placed_storage import placed_dampers
from mrpipe.errors import UserError
from mrpipe.structures import Frame, complex_modes, floor_position, shear_frame, storey_position
from mrpipe.structures.options import DamperSettings
from mrpipe.thesis.gains import THESIS_GAINS


@pytest.fixture(scope="module")
def modes(thesis_frame, floor_one):
    return limits.limiting_modes(thesis_frame, floor_one)


@pytest.fixture(scope="module")
def bare(thesis_frame):
    return exact.undamped(thesis_frame)


@pytest.mark.literature
def test_limiting_frequencies_and_flexibility(modes, thesis_frame, floor_one):
    assert modes.omega_0 == pytest.approx(8.000, rel=1e-3)
    assert modes.omega_inf == pytest.approx(10.450, rel=6e-3)
    assert modes.nu == pytest.approx(1.5404e-4, rel=2e-3)
    assert thesis_frame.stiffness[0, 0] == pytest.approx(9556.0, rel=7e-3)
    assert limits.static_stiffness(thesis_frame, floor_one) == pytest.approx(4123.0, rel=1e-3)
    assert modes.shape_0 @ thesis_frame.mass @ modes.shape_0 == pytest.approx(1.0)
    assert modes.shape_inf @ thesis_frame.mass @ modes.shape_inf == pytest.approx(1.0)
    assert floor_one @ modes.shape_inf == pytest.approx(0.0, abs=1e-12)


@pytest.mark.literature
def test_closed_forms(modes):
    assert limits.optimal_viscosity(modes) == pytest.approx(811.0, rel=5e-3)
    assert limits.optimal_viscosity_thesis(modes) == pytest.approx(704.0, rel=5e-3)
    assert limits.optimal_viscosity(modes, -4500.0) == pytest.approx(249.0, rel=5e-3)
    assert limits.optimal_viscosity_thesis(modes, -4500.0) == pytest.approx(141.0, rel=5e-3)
    assert limits.optimal_friction(modes) == pytest.approx(4010.0, rel=1e-2)
    assert limits.optimal_force_ratio(modes) == pytest.approx(1.24 / modes.nu, rel=1e-2)
    assert limits.attainable_damping(modes) == pytest.approx(0.133, rel=1e-2)
    assert limits.attainable_damping(modes, -4500.0) == pytest.approx(0.433, rel=1e-2)
    assert limits.attainable_damping_friction(modes) == pytest.approx(0.273, rel=1e-2)


@pytest.mark.literature
def test_exact_viscous_damping(bare, floor_one, modes):
    def ratio(c):
        return exact.exact_damping(bare, floor_one, modes, c, 0.0).damping_ratio

    assert ratio(650.0) == pytest.approx(0.154, abs=5e-4)
    assert ratio(538.0) == pytest.approx(0.160, abs=5e-4)
    best = exact.best_gain(ratio, 3000.0)
    assert best.gain == pytest.approx(538.0, rel=5e-3)


@pytest.mark.literature
def test_exact_friction_damping(bare, floor_one, modes):
    best = exact.best_gain(lambda a: exact.exact_friction(bare, floor_one, modes, a).damping_ratio, 6500.0)
    assert best.gain == pytest.approx(3130.0, rel=5e-3)
    assert best.damping_ratio == pytest.approx(0.284, abs=1e-3)
    # with the equivalent viscosity taken at omega_0 in place of a loop that does not depend on frequency
    c = 4.0 * 3000.0 / (np.pi * modes.omega_0)
    assert exact.exact_damping(bare, floor_one, modes, c, -3000.0).damping_ratio == pytest.approx(0.288, abs=1e-3)


@pytest.mark.literature
def test_negative_stiffness_beyond_the_static_limit_folds(bare, thesis_frame, floor_one, modes):
    answer = exact.exact_damping(bare, floor_one, modes, 250.0, -4500.0)
    assert not answer.stable and answer.unstable_pole == pytest.approx(1.29, abs=0.01)
    assert answer.damping_ratio == -1.0
    assert exact.exact_damping(bare, floor_one, modes, 250.0, -4000.0).stable


@pytest.mark.property
def test_a_damper_that_hardly_acts_on_the_target_mode_is_reported(thesis_frame, floor_one, modes):
    assert limits.inherent_damping(thesis_frame, modes) < limits.attainable_damping(modes)
    assert limits.placement_warning(thesis_frame, modes) == ""
    # the first storey is so stiff that floor 1 hardly moves
    frame = shear_frame([100.0] * 4, [4e6, 2e4, 2e4, 2e4], [0.02] * 4)
    near = limits.limiting_modes(frame, floor_position(4, 1))
    said = limits.placement_warning(frame, near)
    assert limits.attainable_damping(near) < limits.inherent_damping(frame, near) == pytest.approx(0.02, rel=0.05)
    assert said.startswith("the damper hardly acts on mode 1: locking it raises the frequency of the mode only from ")
    assert "and the mode has 0.02 without it" in said


@pytest.mark.oracle
@pytest.mark.parametrize("c,k", [(100.0, 0.0), (650.0, 0.0), (400.0, 2500.0), (300.0, -2000.0)])
def test_exact_damping_is_that_of_the_state_space(thesis_frame, floor_one, modes, c, k):
    ours = exact.exact_damping(thesis_frame, floor_one, modes, c, k)
    poles = complex_modes(thesis_frame, position=floor_one, damping=c, stiffness=k)
    assert np.min(np.abs(poles.poles - ours.pole)) < 1e-6


@pytest.mark.property
@pytest.mark.parametrize("c,k", [(250.0, -4500.0), (400.0, 2500.0), (650.0, 0.0), (10.0, -3000.0)])
def test_clipped_linearisation_is_the_fourier_integral(c, k):
    exactly = clipped_linear_stiffness(c, k, 8.0)
    sampled = equivalent_stiffness(lambda x, v: clipped_force(c, k, x, v), 0.01, 8.0)
    assert abs(exactly - sampled) < 1e-5 * abs(exactly)
    friction = equivalent_stiffness(lambda x, v: 3000.0 * (np.sign(v) * 0.01 - x), 0.01, 8.0)
    assert abs(friction - friction_stiffness(3000.0)) < 1e-5 * abs(friction)


@pytest.mark.property
@pytest.mark.parametrize("floors,mode,floor", [(3, 1, 1), (5, 2, 2), (8, 1, 3)])
def test_any_mode_and_any_position(floors, mode, floor):
    frame = shear_frame(np.full(floors, 6.0), np.full(floors, 5000.0), 0.002)
    for position in (floor_position(floors, floor), storey_position(floors, floor)):
        modes = limits.limiting_modes(frame, position, mode)
        assert modes.omega_inf > modes.omega_0
        # a light damper adds u_0^2 c/(2 omega_0) to first order, in the estimate as in the eigenvalue
        c = 1e-3 * limits.optimal_viscosity(modes)
        added = modes.u_0**2 * c / (2.0 * modes.omega_0)
        answer = exact.exact_damping(exact.undamped(frame), position, modes, c, 0.0)
        assert answer.damping_ratio == pytest.approx(added, rel=2e-3)


MASS, STIFFNESS = 100.0, 6400.0


def oscillator():
    return shear_frame([MASS], [STIFFNESS], 0.0)


def optimal_viscosity_of_an_oscillator(stiffness):
    return limits.optimal_viscosity(limits.limiting_modes(oscillator(), np.ones(1)), stiffness)


@pytest.mark.golden
def test_bad_input_is_told_in_one_line(thesis_frame, floor_one):
    cases = [
        (lambda: limits.limiting_modes(thesis_frame, floor_one, 5), "mode 5 is the last one that moves the damper"),
        (lambda: limits.limiting_modes(thesis_frame, floor_one, 6), "mode: is 6; with 5 .* 1 to 4"),
        (lambda: limits.limiting_modes(thesis_frame, np.zeros(5)), "not all zero"),
        (
            lambda: limits.limiting_modes(Frame(np.eye(1), np.zeros((1, 1)), np.eye(1)), np.ones(1), 2),
            "with one degree of freedom it is 1",
        ),
        (
            lambda: optimal_viscosity_of_an_oscillator(-7000.0),
            "negative_stiffness_n_m: is -7000 N/m, so that the structure has no stiffness with the damper; above -6400",
        ),
        (
            lambda: limits.limiting_modes(
                Frame(np.diag([1.0, 0.0, 1.0]), np.zeros((3, 3)), np.eye(3)), np.array([1.0, 0.0, 0.0])
            ),
            "mass: is singular",
        ),
        (
            lambda: calibrate(thesis_frame, floor_one, CalibrationOptions(overrides={"vd": {"c_n_s_m": 0.0}})),
            "vd: c_n_s_m: is 0; law vd needs a positive c_n_s_m",
        ),
        (
            lambda: calibrate(thesis_frame, floor_one, CalibrationOptions(overrides={"vdns": Gains(250.0, 4000.0)})),
            "law vdns needs a negative k_n_m",
        ),
        (
            lambda: CalibrationOptions(published={"vdd": {"c_n_s_m": 5.0}}),
            "^calibrate.published: vdd: is not a control law; one of vd, vdps",
        ),
        (
            lambda: CalibrationOptions(published={"vd": {"c": 5.0}}),
            "^calibrate.published: vd.c: law vd has no such gain; it has: c_n_s_m",
        ),
        (
            lambda: CalibrationOptions(published={"vd": {"c_n_s_m": -5.0}}),
            "^calibrate.published: vd.c_n_s_m: is -5; law vd needs a positive c_n_s_m",
        ),
        (
            lambda: calibrate(thesis_frame, floor_one, CalibrationOptions(overrides={"vd": Gains(-1.0)})),
            "law vd needs a positive c_n_s_m",
        ),
    ]
    for call, words in cases:
        with pytest.raises(UserError, match=words) as caught:
            call()
        assert "\n" not in str(caught.value)


@pytest.mark.golden
def test_sources_of_gains(thesis_frame, floor_one):
    for source, c in (("published", 650.0), ("closed-form", 811.5), ("exact", 537.9)):
        options = CalibrationOptions(source=source, published=THESIS_GAINS, weights=Weights())
        calibration = calibrate(thesis_frame, floor_one, options, [law_named("vd"), law_named("fdns")])
        assert calibration.laws["vd"].gains.c_n_s_m == pytest.approx(c, rel=1e-3)
    gains = calibration.laws["fdns"].gains
    assert law_named("fdns").gains_as_json(gains) == {"alpha_n_m": pytest.approx(3127.6, rel=1e-3)}


@pytest.mark.property
def test_modes_across_the_damper_do_not_count() -> None:
    along = shear_frame([25.0] * 3, [3.0e4] * 3, 0.01)
    across = shear_frame([25.0] * 3, [2.0e4] * 3, 0.01)
    both = Frame(*(block_diag(getattr(across, key), getattr(along, key)) for key in ("mass", "damping", "stiffness")))
    w = np.eye(6)[3]
    expected = limits.limiting_modes(along, w[3:], 1)
    found = limits.limiting_modes(both, w, 2)
    assert (found.omega_0, found.omega_inf) == pytest.approx((expected.omega_0, expected.omega_inf))
    assert found.u_0**2 == pytest.approx(expected.u_0**2)
    with pytest.raises(
        UserError, match="mode 1 does not move the damper; choose another place, or a target mode among 2, "
    ):
        limits.limiting_modes(both, w, 1)
    entries = (DamperSettings(between=(4, "ground")), DamperSettings(between=(1, "ground")))
    assert [item.mode for item in placed_dampers(both, entries, 1)] == [2, 1]


@pytest.mark.property
def test_an_overdamped_mode_has_the_gain_of_critical_damping():
    """Beyond this gain the damping ratio stays 1, the mode returns more slowly, and other modes are damped less."""
    frame = shear_frame([33.0, 25.4, 8.3], [6.2e4, 4.1e4, 3.3e4], 0.0)
    position = np.eye(3)[1]
    modes = limits.limiting_modes(frame, position)

    def answer(c):
        return exact.exact_damping(frame, position, modes, c, 0.0)

    best = exact.best_gain(lambda c: answer(c).damping_ratio, 4.0 * limits.optimal_viscosity(modes))
    assert best.damping_ratio == pytest.approx(1.0, abs=1e-6)
    assert answer(0.999 * best.gain).damping_ratio < 1.0
    assert answer(1.001 * best.gain).damping_ratio == pytest.approx(1.0, abs=1e-9)


@pytest.mark.property
@pytest.mark.parametrize(
    "weights", [{}, {"energy": 0.0, "top_displacement": 1e6}, {"energy": 3.0, "top_displacement": 400.0}]
)
@pytest.mark.parametrize("inherent", [0.0, 0.03])
def test_the_regulator_has_twice_the_damping_of_viscous_damping(weights, inherent):
    """By complex eigenvalues, for dampers that hardly act on mode 1 and for dampers that overdamp it."""
    for frame, position in (
        (shear_frame([40.0, 5.0], [9e3, 9e4], inherent), np.array([-1.0, 1.0])),
        (shear_frame([25.0] * 5, [3e4] * 5, inherent), np.eye(5)[0]),
        (shear_frame([100.0] * 3, [1e4, 2e5, 2e5], inherent), np.eye(3)[0]),
        (oscillator(), np.ones(1)),
    ):
        modes = limits.limiting_modes(frame, position)
        options = CalibrationOptions(weights=balanced_weights(frame, position, modes, **weights))
        found = calibrate(frame, position, options, [law_named("lqg"), law_named("vd")]).laws
        expected = min(2.0 * found["vd"].damping_ratio_exact, np.sqrt(0.5))
        assert found["lqg"].damping_ratio_exact == pytest.approx(expected, rel=2e-3)


@pytest.mark.property
def test_the_weight_of_a_damping_ratio_that_no_weight_reaches_has_the_largest_one():
    """A ratio with its maximum of 0.3 at a weight of 1e-3, and the weight from either side of the start."""
    tried = []

    def ratio(weight):
        tried.append(weight)
        return 0.3 / np.cosh(0.5 * np.log(weight / 1e-3))

    assert _force_weight(ratio, 0.5, 1.0) == pytest.approx(1e-3, rel=1e-2)
    for start in (1e-2, 1.0, 100.0):
        assert ratio(_force_weight(ratio, 0.1, start)) == pytest.approx(0.1, rel=1.1e-3)
    assert len(tried) < 80


@pytest.mark.golden
def test_a_regulator_without_weights_is_refused(thesis_frame, floor_one, modes):
    with pytest.raises(
        UserError, match=r"^calibrate\.regulator: energy_weight: is 0, and so is top_displacement_weight"
    ):
        balanced_weights(thesis_frame, floor_one, modes, energy=0.0)


@pytest.mark.literature
def test_one_degree_of_freedom_has_the_gains_of_the_textbook():
    """Critical damping is 2 sqrt(m (k_0 + k)); the energy of a cycle gives the damping ratio of a weaker device."""
    modes = limits.limiting_modes(oscillator(), np.ones(1))
    assert (modes.omega_0, modes.omega_inf, modes.nu) == (pytest.approx(8.0), np.inf, 0.0)
    assert modes.modal_stiffness == pytest.approx(STIFFNESS)
    found = calibrate(oscillator(), np.ones(1), CalibrationOptions())
    assert set(found.skipped) == {"lyapunov"}  # no inherent damping
    for law, share in (("vd", 0.0), ("vdps", 0.5), ("vdns", -0.8)):
        gains = found.laws[law].gains
        assert gains.k_n_m == pytest.approx(share * STIFFNESS)
        assert gains.c_n_s_m == pytest.approx(2.0 * np.sqrt(MASS * (1.0 + share) * STIFFNESS), rel=1e-6)
        assert found.laws[law].damping_ratio_exact == pytest.approx(1.0, abs=1e-8)
        assert found.laws[law].candidates["closed-form"].c_n_s_m == pytest.approx(gains.c_n_s_m, rel=1e-6)
    assert found.laws["sky-hook"].gains.c_n_s_m == pytest.approx(1600.0, rel=1e-6)
    weak = CalibrationOptions(overrides={"vd": {"c_n_s_m": 80.0}, "vdps": {"c_n_s_m": 80.0, "k_n_m": 3600.0}})
    found = calibrate(oscillator(), np.ones(1), weak, [law_named("vd"), law_named("vdps")])
    assert found.laws["vd"].damping_ratio_estimate == pytest.approx(0.05, rel=1e-6)
    assert found.laws["vd"].damping_ratio_exact == pytest.approx(0.05, rel=1e-9)
    assert found.laws["vdps"].damping_ratio_exact == pytest.approx(0.04, rel=1e-9)


def extrema(force, count=6):
    """Extrema of a free vibration of the oscillator from 1 m, integrated over half cycles with small steps."""
    x, v, last, found = 1.0, 0.0, 1.0, []
    side, step = -1.0, 5e-5
    for _ in range(80_000):
        a = -(STIFFNESS * x + force(x, side, last)) / MASS
        if v == 0.0 and a * side <= 0.0:
            return found  # held
        v += step * a
        x += step * v
        if v * side < 0.0:
            v, side, last = 0.0, -side, abs(x)
            found.append(x)
            if len(found) == count:
                break
    return found


@pytest.mark.oracle
@pytest.mark.parametrize(
    "law,force",
    [
        ("fdns", lambda x, side, last, g: g * (side * last - x)),
        ("homogeneous-friction", lambda x, side, last, g: g * side * last),
    ],
)
def test_friction_ends_the_free_vibration_of_one_degree_of_freedom_in_half_a_cycle(law, force):
    options = CalibrationOptions(weights=Weights())
    gain = calibrate(oscillator(), np.ones(1), options, [law_named(law)]).laws[law].gains.alpha_n_m
    remaining = {
        share: abs(extrema(lambda x, side, last, g=share * gain: force(x, side, last, g), 1)[0])
        for share in (0.5, 0.9, 1.0, 1.1)
    }
    assert remaining[1.0] < 1e-3 < 0.05 < remaining[0.9] < remaining[0.5]
    assert remaining[1.1] > 0.05
    held = 1.001 * {"fdns": 1.5, "homogeneous-friction": 2.0}[law] * gain
    assert extrema(lambda x, side, last: force(x, side, last, held)) == []


@pytest.mark.property
def test_friction_does_not_hold_an_isolated_structure(thesis_frame):
    """The equivalent of fdns has its optimum at several times the stiffness of the isolation, where nothing moves."""
    isolated = shear_frame([100.0] * 3, [1e4, 2e5, 2e5], 0.02)
    for frame, place in ((isolated, np.eye(3)[0]), (thesis_frame, np.eye(5)[1])):
        modes = limits.limiting_modes(frame, place)
        laws = [law_named(name) for name in ("fdns", "fdns-bounded", "homogeneous-friction")]
        options = CalibrationOptions(weights=Weights())
        found, plant = calibrate(frame, place, options, laws).laws, plant_of(frame, place, options)
        for name in ("fdns", "fdns-bounded"):
            assert found[name].gains.alpha_n_m == pytest.approx(modes.modal_stiffness / 3.0)
        assert found["homogeneous-friction"].gains.alpha_n_m < modes.modal_stiffness
        for law in laws:
            low, high = law.gains[0].bounds(plant)
            assert low < 0.5 * found[law.name].gains.alpha_n_m < 1.5 * found[law.name].gains.alpha_n_m < high


@pytest.mark.property
def test_a_single_mode_among_others_is_that_of_one_degree_of_freedom():
    """A damper along x of a mass that the springs do not couple to y."""
    frame = Frame(MASS * np.eye(2), np.zeros((2, 2)), np.diag([4.0 * STIFFNESS, STIFFNESS]))
    with pytest.raises(UserError, match="mode 1 does not move the damper"):
        limits.limiting_modes(frame, np.array([1.0, 0.0]), 1)
    found = calibrate(frame, np.array([1.0, 0.0]), CalibrationOptions(mode=2), [law_named("vd")])
    assert found.laws["vd"].gains.c_n_s_m == pytest.approx(3200.0, rel=1e-6)


@pytest.mark.property
def test_viscosity_is_calibrated_for_the_stiffness_that_is_given(thesis_frame, floor_one):
    given, default = (
        calibrate(thesis_frame, floor_one, item, [law_named("vdns")]).laws["vdns"].gains
        for item in (
            CalibrationOptions(overrides={"vdns": {"k_n_m": -2000.0}}),
            CalibrationOptions(negative_stiffness_n_m=-2000.0),
        )
    )
    assert given == default
