"""Check whether networks and damper model of a closed loop were used within the range of their training and tests.

A network gives an output for every input, but outside the range of its training rows the output has no meaning. The
inputs are reconstructed from the signals that the controller recorded at each of its samples, in the same form as in
its kernel.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.control.controller import Controller
from mrpipe.control.kernel import COMMAND_DISPLACEMENT, COMMAND_FORCE, COMMAND_SWITCHED, COMMAND_VELOCITY
from mrpipe.networks.network import Network
from mrpipe.simulation.loop import Response
from mrpipe.simulation.rig import Rig
from mrpipe.words import in_percent

MARGIN = 0.02
"""Share of the range beyond its ends that still counts as within, because noise at the ends is not an extrapolation."""

WORTH_A_WARNING = 1e-3
"""Share of time outside the range above which a warning is given: 0.06 s in a minute, one strong peak."""

_SUFFIX = {"displacement": "m", "velocity": "m_s", "acceleration": "m_s2", "force": "n"}
_SHOWN = {
    "displacement": (1e3, "mm"),
    "velocity": (1.0, "m/s"),
    "acceleration": (1.0, "m/s²"),
    "force": (1.0, "N"),
}


@dataclass(frozen=True)
class InputRange:
    """One input of a network or model: the range in the loop and the known range.

    Attributes
    ----------
    outside_share
        Share of time outside, past values included [1].
    asked, known
        Smallest and largest value, SI.
    """

    outside_share: float
    asked: tuple[float, float]
    known: tuple[float, float]

    def words(self, name: str) -> str:
        """Return a text such as `velocity up to 0.21 m/s (known to 0.14) 3.2 % of the time`."""
        factor, unit = _SHOWN[name]
        low, high = (factor * value for value in self.asked)
        known_low, known_high = (factor * value for value in self.known)
        if high - known_high >= known_low - low:
            asked, known = f"up to {high:.3g} {unit}", f"{known_high:.3g}"
        else:
            asked, known = f"down to {low:.3g} {unit}", f"{known_low:.3g}"
        return f"{name} {asked} (known to {known}) {in_percent(self.outside_share, digits=2)} of the time"


@dataclass(frozen=True)
class RangeCheck:
    """Inputs of one network or model compared with their known ranges.

    Attributes
    ----------
    what
        `inverse network`, `network of law nnc` or `damper model`.
    outside_share
        Share of time with any input outside [1].
    inputs
        Channel -> range.
    """

    what: str
    outside_share: float
    inputs: Mapping[str, InputRange]

    @property
    def warning(self) -> str:
        """Warning; empty if all inputs stayed within their ranges."""
        if self.outside_share < WORTH_A_WARNING:
            return ""
        left = [item.words(name) for name, item in self.inputs.items() if item.outside_share >= WORTH_A_WARNING / 10.0]
        share = in_percent(self.outside_share, digits=2)
        return f"the {self.what} extrapolates {share} of the time: " + "; ".join(left)

    def as_json(self) -> dict[str, Any]:
        """Return the check as plain values in SI, with units in the keys."""
        inputs = {
            name: {
                "outside_share": item.outside_share,
                f"smallest_{_SUFFIX[name]}": item.asked[0],
                f"largest_{_SUFFIX[name]}": item.asked[1],
                f"known_smallest_{_SUFFIX[name]}": item.known[0],
                f"known_largest_{_SUFFIX[name]}": item.known[1],
            }
            for name, item in self.inputs.items()
        }
        return {"outside_share": self.outside_share, "inputs": inputs}


@dataclass(frozen=True)
class Requests:
    """Inputs of the controller at each of its samples: channel -> shape (samples,), SI."""

    channels: Mapping[str, FloatArray]

    def rows(self, network: Network, rate_hz: float) -> FloatArray:
        """Return the feature rows that the kernel passes to a network, shape (samples, R).

        Past values between samples are interpolated; before the first sample the memory is filled with it.
        """
        spec = network.features
        spacing = rate_hz / spec.sampling_rate_hz
        columns = []
        for name in spec.channels:
            signal = self.channels[name]
            places = np.arange(len(signal), dtype=np.float64)
            columns += [np.interp(places - lag * spacing, places, signal) for lag in range(spec.past_values + 1)]
        rows = np.stack(columns, axis=1)
        return np.abs(rows) if spec.absolute else rows


def requests(response: Response, acceleration: FloatArray) -> Requests:
    """Return the inputs of the controller from its recorded signals; `acceleration` [m/s^2] is that of the damper."""
    commands = response.commands
    return Requests(
        {
            "displacement": commands[:, COMMAND_DISPLACEMENT],
            "velocity": commands[:, COMMAND_VELOCITY],
            "acceleration": acceleration,
            "force": commands[:, COMMAND_FORCE],
        }
    )


def check_ranges(rig: Rig, controller: Controller, response: Response, tested: Mapping[str, float]) -> list[RangeCheck]:
    """Compare the inputs of networks and damper model in a run with what training and bench tests covered.

    Parameters
    ----------
    rig, controller, response
        Rig, controller and response of the run.
    tested
        Largest |displacement| [m] and |velocity| [m/s] of the bench tests; empty where they are not known.
    """
    with_damper = rig.options.tracking == "damper"
    relative = np.einsum("tf,f->t", response.acceleration, rig.position)
    acceleration = np.interp(response.command_time_s, response.time_s, relative)
    checks = check_networks(controller, response, acceleration, drive_counts=with_damper)
    if with_damper and tested:
        checks.append(check_damper(response, tested))
    return checks


def ranges_as_json(checks: Sequence[RangeCheck]) -> dict[str, Any]:
    """Return the checks as plain values, by the network or model that they are of."""
    return {check.what.replace(" ", "_"): check.as_json() for check in checks}


def check_networks(
    controller: Controller, response: Response, acceleration: FloatArray, *, drive_counts: bool = True
) -> list[RangeCheck]:
    """Compare the inputs of the networks of a controller with the range of their training.

    Parameters
    ----------
    controller, response
        Controller and response of the run.
    acceleration
        Acceleration of the damper at the samples of the controller [m/s^2], shape (samples,), for networks that
        read it.
    drive_counts
        False for a perfect damper, which no inverse is needed for.
    """
    asked = requests(response, acceleration)
    checks = []
    for role, network in controller.networks.items():
        if not len(network.feature_minimum) or (role == "inverse" and not drive_counts):
            continue
        counts = np.ones(len(response.commands), dtype=bool)
        if role == "inverse":
            # below the switch force the output of the network is not used
            counts = response.commands[:, COMMAND_SWITCHED] < 0.5
        what = "inverse network" if role == "inverse" else f"network of law {controller.law}"
        checks.append(_check(what, network, asked.rows(network, controller.options.rate_hz), counts))
    return checks


def check_damper(response: Response, tested: Mapping[str, float]) -> RangeCheck:
    """Compare the motion of the damper with the largest of the bench tests.

    Parameters
    ----------
    response
        Response of the run.
    tested
        Largest |displacement| [m] and |velocity| [m/s] of the tests from which the model was identified.
    """
    signals = {"displacement": response.damper_displacement, "velocity": response.damper_velocity}
    outside = np.zeros(len(response.time_s), dtype=bool)
    inputs = {}
    for name, largest in tested.items():
        size = np.abs(signals[name])
        beyond = size > (1.0 + MARGIN) * largest
        outside |= beyond
        inputs[name] = InputRange(float(np.mean(beyond)), (float(size.min()), float(size.max())), (0.0, largest))
    return RangeCheck("damper model", float(np.mean(outside)), inputs)


def _check(what: str, network: Network, rows: FloatArray, counts: BoolArray) -> RangeCheck:
    low, high = network.feature_minimum, network.feature_maximum
    slack = MARGIN * (high - low)
    outside = ((rows < low - slack) | (rows > high + slack)) & counts[:, None]
    window = network.features.past_values + 1
    inputs = {}
    for index, name in enumerate(network.features.channels):
        block = slice(index * window, (index + 1) * window)
        asked = rows[counts, block]
        inputs[name] = InputRange(
            outside_share=float(np.mean(np.any(outside[:, block], axis=1))),
            asked=(float(asked.min()), float(asked.max())) if asked.size else (0.0, 0.0),
            known=(float(low[block].min()), float(high[block].max())),
        )
    return RangeCheck(what, float(np.mean(np.any(outside, axis=1))), inputs)
