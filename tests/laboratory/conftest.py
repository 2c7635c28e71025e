from __future__ import annotations

import pytest

from mrpipe.laboratory.bench import fine_motion
from mrpipe.laboratory.damper import FineMotion, TrueDamper, damper_from_set
from mrpipe.laboratory.motion import BenchTest
from mrpipe.laboratory.options import BenchRig, BenchSensors, Servo

QUIET = BenchSensors(
    displacement_noise_m=0.0,
    acceleration_noise_m_s2=0.0,
    force_noise_n=0.0,
    current_noise_a=0.0,
    displacement_offset_m=0.0,
    acceleration_offset_m_s2=0.0,
    force_offset_n=0.0,
    current_offset_a=0.0,
)
EXACT = BenchRig(servo=Servo(amplitude_error=0.0, harmonic_share=0.0, smoothing_s=1e-5), sensors=QUIET)


@pytest.fixture(scope="session")
def damper() -> TrueDamper:
    return damper_from_set("set-c")


def motion_of(
    motion: str = "sine", amplitude: float = 0.01, frequency: float = 1.0, level: float = 2.0, **more: object
) -> FineMotion:
    test = BenchTest("t", "training", motion, amplitude, frequency, current_a=level, duration_s=5.0, **more)  # type: ignore[arg-type]
    return fine_motion(test, EXACT, 3)
