"""Planted effects on yield force and viscosity, parallel forces, and shapes that belong to no family of effects."""

from __future__ import annotations

import math

from numba import njit

from mrpipe.artifacts import FloatArray, IntArray

HEATING_TWO_NODES, HEATING_ADIABATIC = 10, 8
STRIBECK_RATIONAL, STRIBECK_CUSP = 11, 12
MIGRATION_STRETCHED, MIGRATION_SLIP = 13, 14
ASYMMETRY_YIELD, ASYMMETRY_FORCE = 15, 16
RATE_CREEP, RATE_EYRING = 17, 18
PINCHING_QUARTIC, PINCHING_CUSP = 19, 20
ACCUMULATOR_GAS, ACCUMULATOR_BLADDER = 30, 31
INERTIA_LAGGED, INERTIA_PLAIN, INERTIA_GROWTH = 32, 33, 29
DRAG_POWER, DRAG_TURBULENT = 34, 35
END_STOP_HERTZ, END_STOP_RUBBER = 36, 37
OFFSET_PER_TEST, OFFSET_DRIVE = 38, 39
COGGING, FIELD_PARITY, PUMP_RIPPLE = 60, 61, 62

# of the damper's state (see kernel)
_SLIP, _SINCE, _POWER = 5, 6, 9


@njit(cache=True)
def _heating(code: int, numbers: FloatArray, own: FloatArray, power: float, h: float) -> float:
    """Return the rise of the fluid's temperature [K]: fluid and housing, or the fluid alone with slow loss."""
    if code == HEATING_TWO_NODES:
        exchange = numbers[2] * (own[0] - own[1])
        own[0] += h * (power - exchange) / numbers[1]
        own[1] += h * (exchange - numbers[4] * own[1]) / numbers[3]
    else:
        own[0] += h * (power / numbers[1] - own[0] / numbers[2])
    return own[0]


@njit(cache=True)
def _yield_factor(code: int, numbers: FloatArray, state: FloatArray, x: float, v: float) -> float:
    speed = abs(v)
    if code == STRIBECK_RATIONAL:
        return 1.0 + numbers[0] / (1.0 + (speed / numbers[1]) ** 2)
    if code == STRIBECK_CUSP:
        return 1.0 + numbers[0] * math.exp(-math.sqrt(speed / numbers[1]))
    if code == MIGRATION_STRETCHED:
        return 1.0 - numbers[0] * math.exp(-((state[_SINCE] / numbers[1]) ** numbers[2]))
    if code == MIGRATION_SLIP:
        return 1.0 - numbers[0] / (1.0 + state[_SLIP] / numbers[1])
    if code == ASYMMETRY_YIELD:
        return 1.0 + numbers[0] * v / math.sqrt(v * v + numbers[1] * numbers[1])
    if code == RATE_EYRING:
        return 1.0 - numbers[0] + numbers[0] * math.asinh(speed / numbers[1]) / math.asinh(numbers[2] / numbers[1])
    if code == PINCHING_QUARTIC:
        return 1.0 - numbers[0] / (1.0 + ((x - numbers[2]) / numbers[1]) ** 4)
    if code == PINCHING_CUSP:
        return 1.0 - numbers[0] * math.exp(-abs(x - numbers[2]) / numbers[1])
    return 1.0


@njit(cache=True)
def coefficient_factors(
    codes: IntArray,
    values: FloatArray,
    memory: FloatArray,
    state: FloatArray,
    x: float,
    v: float,
    h: float,
) -> tuple[float, float]:
    """Return the factors of yield force and viscosity."""
    yielding, viscous = 1.0, 1.0
    for k in range(codes.shape[0]):
        code = codes[k]
        if code in (HEATING_TWO_NODES, HEATING_ADIABATIC):
            rise = _heating(code, values[k], memory[k], state[_POWER], h)
            yielding *= 1.0 / (1.0 + values[k, 0] * rise)
            viscous *= math.exp(-2.0 * values[k, 0] * rise)
        elif 11 <= code <= 20:
            yielding *= _yield_factor(code, values[k], state, x, v)
    return yielding, viscous


