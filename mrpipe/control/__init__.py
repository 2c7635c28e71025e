"""Calibration of control laws and the controller of Figure 5.3 (thesis chapter 4, 5.3; P2).

The names below are imported at first use, because the configuration needs the names of the laws without numba.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrpipe.control.controller import Controller, build_controller
    from mrpipe.control.controller_options import ControllerOptions
    from mrpipe.control.gains import Gains
    from mrpipe.control.inverse import InverseTable, inverse_table
    from mrpipe.control.kernel import COMMAND_SIZE, controller_step

__all__ = [
    "COMMAND_SIZE",
    "Controller",
    "ControllerOptions",
    "Gains",
    "InverseTable",
    "build_controller",
    "controller_step",
    "inverse_table",
]

_HOMES = {
    "Controller": "controller",
    "ControllerOptions": "controller_options",
    "build_controller": "controller",
    "Gains": "gains",
    "InverseTable": "inverse",
    "inverse_table": "inverse",
    "COMMAND_SIZE": "kernel",
    "controller_step": "kernel",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
