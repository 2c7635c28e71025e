"""Controllers that share no code with the package: their laws, the loop of Figure 5.3, and a central LQG regulator.

Everything is plain Python and follows the equations of the thesis and docs/control-laws.md. The matrices of the
regulator come from other algorithms than those of the package: its Riccati equation is solved by the eigenvectors of
the Hamiltonian matrix, and the covariance of its observer is repeated until it settles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq


class Law(Protocol):
    """A law that gives the force [N] before clipping, once per sample."""

    def force(self, x: float, v: float) -> float:
        """Return the force for the estimated displacement [m] and velocity [m/s]."""


class HasInverse(Protocol):
    """A damper of which the force after yield is known."""

    def yielded(self, speed: float, drive: float) -> float:
        """Return the force at constant speed and drive, after yield [N]."""


@dataclass(frozen=True)
class Perfect:
    """A damper that has the force that it is asked for, until the next sample."""

    states: int = 0

    def start(self, _: float) -> list[float]:
        return []

    def answer(self, _: float, __: float, ___: np.ndarray, force: float) -> tuple[float, list[float]]:
        """Return the force [N] and the rates of the memory."""
        return force, []

    def yielded(self, _: float, drive: float) -> float:
        """Return the force at constant drive [N]."""
        return drive


@dataclass
class Linear:
    """f = c v + k x (4.14)."""

    c: float
    k: float

    def force(self, x: float, v: float) -> float:
        return self.c * v + self.k * x


@dataclass
class Friction:
    """f = alpha (X sign(v) - x) (4.18), (4.20), where the sign is tanh(v/v0).

    X is the last extremum, or the present displacement if it is larger. An extremum counts once the displacement has
    returned from it by the larger of `step` and a tenth of X, or once it is older than `memory` seconds.
    """

    alpha: float
    rounding: float
    step: float
    memory: float
    rate: float
    X: float = 0.0
    side: int = 1
    since: list[float] = field(default_factory=list)
    """Displacements since the last extremum that counts."""

    def force(self, x: float, v: float) -> float:
        if not self.since:
            self.X, self.side = abs(x), 1 if v >= 0.0 else -1
        self.since.append(x)
        far = self.side * max(self.side * item for item in self.since)
        returned = abs(far - x) > max(self.step, 0.1 * self.X)
        if returned or (len(self.since) - 1) / self.rate > self.memory:
            self.X = abs(far)
            self.side = -self.side if returned else 1 if v >= 0.0 else -1
            self.since = [x]
        return self.alpha * (max(self.X, abs(x)) * math.tanh(v / self.rounding) - x)


@dataclass
class Requested:
    """The force that the central regulator requests; it is set before each sample."""

    wanted: float = 0.0

    def force(self, _: float, __: float) -> float:
        return self.wanted


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
    """A controller of Figure 5.3: velocity, law, inverse, switch P2 (24), low-pass, limits.

    The force of the law is clipped by P2 (22). The inverse is the drive at which the damper, after yield, has the
    desired force at the estimated speed.
    """

    damper: HasInverse
    law: Law
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

    def command(self, x: float, v: float, a: float) -> tuple[float, float]:
        """Return the drive and the desired force; motion of the damper in m, m/s, m/s^2.

        A perfect damper takes the desired force itself as its drive.
        """
        position, speed = (x, v) if self.velocity == "measured" else self.moved(x, a)
        force = self.law.force(position, speed)
        if force * speed < 0.0:
            force = 0.0
        if isinstance(self.damper, Perfect):
            return force, force
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


class Central:
    """One LQG regulator for several dampers: f = -R^-1 B'P z with an observer that predicts one sample.

    At a sample it knows the ground acceleration, the displacements of its dampers, and the absolute accelerations of
    some floors. The forces that its dampers have at this sample, or should have had since the last one, count as those
    of the coming one.

    The cost is the integral of twice the energy of the structure plus the sum of R f^2. The observer assumes noise of
    the ground acceleration, of the forces, of each velocity (`model_noise` of that of the ground), and of its sensors.
    """

    def __init__(
        self,
        M: np.ndarray,
        C: np.ndarray,
        K: np.ndarray,
        W: np.ndarray,
        dt: float,
        *,
        weights: Sequence[float],
        floors: Sequence[int],
        force_noise: Sequence[float],
        ground_noise: float = 0.1,
        displacement_noise: float = 20e-6,
        acceleration_noise: float = 0.1,
        model_noise: float = 0.05,
        flexibilities: Sequence[float] | None = None,
    ) -> None:
        """`W` has a row for each damper, `flexibilities` are those of their braces [m/N]."""
        n, k = len(M), len(W)
        inverse = np.linalg.inv(M)
        lower = -inverse @ np.hstack([K, C])
        A = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower])
        by_force = -inverse @ W.T
        B = np.vstack([np.zeros((n, k)), by_force])
        Q = np.zeros((2 * n, 2 * n))
        Q[:n, :n], Q[n:, n:] = K, M
        R = np.diag(weights)
        self.K = np.linalg.solve(R, B.T @ _riccati(A, B @ np.linalg.solve(R, B.T), Q))
        # inputs that are held over a sample: the ground, then the forces
        inputs = np.hstack([np.vstack([np.zeros((n, 1)), -np.ones((n, 1))]), B])
        held = expm(dt * np.vstack([np.hstack([A, inputs]), np.zeros((1 + k, 2 * n + 1 + k))]))
        self.Ad, self.Bd = held[: 2 * n, : 2 * n], held[: 2 * n, 2 * n :]
        # readings: the displacement of each damper, then absolute accelerations, on which the ground has no direct part
        self.C = np.vstack([np.hstack([W, np.zeros((k, n))]), lower[list(floors)]])
        self.D = np.vstack([-np.diag(flexibilities or np.zeros(k)), by_force[list(floors)]])
        noise = np.diag(np.square(force_noise))
        S = ground_noise**2 * np.outer(self.Bd[:, 0], self.Bd[:, 0]) + self.Bd[:, 1:] @ noise @ self.Bd[:, 1:].T
        S += np.diag([0.0] * n + [(model_noise * ground_noise * dt) ** 2] * n)
        V = np.diag([displacement_noise**2] * k + [acceleration_noise**2] * len(floors))
        V += np.diag(np.diag(self.D @ noise @ self.D.T))
        self.L = _predictor(self.Ad, self.C, S, V)
        self.z, self.floors = np.zeros(2 * n), list(floors)

    def forces(self, ground: float, readings: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the forces for this sample; `last` are those that count as the forces of the coming one."""
        innovation = readings - self.C @ self.z - self.D @ last
        self.z = self.Ad @ self.z + self.Bd @ np.concatenate([[ground], last]) + self.L @ innovation
        return np.asarray(-self.K @ self.z)


def _riccati(A: np.ndarray, G: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """Return P of A'P + P A - P G P + Q = 0, from the stable subspace of the Hamiltonian matrix."""
    values, vectors = np.linalg.eig(np.block([[A, -G], [-Q, -A.T]]))
    stable = vectors[:, values.real < 0.0]
    upper, lower = np.vsplit(stable, 2)
    return np.asarray((lower @ np.linalg.inv(upper)).real)


def _predictor(A: np.ndarray, C: np.ndarray, S: np.ndarray, V: np.ndarray) -> np.ndarray:
    """Return the steady gain of z+ = A z + L (y - C z), by repeating its covariance equations until they settle."""
    P, L = S.copy(), np.zeros((len(A), len(C)))
    for _ in range(50000):
        before = L
        L = np.linalg.solve(C @ P @ C.T + V, C @ P @ A.T).T
        P = A @ P @ A.T + S - L @ (C @ P @ A.T)
        P = 0.5 * (P + P.T)
        if np.abs(L - before).max() < 1e-13 * np.abs(L).max():
            break
    return L
