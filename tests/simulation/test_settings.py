"""Every kind of motion and of fault in the settings is understood by the simulation."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from pydantic import ValidationError

from mrpipe.simulation.acting import excitation_at
from mrpipe.simulation.rig import loop_options
from mrpipe.simulation.settings import ExcitationSettings, SensorFaultSettings, SimulateSettings

pytestmark = pytest.mark.property

KINDS = get_args(ExcitationSettings.model_fields["kind"].annotation)
DURATIONS = {"harmonic": 10.0 + 8.0, "sweep": 20.0, "random": 30.0, "recorded": 4.0, "free-decay": 8.0}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_motion_is_made(kind: str, tmp_path) -> None:
    path = tmp_path / "ground.csv"
    path.write_text("".join(f"{0.1 * k},{np.sin(k)}\n" for k in range(41)), encoding="utf-8")
    settings = ExcitationSettings(kind=kind, sweep_s=20.0, random_s=30.0, cycles=10, settling_cycles=5, file=str(path))
    found = excitation_at(settings, 2.0 * np.pi, 0.5)
    assert found.duration_s == pytest.approx(DURATIONS[kind], abs=1e-6)
    assert found.details["kind"] == {"free-decay": "rest"}.get(kind, kind)


@pytest.mark.parametrize("kind", get_args(SensorFaultSettings.model_fields["kind"].annotation))
def test_every_kind_of_fault_is_passed_on(kind: str) -> None:
    settings = SimulateSettings(sensors={"fault": {"kind": kind, "sensor": "force", "share": 0.2, "samples": 3}})
    fault = loop_options(settings).fault
    assert (fault is None) == (kind == "none")
    assert fault is None or (fault.sensor, fault.share, fault.samples) == ("force", 0.2, 3)


def test_a_perfect_damper_has_perfect_sensors_and_histories_at_the_rate_of_the_plant() -> None:
    sensors = {"displacement_noise_m": 1e-5}
    damper = loop_options(SimulateSettings(plant_rate_hz=3000.0, sensors=sensors))
    ideal = loop_options(SimulateSettings(plant_rate_hz=3000.0, sensors=sensors, tracking="ideal"))
    assert damper.noise.displacement_m == 1e-5 and damper.record_rate_hz == 1000.0
    assert ideal.noise.displacement_m == 0.0 and ideal.record_rate_hz == 3000.0


@pytest.mark.parametrize(
    "values",
    [
        {"plant_rate_hz": 10.0},
        {"tracking": "best"},
        {"excitation": {"cycles": 1}},
        {"sensors": {"fault": {"share": 2.0}}},
    ],
)
def test_values_out_of_range_are_refused(values: dict) -> None:
    with pytest.raises(ValidationError):
        SimulateSettings(**values)
