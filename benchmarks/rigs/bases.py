"""Base forms of the rigs: published laws of a magnetorheological damper, one derivative and one force each.

Every law is written as in its source. `fy` is the yield force at the present drive, times the factors of the planted
effects; `fy0` is the yield force without these factors; `c` is the viscosity. The states are integrated with
Runge-Kutta steps of order four, except the elastic-plastic spring, which has an exact update.
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks.rigs.compiling import compiled
from benchmarks.rigs.types import Array

BASES = (
    "bouc-wen",
    "bouc-wen-1.5",
    "bouc-wen-stiff",
    "dahl",
    "bingham-tanh",
    "maxwell-coulomb",
    "biviscous",
    "hysteretic-biviscous",
    "spencer",
    "kwok",
    "sigmoid",
    "lugre",
    "gamota-filisko",
    "viscoplastic",
    "eyring",
    "algebraic",
)
"""Names of the base forms; the place of a name is its code in the compiled functions."""

SOURCES = {
    "bouc-wen": "Wen 1976, n = 2, yield displacement constant",
    "bouc-wen-1.5": "Wen 1976, n = 1.5",
    "bouc-wen-stiff": "Wen 1976, n = 2, initial stiffness constant: yield displacement in proportion to yield force",
    "dahl": "Dahl 1968, exponent 1",
    "bingham-tanh": "Bingham body regularised with a hyperbolic tangent",
    "maxwell-coulomb": "Coulomb element in series with a spring, viscosity in parallel",
    "biviscous": "Stanway, Sproston and Stevens 1987; Wereley, Pang and Kamath 1998",
    "hysteretic-biviscous": "Wereley, Pang and Kamath 1998",
    "spencer": "Spencer, Dyke, Sain and Carlson 1997, without accumulator",
    "kwok": "Kwok, Ha, Nguyen, Li and Samali 2006, without stiffness and offset",
    "sigmoid": "hysteretic sigmoid in velocity and sign of the acceleration, Ma, Wang and Rakheja type",
    "lugre": "Jimenez and Alvarez-Icaza 2005",
    "gamota-filisko": "Gamota and Filisko 1991",
    "viscoplastic": "Perzyna overstress in series with a spring",
    "eyring": "Bouc-Wen loop whose yield force follows Eyring's law of the speed",
    "algebraic": "algebraic loop in velocity and displacement",
}
"""Where each base form comes from."""

(BOUC_WEN, BOUC_WEN_15, BOUC_WEN_STIFF, DAHL, BINGHAM, MAXWELL, BIVISCOUS, HYSTERETIC_BIVISCOUS, SPENCER, KWOK,
 SIGMOID, LUGRE, GAMOTA, VISCOPLASTIC, EYRING, ALGEBRAIC) = range(16)  # fmt: skip

STATES = 3


@compiled
def _bouc_wen_rate(z: float, v: float, yield_displacement: float, n: float, share: float) -> float:
    turning = share + (1.0 - share) * (1.0 if v * z > 0.0 else -1.0)
    return v / yield_displacement * (1.0 - abs(z) ** n * turning)


@compiled
def _spencer_inner_velocity(p: Array, s: Array, x: float, v: float, fy: float, c: float) -> float:
    """Return the velocity y' of the inner node; p[3] is c1, p[4] is k0."""
    return (fy * s[0] + c * v + p[4] * (x - s[1])) / (c + p[3])


@compiled
def _rates(code: int, p: Array, s: Array, x: float, v: float, fy: float, fy0: float, c: float, out: Array) -> None:
    """Write the derivatives of the states; p[0] is the yield displacement [m] at full drive."""
    out[0], out[1], out[2] = 0.0, 0.0, 0.0
    if code in (BOUC_WEN, BOUC_WEN_15, EYRING):
        out[0] = _bouc_wen_rate(s[0], v, p[0], p[1], p[2])
    elif code == BOUC_WEN_STIFF:
        # the stiffness p[3] is constant
        out[0] = _bouc_wen_rate(s[0], v, fy0 / p[3], p[1], p[2])
    elif code in (DAHL, LUGRE):
        out[0] = (v - abs(v) * s[0]) / p[0]
    elif code == SPENCER:
        inner = _spencer_inner_velocity(p, s, x, v, fy, c)
        out[0] = _bouc_wen_rate(s[0], v - inner, p[0], p[1], p[2])
        out[1] = inner
    elif code == GAMOTA:
        # s[0] force of the chain, s[1] elongation of the Kelvin-Voigt element (k1 p[4], c1 p[5]); p[3] is k2
        creep = (s[0] - p[4] * s[1]) / p[5]
        over = max(abs(s[0]) - fy, 0.0) * (1.0 if s[0] > 0.0 else -1.0)
        out[0] = p[3] * (v - creep - over / c)
        out[1] = creep
    elif code == VISCOPLASTIC:
        # s[0] force over fy0; p[1] exponent, p[3] reference speed
        over = max(abs(s[0]) * fy0 / fy - 1.0, 0.0) ** p[1]
        out[0] = (v - p[3] * over * (1.0 if s[0] > 0.0 else -1.0)) / p[0]


