"""The closed loop: frame, damper, sensors and controller (thesis chapter 5)."""

from mrpipe.simulation.excitation import Excitation, amplitude_for, at_rest, harmonic, recorded, sweep
from mrpipe.simulation.loop import LoopOptions, Response, SensorNoise, simulate_law

__all__ = [
    "Excitation",
    "LoopOptions",
    "Response",
    "SensorNoise",
    "amplitude_for",
    "at_rest",
    "harmonic",
    "recorded",
    "simulate_law",
    "sweep",
]
