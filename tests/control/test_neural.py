"""Loops on which the network of nnc is trained, for a structure."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control.calibration_settings import NeuralReferenceSettings
from mrpipe.control.limits import limiting_modes
from mrpipe.control.neural import reference_options
from mrpipe.structures import floor_position, frame_from_parameter_set, natural_modes


@pytest.mark.property
@pytest.mark.parametrize("mode", [1, 2])
def test_the_loops_lie_about_the_free_mode_and_the_expected_amplitude(mode: int) -> None:
    frame = frame_from_parameter_set("thesis")
    modes = limiting_modes(frame, floor_position(frame.floors), mode)
    settings = NeuralReferenceSettings()
    options = reference_options(settings, 3000.0, frame, modes, 0.01, 0.0125)
    frequencies, amplitudes = np.array(options.frequencies_hz), np.array(options.amplitudes_m)
    assert (len(frequencies), len(amplitudes)) == (settings.frequencies, settings.amplitudes)
    # the free mode is in the middle of the frequencies on a logarithmic scale
    assert np.sqrt(frequencies[0] * frequencies[-1]) == pytest.approx(modes.omega_0 / (2.0 * np.pi))
    assert (amplitudes[0], amplitudes[-1]) == (pytest.approx(0.002), pytest.approx(0.02))
    # disturbances are the other modes, as far as the rate of the network shows them
    others = np.delete(natural_modes(frame).angular_frequencies, mode - 1)
    assert options.disturbances_rad_s == tuple(others[others < 0.5 * np.pi * settings.rate_hz])
    assert options.displacement_noise_m == pytest.approx(2e-5)
