"""Construction of a controller as plain arrays, which :func:`mrpipe.control.kernel.controller_step` runs.

The closed loop, the virtual laboratory, the tracing of effects and the C export use the same arrays::

    controller = build_controller("fdns", Gains(alpha_n_m=3000.0), ControllerOptions(rate_hz=200.0), inverse=network)
    state = controller.new_state()
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.control import kernel
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import InverseTable
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named
from mrpipe.control.lqg import Observer
from mrpipe.control.packing import ControllerArrays
from mrpipe.errors import UserError
from mrpipe.networks.network import Network


@dataclass(frozen=True)
class Controller:
    """Controller as a compiled force and plain arrays.

    Attributes
    ----------
    law
        Name of its law.
    force
        Compiled force of the law.
    numbers, layout
        Arrays for :func:`~mrpipe.control.kernel.controller_step`.
    gains, options
        Gains and options from which it was built.
    floors
        Number of floors whose accelerometers it reads; 0: it reads none.
    networks
        Networks `inverse` and `law`, if present, in the form in which they are evaluated.
    details
        Further facts about the controller, for tables and JSON.
    """

    law: str
    force: Any
    numbers: FloatArray
    layout: IntArray
    gains: Gains
    options: ControllerOptions
    floors: int = 0
    networks: Mapping[str, Network] = field(default_factory=dict)
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def arguments(self) -> tuple[Any, FloatArray, IntArray]:
        """Return (force, numbers, layout), the first arguments of :func:`~mrpipe.control.kernel.controller_step`."""
        return self.force, self.numbers, self.layout

    @property
    def sample_time_s(self) -> float:
        """Interval between calls [s]."""
        return 1.0 / self.options.rate_hz

    @property
    def state_size(self) -> int:
        """Length of its state array."""
        return int(self.layout[kernel.STATE_SIZE])

    @property
    def measured_size(self) -> int:
        """Smallest length of the array of measurements."""
        return kernel.MEASURED_FLOORS + self.floors

    def new_state(self) -> FloatArray:
        """Return a state array of zeros for the first call."""
        return np.zeros(self.state_size)


def build_controller(
    law: str | Law,
    gains: Gains,
    options: ControllerOptions,
    *,
    inverse: Network | InverseTable | None = None,
    reference: Network | None = None,
    observer: Observer | None = None,
    position: FloatArray | None = None,
) -> Controller:
    """Return the controller of a law, packed into arrays.

    Parameters
    ----------
    law
        A law or its name.
    gains
        Gains of the law.
    options
        Options of the controller.
    inverse
        Inverse from desired force to drive: a network as P2 (23), or a table; None: a damper that tracks the desired
        force perfectly.
    reference
        Network from displacement and velocity to force (4.3.4), for a law that needs one.
    observer
        Observer, for a law that needs one.
    position
        Connectivity vector w of the damper, shape (n,), for a law that reads the accelerometers of the floors.

    Raises
    ------
    UserError
        If the law is unknown, if its gains, network or observer are missing, or if the cut-off of the low-pass is above
        half the sampling rate.
    """
    entry = law_named(law) if isinstance(law, str) else law
    _check_parts(entry, gains, reference, observer, position)
    arrays = ControllerArrays(options)
    arrays.layout[kernel.OUTPUT] = kernel.OUTPUT_DRIVE if entry.output == "drive" else kernel.OUTPUT_FORCE
    arrays.numbers[0][kernel.GAIN_C : kernel.GAIN_ALPHA + 1] = [gains.c_n_s_m, gains.k_n_m, gains.alpha_n_m]
    limit = options.drive_limit
    history = 2
    networks: dict[str, Network] = {}
    if isinstance(inverse, InverseTable):
        arrays.add_table(inverse)
        limit = inverse.largest_drive if limit is None else limit
    elif inverse is not None:
        # a network that reads its own past output is refused when it is added
        plain = options.inverse_request == "history" or inverse.features.past_target
        requested = inverse if plain else inverse.steady()
        history = max(history, arrays.add_network(requested, kernel.NETWORK_INVERSE, kernel.INVERSE_SPACING))
        arrays.layout[kernel.INVERSE] = kernel.INVERSE_NETWORK
        if entry.output == "force":
            networks["inverse"] = requested
    if reference is not None and "network" in entry.needs:
        networks["law"] = reference
        history = max(history, arrays.add_network(reference, kernel.NETWORK_LAW, kernel.LAW_SPACING))
    floors = 0
    if observer is not None and "observer" in entry.needs:
        floors = arrays.add_observer(observer)
    elif position is not None and "floor-accelerations" in entry.needs:
        floors = len(position)
    arrays.numbers[0][kernel.DRIVE_LIMIT] = 1e300 if limit is None else limit
    if limit is None and "drive-limit" in entry.needs:
        raise UserError("control law", entry.name, "has no drive limit", "give the largest drive of the damper")
    arrays.layout[kernel.AT_LAW] = arrays.at
    arrays.numbers.append(entry.numbers(gains, position, 1.0 / options.rate_hz))
    numbers, layout = arrays.finish(entry, history, floors)
    return Controller(entry.name, entry.force, numbers, layout, gains, options, floors, networks)


def _check_parts(
    law: Law, gains: Gains, reference: Network | None, observer: Observer | None, position: FloatArray | None
) -> None:
    if "network" in law.needs and reference is None:
        raise UserError("control law", law.name, "has no trained network", "calibrate it first")
    if "observer" in law.needs and observer is None:
        raise UserError("control law", law.name, "has no observer", "calibrate it first")
    if "floor-accelerations" in law.needs and observer is None and position is None:
        raise UserError("control law", law.name, "does not know where the damper is", "give its position")
    required = [gain.name for gain in law.gains if not gain.optional]
    if required and "network" not in law.needs and not any(gains.get(name, 0.0) for name in required):
        raise UserError("control law", law.name, "has no gains", "calibrate it first or give them")