@njit(cache=True)
def _end_stop(code: int, numbers: FloatArray, x: float, v: float) -> float:
    past = abs(x) - numbers[1]
    if past <= 0.0:
        return 0.0
    side = 1.0 if x > 0.0 else -1.0
    if code == END_STOP_HERTZ:
        push = numbers[0] * past**1.5 * (1.0 + numbers[2] * side * v)
    else:
        push = numbers[0] * numbers[2] * (math.exp(past / numbers[2]) - 1.0)
        push += 0.01 * numbers[0] * side * v * min(past / numbers[2], 1.0)
    return side * max(push, 0.0)


@njit(cache=True)
def _unfamiliar(code: int, numbers: FloatArray, x: float, v: float, u: float, time: float) -> float:
    """Return a force whose shape is in no library of effects."""
    if code == COGGING:
        return numbers[0] * math.sin(2.0 * math.pi * x / numbers[1] + numbers[2])
    if code == FIELD_PARITY:
        return numbers[0] * u * ((x / numbers[1]) ** 2 - 0.5)
    wave = math.sin(2.0 * math.pi * numbers[1] * time + numbers[2])
    return numbers[0] * wave * v / math.sqrt(v * v + 1e-6)


@njit(cache=True)
def _accumulator(code: int, numbers: FloatArray, x: float) -> float:
    if code == ACCUMULATOR_GAS:
        room = max(1.0 - x / numbers[1], 0.2)
        return numbers[2] + numbers[0] * numbers[1] / 1.35 * (room**-1.35 - 1.0)
    return numbers[2] + numbers[0] * x * (1.0 + (x / numbers[1]) ** 2)


@njit(cache=True)
def _inertia(code: int, numbers: FloatArray, own: FloatArray, x: float, a: float, h: float) -> float:
    if code == INERTIA_LAGGED:
        own[0] += (a - own[0]) * (1.0 - math.exp(-h / numbers[1]))
        return numbers[0] * own[0]
    if code == INERTIA_PLAIN:
        return numbers[0] * a * (1.0 + (x / numbers[1]) ** 2)
    # the variable part, if the constant part is a mass of the structure
    return numbers[0] * a * (x / numbers[1]) ** 2


@njit(cache=True)
def _drag(code: int, numbers: FloatArray, v: float) -> float:
    if code == DRAG_POWER:
        return numbers[0] * v * abs(v) ** (numbers[1] - 1.0)
    return numbers[0] * v * v * abs(v) / (abs(v) + numbers[1]) * (1.0 if v > 0.0 else -1.0)


@njit(cache=True)
def parallel_force(
    codes: IntArray,
    values: FloatArray,
    memory: FloatArray,
    core: float,
    x: float,
    v: float,
    a: float,
    u: float,
    drive: float,
    time: float,
    h: float,
) -> float:
    """Return the damper force: the core and the forces in parallel with it [N]."""
    force = core
    for k in range(codes.shape[0]):
        code = codes[k]
        numbers = values[k]
        if code == ASYMMETRY_FORCE:
            force *= 1.0 + numbers[0] * core / math.sqrt(core * core + numbers[1] * numbers[1])
        elif code in (ACCUMULATOR_GAS, ACCUMULATOR_BLADDER):
            force += _accumulator(code, numbers, x)
        elif code in (INERTIA_LAGGED, INERTIA_PLAIN, INERTIA_GROWTH):
            force += _inertia(code, numbers, memory[k], x, a, h)
        elif code in (DRAG_POWER, DRAG_TURBULENT):
            force += _drag(code, numbers, v)
        elif code in (END_STOP_HERTZ, END_STOP_RUBBER):
            force += _end_stop(code, numbers, x, v)
        elif code == OFFSET_PER_TEST:
            force += numbers[0] * numbers[1]
        elif code == OFFSET_DRIVE:
            force += numbers[0] * abs(drive) ** numbers[1]
        elif code >= COGGING and code <= PUMP_RIPPLE:
            force += _unfamiliar(code, numbers, x, v, u, time)
    return force
