"""The loop with several dampers as settings and artifacts describe it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrpipe.control.settings import ControllerSettings
from mrpipe.errors import UserError
from mrpipe.simulation.resonance import BAND
from mrpipe.simulation.settings import ExcitationSettings, SimulateSettings
from mrpipe.simulation.several_dampers_rig import (
    DampersRig,
    controller_of,
    dampers_band,
    dampers_excitation,
    dampers_release,
    read_dampers_rig,
)
from mrpipe.structures import natural_modes
from mrpipe.structures.options import DamperSettings, StructureSettings
from tests.control.placed import AMPLITUDE_M, FRAME, TWO, structure, write_artifacts

from .independent_control import Central

pytestmark = pytest.mark.property


def rig_of(folder: Any, settings: StructureSettings = TWO, **simulate: Any) -> DampersRig:
    artifacts = write_artifacts(folder, settings)
    return read_dampers_rig(SimulateSettings(**simulate), settings, "set-c", artifacts.__getitem__)


def test_factors_multiply_the_tuned_gains_of_the_dampers_they_name(tmp_path) -> None:
    rig = rig_of(tmp_path)
    plain, scaled = rig.gains(), rig.gains({"low": 2.0})
    assert scaled[0].c_n_s_m == pytest.approx(2.0 * plain[0].c_n_s_m)
    assert scaled[1] == plain[1]
    assert [item.name for item in rig.loop_dampers()] == ["low", "damper 2"]
    assert [item.brace_n_m for item in rig.loop_dampers()] == [4.0e5, np.inf]
    assert len(rig.devices()) == 2 and rig.regulator(rig.loop_dampers()) is None


def test_at_the_adjusted_amplitude_no_damper_moves_more_than_expected(tmp_path) -> None:
    linear = structure({"between": (1, "ground"), "law": "vd"}, {"between": (3, 2), "law": "vdps"})
    rig = rig_of(tmp_path, linear, tracking="unclipped")
    omega = float(natural_modes(FRAME).angular_frequencies[0])
    settings = ExcitationSettings(kind="harmonic", cycles=40, settling_cycles=30, decay_s=0.0)
    excitation = dampers_excitation(rig, settings)
    assert excitation.details["frequency_rad_s"] == pytest.approx(rig.dampers[0].known.calibrated.omega_0)
    response = rig.run(excitation)
    late = response.first.time_s > 30.0 * 2.0 * np.pi / omega
    strokes = [float(np.abs(item.damper_displacement[late]).max()) for item in response.dampers.values()]
    assert max(strokes) == pytest.approx(AMPLITUDE_M, rel=0.01)


def test_release_gives_the_first_damper_its_expected_amplitude(tmp_path) -> None:
    rig = rig_of(tmp_path)
    free = dampers_release(rig, ExcitationSettings(kind="free-decay"))
    assert free is not None
    assert abs(free[0]) == pytest.approx(AMPLITUDE_M) and np.all(free[3:] == 0.0)
    given = dampers_release(rig, ExcitationSettings(kind="free-decay", release_top_m=0.05))
    assert given is not None and given[2] == pytest.approx(0.05)
    assert dampers_release(rig, ExcitationSettings(kind="harmonic")) is None


def test_the_band_spans_all_dampers(tmp_path) -> None:
    low, high = dampers_band(rig_of(tmp_path))
    omega = natural_modes(FRAME).angular_frequencies[0]
    assert 0.5 * omega < low < omega < high < 2.0 * omega


def test_the_band_of_two_target_modes_contains_both(tmp_path) -> None:
    # the gains do not matter here, and given ones need no search
    upper = {"between": (3, 2), "law": "vd", "target_mode": 2, "gains": {"c_n_s_m": 400.0}}
    both = structure({"between": (1, "ground"), "law": "vd", "gains": {"c_n_s_m": 900.0}}, upper)
    low, high = dampers_band(rig_of(tmp_path, both))
    first, second = natural_modes(FRAME).angular_frequencies[:2]
    assert low == pytest.approx(BAND[0] * first)
    assert high > second


def test_without_a_linear_equivalent_the_amplitude_has_to_be_given(tmp_path) -> None:
    rig = rig_of(tmp_path, structure({"between": (1, "ground"), "law": "passive-on"}))
    with pytest.raises(UserError, match="base_amplitude_m_s2: is not given"):
        dampers_excitation(rig, ExcitationSettings(kind="harmonic"))
    given = dampers_excitation(rig, ExcitationSettings(kind="harmonic", base_amplitude_m_s2=0.5))
    assert given.details["base_amplitude_m_s2"] == 0.5


@pytest.mark.parametrize("simulate", [{"frame": "thesis"}, {"damper": "traced"}])
def test_settings_of_a_single_damper_are_refused(tmp_path, simulate: dict[str, str]) -> None:
    with pytest.raises(UserError, match="the section structure gives the structure and its dampers"):
        rig_of(tmp_path, **simulate)


@pytest.mark.parametrize(
    ("sensors", "velocity"),
    [
        (("displacement", "acceleration"), "kalman"),
        (("displacement",), "difference"),
        (("displacement", "velocity"), "measured"),
    ],
)
def test_the_velocity_comes_from_the_sensors_that_are_there(sensors: tuple[str, ...], velocity: str) -> None:
    entry = DamperSettings(between=(1, "ground"), sensors=sensors)
    found = controller_of(entry, ControllerSettings(velocity="kalman"))
    assert (found.velocity, found.inverse) == (velocity, "model")


def test_dampers_under_lqg_share_one_regulator(tmp_path) -> None:
    both = structure({"between": (1, "ground"), "law": "lqg"}, {"between": (3, 2), "law": "vd"}, accelerometers=(1, 3))
    rig = rig_of(tmp_path, both)
    assert rig.accelerometers == (0, 2)
    dampers = rig.loop_dampers()
    assert [item.central for item in dampers] == [True, False]
    assert rig.regulator(dampers) is not None


@pytest.mark.oracle
def test_the_regulator_knows_braces_and_the_gains_of_the_other_dampers(tmp_path) -> None:
    """Its matrices are those of an independent regulator, for the calibrated gains and for the gains of a design."""
    braced = structure(
        {"between": (1, "ground"), "name": "low", "gains": {"c_n_s_m": 900.0}, "brace_stiffness_n_m": 3.0e4},
        {"between": (3, 2), "law": "lqg", "brace_stiffness_n_m": 5.0e4},
        accelerometers=(1, 3),
    )
    rig = rig_of(tmp_path, braced)
    low, upper = rig.dampers
    omega, weights = low.known.calibrated.omega_0, upper.known.calibrated.weights
    for factor in (1.0, 1.7):
        c = factor * low.gains.c_n_s_m
        # spring 1/k_b in series with the dashpot c
        own = 1.0 / (1.0 / 3.0e4 + 1.0 / (1j * omega * c))
        C, K = FRAME.damping.copy(), FRAME.stiffness.copy()
        C[0, 0] += own.imag / omega
        K[0, 0] += own.real
        expected = Central(
            FRAME.mass,
            C,
            K,
            np.array([[0.0, -1.0, 1.0]]),
            0.005,
            weights=[weights.force],
            floors=(0, 2),
            force_noise=[weights.force_noise_n],
            flexibilities=[2.0e-5],
        )
        found = rig.regulator(rig.loop_dampers({"low": factor}))
        assert found is not None
        for ours, theirs in (
            (found.gain, expected.K),
            (found.transition, expected.Ad - expected.L @ expected.C),
            (found.force_input, expected.Bd[:, 1:] - expected.L @ expected.D),
            (found.innovation, np.column_stack([expected.Bd[:, 0], expected.L])),
        ):
            np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-8 * np.abs(theirs).max())
