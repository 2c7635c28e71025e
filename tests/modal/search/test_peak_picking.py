"""Peak picking on planted frames: near the truth, and less exact than the multi-mode fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.modal.identify import identify_frame
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.recordings import frame_tests
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search.peak_picking import transfer_functions
from mrpipe.structures import frame_from_parameter_set, modal_assurance, natural_modes
from tests.modal.rig import Rig, campaign_of, full_set

RIG = Rig(noise=0.01, rate=250.0, sweep_s=120.0, decay_s=20.0)
PEAKS = IdentificationOptions(modes_from="peak-picking", orthogonal_shapes=False)


@pytest.fixture(scope="module")
def tests() -> object:
    frame = frame_from_parameter_set("thesis")
    return frame_tests(campaign_of(frame, full_set(frame, np.random.default_rng(4), RIG), Path("planted"), None))


@pytest.mark.planted
def test_frequencies_and_signs_of_the_shapes_are_found(tests) -> None:  # type: ignore[no-untyped-def]
    modes = natural_modes(frame_from_parameter_set("thesis"))
    picked = identify_frame(tests, PEAKS)
    omega = np.array([item.value for item in picked.frequencies])
    assert picked.amplitude is None
    # three lines of 0.052 rad/s are averaged in a spectrum of two minutes
    assert np.abs(omega - modes.angular_frequencies).max() < 1.5 * 2.0 * np.pi / 120.0
    assert np.diag(modal_assurance(picked.mode_shapes, modes.mode_shapes)).min() > 0.99
    fitted = identify_frame(tests, IdentificationOptions(orthogonal_shapes=False))
    exact = np.array([item.value for item in fitted.frequencies])
    assert np.abs(exact - modes.angular_frequencies).max() < np.abs(omega - modes.angular_frequencies).max()
    # the interval of a picked frequency is that of the averaged lines, that of the fit is narrower
    assert picked.frequencies[0].half_width > 5.0 * fitted.frequencies[0].half_width


@pytest.mark.planted
@pytest.mark.parametrize("method", ["logarithmic-decrement", "point-to-point", "linear-fit"])
def test_damping_is_read_as_the_setting_says(tests, method: str) -> None:  # type: ignore[no-untyped-def]
    options = IdentificationOptions(decay_method=method, amplitude_dependence=False)  # type: ignore[arg-type]
    found = identify_frame(tests, options)
    by_default = identify_frame(tests, IdentificationOptions(amplitude_dependence=False))
    first, second = found.damping[0].value, by_default.damping[0].value
    assert found.damping_source[0] == "decay"
    assert first == found.decays[1].damping_ratio(method).value != second  # type: ignore[arg-type]
    # a straight line through an exponential decay is flatter than the decay at its start
    assert first == pytest.approx(second, rel=0.03) if method != "linear-fit" else 0.4 * second < first < 0.95 * second


@pytest.mark.property
def test_transfer_function_of_a_known_gain() -> None:
    rng = np.random.default_rng(1)
    ground = rng.standard_normal(5000)
    record = FrameTest("known", "random", 100.0, ground, np.column_stack([2.0 * ground, -0.5 * ground]), (False, False))
    omega, response = transfer_functions(record, (1.0, 20.0))
    assert omega[0] >= 2.0 * np.pi - 0.1 and omega[-1] <= 40.0 * np.pi + 0.1
    # the first and the last line have one neighbour only, in both densities
    np.testing.assert_allclose(response[1:-1], np.broadcast_to([2.0, -0.5], response[1:-1].shape), atol=1e-9)
