"""The time loop of the benchmark structures, compiled: exact steps of the linear structure, implicit device forces.

Loads are linear between their samples, device forces are constant over a step; for both the structure's step is exact
(matrix exponential). Where damping does not couple the modes a step costs a few operations a mode.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import float64, int64, njit, types, void

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.devices import (
    ACTIVE,
    ALPHA,
    BINGHAM,
    CAPACITY,
    CHAIN,
    CHAIN_COUNT,
    CLASSICAL,
    CONSTANT,
    CONTROL_EVERY,
    COUNT,
    DT,
    FADE,
    FILTER_RATE,
    FORCE_A,
    FORCE_B,
    FRICTION,
    HIGHEST_VOLTAGE,
    KELVIN,
    LAW,
    LQG,
    NEURAL,
    NONE,
    RATIO,
    REALISATION,
    SAVE,
    STIFFNESS,
    VISCOSITY_A,
    VISCOSITY_B,
    VISCOUS,
    VOLTAGE,
    desired_force,
    dissipative_force,
    inverse_bingham,
    network_voltage,
    update_amplitude,
)
from mrpipe.dampers.plant import (
    ACCELERATION,
    BOOKKEEPING,
    CHAIN_FUNCTIONS,
    DISPLACEMENT,
    DRIVE,
    FIRST,
    FORCE,
    VELOCITY,
    WIRE_SIZE,
    advance,
)
from mrpipe.simulation.parts import multiply

REST = 1e-12
"""Velocity below which a rod is at rest [m/s]."""

_V = float64[::1]
_M = float64[:, ::1]
_STRUCTURE = types.UniTuple(_M, 11)
_CONTROL = types.UniTuple(_M, 8)
_NETWORK = types.Tuple((_M, _V, _M, _V, _V, _V))
_CHAIN = types.Tuple((CHAIN_FUNCTIONS, _V, int64[::1], int64[::1]))
_RESULT = types.UniTuple(_M, 5)


@njit(cache=True)
def interpolate(loads: FloatArray, k: int, ratio: int, now: FloatArray, after: FloatArray) -> None:
    """Put the loads at the start and the end of step k into `now` and `after`."""
    coarse = k // ratio
    share = (k - coarse * ratio) / ratio
    for j in range(loads.shape[1]):
        slope = loads[coarse + 1, j] - loads[coarse, j]
        now[j] = loads[coarse, j] + share * slope
        after[j] = loads[coarse, j] + (share + 1.0 / ratio) * slope


@njit(cache=True)
def free_step(
    classical: bool, structure: Any, state: FloatArray, now: FloatArray, after: FloatArray, result: FloatArray
) -> None:
    """Advance the structure by one step under its loads alone."""
    step, load_now, load_next, blocks, pulses = structure[0], structure[1], structure[2], structure[3], structure[4]
    n = state.shape[0] // 2
    if classical:
        for i in range(n):
            q, v, p, r = state[i], state[n + i], now[i], after[i]
            result[i] = blocks[i, 0] * q + blocks[i, 1] * v + pulses[i, 0] * p + pulses[i, 1] * r
            result[n + i] = blocks[i, 2] * q + blocks[i, 3] * v + pulses[i, 2] * p + pulses[i, 3] * r
        return
    multiply(step, state, result)
    for j in range(now.shape[0]):
        for i in range(2 * n):
            result[i] += load_now[j, i] * now[j] + load_next[j, i] * after[j]


@njit(cache=True)
def damping_power(classical: bool, state: FloatArray, damping: FloatArray) -> float:
    """Return q'' D q' [W]: what the structure's own damping dissipates."""
    n = damping.shape[0]
    power = 0.0
    for i in range(n):
        row = damping[i, i] * state[n + i]
        if not classical:
            row = 0.0
            for j in range(n):
                row += damping[i, j] * state[n + j]
        power += row * state[n + i]
    return power


@njit(cache=True)
def input_work(
    classical: bool, modal_load: FloatArray, now: FloatArray, after: FloatArray, old: FloatArray, new: FloatArray
) -> float:
    """Return the work of the loads in a step [J]: mean load times change of position."""
    total = 0.0
    n = old.shape[0] // 2
    for j in range(now.shape[0]):
        moved = new[j] - old[j] if classical else 0.0
        if not classical:
            for i in range(n):
                moved += modal_load[j, i] * (new[i] - old[i])
        total += 0.5 * (now[j] + after[j]) * moved
    return total


@njit(cache=True)
def rod_motion(positions: FloatArray, state: FloatArray, x: FloatArray, v: FloatArray) -> None:
    """Put displacement and velocity of each device's rod into `x` and `v`."""
    n = positions.shape[1]
    for d in range(positions.shape[0]):
        x[d], v[d] = 0.0, 0.0
        for i in range(n):
            x[d] += positions[d, i] * state[i]
            v[d] += positions[d, i] * state[n + i]


