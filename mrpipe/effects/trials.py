"""Dampers of two sizes for trials of effects, and steps that are tried, rejected and repeated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import float64, int64, njit, types

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.dampers.drive import driver_lag, polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.plant import (
    ACCELERATION,
    CHAIN_FUNCTIONS,
    DISPLACEMENT,
    DRIVE,
    FIRST,
    FORCE,
    TIME,
    VELOCITY,
    WIRE_SIZE,
    Chain,
    Step,
    advance,
    new_state,
)
from mrpipe.effects.contract import EffectScales

Motion = tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]
"""Displacement [m], velocity [m/s], acceleration [m/s^2], drive [A or V], shape (n,) each; interval [s]."""


@dataclass(frozen=True)
class Size:
    """A damper for trials of effects: scales, and the steps of a simple base form of the same size."""

    scales: EffectScales
    frequency_hz: float
    base: tuple[Step, ...]


SIZES = (
    Size(
        EffectScales(stroke=0.01, speed=0.12, acceleration=1.5, drive=4.0, force=120.0, time=5.0),
        1.9,
        (polynomial_coefficients([22.0, 5.5, 22.0, -2.0], [50.0, 75.0]), driver_lag(100.0), hysteresis(3.7e-4, 0.5, 2)),
    ),
    Size(
        EffectScales(stroke=0.1, speed=0.4, acceleration=1.6, drive=10.0, force=1.5e5, time=20.0),
        0.6,
        (polynomial_coefficients([2e4, 1.5e4], [2e5, 1e4]), driver_lag(20.0), hysteresis(4e-3, 0.5, 2)),
    ),
)
"""A laboratory damper (0.1 kN, 10 mm) and a damper of a building (150 kN, 100 mm)."""
RATE_HZ = 1000.0


def motion_of(size: Size, share: float = 0.9, faster: float = 1.0) -> Motion:
    """Return displacement, velocity, acceleration, drive and interval of a sine over three cycles."""
    omega = 2.0 * np.pi * size.frequency_hz * faster
    time = np.arange(int(3.0 * 2.0 * np.pi / omega * RATE_HZ)) / RATE_HZ
    x = share * size.scales.stroke * np.sin(omega * time)
    v = share * size.scales.stroke * omega * np.cos(omega * time)
    drive = size.scales.drive * (0.5 + 0.4 * np.sin(0.55 * omega * time))
    return x, v, -(omega**2) * x, drive, 1.0 / RATE_HZ


@njit(
    types.UniTuple(float64, 2)(
        CHAIN_FUNCTIONS, float64[::1], int64[::1], int64[::1], float64[::1], float64[:, ::1], float64[::1], float64
    ),
    cache=True,
)
def _twice(
    functions: Any,
    parameters: FloatArray,
    parameter_offsets: IntArray,
    state_offsets: IntArray,
    state: FloatArray,
    motion: FloatArray,
    aside: FloatArray,
    dt: float,
) -> tuple[float, float]:
    wire, shown = np.zeros(WIRE_SIZE), np.zeros(WIRE_SIZE)
    before, after = np.zeros(state.shape[0]), np.zeros(state.shape[0])
    places = (DISPLACEMENT, VELOCITY, ACCELERATION, DRIVE)
    for index in range(motion.shape[1]):
        before[:] = state
        # the step, another step that a solver rejects, and the step again
        for trial in range(3):
            state[:] = before
            wire[TIME] = index * dt
            wire[FIRST] = 1.0 if index == 0 else 0.0
            for k in range(4):
                wire[places[k]] = motion[k, index] + (aside[k] if trial == 1 else 0.0)
            advance(functions, parameters, parameter_offsets, state_offsets, state, wire, dt)
            if trial == 0:
                shown[:] = wire
                after[:] = state
        if wire[FORCE] != shown[FORCE]:
            return shown[FORCE], wire[FORCE]
        for k in range(state.shape[0]):
            if state[k] != after[k]:
                return after[k], state[k]
    return 0.0, 0.0


def tried_twice(chain: Chain, size: Size, motion: Motion) -> tuple[float, float]:
    """Do every step of a motion twice from the same state, with another trial in between, like the closed loop.

    Returns
    -------
    The first pair of forces [N] (or of numbers of the state) that differ; two equal numbers if none differ.
    """
    x, v, a, drive, dt = motion
    scales = size.scales
    aside = np.array([0.3 * scales.stroke, -scales.speed, scales.acceleration, -0.2 * scales.drive])
    first, again = _twice(*chain.arguments, new_state(chain), np.array([x, v, a, drive]), aside, dt)
    return float(first), float(again)
