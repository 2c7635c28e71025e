"""A controller over many samples in one compiled loop: a call from Python takes a tenth of a millisecond for each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import boolean, float64, int64, njit

from mrpipe.control.controller import Controller
from mrpipe.control.kernel import COMMAND_SIZE, LAW_FUNCTION, controller_step


@njit(boolean(LAW_FUNCTION, float64[::1], int64[::1], float64[::1], float64[:, ::1], float64[:, ::1]))
def _all_samples(
    law: Any, numbers: np.ndarray, layout: np.ndarray, state: np.ndarray, measured: np.ndarray, commands: np.ndarray
) -> bool:
    finite = True
    for index in range(len(measured)):
        controller_step(law, numbers, layout, state, measured[index], commands[index])
        finite = finite and bool(np.all(np.isfinite(state)))
    return finite


def commands_of(controller: Controller, measured: np.ndarray) -> np.ndarray:
    """Return the commands to these readings, shape (n, COMMAND_SIZE); the state must stay finite."""
    commands = np.zeros((len(measured), COMMAND_SIZE))
    readings = np.ascontiguousarray(measured, dtype=np.float64)
    assert _all_samples(*controller.arguments, controller.new_state(), readings, commands)
    return commands
