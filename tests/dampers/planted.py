"""Bench tests made without the package's own damper code: (2.1) to (2.4) by an adaptive integrator, and noise."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import butter, sosfiltfilt

from mrpipe.signals.prepared import PreparedTest

SET_C = {
    "alpha": (19.92, 5.03, 20.03, -1.785),
    "c0": (50.0, 75.0),
    "A": 3000.0,
    "gamma": 1230.0,
    "beta": 1230.0,
    "eta": 100.0,
}


def equations_force(times, displacement, velocity, current, numbers=SET_C):
    """Force of the simplified Bouc-Wen model, n = 2; the arguments are functions of time."""

    def rate(t, state):
        z, u = state
        v = velocity(t)
        z_dot = -numbers["gamma"] * abs(v) * z * abs(z) - numbers["beta"] * v * z**2 + numbers["A"] * v
        return [z_dot, -numbers["eta"] * (u - current(t))]

    answer = solve_ivp(
        rate, (times[0], times[-1]), [0.0, current(times[0])], t_eval=times, rtol=1e-7, atol=1e-9, max_step=4e-3
    )
    z, u = answer.y
    return np.polynomial.polynomial.polyval(u, numbers["alpha"]) * z + (
        np.polynomial.polynomial.polyval(u, numbers["c0"]) * velocity(times)
    )


def bench_test(name, role, amplitude, frequency, current, force=None, *, seed=0, phase=0.0, noise=(20e-6, 2.0)):
    """One sine test of some two and a half cycles at 1 kHz as `prepare` hands it on.

    `current` is a level [A] or ("half-sine", amplitude); `force` a function (x, v, u, times) in place of the equations.
    """
    omega = 2 * np.pi * frequency
    times = np.arange(0.0, 2.6 / frequency, 1e-3)
    rng = np.random.default_rng(seed)

    def position(t):
        return amplitude * np.sin(omega * t + phase)

    def speed(t):
        return amplitude * omega * np.cos(omega * t + phase)

    def drive(t):
        if isinstance(current, tuple):
            return current[1] * np.abs(np.sin(omega * t + 0.4))
        return current + 0.0 * t

    if force is None:
        measured = equations_force(times, position, speed, drive)
    else:
        measured = force(position(times), speed(times), drive(times), times)
    measured = measured + noise[1] * rng.normal(size=len(times))
    raw = position(times) + noise[0] * rng.normal(size=len(times))
    smooth = butter(2, 100.0, fs=1000.0, output="sos")
    slow = butter(2, 20.0, fs=1000.0, output="sos")
    displacement = sosfiltfilt(smooth, raw)
    velocity = sosfiltfilt(slow, np.gradient(displacement, 1e-3))
    return PreparedTest(
        name=name,
        role=role,
        sampling_rate_hz=1000.0,
        time_s=times,
        displacement_m=displacement,
        velocity_m_s=velocity,
        acceleration_m_s2=np.gradient(velocity, 1e-3),
        drive=drive(times),
        force_n=sosfiltfilt(smooth, measured),
        displacement_raw_m=raw,
        force_raw_n=measured,
        cycles=np.zeros(0, dtype=np.int64),
        drive_unit="A",
    )


def set_c_campaign():
    """Constant and half-sine current, two amplitudes, two frequencies; the last of each kind for validation."""
    tests = []
    for place, (amplitude, frequency) in enumerate([(5e-3, 0.8), (10e-3, 1.27), (5e-3, 2.2), (10e-3, 1.8)]):
        role = "validation" if place == 3 else "training"
        for current in (0.0, 2.0, 4.0, ("half-sine", 3.0), ("half-sine", 4.0)):
            seed = len(tests)
            tests.append(bench_test(f"test-{seed}", role, amplitude, frequency, current, seed=seed, phase=0.3 * seed))
    return tests
