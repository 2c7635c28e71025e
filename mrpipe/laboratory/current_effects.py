"""Planted effects between the drive and the magnetic field in the fluid."""

from __future__ import annotations

import math

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray

DELAY_DEAD_TIME, DELAY_SECOND_ORDER, SATURATION_DRIVER = 1, 2, 6
REMANENCE_RELAXING, REMANENCE_DOMAINS, SATURATION_KNEE = 3, 4, 5
RATED_CURRENT = 4.0


@njit(cache=True)
def _dead_time(numbers: FloatArray, own: FloatArray, ring: FloatArray, current: float, h: float) -> float:
    """Return the current `numbers[0]` seconds ago, interpolated linearly between the stored samples."""
    size = ring.shape[0]
    head = int(own[0])
    ring[head] = current
    own[0] = float((head + 1) % size)
    lag = min(numbers[0] / h, size - 2.0)
    whole = int(lag)
    part = lag - whole
    return (1.0 - part) * ring[(head - whole) % size] + part * ring[(head - whole - 1) % size]


@njit(cache=True)
def _second_order(numbers: FloatArray, own: FloatArray, current: float, h: float) -> float:
    """Return the output current of a second-order driver with the low-frequency delay `numbers[0]`."""
    if numbers[0] <= 0.0:
        return current
    omega = 2.0 * numbers[1] / numbers[0]
    if own[2] < 0.5:
        own[0], own[1], own[2] = current, 0.0, 1.0
    parts = int(omega * h / 0.2) + 1
    for _ in range(parts):
        own[1] += h / parts * (omega * omega * (current - own[0]) - 2.0 * numbers[1] * omega * own[1])
        own[0] += h / parts * own[1]
    return own[0]


@njit(cache=True)
def _driver(numbers: FloatArray, own: FloatArray, current: float, h: float) -> float:
    """Return the output current of a driver with limited current and limited rate."""
    limit = RATED_CURRENT / max(numbers[0], 1e-9)
    wanted = min(max(current, -limit), limit)
    if own[1] < 0.5:
        own[0], own[1] = wanted, 1.0
    change = numbers[1] * h
    own[0] += min(max(wanted - own[0], -change), change)
    return own[0]


@njit(cache=True)
def _relaxing(numbers: FloatArray, own: FloatArray, u: float, v: float, h: float) -> float:
    """Return the current of the field with a remanence that saturates and decays with time and with slip."""
    # the remanent field is always smaller than the field before
    level = min(numbers[0] * u / (1.0 + u / numbers[1]), 0.97 * u)
    kept = own[0]
    if level > kept:
        kept += (level - kept) * (1.0 - math.exp(-h / numbers[2]))
    else:
        fade = 1.0 / numbers[3] + abs(v) / numbers[4]
        excess = (kept - level) / numbers[1]
        # the decay is faster at a high excess: a power law, not an exponential
        kept -= (kept - level) * (1.0 - math.exp(-h * fade * (0.3 + 2.0 * excess)))
    own[0] = kept
    size = max(u, 1e-12)
    return float((size**8 + kept**8) ** 0.125)


@njit(cache=True)
def _domains(numbers: FloatArray, own: FloatArray, u: float) -> float:
    """Return the current of the field after three play elements, which model domains with different thresholds."""
    total = 0.0
    for k in range(3):
        width = numbers[1] * (0.4 + 0.6 * k)
        own[k] = min(max(own[k], u), u + width)
        total += (own[k] - u) / 3.0
    return u + numbers[0] * total


@njit(cache=True)
def effective_current(
    codes: IntArray,
    values: FloatArray,
    memory: FloatArray,
    ring: FloatArray,
    current: float,
    v: float,
    h: float,
    place: int,
) -> float:
    """Return the current after the effects that precede (`place` 0) or follow (`place` 1) the lag (2.4)."""
    for k in range(codes.shape[0]):
        code = codes[k]
        if place == 0:
            if code == DELAY_DEAD_TIME:
                current = _dead_time(values[k], memory[k], ring[k], current, h)
            elif code == DELAY_SECOND_ORDER:
                current = _second_order(values[k], memory[k], current, h)
            elif code == SATURATION_DRIVER:
                current = _driver(values[k], memory[k], current, h)
        elif code == REMANENCE_RELAXING:
            current = _relaxing(values[k], memory[k], max(current, 0.0), v, h)
        elif code == REMANENCE_DOMAINS:
            current = _domains(values[k], memory[k], max(current, 0.0))
        elif code == SATURATION_KNEE:
            knee = RATED_CURRENT / max(values[k, 0], 1e-9)
            size = abs(current) / knee
            current = current / (1.0 + size ** values[k, 1]) ** (1.0 / values[k, 1])
    return current
