"""Calibration of control laws and the controller of Figure 5.3 (thesis chapter 4, 5.3; P2)."""

from mrpipe.control.controller import LAWS, PASSIVE, Controller, ControllerOptions, Gains, build_controller
from mrpipe.control.inverse import InverseTable, inverse_table
from mrpipe.control.kernel import COMMAND_SIZE, controller_step

__all__ = [
    "COMMAND_SIZE",
    "LAWS",
    "PASSIVE",
    "Controller",
    "ControllerOptions",
    "Gains",
    "InverseTable",
    "build_controller",
    "controller_step",
    "inverse_table",
]
