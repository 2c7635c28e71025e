"""Several linear devices in a structure: exact eigenvalues, braces, and gains for all dampers together."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.control.calibration import CalibrationOptions, calibrate
from mrpipe.control.laws import law_named
from mrpipe.control.placed import PlacedDamper, calibrate_placed, modes_together
from mrpipe.control.together import LinearDevice, damping_together, ground_response, linear_device
from mrpipe.errors import UserError
from mrpipe.structures import complex_modes, frequency_response, shear_frame
from mrpipe.structures.places import device_position

FRAME = shear_frame([20.0] * 4, [3.0e4] * 4, np.full(4, 0.01), name="four storeys", source="test")
FIRST, BETWEEN = device_position(FRAME, 1), device_position(FRAME, 3, 2)


@pytest.mark.property
def test_rigid_devices_are_part_of_the_matrices() -> None:
    devices = [LinearDevice(FIRST, 200.0, 1000.0), LinearDevice(BETWEEN, 150.0)]
    inside = FRAME
    for item in devices:
        outer = np.outer(item.position, item.position)
        inside = replace(
            inside, damping=inside.damping + item.viscosity * outer, stiffness=inside.stiffness + item.stiffness * outer
        )
    expected = complex_modes(inside, position=np.zeros(4))
    found = damping_together(FRAME, devices, [1, 2])
    np.testing.assert_allclose(found.poles, expected.poles[:2], rtol=1e-9)
    top = frequency_response(inside, 7.0, absolute_acceleration=False)[0]
    floors, strokes = ground_response(FRAME, devices, 7.0)
    np.testing.assert_allclose(floors, top, rtol=1e-9)
    np.testing.assert_allclose(strokes, [FIRST @ top, BETWEEN @ top], rtol=1e-9)


@pytest.mark.oracle
@pytest.mark.parametrize("brace", [2.0e4, 2.0e6])
def test_eigenvalue_with_a_brace_solves_the_dynamic_stiffness(brace: float) -> None:
    devices = [LinearDevice(FIRST, 400.0, 500.0, brace_n_m=brace), LinearDevice(BETWEEN, equivalent=900.0 + 2000.0j)]
    s = complex(damping_together(FRAME, devices, [1]).poles[0])
    dynamic = FRAME.stiffness + s * FRAME.damping + s**2 * FRAME.mass
    own = 500.0 + s * 400.0
    dynamic = dynamic + own * brace / (own + brace) * np.outer(FIRST, FIRST)
    dynamic = dynamic + (900.0 + 2000.0j) * np.outer(BETWEEN, BETWEEN)
    singular = np.linalg.svd(dynamic, compute_uv=False)
    assert singular[-1] < 1e-9 * singular[0]


@pytest.mark.oracle
def test_a_dashpot_behind_its_brace_moves_less_than_both_together() -> None:
    """The rod y of k_b (w'x - y) = c y' as a further unknown of the harmonic equations."""
    omega, c, brace = 9.0, 400.0, 2.0e4
    devices = [LinearDevice(FIRST, 200.0), LinearDevice(BETWEEN, c, brace_n_m=brace)]
    floors, strokes = ground_response(FRAME, devices, omega)
    equations = np.zeros((5, 5), dtype=complex)
    equations[:4, :4] = FRAME.stiffness + 1j * omega * FRAME.damping - omega**2 * FRAME.mass
    equations[:4, :4] += 200.0j * omega * np.outer(FIRST, FIRST) + brace * np.outer(BETWEEN, BETWEEN)
    equations[:4, 4], equations[4, :4], equations[4, 4] = -brace * BETWEEN, -brace * BETWEEN, brace + 1j * omega * c
    found = np.linalg.solve(equations, np.append(-FRAME.mass @ np.ones(4), 0.0))
    np.testing.assert_allclose(floors, found[:4], rtol=1e-9)
    np.testing.assert_allclose(strokes, [FIRST @ found[:4], found[4]], rtol=1e-9)
    assert abs(strokes[1]) < 0.99 * abs(BETWEEN @ floors)


@pytest.mark.property
@pytest.mark.parametrize("zeta", [0.4, 1.0, 1.5, 3.0])
def test_the_effective_damping_ratio_falls_beyond_critical_damping(zeta: float) -> None:
    """The poles of x'' + 2 zeta w x' + w^2 x are w (-zeta +- sqrt(zeta^2 - 1))."""
    mass, stiffness = 20.0, 3.0e4
    frame = shear_frame([mass], [stiffness], np.zeros(1), name="one storey", source="test")
    found = damping_together(frame, [LinearDevice(np.ones(1), 2.0 * zeta * math.sqrt(mass * stiffness))], [1])
    expected = zeta if zeta < 1.0 else zeta - math.sqrt(zeta**2 - 1.0)
    assert found.effective_ratios[0] == pytest.approx(expected, rel=1e-6)
    assert found.damping_ratios[0] == pytest.approx(min(zeta, 1.0), rel=1e-6)


@pytest.mark.property
def test_a_damper_alone_has_the_gains_of_the_calibration_of_one_damper() -> None:
    placed = calibrate_placed(FRAME, [PlacedDamper("base", FIRST, "vdns")], CalibrationOptions())
    single = calibrate(FRAME, FIRST, CalibrationOptions(), [law_named("vdns")])
    assert placed[0].together == single.laws["vdns"].gains


@pytest.mark.property
def test_gains_together_damp_the_target_mode_more_than_gains_alone() -> None:
    dampers = [PlacedDamper("base", FIRST, "vd"), PlacedDamper("third", BETWEEN, "fdns")]
    found = calibrate_placed(FRAME, dampers, CalibrationOptions())
    bare = replace(FRAME, damping=np.zeros_like(FRAME.damping))
    alone = modes_together(bare, found, [1], alone=True).damping_ratios[0]
    together = modes_together(bare, found, [1]).damping_ratios[0]
    assert together > alone
    # a small change of either gain does not damp more
    for place in (0, 1):
        for factor in (0.97, 1.03):
            law = law_named(found[place].damper.law)
            moved = list(found)
            moved[place] = replace(found[place], together=law.scaled(found[place].together, factor))
            assert modes_together(bare, moved, [1]).damping_ratios[0] <= together + 1e-7


@pytest.mark.property
def test_of_two_target_modes_the_one_that_gains_least_over_single_dampers_counts() -> None:
    low, high = device_position(FRAME, 2, 1), device_position(FRAME, 4, 3)
    dampers = [PlacedDamper("low", low, "vd"), PlacedDamper("high", high, "vd", mode=2)]
    found = calibrate_placed(FRAME, dampers, CalibrationOptions())
    bare = replace(FRAME, damping=np.zeros_like(FRAME.damping))
    alone = modes_together(bare, found, [1, 2], alone=True).damping_ratios

    def improvement(factors: tuple[float, float]) -> float:
        devices = [
            LinearDevice(item.damper.position, factor * item.together.c_n_s_m)
            for item, factor in zip(found, factors, strict=True)
        ]
        ratios = damping_together(bare, devices, [1, 2]).damping_ratios
        return float(np.min(ratios / alone))

    best = improvement((1.0, 1.0))
    assert best > 1.01
    for step in (0.95, 1.05):
        for factors in ((step, 1.0), (1.0, step), (step, step), (step, 1.0 / step)):
            assert improvement(factors) <= best + 1e-6


@pytest.mark.property
def test_a_given_gain_stays_and_a_brace_changes_the_best_gain() -> None:
    dampers = [PlacedDamper("base", FIRST, "vd", gains={"c_n_s_m": 321.0}), PlacedDamper("third", BETWEEN, "vd")]
    found = calibrate_placed(FRAME, dampers, CalibrationOptions())
    assert found[0].together.c_n_s_m == 321.0
    # a viscosity that is left out suits the stiffness that is given
    stiff = PlacedDamper("base", FIRST, "vdps", gains={"k_n_m": 3000.0})
    best = calibrate_placed(FRAME, [stiff], CalibrationOptions())[0].together
    assert best.k_n_m == 3000.0
    ratios = [
        damping_together(
            replace(FRAME, damping=np.zeros((4, 4))), [LinearDevice(FIRST, factor * best.c_n_s_m, 3000.0)], [1]
        ).damping_ratios[0]
        for factor in (0.97, 1.0, 1.03)
    ]
    assert max(ratios) == ratios[1]
    rigid, braced = (
        calibrate_placed(FRAME, [PlacedDamper("base", FIRST, "vd", brace_n_m=brace)], CalibrationOptions())[0]
        for brace in (math.inf, 3.0e4)
    )
    bare = replace(FRAME, damping=np.zeros_like(FRAME.damping))
    tried = linear_device(law_named("vd"), rigid.alone, FIRST, rigid.modes.omega_0, 1.0, 3.0e4)
    assert tried is not None
    with_brace = modes_together(bare, [braced], [1]).damping_ratios[0]
    assert with_brace > damping_together(bare, [tried], [1]).damping_ratios[0]
    assert with_brace < modes_together(bare, [rigid], [1]).damping_ratios[0]


@pytest.mark.property
def test_a_law_with_a_network_is_refused() -> None:
    with pytest.raises(UserError, match="network"):
        calibrate_placed(FRAME, [PlacedDamper("base", FIRST, "nnc")], CalibrationOptions())


@pytest.mark.literature
def test_two_dampers_of_one_degree_of_freedom_damp_it_critically_together() -> None:
    mass, stiffness = 100.0, 6400.0
    frame, place = shear_frame([mass], [stiffness], 0.0), np.ones(1)
    critical = 2.0 * math.sqrt(mass * stiffness)
    viscous = [PlacedDamper("left", place, "vd"), PlacedDamper("right", place, "vd")]
    found = calibrate_placed(frame, viscous, CalibrationOptions())
    assert [item.alone.c_n_s_m for item in found] == pytest.approx([critical, critical], rel=1e-6)
    assert sum(item.together.c_n_s_m for item in found) == pytest.approx(critical, rel=1e-6)
    # the damping of the equivalent grows without limit, but a third of the stiffness ends a vibration in half a cycle
    friction = [PlacedDamper("left", place, "fdns"), PlacedDamper("right", place, "vd", gains={"c_n_s_m": 80.0})]
    found = calibrate_placed(frame, friction, CalibrationOptions())
    assert found[0].together.alpha_n_m <= stiffness / 3.0 * (1.0 + 1e-9)