@njit(cache=True)
def observe(
    control: Any, k: int, state: FloatArray, force: FloatArray, estimate: FloatArray, wanted: FloatArray
) -> None:
    """Put the LQG force of the present estimate into `wanted` and advance the estimate by the measurement of now.

    y = Cy z - Dy f + noise with the force of the step before; xh+ = Ao xh - Bo f + Lo y.
    """
    step, step_force, gain, feedback, measure, measure_force, noise = control[1:8]
    measured = noise[k % noise.shape[0]].copy()
    for o in range(measured.shape[0]):
        for i in range(state.shape[0]):
            measured[o] += measure[i, o] * state[i]
        for d in range(force.shape[0]):
            measured[o] -= measure_force[d, o] * force[d]
    for d in range(force.shape[0]):
        wanted[d] = 0.0
        for i in range(estimate.shape[0]):
            wanted[d] += feedback[d, i] * estimate[i]
    updated = np.zeros_like(estimate)
    multiply(step, estimate, updated)
    for i in range(estimate.shape[0]):
        for d in range(force.shape[0]):
            updated[i] -= step_force[d, i] * force[d]
        for o in range(measured.shape[0]):
            updated[i] += gain[o, i] * measured[o]
    estimate[:] = updated


@njit(cache=True)
def voltage_of(settings: FloatArray, desired: float, velocity: float, network: Any) -> float:
    """Return the voltage for a desired force, by formula or network; nothing where the force would push.

    Close to rest the force fades with the velocity: a command that jumps with the sign of a velocity makes the run hang
    on which sample a reversal happens to fall between.
    """
    if desired * velocity <= 0.0:
        return 0.0
    if abs(velocity) < settings[FADE]:
        desired *= abs(velocity) / settings[FADE]
    if settings[NEURAL] < 0.5:
        return inverse_bingham(desired, velocity, settings)
    force = abs(desired) / settings[COUNT]
    volts = network_voltage(abs(velocity), force, *network)
    return min(max(volts, 0.0), settings[HIGHEST_VOLTAGE])


@njit(cache=True)
def command(
    settings: FloatArray, gains: FloatArray, wanted: float, x: float, v: float, amplitude: float, network: Any
) -> tuple[float, float]:
    """Return desired force [N] and voltage [V] of one device from its motion at a controller sample."""
    law = settings[LAW]
    if law == NONE:
        return 0.0, 0.0
    if law == CONSTANT:
        return 0.0, gains[VOLTAGE]
    if abs(v) < REST:
        v = 0.0  # a rod that its damper holds: its remaining velocity is rounding error, and so is the sign
    desired = wanted if law == LQG else desired_force(law, gains, x, v, amplitude)
    if settings[REALISATION] < BINGHAM:
        return desired, 0.0
    return desired, voltage_of(settings, desired, v, network)


