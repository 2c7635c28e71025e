"""A second, readable version of the closed loop in plain numpy, as reference for tests of the compiled kernel.

It supports Bouc-Wen dampers only. Every part is programmed independently: the hysteresis is integrated from (2.2) with
small Runge-Kutta steps, the controller works on arrays and lists, and the step solves for motion and force by simple
iteration.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.kalman import discrete_kalman_gains
from mrpipe.dampers.model import DamperModel
from mrpipe.networks.network import Network
from mrpipe.signals.discretisation import discretise_first_order
from mrpipe.structures import Frame, state_space


@dataclass
class ReferenceController:
    """Laws vd, vdps, vdns and fdns with an inverse network; the same rules as `control.kernel`."""

    gains: Gains
    options: ControllerOptions
    inverse: Network
    x: float = 0.0
    v: float = 0.0
    last_acceleration: float | None = None
    direction: float = 0.0
    seeking: float = 0.0
    extreme: float = 0.0
    amplitude: float = 0.0
    age: float = 0.0
    speeds: deque[float] = field(default_factory=deque)
    forces: deque[float] = field(default_factory=deque)
    filtered: list[float] = field(default_factory=lambda: [0.0, 0.0])
    asked: list[float] = field(default_factory=lambda: [0.0, 0.0])

    def step(self, displacement: float, acceleration: float) -> tuple[float, float]:
        """Return drive and desired force; the rate of network and controller must be one."""
        started = self.last_acceleration is not None
        self._estimate(displacement, acceleration)
        self._follow(started)
        force = self._force()
        past = self.inverse.features.past_values
        if not started or self.options.inverse_request == "steady":
            self.speeds.clear()
            self.forces.clear()
            self.speeds.extend([self.v] * past)
            self.forces.extend([force] * past)
        self.speeds.appendleft(self.v)
        self.forces.appendleft(force)
        row = np.abs([*list(self.speeds)[: past + 1], *list(self.forces)[: past + 1]])
        drive = float(self.inverse.predict(row[None, :])[0])
        if abs(force) < self.options.residual_force_n:
            drive = 0.0
        return min(max(self._low_pass(drive), 0.0), self.options.drive_limit or np.inf), force

    def _estimate(self, displacement: float, acceleration: float) -> None:
        dt = 1.0 / self.options.rate_hz
        if self.last_acceleration is None:
            self.x, self.v = displacement, 0.0
        else:
            gain = discrete_kalman_gains(self.options.displacement_noise_m, self.options.acceleration_noise_m_s2, dt)
            mean = 0.5 * (acceleration + self.last_acceleration)
            predicted = np.array([[1.0, dt], [0.0, 1.0]]) @ [self.x, self.v] + np.array([0.5 * dt**2, dt]) * mean
            corrected = predicted + gain[:2] * (displacement - predicted[0])
            self.x, self.v = float(corrected[0]), float(corrected[1])
        self.last_acceleration = acceleration

    def _follow(self, started: bool) -> None:
        if self.v != 0.0:
            self.direction = float(np.sign(self.v))
        if not started:
            self.seeking = 1.0 if self.v >= 0.0 else -1.0
            self.extreme, self.amplitude = self.x, abs(self.x)
            return
        self.age += 1.0 / self.options.rate_hz
        self.extreme = self.seeking * max(self.seeking * self.x, self.seeking * self.extreme)
        enough = max(self.options.extremum_step_m, self.options.extremum_share * self.amplitude)
        if self.seeking * (self.extreme - self.x) > enough:
            self.amplitude, self.seeking, self.extreme, self.age = abs(self.extreme), -self.seeking, self.x, 0.0
        elif self.age > self.options.extremum_memory_s:
            self.amplitude, self.seeking, self.extreme = abs(self.extreme), 1.0 if self.v >= 0.0 else -1.0, self.x
            self.age = 0.0

    def _force(self) -> float:
        if self.gains.alpha_n_m:
            largest = max(self.amplitude, abs(self.x))
            rounding = self.options.friction_rounding_m_s
            side = float(np.tanh(self.v / rounding)) if rounding > 0.0 else self.direction
            force = self.gains.alpha_n_m * (side * largest - self.x)
        else:
            force = self.gains.c_n_s_m * self.v + self.gains.k_n_m * self.x
        return force if force * self.direction >= 0.0 else 0.0

    def _low_pass(self, drive: float) -> float:
        from scipy.signal import butter

        if self.options.low_pass_hz is None:
            return drive
        b, a = butter(2, self.options.low_pass_hz, fs=self.options.rate_hz)
        result = float(b @ [drive, *self.asked] - a[1:] @ self.filtered)
        self.asked = [drive, self.asked[0]]
        self.filtered = [result, self.filtered[0]]
        return result


@dataclass
class ReferenceDamper:
    """Bouc-Wen damper of (2.1) to (2.4), normalised, moved by increments of displacement."""

    model: DamperModel
    zeta: float = 0.0
    current: float = 0.0
    speed: float = 0.0

    def moved(self, increment: float, velocity: float, command: float, dt: float) -> tuple[float, ReferenceDamper]:
        """Return the force [N] after a step, and the damper in its new state."""
        numbers = self.model.parameters
        turn = _turning_point(increment, self.speed, velocity, dt)
        zeta = self.zeta
        for part in (turn, increment - turn):
            zeta = _hysteresis(zeta, part, numbers["yield_displacement"], numbers["gamma_share"])
        # the command is held over the step
        current = command + (self.current - command) * np.exp(-numbers["eta"] * dt)
        force = self.model.yield_force(current) * zeta + self.model.viscosity(current) * velocity
        return float(force), ReferenceDamper(self.model, zeta, float(current), velocity)


def _turning_point(increment: float, speed_before: float, speed_after: float, dt: float) -> float:
    """Return the path [m] to the point at which the motion turns within the step; `increment` if it does not."""
    from scipy.interpolate import CubicHermiteSpline

    if speed_before * speed_after >= 0.0:
        return increment
    path = CubicHermiteSpline([0.0, dt], [0.0, increment], [speed_before, speed_after])
    turns = path.derivative().roots(extrapolate=False)
    return float(path(turns[0])) if len(turns) else increment


def _hysteresis(zeta: float, increment: float, yield_displacement: float, gamma_share: float) -> float:
    """Integrate (2.2) in displacement, n = 2: dzeta/dx = (1 - (gamma sign(dx zeta) + beta) zeta^2)/x_y."""
    if increment == 0.0:
        return zeta
    count = 8
    h = increment / count
    sign = np.sign(increment)

    def slope(z: float) -> float:
        return float((1.0 - (gamma_share * sign * np.sign(z) + 1.0 - gamma_share) * z**2) / yield_displacement)

    for _ in range(count):
        k1 = slope(zeta)
        k2 = slope(zeta + 0.5 * h * k1)
        k3 = slope(zeta + 0.5 * h * k2)
        k4 = slope(zeta + h * k3)
        zeta += h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    return zeta


def reference_loop(
    frame: Frame,
    damper: DamperModel,
    controller: ReferenceController,
    ground: FloatArray,
    *,
    per_sample: int,
    position: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Run the loop without sensor noise.

    Parameters
    ----------
    frame, damper, position
        As in :func:`~mrpipe.simulation.loop.simulate_law`.
    controller
        Fresh.
    ground
        Base acceleration at every plant step, shape (steps + 1,) [m/s^2].
    per_sample
        Plant steps per controller sample.

    Returns
    -------
    Displacements (steps + 1, n) [m], damper force [N] and drive [A], each of shape (steps + 1,).
    """
    n = frame.floors
    w = np.asarray(position, dtype=np.float64)
    dt = 1.0 / (controller.options.rate_hz * per_sample)
    space = state_space(frame, -w)
    Ad, B0, B1 = discretise_first_order(space.A, space.B, dt)
    z, force, drive = np.zeros(2 * n), 0.0, 0.0
    device = ReferenceDamper(damper)
    states, forces, drives = [], [], []
    for step, acceleration in enumerate(ground):
        if step % per_sample == 0:
            relative = w @ (space.A[n:] @ z + space.B[n:] @ [acceleration, force])
            drive, _ = controller.step(float(w @ z[:n]), float(relative))
            if step == 0:
                device = ReferenceDamper(damper, 0.0, drive)
        states.append(z[:n].copy())
        forces.append(force)
        drives.append(drive)
        if step == len(ground) - 1:
            break
        free = Ad @ z + B0 @ [acceleration, force] + B1[:, 0] * ground[step + 1]
        before = float(w @ z[:n])
        new = force
        for _ in range(60):
            trial = free + B1[:, 1] * new
            answer, moved = device.moved(float(w @ trial[:n]) - before, float(w @ trial[n:]), drive, dt)
            if abs(answer - new) < 1e-12:
                break
            new = answer
        z, force, device = free + B1[:, 1] * new, new, moved
    return np.array(states), np.array(forces), np.array(drives)
