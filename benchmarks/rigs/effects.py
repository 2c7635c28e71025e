"""Effects that are planted on a rig: laws that differ from those of the program wherever the physics allows it.

A planted effect has numbers whose first is its strength (0 means no effect). Most effects act within the integration;
the drive's driver and delay, the offset and the skew of channels act on whole records (:mod:`benchmarks.rigs.records`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.rigs.compiling import compiled
from benchmarks.rigs.types import Array

(STRIBECK_SECH, STRIBECK_HYPERBOLA, MIGRATION_SLIP, MIGRATION_TIME, ASYMMETRY_YIELD, PINCHING_COSINE, PINCHING_SECH,
 HEATING_LINEAR, HEATING_LIMITED, STICK_EVENTS) = range(1, 11)  # fmt: skip
REMANENCE_WIPED, REMANENCE_TWO, BACKLASH = 20, 21, 22
(ACCUMULATOR_CUBIC, ACCUMULATOR_ISOTHERMAL, INERTIA_LAGGED, INERTIA_POSITION, DRAG_BLASIUS, DRAG_ONSET, STOP_HERTZ,
 STOP_RUBBER, ASYMMETRY_FORCE) = range(30, 39)  # fmt: skip
BUMP, FRACTIONAL, RIPPLE, SHAKER, LOBES = range(50, 55)
OFFSET_TEST, OFFSET_DRIVE, OFFSET_WARMING, SATURATION, DELAY_CASCADE, DELAY_DEAD, SKEW_SHIFT, SKEW_FILTER = range(
    70, 78
)

NUMBERS, MEMORY = 6, 6
FRACTIONAL_RATES = np.array([1.0, 4.5, 20.0, 90.0, 400.0])
"""Rates [1/s] of the relaxations whose sum approximates a derivative of order one half."""


@dataclass(frozen=True)
class Planted:
    """An effect of a rig: `numbers` has shape (6,), the strength first; `compare` names numbers of clear meaning."""

    name: str
    form: str
    code: int
    numbers: Array
    strongest: float
    compare: tuple[tuple[str, int], ...] = ()

    def with_strength(self, strength: float) -> Planted:
        """Return the effect with another strength."""
        numbers = self.numbers.copy()
        numbers[0] = strength
        return replace(self, numbers=numbers)

    def comparable(self) -> dict[str, float]:
        """Return the numbers that a parameter of the program can be compared with."""
        return {key: float(self.numbers[place]) for key, place in self.compare}


@dataclass(frozen=True)
class Scales:
    """What the numbers of an effect are drawn around: largest values of a rig, SI; `test_s` is the length of a test."""

    stroke: float
    speed: float
    force: float
    drive: float
    test_s: float

    @property
    def acceleration(self) -> float:
        """Return the largest acceleration of a sine with this stroke and speed [m/s^2]."""
        return self.speed**2 / self.stroke


def _draw(name: str, scale: Scales, rng: np.random.Generator) -> tuple[str, int, list[float], float, tuple]:
    """Return form, code, numbers (with a guess of the strength), largest strength, and comparable numbers."""
    a, v, f = scale.stroke, scale.speed, scale.force
    pick = int(rng.integers(2))
    u = rng.uniform
    if name == "offset":
        pick = int(rng.integers(3))
        forms = (
            ("test-to-test", OFFSET_TEST, [0.1 * f], f),
            ("drive-power", OFFSET_DRIVE, [0.1 * f, u(1.3, 1.7), scale.drive], f),
            ("warming", OFFSET_WARMING, [0.1 * f, u(0.3, 0.7) * scale.test_s], f),
        )
        return *forms[pick], ()
    if name == "accumulator":
        if pick:
            return "cubic", ACCUMULATOR_CUBIC, [0.1 * f / a, a / np.sqrt(u(0.1, 0.4))], 5 * f / a, (("stiffness", 0),)
        return "isothermal", ACCUMULATOR_ISOTHERMAL, [0.1 * f / a, u(2.5, 5.0) * a], 5 * f / a, (("stiffness", 0),)
    if name == "inertia":
        mass = 0.1 * f / scale.acceleration
        if pick:
            return "lagged", INERTIA_LAGGED, [mass, u(0.001, 0.003)], 20 * mass, (("mass", 0),)
        return "position", INERTIA_POSITION, [mass, a / np.sqrt(u(0.1, 0.4))], 20 * mass, (("mass", 0),)
    if name == "asymmetry":
        if pick:
            return "yield", ASYMMETRY_YIELD, [0.1, 0.05 * v * u(0.5, 2.0)], 0.7, ()
        return "force", ASYMMETRY_FORCE, [0.1, 0.1 * f], 0.7, ()
    if name == "stribeck":
        if pick:
            return "sech", STRIBECK_SECH, [0.3, v * u(0.08, 0.3)], 3.0, ()
        return "hyperbola", STRIBECK_HYPERBOLA, [0.3, v * u(0.05, 0.2)], 3.0, ()
    if name == "quadratic-drag":
        if pick:
            return "blasius", DRAG_BLASIUS, [0.2 * f, u(1.7, 1.9), v], 5 * f, ()
        return "onset", DRAG_ONSET, [0.2 * f, u(0.05, 0.25) * v, v], 5 * f, ()
    if name == "migration":
        if pick:
            return "slip", MIGRATION_SLIP, [0.3, a * u(0.2, 0.6)], 0.95, ()
        return "time", MIGRATION_TIME, [0.3, a / v * u(0.4, 1.5)], 0.95, ()
    if name == "remanence":
        if pick:
            return "wiped", REMANENCE_WIPED, [0.4, a * u(1.0, 4.0), u(2.5, 4.0)], 0.95, ()
        return "two-domains", REMANENCE_TWO, [0.3, a * u(0.5, 2.0), u(0.3, 1.5)], 0.95, ()
    if name == "heating":
        power = 0.4 * f * v * scale.test_s
        if pick:
            return "linear", HEATING_LINEAR, [0.3, power, u(1.5, 6.0) * scale.test_s], 5.0, ()
        return "limited", HEATING_LIMITED, [0.3, power, u(1.5, 6.0) * scale.test_s], 5.0, ()
    if name == "backlash":
        form = ("soft", "hard")[pick]
        return form, BACKLASH, [0.02 * a, (6.0, 20.0)[pick]], 0.3 * a, (("gap", 0),)
    if name == "delay":
        if pick:
            return "cascade", DELAY_CASCADE, [0.02], 0.25, (("delay", 0),)
        return "dead-time", DELAY_DEAD, [0.02, u(0.2, 0.4)], 0.25, (("delay", 0),)
    if name == "saturation":
        # the strength is the drive beyond the knee, so that 0 is no effect
        return "driver", SATURATION, [0.4 * scale.drive, u(6.0, 12.0), scale.drive], 0.8 * scale.drive, ()
    if name == "pinching":
        middle = a * u(-0.25, 0.25)
        if pick:
            return "cosine", PINCHING_COSINE, [0.3, a * u(0.3, 0.7), middle], 0.95, ()
        return "sech", PINCHING_SECH, [0.3, a * u(0.15, 0.35), middle], 0.95, ()
    if name == "channel-skew":
        if pick:
            return "shift", SKEW_SHIFT, [0.002], 0.03, (("skew", 0),)
        return "filter", SKEW_FILTER, [0.002], 0.03, (("skew", 0),)
    if name == "end-stop":
        clearance = a * u(0.75, 0.9)
        compare = (("free_travel", 1),)
        if pick:
            return "hertz", STOP_HERTZ, [f, clearance, a], 1e4 * f, compare
        return "rubber", STOP_RUBBER, [f, clearance, a], 1e4 * f, compare
    return _draw_outside(name, scale, rng)


def _draw_outside(name: str, scale: Scales, rng: np.random.Generator) -> tuple[str, int, list[float], float, tuple]:
    """Return a shape that is in no library."""
    a, f = scale.stroke, scale.force
    u = rng.uniform
    if name == "bump":
        return "drive-position", BUMP, [0.3 * f, a * u(-0.5, 0.5), a * u(0.15, 0.3), scale.drive], 10 * f, ()
    if name == "fractional-memory":
        return "half-order", FRACTIONAL, [0.1 * f, a, scale.drive], 10 * f, ()
    if name == "ripple":
        return "position", RIPPLE, [0.1 * f, a * u(0.2, 0.5), u(0.0, 2 * np.pi)], 10 * f, ()
    if name == "shaker":
        return "time", SHAKER, [0.1 * f, u(5.0, 12.0), scale.speed], 10 * f, ()
    if name == "lobes":
        return "phase-plane", LOBES, [0.1 * f, a, scale.speed, float(rng.integers(3, 5))], 10 * f, ()
    return "sudden", STICK_EVENTS, [0.5, u(0.02, 0.06), u(2.0, 4.0), float(rng.integers(1, 2**31))], 5.0, ()


EFFECTS = (
    "offset", "accumulator", "inertia", "asymmetry", "stribeck", "quadratic-drag", "migration", "remanence", "heating",
    "backlash", "delay", "saturation", "pinching", "channel-skew", "end-stop",
)  # fmt: skip
LAWS = {
    "offset": "shift of zero from test to test; with drive to the power 1.3 to 1.7; warming 1 - exp(-t/T)",
    "accumulator": "cubic spring; isothermal gas",
    "inertia": "mass behind a lag of 1 to 3 ms; mass that grows with the square of the displacement",
    "asymmetry": "yield force times 1 + s tanh(v/v_t); force times 1 + s F/sqrt(F^2 + F_0^2)",
    "stribeck": "yield force times 1 + s sech(v/v_s); 1 + s/(1 + |v|/v_s)",
    "quadratic-drag": "|v|^1.7 to |v|^1.9 after Blasius; square above an onset speed",
    "migration": "yield force times 1 - s/(1 + slip/L)^2; 1 - s (1 - tanh(t/T)) since the reversal",
    "remanence": "peak that the motion wipes out, joined by a power; two domains that forget with slip and with time",
    "heating": "temperature from dissipated work and loss; yield force falls linearly or to a limit, viscosity squared",
    "backlash": "play whose edge carries the damper gradually, soft or hard",
    "delay": "three lags in series; dead time and an amplifier's lag",
    "saturation": "driver with a soft knee, before the lag",
    "pinching": "dip of the yield force: squared cosine; squared hyperbolic secant",
    "channel-skew": "late force: pure shift; amplifier of second order",
    "end-stop": "Hertz contact; rubber that stiffens without bound",
    "bump": "outside the library: drive times a bump over the displacement",
    "fractional-memory": "outside the library: derivative of order one half of the displacement, times drive",
    "ripple": "outside the library: sine of the displacement",
    "shaker": "outside the library: sine of the time, growing with speed",
    "lobes": "outside the library: sine of three or four times the angle in the phase plane",
    "stick-events": "outside the library: sudden short rises of the yield force",
}
"""What is planted under each name; two laws are drawn with equal odds where two are named."""

OUTSIDE = ("bump", "fractional-memory", "ripple", "shaker", "lobes", "stick-events")


def draw_effect(name: str, scale: Scales, rng: np.random.Generator) -> Planted:
    """Return an effect with a guess of its strength."""
    form, code, numbers, strongest, compare = _draw(name, scale, rng)
    padded = np.zeros(NUMBERS)
    padded[: len(numbers)] = numbers
    return Planted(name, form, code, padded, float(strongest), compare)


# --- within the integration -------------------------------------------------------------------------------------------
@compiled
def _pulse(seed: float, width: float, rate: float, time: float) -> float:
    """Return 1 within events of a fixed random sequence (one event at most in each interval of 1/rate), else 0."""
    interval = math.floor(time * rate)
    value = math.sin(seed % 1000.0 + 12.9898 * (interval + 1.0)) * 43758.5453
    at = (interval + value - math.floor(value)) / rate
    return 1.0 if at <= time < at + width else 0.0


@compiled
def yield_factors(
    codes: Array, values: Array, memory: Array, x: float, v: float, slip: float, since: float, power: float,
    time: float, h: float, out: Array,
) -> None:  # fmt: skip
    """Write the factors of yield force and viscosity; `power` is dissipated power [W], `since` time since reversal."""
    out[0], out[1] = 1.0, 1.0
    for k in range(codes.shape[0]):
        code, n, own = codes[k], values[k], memory[k]
        if code == STRIBECK_SECH:
            out[0] *= 1.0 + n[0] / math.cosh(min(abs(v) / n[1], 50.0))
        elif code == STRIBECK_HYPERBOLA:
            out[0] *= 1.0 + n[0] / (1.0 + abs(v) / n[1])
        elif code == MIGRATION_SLIP:
            out[0] *= 1.0 - n[0] / (1.0 + slip / n[1]) ** 2
        elif code == MIGRATION_TIME:
            out[0] *= 1.0 - n[0] * (1.0 - math.tanh(since / n[1]))
        elif code == ASYMMETRY_YIELD:
            out[0] *= 1.0 + n[0] * math.tanh(v / n[1])
        elif code == PINCHING_COSINE:
            if abs(x - n[2]) < n[1]:
                out[0] *= 1.0 - n[0] * math.cos(0.5 * math.pi * (x - n[2]) / n[1]) ** 2
        elif code == PINCHING_SECH:
            out[0] *= 1.0 - n[0] / math.cosh(min(abs(x - n[2]) / n[1], 50.0)) ** 2
        elif code in (HEATING_LINEAR, HEATING_LIMITED):
            own[0] += h * (max(power, 0.0) / n[1] - own[0] / n[2])
            if code == HEATING_LINEAR:
                factor = max(1.0 - n[0] * own[0], 0.2)
            else:
                factor = math.exp(-n[0] * own[0] / (1.0 + 0.3 * own[0]))
            out[0] *= factor
            out[1] *= factor * factor
        elif code == STICK_EVENTS:
            out[0] *= 1.0 + n[0] * _pulse(n[3], n[1], n[2], time)


@compiled
def effective_drive(codes: Array, values: Array, memory: Array, u: float, v: float, h: float) -> float:
    """Return the drive that the fluid sees [A]: the lagged drive, and what the magnetic circuit remembers."""
    for k in range(codes.shape[0]):
        code, n, own = codes[k], values[k], memory[k]
        if code == REMANENCE_WIPED:
            # magnetisation stays at its peak and is wiped out by the motion
            own[0] = max(own[0] * math.exp(-abs(v) * h / n[1]), u)
            u = (max(u, 0.0) ** n[2] + (n[0] * own[0]) ** n[2]) ** (1.0 / n[2]) / (1.0 + n[0] ** n[2]) ** (1.0 / n[2])
        elif code == REMANENCE_TWO:
            # one domain forgets with motion, the other with time
            own[0] = max(u, u + (own[0] - u) * math.exp(-abs(v) * h / n[1]))
            own[1] = max(u, u + (own[1] - u) * math.exp(-h / n[2]))
            u += n[0] * (0.6 * (own[0] - u) + 0.4 * (own[1] - u))
    return u


@compiled
def damper_speed(codes: Array, values: Array, memory: Array, v: float, h: float) -> float:
    """Return the speed of the damper [m/s] behind the play of its bearing.

    The rod's place within the gap runs from -1 to 1; the damper begins to move as the rod comes near the edge.
    """
    for k in range(codes.shape[0]):
        if codes[k] == BACKLASH and values[k, 0] > 0.0:
            own = memory[k]
            ahead = own[0] if v > 0.0 else -own[0]
            carried = min(max(ahead, 0.0), 1.0) ** values[k, 1]
            own[0] = min(max(own[0] + 2.0 * v * (1.0 - carried) * h / values[k, 0], -1.0), 1.0)
            v *= carried
    return v


@compiled
def _end_stop(code: int, n: Array, x: float) -> float:
    past = (abs(x) - n[1]) / n[2]
    if past <= 0.0:
        return 0.0
    push = n[0] * past**1.5 if code == STOP_HERTZ else n[0] * past / (1.0 + 0.2 - min(past, 1.0))
    return push if x > 0.0 else -push


@compiled
def _fractional(n: Array, own: Array, rates: Array, x: float, u: float, h: float) -> float:
    """Return a force in proportion to the derivative of order one half of the displacement, and to the drive."""
    total = 0.0
    for j in range(rates.shape[0]):
        own[j] += (x - own[j]) * (1.0 - math.exp(-rates[j] * h))
        total += math.sqrt(rates[j]) * (x - own[j])
    return n[0] * (0.3 + u / n[2]) * total / (n[1] * 5.0)


@compiled
def parallel_force(
    codes: Array, values: Array, memory: Array, rates: Array, core: float, x: float, v: float, a: float, u: float,
    time: float, h: float,
) -> float:  # fmt: skip
    """Return the force of the core and of what acts in parallel [N]; `x`, `v`, `a` are those of the rod."""
    force = core
    for k in range(codes.shape[0]):
        code, n, own = codes[k], values[k], memory[k]
        if code == ACCUMULATOR_CUBIC:
            force += n[0] * x * (1.0 + (x / n[1]) ** 2)
        elif code == ACCUMULATOR_ISOTHERMAL:
            force += n[0] * n[1] * (1.0 / max(1.0 - x / n[1], 0.2) - 1.0)
        elif code == INERTIA_LAGGED:
            own[0] += (a - own[0]) * (1.0 - math.exp(-h / n[1]))
            force += n[0] * own[0]
        elif code == INERTIA_POSITION:
            force += n[0] * a * (1.0 + (x / n[1]) ** 2)
        elif code == DRAG_BLASIUS:
            force += n[0] * (abs(v) / n[2]) ** n[1] * (1.0 if v > 0.0 else -1.0)
        elif code == DRAG_ONSET:
            # laminar flow turns turbulent above n[1]
            force += n[0] * max(abs(v) - n[1], 0.0) ** 2 / n[2] ** 2 * (1.0 if v > 0.0 else -1.0)
        elif code in (STOP_HERTZ, STOP_RUBBER):
            force += _end_stop(code, n, x)
        elif code == ASYMMETRY_FORCE:
            force += n[0] * core * core / math.sqrt(core * core + n[1] * n[1])
        elif code == BUMP:
            force += n[0] * u / n[3] * math.exp(-(((x - n[1]) / n[2]) ** 2))
        elif code == FRACTIONAL:
            force += _fractional(n, own, rates, x, u, h)
        elif code == RIPPLE:
            force += n[0] * math.sin(2.0 * math.pi * x / n[1] + n[2])
        elif code == SHAKER:
            force += n[0] * math.sin(2.0 * math.pi * n[1] * time) * (0.3 + abs(v) / n[2])
        elif code == LOBES:
            force += n[0] * math.sin(n[3] * math.atan2(x / n[1], v / n[2]))
    return force
