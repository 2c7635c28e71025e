"""A closed loop with several dampers that shares no code with the package: equations of motion, dampers, controllers.

Between the instants at which a command changes, `solve_ivp` integrates structure and dampers with tight tolerances. At
each sample a controller in plain Python reads its sensors and holds its drive until its next command acts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from .independent_control import Central, Perfect, Requested, Sampled

Polynomial = tuple[float, ...]
"""Coefficients of a polynomial of the drive, constant first."""


def value(coefficients: Polynomial, drive: float) -> float:
    return sum(factor * drive**power for power, factor in enumerate(coefficients))


@dataclass(frozen=True)
class BoucWen:
    """(2.1) to (2.4): f = alpha(u) z + c0(u) v, z' = A v - gamma |v| z |z| - beta v z^2, u' = eta (I - u).

    Its memory is z and u; behind a brace also its displacement, whose rate follows from the force of the brace.
    """

    alpha: Polynomial
    c0: Polynomial
    A: float
    gamma: float
    beta: float
    eta: float
    states: int = 2

    def start(self, drive: float) -> list[float]:
        return [0.0, drive]

    def answer(self, x: float, v: float, memory: np.ndarray, drive: float) -> tuple[float, list[float]]:
        """Return the force [N] and the rates of the memory."""
        z, u = memory
        return value(self.alpha, u) * z + value(self.c0, u) * v, self.rates(v, memory, drive)

    def rates(self, v: float, memory: np.ndarray, drive: float) -> list[float]:
        z, u = memory
        return [self.A * v - self.gamma * abs(v) * z * abs(z) - self.beta * v * z * z, self.eta * (drive - u)]

    def velocity(self, force: float, x: float, memory: np.ndarray) -> float:
        """Return the velocity of the rod at which the damper has this force."""
        z, u = memory
        return (force - value(self.alpha, u) * z) / value(self.c0, u)

    def yielded(self, speed: float, drive: float) -> float:
        """Return the force at constant speed and drive, after yield [N]."""
        return value(self.alpha, drive) * math.sqrt(self.A / (self.gamma + self.beta)) + value(self.c0, drive) * speed


@dataclass(frozen=True)
class ModifiedBoucWen:
    """Paper P4 (1) to (5): f = c1 y' + k1 (x - x0), (c0 + c1) y' = alpha z + c0 x' + k0 (x - y), u' = eta (I - u).

    Its memory is y, z and the voltage u at the damper. The numbers are those of Table 1 of the paper.
    """

    alpha: Polynomial = (46.2e3, 41.2e3)
    c0: Polynomial = (110.0e3, 114.3e3)
    c1: Polynomial = (8359.2e3, 7482.9e3)
    k0: float = 2.0
    k1: float = 9.7
    x0: float = 0.18
    A: float = 1107.2
    gamma: float = 164.0
    beta: float = 164.0
    eta: float = 100.0
    states: int = 3

    def start(self, drive: float) -> list[float]:
        return [0.0, 0.0, drive]

    def answer(self, x: float, v: float, memory: np.ndarray, drive: float) -> tuple[float, list[float]]:
        """Return the force [N] and the rates of the memory."""
        y, z, u = memory
        c0, c1 = value(self.c0, u), value(self.c1, u)
        rate = (value(self.alpha, u) * z + c0 * v + self.k0 * (x - y)) / (c0 + c1)
        w = v - rate
        hysteresis = self.A * w - self.gamma * abs(w) * z * abs(z) - self.beta * w * z * z
        return c1 * rate + self.k1 * (x - self.x0), [rate, hysteresis, self.eta * (drive - u)]

    def yielded(self, speed: float, drive: float) -> float:
        """Return the force at constant speed and drive, after yield [N]; c1 alone gives way to a slow motion."""
        c0, c1 = value(self.c0, drive), value(self.c1, drive)
        plastic = value(self.alpha, drive) * math.sqrt(self.A / (self.gamma + self.beta))
        return min(c1 * speed, c1 * (plastic + c0 * speed) / (c0 + c1))


@dataclass
class Device:
    """A damper between two places of the structure, with its controller; `brace` [N/m] is in series with the damper."""

    w: np.ndarray
    damper: BoucWen | ModifiedBoucWen | Perfect
    controller: Sampled
    brace: float = math.inf


@dataclass(frozen=True)
class Histories:
    """Values at the samples: displacement (m, n), and for each damper force, command and stroke (m, dampers).

    `drive` is the drive at the damper up to the sample.
    """

    time: np.ndarray
    displacement: np.ndarray
    force: np.ndarray
    drive: np.ndarray
    command: np.ndarray
    desired: np.ndarray
    stroke: np.ndarray


class Loop:
    """M x'' + C x' + K x = -sum w f - M 1 a_g with devices; `driver_s` is the time constant of a current driver.

    The state is [x, x', memories], where the memory of a device is that of its damper, then the displacement of the
    rod where there is a brace, then the current where there is a driver.
    """

    def __init__(
        self,
        M: np.ndarray,
        C: np.ndarray,
        K: np.ndarray,
        devices: Sequence[Device],
        ground: Callable[[float], float],
        driver_s: float,
    ) -> None:
        self.inverse, self.C, self.K = np.linalg.inv(M), C, K
        self.devices, self.ground, self.driver_s, self.n = devices, ground, driver_s, len(M)
        self.W = np.array([item.w for item in devices])
        self.held = np.zeros(len(devices))
        sizes = [item.damper.states + (item.brace < math.inf) + (driver_s > 0.0) for item in devices]
        self.starts = 2 * self.n + np.cumsum([0, *sizes])

    def start(self) -> np.ndarray:
        """Return the state at rest, where all lags are in equilibrium with the drives that are held."""
        state = [np.zeros(2 * self.n)]
        for item, drive in zip(self.devices, self.held, strict=True):
            extra = [0.0] * (item.brace < math.inf) + [drive] * (self.driver_s > 0.0)
            state.append(np.array([*item.damper.start(drive), *extra]))
        return np.concatenate(state)

    def device(
        self, d: int, stroke: float, speed: float, own: np.ndarray
    ) -> tuple[float, float, float, float, list[float]]:
        """Return force, displacement and speed of the rod, drive at the damper, and rates of the memory."""
        item = self.devices[d]
        memory, drive, driver = own[: item.damper.states], float(self.held[d]), []
        if self.driver_s > 0.0:
            drive, driver = own[-1], [(drive - own[-1]) / self.driver_s]
        if item.brace == math.inf:
            force, rates = item.damper.answer(stroke, speed, memory, drive)
            return force, stroke, speed, drive, [*rates, *driver]
        rod = own[item.damper.states]
        assert isinstance(item.damper, BoucWen), "this damper has no brace here"
        force = item.brace * (stroke - rod)
        speed = item.damper.velocity(force, rod, memory)
        return force, rod, speed, drive, [*item.damper.rates(speed, memory, drive), speed, *driver]

    def parts(self, y: np.ndarray) -> list[tuple[float, float, float, float, list[float]]]:
        strokes, speeds = self.W @ y[: self.n], self.W @ y[self.n : 2 * self.n]
        return [
            self.device(d, strokes[d], speeds[d], y[self.starts[d] : self.starts[d + 1]])
            for d in range(len(self.devices))
        ]

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        parts, v = self.parts(y), y[self.n : 2 * self.n]
        pull = self.W.T @ [part[0] for part in parts]
        acceleration = self.inverse @ (-self.C @ v - self.K @ y[: self.n] - pull) - self.ground(t)
        return np.concatenate([v, acceleration, *(part[4] for part in parts)])

    def floor_accelerations(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the absolute acceleration of each floor."""
        return np.asarray(self.slope(t, y)[self.n : 2 * self.n] + self.ground(t))

    def rod_accelerations(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return the acceleration of each rod; behind a brace it is the change of its speed along the solution."""
        rate = self.slope(t, y)
        found = self.W @ rate[self.n : 2 * self.n]
        for d, item in enumerate(self.devices):
            if item.brace < math.inf:
                after, before = (self.parts(y + side * 1e-6 * rate)[d][2] for side in (1.0, -1.0))
                found[d] = (after - before) / 2e-6
        return np.asarray(found)


def integrate(
    M: np.ndarray,
    C: np.ndarray,
    K: np.ndarray,
    devices: Sequence[Device],
    ground: Callable[[float], float],
    duration: float,
    *,
    delay: float = 0.0,
    driver_s: float = 0.0,
    central: Central | None = None,
    load_cells: bool = True,
    rtol: float = 1e-8,
    atol: float = 1e-11,
) -> Histories:
    """Integrate the loop from rest; a command acts `delay` after its sample, and the first drive acts before, too.

    `central` is the regulator of the dampers with the law `Requested`. It reads the forces of its dampers; without
    `load_cells` it takes the forces that they should have had since the last sample.
    """
    loop = Loop(M, C, K, devices, ground, driver_s)
    rate = devices[0].controller.rate
    regulated = [d for d, item in enumerate(devices) if isinstance(item.controller.law, Requested)]
    desired = np.zeros(len(devices))
    samples = round(duration * rate) + 1
    rows: list[tuple[np.ndarray, ...]] = []
    y = loop.start()

    def forward(start: float, end: float, state: np.ndarray) -> np.ndarray:
        if end - start < 1e-12:
            return state
        return np.asarray(solve_ivp(loop.slope, (start, end), state, "LSODA", rtol=rtol, atol=atol).y[:, -1])

    for sample in range(samples):
        t = sample / rate
        across, parts = loop.rod_accelerations(t, y), loop.parts(y)
        if central is not None:
            readings = [*(parts[d][1] for d in regulated), *loop.floor_accelerations(t, y)[central.floors]]
            known = np.array([parts[d][0] for d in regulated]) if load_cells else desired[regulated]
            wanted = central.forces(ground(t), np.array(readings), known)
            for d, force in zip(regulated, wanted, strict=True):
                devices[d].controller.law = Requested(float(force))
        answers = [
            item.controller.command(part[1], part[2], a) for item, part, a in zip(devices, parts, across, strict=True)
        ]
        commands, desired = (np.array(column) for column in zip(*answers, strict=True))
        if sample == 0:
            # a perfect damper has no force before
            loop.held[:] = [drive * (item.damper.states > 0) for item, drive in zip(devices, commands, strict=True)]
            y = loop.start()
        forces, strokes, _, drives, _ = zip(*loop.parts(y), strict=True)
        rows.append((y[: loop.n], np.array(forces), np.array(drives), commands, desired, np.array(strokes)))
        if sample < samples - 1:
            y = forward(t, t + delay, y)
            loop.held[:] = commands
            y = forward(t + delay, t + 1.0 / rate, y)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Histories(np.arange(samples) / rate, *columns)