@compiled
def _memoryless(code: int, p: Array, x: float, v: float, a: float, fy: float, c: float) -> float:
    """Return the force of a law without a state of its own."""
    if code == BINGHAM:
        return fy * math.tanh(v / p[1]) + c * v
    if code in (BIVISCOUS, HYSTERETIC_BIVISCOUS):
        # p[1] speed at which it yields at full drive, p[2] full yield force, p[3] shift in speed
        before = p[2] / p[1] + c
        shift = p[3] * math.tanh(a / p[4])
        return c * v + min(max((before - c) * v - before * shift, -fy), fy)
    if code == KWOK:
        # the sign of the displacement in the source; smooth here, because noise at rest would turn it back and forth
        return fy * math.tanh(v / p[1] + p[2] * math.tanh(x / p[3])) + c * v
    if code == SIGMOID:
        decay = math.exp(-min(max(2.0 * (v - p[3] * math.tanh(a / p[4])) / p[1], -60.0), 60.0))
        return fy * (1.0 - decay) / (1.0 + decay) + c * v
    # the algebraic loop: p[2] is a frequency [1/s], p[3] the sharpness of the knee
    s = (v + p[2] * x) / p[1]
    return fy * s / (1.0 + abs(s) ** p[3]) ** (1.0 / p[3]) + c * v


@compiled
def _advanced(
    code: int, p: Array, s: Array, start: Array, stop: Array, fy: float, fy0: float, c: float, h: float, k: Array
) -> None:
    """Advance the states by one step; `start` and `stop` hold displacement and velocity, linear in between."""
    size = STATES
    trial = k[4]
    xm, vm = 0.5 * (start[0] + stop[0]), 0.5 * (start[1] + stop[1])
    _rates(code, p, s, start[0], start[1], fy, fy0, c, k[0])
    for j in range(size):
        trial[j] = s[j] + 0.5 * h * k[0, j]
    _rates(code, p, trial, xm, vm, fy, fy0, c, k[1])
    for j in range(size):
        trial[j] = s[j] + 0.5 * h * k[1, j]
    _rates(code, p, trial, xm, vm, fy, fy0, c, k[2])
    for j in range(size):
        trial[j] = s[j] + h * k[2, j]
    _rates(code, p, trial, stop[0], stop[1], fy, fy0, c, k[3])
    for j in range(size):
        s[j] += h / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])


@compiled
def base_step(
    code: int,
    p: Array,
    s: Array,
    start: Array,
    stop: Array,
    a: float,
    yielding: Array,
    c: float,
    h: float,
    work: Array,
) -> float:
    """Advance a base form by one step of `h` seconds and return its force [N].

    `yielding` holds `fy` and `fy0`; `work` is scratch space of shape (5, STATES).
    """
    fy, fy0 = yielding[0], yielding[1]
    x, v = stop[0], stop[1]
    if code == MAXWELL:
        s[0] = min(max(s[0] + p[3] * (x - start[0]), -fy), fy)
        return s[0] + c * v
    if code in (BINGHAM, BIVISCOUS, HYSTERETIC_BIVISCOUS, KWOK, SIGMOID, ALGEBRAIC):
        return _memoryless(code, p, x, v, a, fy, c)
    _advanced(code, p, s, start, stop, fy, fy0, c, h, work)
    if code == SPENCER:
        return p[3] * _spencer_inner_velocity(p, s, x, v, fy, c)
    if code == GAMOTA:
        return s[0]
    if code == VISCOPLASTIC:
        return fy0 * s[0] + c * v
    if code == LUGRE:
        # p[3] is the ratio of micro-viscosity to micro-stiffness [s]
        _rates(code, p, s, x, v, fy, fy0, c, work[0])
        return fy * (s[0] + p[3] * work[0, 0]) + c * v
    if code == EYRING:
        fy *= math.asinh(abs(v) / p[3]) / math.asinh(p[4] / p[3])
    return fy * s[0] + c * v


def draw_parameters(name: str, rng: np.random.Generator, *, stroke: float, speed: float, force: float) -> np.ndarray:
    """Return the numbers of a base form, shape (6,).

    Parameters
    ----------
    stroke, speed, force
        Largest displacement [m], speed [m/s] and yield force [N] of the rig.
    """
    code = BASES.index(name)
    p = np.zeros(6)
    p[0] = stroke * np.exp(rng.uniform(np.log(0.01), np.log(0.06)))
    p[1], p[2] = (1.5 if code == BOUC_WEN_15 else 2.0), rng.uniform(0.4, 0.7)
    rounding = speed * rng.uniform(0.03, 0.15)
    if code in (BOUC_WEN_STIFF, MAXWELL):
        p[3] = force / p[0]
    elif code in (BINGHAM, KWOK, SIGMOID, ALGEBRAIC):
        p[1] = rounding
        p[2] = rng.uniform(0.3, 0.9)
        p[3], p[4] = rounding * rng.uniform(0.3, 0.8), 0.05 * speed**2 / stroke
        if code == KWOK:
            p[3] = 0.05 * stroke
        elif code == ALGEBRAIC:
            p[2], p[3] = p[2] * rounding / stroke, rng.uniform(1.5, 3.0)
    elif code in (BIVISCOUS, HYSTERETIC_BIVISCOUS):
        p[1], p[2], p[4] = rounding, force, 0.05 * speed**2 / stroke
        p[3] = 0.0 if code == BIVISCOUS else rounding * rng.uniform(0.2, 0.5)
    elif code == SPENCER:
        p[3] = force / (speed * rng.uniform(0.01, 0.04))
    elif code == LUGRE:
        p[3] = p[0] / speed * rng.uniform(0.1, 0.4)
    elif code == GAMOTA:
        p[3] = force / p[0]
        p[4], p[5] = p[3] * rng.uniform(1.0, 3.0), p[3] * rng.uniform(0.003, 0.01)
    elif code == VISCOPLASTIC:
        p[1], p[3] = rng.uniform(1.0, 2.0), speed * rng.uniform(2.0, 6.0)
    elif code == EYRING:
        p[3], p[4] = speed * rng.uniform(0.01, 0.1), speed
    return p
