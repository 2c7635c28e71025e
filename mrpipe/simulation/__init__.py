"""The closed loop: frame, damper, sensors and controller (thesis chapter 5).

The names below are imported at first use, because the configuration needs the settings of this package without numba.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrpipe.simulation.excitation import Excitation, amplitude_for, at_rest, harmonic, recorded, sweep
    from mrpipe.simulation.loop import LoopOptions, Response, simulate_law
    from mrpipe.simulation.sensors import SensorNoise

LOADS_FROM: tuple[str, ...] = ()  # the modules loaded at first use are those imported above

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

_PLACES = {"LoopOptions": "loop", "Response": "loop", "SensorNoise": "sensors", "simulate_law": "loop"}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES.get(name, 'excitation')}"), name)
