"""Migration: after a reversal the force rises slowly, while particles move back into the gap."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import float64, njit

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.plant import (
    FIRST,
    FORCE,
    HYSTERESIS,
    SINCE_REVERSAL,
    SLIP,
    STEP_SIGNATURE,
    VELOCITY,
    YIELD_FORCE,
    Phase,
    Step,
    change_yield_force,
)
from mrpipe.effects.amplitudes import multiplied
from mrpipe.effects.contract import Effect, EffectForm, Separation, Values, amplitude, shape, strength
from mrpipe.effects.profiles import PATH, RISING, SINCE, free_profile


@njit(float64(float64, float64, float64), cache=True)
def _power_law_rise(slip: float, length: float, power: float) -> float:
    """Return 1 - (1 + s/(p L))^-p: a rational rise at p = 1, an exponential one at large p."""
    return 1.0 - (1.0 + slip / (power * length)) ** (-power)


@njit(float64(float64, float64, float64), cache=True)
def _stretched_rise(way: float, scale: float, exponent: float) -> float:
    """Return 1 - exp(-(w/S)^p) for a slip or a time since the reversal: many lengths or times at once."""
    return 1.0 - math.exp(-((way / scale) ** exponent))


@njit(STEP_SIGNATURE, cache=True)
def migration_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Parameters: amplitude, length [m] or time [s], kind of rise (0..6), of amplitude (0 yield, 1, 2 with drive), p.

    State: a variable that follows the direction of motion along the path, and the last direction.
    """
    kind = parameters[2]
    if kind == 0.0:
        rise = 1.0 - math.exp(-wire[SLIP] / parameters[1])
    elif kind == 1.0:
        rise = 1.0 - math.exp(-wire[SINCE_REVERSAL] / parameters[1])
    elif kind == 2.0:
        rise = wire[SLIP] / (wire[SLIP] + parameters[1])
    elif kind == 4.0 or kind == 5.0:
        way = wire[SLIP] if kind == 4.0 else wire[SINCE_REVERSAL]
        rise = _stretched_rise(way, parameters[1], parameters[4])
    elif kind == 6.0:
        rise = _power_law_rise(wire[SLIP], parameters[1], parameters[4])
    else:
        # a second, slow hysteretic variable: it follows the direction of motion along the path
        if wire[FIRST] > 0.5:
            state[0] = 0.0
        path = abs(wire[VELOCITY]) * dt / parameters[1]
        direction = 1.0 if wire[VELOCITY] > 0.0 else -1.0
        state[0] = direction + (state[0] - direction) * math.exp(-path)
        rise = state[0]
    shape_of = 1.0 if kind == 3.0 else wire[HYSTERESIS]
    wire[FORCE] += parameters[0] * multiplied(wire, parameters[3]) * rise * shape_of


