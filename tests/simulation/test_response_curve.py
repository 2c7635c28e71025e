"""Response over frequency: exact for linear loops, independent of the grid, the loop's own resonance."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control.gains import Gains
from mrpipe.errors import UserError
from mrpipe.simulation import LoopOptions, simulate_law
from mrpipe.simulation.response_curve import ResponseCurve, response_curve
from mrpipe.simulation.steady_state import CurveOptions, steady_values
from mrpipe.simulation.windows import DISPLAYED, QUANTITIES, settled
from mrpipe.structures import Frame, frequency_response

from .conftest import Rig

EXACT = CurveOptions(points=5, settling_cycles=30, window_cycles=6, tolerance=1e-7, most_cycles=168)


def curve_of(
    rig: Rig, law: str, options: CurveOptions, gains: Gains | None = None, amplitude: float = 0.79
) -> ResponseCurve:
    controller = rig.controller(law, gains)
    chain = rig.damper.chain()
    return response_curve(
        lambda excitation: simulate_law(rig.frame, chain, controller, excitation, LoopOptions()),
        amplitude,
        (6.5, 12.0),
        options,
    )


@pytest.mark.oracle
@pytest.mark.parametrize(
    ("law", "gains"), [("vd", Gains(650.0)), ("vdps", Gains(400.0, 2500.0)), ("vdns", Gains(500.0, -1500.0))]
)
def test_an_unclipped_linear_law_follows_the_exact_frequency_response(rig: Rig, law: str, gains: Gains) -> None:
    w = rig.position
    controlled = Frame(
        rig.frame.mass,
        rig.frame.damping + gains.c_n_s_m * np.outer(w, w),
        rig.frame.stiffness + gains.k_n_m * np.outer(w, w),
    )
    controller = rig.controller(law, gains)
    options = LoopOptions(tracking="unclipped", plant_rate_hz=16000.0, record_rate_hz=16000.0)

    def run(excitation):  # type: ignore[no-untyped-def]
        return simulate_law(rig.frame, None, controller, excitation, options)

    for omega in (7.0, 9.2):
        found = steady_values(run, 0.79, omega, EXACT)
        motion = frequency_response(controlled, [omega], absolute_acceleration=False)[0] * 0.79 / np.sqrt(2.0)
        exact = np.abs(motion)
        assert found.steady
        # relative accelerations of harmonic motion are omega^2 times the displacements
        expected = [exact[-1], exact[0], omega**2 * exact[0], omega**2 * exact[-1], exact[0]]
        np.testing.assert_allclose(found.values[: len(DISPLAYED)], expected, rtol=1e-6)
        drift = np.abs(np.diff(motion, prepend=0.0)).max()
        shear = abs(rig.frame.mass.sum(axis=0) @ (0.79 / np.sqrt(2.0) - omega**2 * motion))
        named = dict(zip(QUANTITIES, found.values, strict=True))
        assert named["rms_drift_m"] == pytest.approx(drift, rel=1e-6)
        assert named["rms_base_shear_n"] == pytest.approx(shear, rel=1e-6)
        # the largest value of a sine is the square root of 2 times its RMS value
        for name in ("x_top_m", "x1_m", "a1_m_s2", "a_top_m_s2", "stroke_m", "drift_m", "base_shear_n"):
            assert named[f"max_{name}"] == pytest.approx(np.sqrt(2.0) * named[f"rms_{name}"], rel=1e-5)
        force = np.hypot(gains.k_n_m, omega * gains.c_n_s_m) * exact[0]
        assert named["max_force_n"] == pytest.approx(np.sqrt(2.0) * force, rel=1e-5)


@pytest.mark.property
@pytest.mark.parametrize("law", ["vd", "vdns"])
def test_half_the_frequency_step_changes_no_peak(rig: Rig, law: str) -> None:
    coarse = curve_of(rig, law, CurveOptions(points=15))
    fine = curve_of(rig, law, CurveOptions(points=29))
    for quantity in ("rms_x_top_m", "rms_a1_m_s2", "rms_a_top_m_s2"):
        assert coarse.peak(quantity) == pytest.approx(fine.peak(quantity), rel=5e-3)


@pytest.mark.literature
def test_the_loop_resonates_above_the_free_frequency(rig: Rig) -> None:
    # thesis 5.5.1 takes its values at the actual resonance frequency, which the damper raises above 8.0 rad/s
    curve = curve_of(rig, "vd", CurveOptions(points=15))
    assert 9.0 < curve.resonance_rad_s < 9.6
    assert curve.peak("rms_x_top_m") > 1.2 * float(np.interp(8.0, curve.frequency_rad_s, curve.column("rms_x_top_m")))


@pytest.mark.property
def test_passive_on_is_worst_at_its_own_resonance(rig: Rig) -> None:
    # a locked damper moves the resonance to that of the locked frame; a ranking at one frequency would not see it
    on, viscous = (curve_of(rig, law, CurveOptions(points=15)) for law in ("passive-on", "vd"))
    assert on.resonance_rad_s > 10.0
    assert on.peak("rms_x_top_m") > 2.0 * viscous.peak("rms_x_top_m")


@pytest.mark.property
def test_a_curve_says_what_it_holds(rig: Rig) -> None:
    curve = curve_of(rig, "vd", CurveOptions(points=5))
    found = curve.as_json()
    assert found["peak_rms_x_top_m"] == max(found["response_curve"]["rms_x_top_m"])
    assert len(found["response_curve"]["frequency_rad_s"]) == len(found["response_curve"]["rms_a1_m_s2"])
    assert found["response_curve"]["frequency_rad_s"] == sorted(found["response_curve"]["frequency_rad_s"])


@pytest.mark.property
def test_noise_is_averaged_and_a_drift_is_not_taken_for_noise() -> None:
    rng = np.random.default_rng(4)
    noisy = 1.0 + 0.01 * rng.standard_normal((40, 1))
    assert settled(noisy[:4], 1e-3) == 0
    assert settled(noisy, 3e-3) == 40
    # a response that still grows by 1 % from window to window is not steady, with or without noise
    assert settled(1.01 ** np.arange(12.0)[:, None], 2e-3) == 0


@pytest.mark.property
def test_a_law_that_commands_the_drive_has_no_force_for_a_perfect_damper(rig: Rig) -> None:
    with pytest.raises(UserError, match="commands the drive"):
        rig.run("passive-on", LoopOptions(tracking="ideal"))
