"""Response over frequency from the settings of a run: default band, nominal curve, warnings."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance, no_progress
from mrpipe.errors import UserError
from mrpipe.simulation import at_rest, harmonic, resonance
from mrpipe.simulation.resonance import curve_options, default_band, measure_resonance
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.settings import ResonanceSettings
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.simulation.windows import QUANTITIES

pytestmark = pytest.mark.property

EXCITATION = harmonic(0.8, 8.0, cycles=10, settling_cycles=5, ramp_cycles=2.0, decay_s=1.0)
BAND = (6.0, 10.0)


def _measured(
    monkeypatch: pytest.MonkeyPatch, top: dict[float, list[float]], settings: ResonanceSettings, error: float = 1e-4
) -> resonance.Curves:
    """Replace the loop by curves of three frequencies: amplitude -> top displacement."""

    def curve(
        _: object, amplitude: float, band: tuple[float, float], options: CurveOptions, jobs: int
    ) -> ResponseCurve:
        values = np.tile(np.array(top[round(amplitude, 9)])[:, None], (1, len(QUANTITIES)))
        return ResponseCurve(amplitude, np.array([band[0], 8.0, band[1]]), values, error * values, np.full(3, True))

    monkeypatch.setattr(resonance, "response_curve", curve)
    monkeypatch.setattr(resonance, "runner", lambda *_: None)
    rig = SimpleNamespace(controller=lambda law: law)
    rng = np.random.default_rng(1)
    return measure_resonance(rig, "vd", EXCITATION, BAND, settings, False, rng, no_progress)  # type: ignore[arg-type]


def test_one_curve_for_each_amplitude_and_the_nominal_one_first(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = ResonanceSettings(amplitude_factors=(0.5, 1.0, 2.0))
    tops = {0.4: [0.1, 0.2, 0.1], 0.8: [0.2, 0.5, 0.3], 1.6: [0.3, 0.9, 0.4]}
    found = _measured(monkeypatch, tops, settings)
    assert found.nominal.base_amplitude_m_s2 == 0.8 and found.warnings == ()
    shown = found.as_json()
    assert shown["peak_rms_x_top_m"] == 0.5 and shown["resonance_rad_s"] == 8.0
    assert [row["peak_rms_x_top_m"] for row in shown["amplitudes"]] == [0.2, 0.5, 0.9]
    assert [row["amplitude_factor"] for row in shown["amplitudes"]] == [0.5, 1.0, 2.0]


def test_a_peak_at_the_edge_and_growth_without_bound_are_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = ResonanceSettings(amplitude_factors=(1.0, 2.0))
    found = _measured(monkeypatch, {0.8: [0.1, 0.2, 0.3], 1.6: [0.1, np.inf, 0.3]}, settings)
    edge, growth = found.warnings
    assert "at the edge of the band, 10 rad/s; widen resonance.band_rad_s (6 to 10)" in edge
    assert "at 1.6 m/s² the response grows without bound" in growth


def test_a_largest_value_that_is_not_known_accurately_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    found = _measured(monkeypatch, {0.8: [0.1, 0.3, 0.2]}, ResonanceSettings(), error=0.008)
    (warning,) = found.warnings
    assert "does not become periodic" in warning and "0.8 %" in warning and "resonance.most_averaged_cycles" in warning
    assert found.as_json()["standard_error_rms_x_top_m"] == pytest.approx(0.0024)


@pytest.mark.parametrize("band", [(0.0, 5.0), (9.0, 6.0)])
def test_an_empty_band_is_refused(band: tuple[float, float]) -> None:
    with pytest.raises(UserError, match="give a positive rising band"):
        measure_resonance(None, "vd", EXCITATION, band, ResonanceSettings(), False, None, no_progress)  # type: ignore[arg-type]


def test_a_motion_without_amplitude_is_refused() -> None:
    with pytest.raises(UserError, match="set kind: harmonic"):
        measure_resonance(None, "vd", at_rest(5.0), BAND, ResonanceSettings(), False, None, no_progress)  # type: ignore[arg-type]


def test_the_band_spans_the_free_and_the_locked_frequency(tmp_path) -> None:
    with ArtifactWriter.create(tmp_path / "control.h5", Provenance("calibrate")) as artifact:
        artifact.put("omega_0", 8.0, unit="rad/s")
        artifact.put("omega_inf", 10.0, unit="rad/s")
    low, high = default_band(Artifact(tmp_path / "control.h5"))
    assert low < 8.0 < 10.0 < high


def test_every_setting_of_the_curve_reaches_its_options() -> None:
    settings = ResonanceSettings(points=7, tolerance=0.01, window_cycles=3, most_cycles=30)
    options = curve_options(settings.changed(standard_error=0.02, most_averaged_cycles=50), absolute=True)
    assert (options.standard_error, options.most_averaged_cycles) == (0.02, 50)
    assert (options.points, options.tolerance, options.window_cycles, options.most_cycles) == (7, 0.01, 3, 30)
    assert options.absolute