@njit(float64(float64[::1], float64[::1], float64[::1], float64), cache=True)
def _rise_of_fast_reversals(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> float:
    """Return the rise since the last reversal that was fast enough.

    Parameters: share, length [m] or time [s], exponent, kind of rise (0 slip, 1 time), speed of a reversal [m/s].
    State: rise at the last sample, rise before the last reversal, and its share that has vanished. The flow must reach
    a least speed to move the particles; below it the rise from before the reversal remains.
    """
    if wire[FIRST] > 0.5:
        state[:] = 0.0
    if wire[SINCE_REVERSAL] <= dt:
        state[1] = state[0]
        state[2] = 0.0
    if parameters[3] == 0.0:
        rise = _power_law_rise(wire[SLIP], parameters[1], parameters[2])
    else:
        rise = _stretched_rise(wire[SINCE_REVERSAL], parameters[1], parameters[2])
    fast = (wire[VELOCITY] / parameters[4]) ** 4
    state[2] = max(state[2], fast / (1.0 + fast))
    state[0] = state[1] + (rise - state[1]) * state[2]
    return state[0]


@njit(STEP_SIGNATURE, cache=True)
def yield_force_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Change the yield force before the damper yields; parameters as for the rise of fast reversals."""
    change_yield_force(wire, 1.0 + parameters[0] * _rise_of_fast_reversals(wire, state, parameters, dt))


@njit(STEP_SIGNATURE, cache=True)
def fast_reversal_step(wire: FloatArray, state: FloatArray, parameters: FloatArray, dt: float) -> None:
    """Change the hysteretic force; parameters as for the rise of fast reversals."""
    rise = _rise_of_fast_reversals(wire, state, parameters, dt)
    wire[FORCE] += parameters[0] * wire[YIELD_FORCE] * rise * wire[HYSTERESIS]


def _fast_reversals(size: str, power: str, kind: float, *, before_yield: bool) -> Callable[[Values], list[Step]]:
    phase = Phase.COEFFICIENT_EFFECT if before_yield else Phase.FORCE_EFFECT
    kernel = yield_force_step if before_yield else fast_reversal_step

    def steps(values: Values) -> list[Step]:
        numbers = np.array([values["share"], values[size], values[power], kind, values["reversal_speed"]])
        return [Step("migration", phase, kernel, numbers, 3)]

    return steps


def _step(value: float, length: float, kind: float, of: float, power: float = 1.0) -> Step:
    return Step("migration", Phase.FORCE_EFFECT, migration_step, np.array([value, length, kind, of, power]), 1)


def _slip(values: Values) -> list[Step]:
    return [_step(values["share"], values["slip_length"], 0.0, 0.0)]


def _time(values: Values) -> list[Step]:
    return [_step(values["share"], values["rise_time"], 1.0, 0.0)]


def _rational(values: Values) -> list[Step]:
    return [_step(values["share"], values["slip_length"], 2.0, 0.0)]


def _slow(values: Values) -> list[Step]:
    return [_step(values["share"], values["slip_length"], 3.0, 0.0)]


def _stretched(values: Values) -> list[Step]:
    return [_step(values["share"], values["slip_length"], 4.0, 0.0, values["exponent"])]


def _stretched_time(values: Values) -> list[Step]:
    return [_step(values["share"], values["rise_time"], 5.0, 0.0, values["exponent"])]


def _power_law(values: Values) -> list[Step]:
    return [_step(values["share"], values["slip_length"], 6.0, 0.0, values["power"])]


def _own(values: Values) -> list[Step]:
    length = values["slip_length"]
    return [_step(values["friction"], length, 0.0, 1.0), _step(values["friction_rate"], length, 0.0, 2.0)]


_LENGTH = shape("slip_length", "m", "path over which the force returns", "stroke", 0.02, 0.9, (0.06, 0.15, 0.4))
_TIME = shape("rise_time", "s", "time over which the force returns", "stroke/speed", 0.05, 20.0, (0.2, 0.5, 2.0))
_POWER = shape("exponent", "1", "below 1: a steep rise and a long tail", "one", 0.3, 2.0, (0.6,))
_RATIONAL = shape("power", "1", "1: rational, large: exponential", "one", 0.2, 20.0, (1.0, 4.0))
_REVERSAL = shape("reversal_speed", "m/s", "speed from which a reversal counts", "speed", 1e-4, 0.1, (0.01,))
_LATE = strength("share", "1", "late share of the yield force", "one", 0.0, 30.0, 0.05)
_SHARE = amplitude("share", "1", "late share of the yield force", "one", 0.0, 30.0)

EFFECT = Effect(
    name="migration",
    summary="the force rises slowly after every reversal",
    physics="Particles settle or leave the gap when the flow reverses; the field needs a path or a time to bring them "
    "back.",
    remedy="Measure triangles at several speeds with pauses after the reversal; stir or replace the fluid, or declare "
    "the length or time.",
    residual="Negative after each reversal; it vanishes over a path or a time, and is largest after long half cycles.",
    source="Sahin et al. 2010 on response after reversal; second hysteretic variable of longer yield displacement",
    acts_on="yield force",
    forms=(
        EffectForm("slip", "alpha (1 + s (1 - exp(-slip/L)))", (_LENGTH, _SHARE), _slip, {"share": 0}),
        EffectForm(
            "time",
            "alpha (1 + s (1 - exp(-t_rev/tau)))",
            (_TIME, _SHARE),
            _time,
            {"share": 0},
        ),
        EffectForm("rational", "alpha (1 + s slip/(slip + L))", (_LENGTH, _SHARE), _rational, {"share": 0}),
        EffectForm(
            "slow-hysteresis", "F + s alpha w, dw = (sign v - w) |dx|/L", (_LENGTH, _SHARE), _slow, {"share": 0}
        ),
        EffectForm(
            "stretched-slip",
            "alpha (1 + s (1 - exp(-(slip/L)^p)))",
            (_LENGTH, _POWER, _SHARE),
            _stretched,
            {"share": 0},
        ),
        EffectForm(
            "stretched-time",
            "alpha (1 + s (1 - exp(-(t_rev/tau)^p)))",
            (_TIME, _POWER, _SHARE),
            _stretched_time,
            {"share": 0},
        ),
        EffectForm(
            "own-friction",
            "alpha + (a + b u) (1 - exp(-slip/L))",
            (
                _LENGTH,
                amplitude("friction", "N", "late part of the force without drive", "force", -0.05, 5.0),
                amplitude(
                    "friction_rate", "N/drive", "change of the late part with the drive", "force/drive", -0.1, 5.0
                ),
            ),
            _own,
            {"friction": 0, "friction_rate": 1},
        ),
    ),
    separated_by={
        "accumulator": Separation("rest at several positions of the stroke", ("positions",)),
        "backlash": Separation("small slow triangles at two currents", ("reversal",)),
        "heating": Separation("a long run with a pause for cooling", ("long",)),
    },
    refinements=(
        EffectForm(
            "power-law",
            "alpha (1 + s (1 - (1 + slip/(p L))^-p))",
            (_LENGTH, _RATIONAL, _SHARE),
            _power_law,
            {"share": 0},
        ),
        EffectForm(
            "power-law-fast-reversals",
            "alpha (1 + s (1 - (1 + slip/(p L))^-p)), slip since the last fast reversal",
            (_LENGTH, _RATIONAL, _REVERSAL, _SHARE),
            _fast_reversals("slip_length", "power", 0.0, before_yield=False),
            {"share": 0},
        ),
        EffectForm(
            "yield-force",
            "F_y (1 + s (1 - (1 + slip/(p L))^-p)) before the damper yields",
            (_LENGTH, _RATIONAL, _REVERSAL, _LATE),
            _fast_reversals("slip_length", "power", 0.0, before_yield=True),
        ),
        EffectForm(
            "yield-force-time",
            "F_y (1 + s (1 - exp(-(t_rev/tau)^p))) before the damper yields",
            (_TIME, replace(_POWER, starts=(1.0,)), _REVERSAL, _LATE),
            _fast_reversals("rise_time", "exponent", 1.0, before_yield=True),
        ),
        free_profile(
            "profile",
            "alpha (1 + sum s_k (1 - exp(-slip/L_k)))",
            PATH,
            RISING,
            shape("path_scale", "m", "path whose multiples are the lengths of the profile", "stroke", 0.1, 3.0, (0.5,)),
            _SHARE,
        ),
        free_profile(
            "profile-in-time",
            "alpha (1 + sum s_k (1 - exp(-t_rev/tau_k)))",
            SINCE,
            RISING,
            shape(
                "time_scale",
                "s",
                "time whose multiples are the times of the profile",
                "stroke/speed",
                0.2,
                20.0,
                (1.5,),
            ),
            _SHARE,
        ),
    ),
)
