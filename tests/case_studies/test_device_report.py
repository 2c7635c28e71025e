"""Figures of the 1000 kN damper in the reports of the benchmark structures."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.case_studies.device_report import VOLTAGES, describe_device, force_diagram, inverse_figure
from mrpipe.case_studies.inverse import ValidatedInverse, training_history, validated_inverse
from mrpipe.case_studies.run import BinghamDevice
from mrpipe.networks.network import FeatureSpec
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.training import train
from tests.case_studies.section import Kept


@pytest.mark.literature
def test_force_at_a_constant_voltage_follows_the_bingham_model() -> None:
    by_displacement, by_velocity = force_diagram(BinghamDevice()).axes
    assert [line.get_label() for line in by_velocity.lines] == ["2 V", "4 V", "6 V"]
    for line, voltage in zip(by_velocity.lines, VOLTAGES, strict=True):
        velocity, force = (np.asarray(values) for values in line.get_data())
        # Table 6.1: 100 kN, 75 kN/V, 81 kN s/m, 90 kN s/m/V
        expected = (100.0 + 75.0 * voltage) * np.sign(velocity) + (81.0 + 90.0 * voltage) * velocity
        np.testing.assert_allclose(force, expected, atol=1e-9)
        assert np.abs(velocity).max() == pytest.approx(0.1 * 6.0 * np.pi)
    assert np.abs(np.asarray(by_displacement.lines[0].get_xdata())).max() == pytest.approx(100.0)


@pytest.mark.property
def test_the_inverse_is_shown_only_where_there_is_one() -> None:
    device, rng, sink = BinghamDevice(), np.random.default_rng(3), Kept()
    describe_device(sink, device, None)
    assert set(sink.captions) == {"force-diagram"}
    history = training_history(device, rng, records=1)
    options = TrainingOptions(architecture=(2, 2), biases=True, starts=1, refined_starts=1, iterations=2)
    spec = FeatureSpec(("velocity", "force"), 0, True, history.sampling_rate_hz, "drive")
    inverse: ValidatedInverse = validated_inverse(device, train(history, spec, options, rng))
    error = inverse.estimate_v - inverse.voltage_v
    assert inverse.nrmse == pytest.approx(np.linalg.norm(error) / np.linalg.norm(inverse.voltage_v))
    shown = Kept()
    describe_device(shown, device, inverse)
    assert f"{100.0 * inverse.nrmse:.2g} %" in shown.captions["inverse-validation"]
    given, estimate = inverse_figure(inverse).axes[0].lines
    np.testing.assert_array_equal(np.asarray(given.get_ydata()), inverse.voltage_v)
    np.testing.assert_array_equal(np.asarray(estimate.get_ydata()), inverse.estimate_v)
