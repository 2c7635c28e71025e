"""A closed loop with several dampers that shares no code with the package: equations of motion, dampers, controllers.

Between the instants at which a command changes, `solve_ivp` integrates structure and dampers with tight tolerances. At
each sample a controller in plain Python reads its sensors and holds its drive until its next command acts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

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


def kalman_gains(displacement_noise: float, acceleration_noise: float, dt: float) -> np.ndarray:
    """Return the steady gains of the kinematic filter, by repeating its covariance equations until they settle."""
    A, G = np.array([[1.0, dt], [0.0, 1.0]]), np.array([0.5 * dt**2, dt])
    Q = acceleration_noise**2 * np.outer(G, G)
    P, gains = Q.copy(), np.zeros(2)
    for _ in range(20000):
        before = gains
        gains = P[:, 0] / (P[0, 0] + displacement_noise**2)
        P = A @ (P - np.outer(gains, P[0])) @ A.T + Q
        if np.abs(gains - before).max() < 1e-14 * np.abs(gains).max():
            break
    return gains


@dataclass
class Sampled:
    """A controller of Figure 5.3: velocity, force, inverse, switch P2 (24), low-pass, limits.

    The force is c v + k x, clipped by P2 (22). The inverse is the drive at which the damper, after yield, has the
    desired force at the estimated speed.
    """

    damper: BoucWen
    c: float
    k: float
    rate: float
    limit: float
    switch: float
    low_pass_hz: float | None
    velocity: str
    noise: tuple[float, float] = (20e-6, 0.1)
    estimate: tuple[float, float] | None = None
    last: tuple[float, float] = (0.0, 0.0)
    asked: list[float] = field(default_factory=lambda: [0.0, 0.0])
    given: list[float] = field(default_factory=lambda: [0.0, 0.0])

    def __post_init__(self) -> None:
        self.gains = kalman_gains(*self.noise, 1.0 / self.rate)

    def command(self, x: float, a: float) -> tuple[float, float]:
        """Return the drive and the desired force, from displacement [m] and acceleration [m/s^2] of the damper."""
        position, speed = self.moved(x, a)
        force = self.c * speed + self.k * position
        if force * speed < 0.0:
            force = 0.0
        drive = 0.0 if abs(force) < self.switch else self.inverse(abs(speed), abs(force))
        return min(max(self.filtered(drive), 0.0), self.limit), force

    def moved(self, x: float, a: float) -> tuple[float, float]:
        dt = 1.0 / self.rate
        if self.estimate is None:
            self.estimate = (x, 0.0)
        elif self.velocity == "difference":
            self.estimate = (x, (x - self.last[0]) / dt)
        else:
            mean = 0.5 * (a + self.last[1])
            ahead = self.estimate[0] + dt * self.estimate[1] + 0.5 * dt**2 * mean
            error = x - ahead
            self.estimate = (ahead + self.gains[0] * error, self.estimate[1] + dt * mean + self.gains[1] * error)
        self.last = (x, a)
        return self.estimate

    def inverse(self, speed: float, force: float) -> float:
        if self.damper.yielded(speed, 0.0) >= force:
            return 0.0
        if self.damper.yielded(speed, self.limit) <= force:
            return self.limit
        return float(brentq(lambda u: self.damper.yielded(speed, u) - force, 0.0, self.limit, xtol=1e-13))

    def filtered(self, drive: float) -> float:
        """Butterworth low-pass of second order by the bilinear transform, with the frequency of the cut-off exact."""
        if self.low_pass_hz is None:
            return drive
        w = math.tan(math.pi * self.low_pass_hz / self.rate)
        scale = 1.0 + math.sqrt(2.0) * w + w * w
        total = w * w * (drive + 2.0 * self.asked[0] + self.asked[1])
        total -= 2.0 * (w * w - 1.0) * self.given[0] + (1.0 - math.sqrt(2.0) * w + w * w) * self.given[1]
        result = total / scale
        self.asked, self.given = [drive, self.asked[0]], [result, self.given[0]]
        return result


@dataclass
class Device:
    """A damper between two places of the structure, with its controller; `brace` [N/m] is in series with the damper."""

    w: np.ndarray
    damper: BoucWen
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
    rtol: float = 1e-8,
    atol: float = 1e-11,
) -> Histories:
    """Integrate the loop from rest; a command acts `delay` after its sample, and the first one acts before, too."""
    loop = Loop(M, C, K, devices, ground, driver_s)
    rate = devices[0].controller.rate
    samples = round(duration * rate) + 1
    rows: list[tuple[np.ndarray, ...]] = []
    y = loop.start()

    def forward(start: float, end: float, state: np.ndarray) -> np.ndarray:
        if end - start < 1e-12:
            return state
        return np.asarray(solve_ivp(loop.slope, (start, end), state, "LSODA", rtol=rtol, atol=atol).y[:, -1])

    for sample in range(samples):
        t = sample / rate
        across = loop.rod_accelerations(t, y)
        answers = [
            item.controller.command(part[1], a) for item, part, a in zip(devices, loop.parts(y), across, strict=True)
        ]
        commands, desired = (np.array(column) for column in zip(*answers, strict=True))
        if sample == 0:
            loop.held[:] = commands
            y = loop.start()
        forces, strokes, _, drives, _ = zip(*loop.parts(y), strict=True)
        rows.append((y[: loop.n], np.array(forces), np.array(drives), commands, desired, np.array(strokes)))
        if sample < samples - 1:
            y = forward(t, t + delay, y)
            loop.held[:] = commands
            y = forward(t + delay, t + 1.0 / rate, y)
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Histories(np.arange(samples) / rate, *columns)
