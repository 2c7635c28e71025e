"""Noise and faulty readings of the sensors of a loop."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control.kernel import (
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_GROUND,
)
from mrpipe.simulation.sensors import MISSING, STUCK, ZERO, SensorFault, SensorNoise, add_fault, sensor_noise

pytestmark = pytest.mark.property


def test_noise_has_the_rms_of_each_sensor_and_the_bias() -> None:
    noise = SensorNoise(displacement_m=1e-5, acceleration_m_s2=0.02, acceleration_bias_m_s2=0.3)
    found = sensor_noise(noise, 20000, 3, np.random.default_rng(1))
    assert found.shape == (20000, MEASURED_FLOORS + 3)
    rms = found.std(axis=0)
    assert rms[MEASURED_DISPLACEMENT] == pytest.approx(1e-5, rel=0.03)
    assert rms[MEASURED_GROUND] == pytest.approx(0.02, rel=0.03)
    assert rms[MEASURED_FLOORS:] == pytest.approx(0.02, rel=0.03)
    assert found[:, MEASURED_ACCELERATION].mean() == pytest.approx(0.3, abs=1e-3)
    assert np.all(found[:, MEASURED_FORCE] == 0.0)


def test_without_noise_no_generator_is_needed() -> None:
    assert np.all(sensor_noise(SensorNoise(), 10, 2, None) == 0.0)
    with pytest.raises(ValueError, match="needs a generator"):
        sensor_noise(SensorNoise(displacement_m=1e-6), 10, 2, None)


@pytest.mark.parametrize("mark", [MISSING, ZERO, STUCK])
def test_a_fault_marks_its_sensor_alone_and_spares_the_first_sample(mark: float) -> None:
    noise = np.zeros((5000, MEASURED_FLOORS + 2))
    add_fault(noise, SensorFault(mark, "displacement", 0.01, 3), np.random.default_rng(2))
    marked = np.isnan(noise) if np.isnan(mark) else noise == mark
    assert not marked[0].any()
    assert not np.delete(marked, MEASURED_DISPLACEMENT, axis=1).any()
    assert 0.01 < marked[:, MEASURED_DISPLACEMENT].mean() < 0.05


def test_all_accelerometers_fail_together() -> None:
    noise = np.zeros((1000, MEASURED_FLOORS + 2))
    add_fault(noise, SensorFault(MISSING, "accelerometers", 0.02, 2), np.random.default_rng(2))
    marked = np.isnan(noise)
    assert marked.any()
    assert np.array_equal(marked[:, MEASURED_GROUND], marked[:, MEASURED_FLOORS + 1])
    assert not marked[:, MEASURED_DISPLACEMENT].any()