@njit(cache=True)
def device_force(
    settings: FloatArray,
    gains: FloatArray,
    drive: tuple[float, float, float],
    motion: tuple[float, float, float, float],
    compliance: float,
) -> float:
    """Return the mean force [N] of one device over a step (except damper chains).

    `drive` is desired force, voltage, amplitude; `motion` is x, v at the start, and both at the end without the force.
    """
    law, limit = settings[LAW], settings[CAPACITY]
    desired, volts, amplitude = drive
    x, v, free_x, free_v = motion
    if law == NONE:
        return 0.0
    if settings[REALISATION] == BINGHAM:
        offset = settings[COUNT] * (settings[FORCE_A] + settings[FORCE_B] * volts)
        slope = settings[COUNT] * (settings[VISCOSITY_A] + settings[VISCOSITY_B] * volts)
        return dissipative_force(offset, offset, slope, 1e30, v, free_v, compliance)
    middle = 0.5 * (x + free_x)
    if settings[REALISATION] == ACTIVE:
        force = desired
        if law == KELVIN:
            force = gains[VISCOUS] * 0.5 * (v + free_v) + gains[STIFFNESS] * middle
            force /= 1.0 + 0.5 * gains[VISCOUS] * compliance
        return min(max(force, -limit), limit)
    push, pull, slope = max(desired, 0.0), max(-desired, 0.0), 0.0
    if law == KELVIN:
        push, slope = gains[STIFFNESS] * middle, gains[VISCOUS]
        pull = -push
    elif law == FRICTION:
        extreme = max(amplitude, abs(middle))
        push, pull = gains[ALPHA] * (extreme - middle), gains[ALPHA] * (extreme + middle)
    return dissipative_force(push, pull, slope, limit, v, free_v, compliance)


@njit(cache=True)
def mean_chain_force(
    settings: FloatArray,
    chain: Any,
    memory: FloatArray,
    trial: FloatArray,
    wire: FloatArray,
    start: tuple[float, float, float],
    motion: tuple[float, float, float, float],
    compliance: tuple[float, float],
) -> float:
    """Return the mean force [N] over a step of a damper given as a chain of steps; `trial` becomes its state.

    Predictor and corrector with a given number of steps, unlike the loops of :mod:`mrpipe.simulation`: the mean force
    over a step is needed, and the slope of the answer is known. The chain is run with the motion that a guess of the
    force gives, from the same state each time. `start` is the guess, the force at the start of the step, and the
    voltage.
    """
    guess, before, volts = start
    v, free_x, free_v = motion[1], motion[2], motion[3]
    dt, count = settings[DT], settings[COUNT]
    slope = count * (settings[VISCOSITY_A] + settings[VISCOSITY_B] * volts) * compliance[1]
    for _ in range(int(settings[CHAIN_COUNT])):
        trial[:] = memory
        wire[FIRST] = 0.0
        wire[DISPLACEMENT] = free_x - compliance[0] * guess
        wire[VELOCITY] = free_v - compliance[1] * guess
        wire[ACCELERATION] = (wire[VELOCITY] - v) / dt
        wire[DRIVE] = volts
        advance(chain[0], chain[1], chain[2], chain[3], trial, wire, dt)
        change = 0.5 * (before + count * wire[FORCE]) - guess
        # the chain answers a guess through its viscosity: a secant step with the slope of the Bingham model
        guess += change / (1.0 + 0.5 * slope)
    return guess


