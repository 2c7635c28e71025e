"""Whether the size of each quantity is one that a damper or a structure can have.

The ranges are wide: they span laboratory models to the largest dampers and buildings. A unit that is wrong by a factor
of 1000 mostly leads out of them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.campaigns.plausibility.channels import find_spikes
from mrpipe.campaigns.plausibility.finding import Finding
from mrpipe.campaigns.plausibility.library import Check
from mrpipe.campaigns.schema import quantity_of

RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "damper-bench": {
        "displacement": (1e-5, 1.0),
        "velocity": (1e-5, 10.0),
        "acceleration": (1e-4, 1000.0),
        "force": (1.5, 1e7),
        "A": (0.005, 30.0),
        "V": (0.005, 20e3),
    },
    "shear-frame": {
        "displacement": (1e-7, 5.0),
        "velocity": (1e-7, 20.0),
        "acceleration": (1e-6, 300.0),
        "force": (1e-3, 1e8),
        "A": (0.005, 30.0),
        "V": (0.005, 20e3),
    },
}
"""Rig -> quantity -> smallest and largest plausible amplitude over all tests (half the range of a channel, SI)."""

COIL_VOLTAGE = 500.0
"""Drive [V] above which no damper with a coil is driven; electrorheological dampers take up to 20 kV (5 kV over each
millimetre of a gap, the strength of the fluid), so a drive above it may be right, or millivolts given as volts."""

STIFFNESS = (50.0, 1e9)
"""Plausible ratios of the largest force to the largest displacement of a bench campaign [N/m]."""

SPEED = 8.0
"""Largest plausible velocity of a damper's piston [m/s]."""

_SPIKES = ("displacement", "force")
"""Quantities of a bench in which the check of spikes reports an error."""

_SI = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²", "force": "N"}


def _amplitude(values: FloatArray, quantity: str) -> float:
    """Return half the range of a channel; the largest magnitude of a drive, which may be constant."""
    return float(np.abs(values).max()) if quantity == "drive" else 0.5 * float(np.ptp(values))


def _judge(campaign: Campaign) -> Iterator[Finding]:
    ranges = RANGES[campaign.rig]
    sizes: dict[str, list[tuple[float, str]]] = {}
    for test in campaign.recordings:
        for channel in test.channels:
            quantity = quantity_of(channel, campaign.rig) or ""
            values = test.used(channel)
            size = _amplitude(values, quantity)
            if campaign.rig == "damper-bench" and quantity in _SPIKES and size > ranges[quantity][1]:
                # the check of spikes names these samples, and a unit that is wrong shows in the others too
                size = _amplitude(np.delete(values, find_spikes(values)), quantity)
            sizes.setdefault(channel, []).append((size, test.name))
    found = False
    for channel, entries in sizes.items():
        quantity = quantity_of(channel, campaign.rig) or ""
        key = campaign.drive_unit if quantity == "drive" else quantity
        if key not in ranges:
            continue
        finding = _outside(channel, entries, ranges[key], _SI.get(key, key))
        if finding is not None:
            found = True
            yield finding
        elif key == "V" and max(entries)[0] > COIL_VOLTAGE:
            yield _of_no_coil(channel, *max(entries))
    if campaign.rig == "damper-bench" and not found:
        yield from _together(campaign, sizes)


def _outside(channel: str, entries: list[tuple[float, str]], limits: tuple[float, float], unit: str) -> Finding | None:
    """Return a finding where the largest amplitude of a channel is implausible."""
    largest, test = max(entries)
    low, high = limits
    if largest == 0.0 or low <= largest <= high:
        return None
    size = "large" if largest > high else "small"
    beyond = sum(amplitude > high for amplitude, _ in entries)
    several = f", in {beyond} of {len(entries)} tests; the largest is that of test {test}" if beyond > 1 else ""
    return Finding(
        name="unit-range",
        severity="error",
        channel=channel,
        test=test if beyond == 1 else "",
        sentence=f"an amplitude of {largest:.3g} {unit} is implausibly {size} (plausible: {low:g} to {high:g} {unit})"
        f"{several}",
        remedy=f"correct the unit of {channel} in campaign.yaml (a factor of 1000 is the usual mistake)",
        numbers={"amplitude_si": largest, "smallest_si": low, "largest_si": high},
    )


def _of_no_coil(channel: str, largest: float, test: str) -> Finding:
    """Return the warning that a drive has the voltage of an electrorheological damper, or that its unit is wrong."""
    return Finding(
        name="high-voltage",
        severity="warning",
        channel=channel,
        sentence=f"the drive reaches {largest:.4g} V (test {test}): an electrorheological damper is driven with "
        f"kilovolts, the coil of a magnetorheological damper with less than {COIL_VOLTAGE:g} V",
        remedy="if this damper has a coil, correct the unit of the drive in campaign.yaml (mV given as V?)",
        numbers={"amplitude_v": largest},
    )


def _together(campaign: Campaign, sizes: dict[str, list[tuple[float, str]]]) -> Iterator[Finding]:
    """Yield findings on quantities that are plausible singly but not together."""
    force, displacement = max(sizes["force"])[0], max(sizes["displacement"])[0]
    if displacement > 0.0 and force > 0.0 and not STIFFNESS[0] <= force / displacement <= STIFFNESS[1]:
        yield Finding(
            name="unit-range",
            severity="error",
            sentence=f"a force of {force:.3g} N at a displacement of {displacement:.3g} m (amplitudes) is implausible "
            "for a damper",
            remedy="correct the unit of force or displacement in campaign.yaml",
            numbers={"force_n": force, "displacement_m": displacement},
        )
    speeds = {test.name: _speed(test) for test in campaign.recordings}
    name = max(speeds, key=lambda item: speeds[item])
    if speeds[name] > SPEED:
        yield Finding(
            name="unit-range",
            severity="error",
            test=name,
            channel="displacement",
            sentence=f"moves at {speeds[name]:.3g} m/s (99th percentile), faster than a damper can",
            remedy="correct the unit of displacement or time in campaign.yaml",
            numbers={"speed_m_s": speeds[name]},
        )


def _speed(test: Recording) -> float:
    """Return the 99th percentile of speed over a hundredth of the record's typical oscillation [m/s]."""
    begin, end = test.segments[0]
    values = test.channels["displacement"][begin:end]
    step = max(1, values.size // 1000)
    coarse = values[::step]
    if coarse.size < 10:
        return 0.0
    return float(np.quantile(np.abs(np.diff(coarse)), 0.99) * test.sampling_rate_hz / step)


CHECK = Check("ranges", _judge)