@njit(void(_V, _STRUCTURE, _CONTROL, _NETWORK, _CHAIN, _RESULT), cache=True, nogil=True)
def run(  # noqa: C901, PLR0915 - functions that take arrays in each step make it up to half slower
    settings: FloatArray, structure: Any, control: Any, network: Any, chain: Any, result: Any
) -> None:
    """Run the structure from rest; see :mod:`mrpipe.case_studies.run` for what the arrays hold.

    Matrices whose product with a vector is wanted are passed transposed (a row a column), for contiguous inner loops.
    """
    reaction, positions, compliance, damping, modal_load, loads = structure[5:11]
    states, forces, voltages, desires, energies = result
    gains, devices, n = control[0], positions.shape[0], positions.shape[1]
    classical, ratio, save = settings[CLASSICAL] > 0.5, int(settings[RATIO]), int(settings[SAVE])
    law, chained = settings[LAW], settings[REALISATION] == CHAIN and settings[LAW] != NONE
    state, free = np.zeros(2 * n), np.zeros(2 * n)
    now, after = np.zeros(loads.shape[1]), np.zeros(loads.shape[1])
    x, v, xf, vf = np.zeros(devices), np.zeros(devices), np.zeros(devices), np.zeros(devices)
    force, desired, volts, wanted = np.zeros(devices), np.zeros(devices), np.zeros(devices), np.zeros(devices)
    target, steady, every = np.zeros(devices), np.zeros(devices), int(settings[CONTROL_EVERY])
    passed = settings[FILTER_RATE] * settings[DT]
    # what the voltage filter leaves of a gap at the end of a step, and on the mean of it
    left, mean = (np.exp(-passed), (1.0 - np.exp(-passed)) / passed) if passed > 0.0 else (0.0, 0.0)
    sampling = settings[REALISATION] >= BINGHAM
    amplitude, estimate, energy = np.zeros((devices, 2)), np.zeros(control[1].shape[0]), np.zeros(3)
    size = chain[3][-1] + BOOKKEEPING
    memory, trial, wire = np.zeros(size), np.zeros(size), np.zeros(WIRE_SIZE)
    wire[FIRST] = 1.0
    advance(chain[0], chain[1], chain[2], chain[3], memory, wire, settings[DT])
    before, power = settings[COUNT] * wire[FORCE], 0.0
    for k in range((loads.shape[0] - 1) * ratio):
        interpolate(loads, k, ratio, now, after)
        free_step(classical, structure, state, now, after, free)
        rod_motion(positions, state, x, v)
        rod_motion(positions, free, xf, vf)
        sample, sampled = k // every, k % every == 0
        if law == LQG and sampled:
            observe(control, sample, state, force, estimate, wanted)
        for d in range(devices):
            if (sampled or not sampling) and abs(v[d]) > REST:
                update_amplitude(amplitude[d], x[d], v[d])
            if sampled:
                desired[d], target[d] = command(settings, gains[d], wanted[d], x[d], v[d], amplitude[d, 0], network)
            steady[d] = target[d] + mean * (volts[d] - target[d])
            volts[d] = target[d] + left * (volts[d] - target[d])
        for _ in range(1 if devices == 1 else 3):
            for d in range(devices):
                free_x, free_v = xf[d], vf[d]
                for e in range(devices):
                    if e != d:
                        free_x -= compliance[d, e] * force[e]
                        free_v -= compliance[devices + d, e] * force[e]
                motion = (x[d], v[d], free_x, free_v)
                if chained:
                    own = (compliance[d, d], compliance[devices + d, d])
                    start = (force[d], before, volts[d])
                    force[d] = mean_chain_force(settings, chain, memory, trial, wire, start, motion, own)
                else:
                    drive = (desired[d], steady[d], amplitude[d, 0])
                    force[d] = device_force(settings, gains[d], drive, motion, compliance[devices + d, d])
        if chained:
            memory[:], before = trial, settings[COUNT] * wire[FORCE]
        for d in range(devices):
            for i in range(2 * n):
                free[i] -= reaction[d, i] * force[d]
        rod_motion(positions, free, xf, vf)
        for d in range(devices):
            energy[2] += force[d] * (xf[d] - x[d])
        energy[0] += input_work(classical, modal_load, now, after, state, free)
        latest = damping_power(classical, free, damping)
        energy[1] += 0.5 * (power + latest) * settings[DT]
        power = latest
        state[:] = free
        if (k + 1) % save == 0:
            place = (k + 1) // save
            states[place], forces[place], voltages[place] = state, force, volts
            desires[place], energies[place] = desired, energy
