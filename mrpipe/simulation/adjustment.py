"""Base amplitude at which viscous damping gives a required response (section 5.5.1 of the thesis)."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.controller import Controller
from mrpipe.dampers.plant import Chain
from mrpipe.errors import DivergedError, UserError
from mrpipe.simulation.excitation import Excitation, amplitude_for
from mrpipe.simulation.loop import LoopOptions, Response, simulate_law
from mrpipe.structures import Frame

SETTLED = 5e-3
"""Largest relative error of the response for an amplitude that counts as found."""


def adjusted_amplitude(
    frame: Frame,
    chain: Chain,
    viscous: Controller,
    excite: Callable[[float], Excitation],
    options: LoopOptions,
    *,
    position: FloatArray,
    rms_top_m: float,
    rounds: int = 16,
    must: bool = True,
) -> tuple[float, Response, float]:
    """Return the base amplitude [m/s^2] at which law vd gives a rms top displacement, its response, and the error [1].

    The response grows with the amplitude, but it may jump when a sticking damper begins to slip. The amplitude is first
    scaled by the ratio of required to actual response, and bisected once it is bracketed.

    Parameters
    ----------
    frame, chain, options, position
        As in :func:`~mrpipe.simulation.loop.simulate_law`; without sensor noise.
    viscous
        Controller of law vd with the reference gain.
    excite
        Function from an amplitude to the excitation.
    rms_top_m
        RMS displacement of the top floor that shall be reached [m].
    rounds
        Largest number of simulations.
    must
        Whether it is an error if no amplitude gives the response.

    Raises
    ------
    UserError
        If no amplitude gives the response and one must.
    """
    amplitude = amplitude_for(frame, position, viscous.gains.c_n_s_m, excite(1.0).frequency_rad_s, rms_top_m)
    low, high = 0.0, math.inf
    best: tuple[float, Response, float] | None = None
    for _ in range(rounds):
        excitation = excite(amplitude)
        try:
            response = simulate_law(frame, chain, viscous, excitation, options, position=position)
            ratio = _rms_top(response, excitation) / rms_top_m
        except DivergedError:
            ratio = math.inf
        if math.isfinite(ratio) and (best is None or abs(ratio - 1.0) < best[2]):
            best = amplitude, response, abs(ratio - 1.0)
        if abs(ratio - 1.0) < 0.4 * SETTLED:
            break
        low, high = (amplitude, high) if ratio < 1.0 else (low, amplitude)
        amplitude /= min(max(ratio, 0.1), 10.0)
        if not low < amplitude < high:
            amplitude = math.sqrt(low * high) if low > 0.0 else 0.5 * high
    if best is None or (must and best[2] > SETTLED):
        raise UserError(
            "simulate.excitation",
            "base_amplitude_m_s2",
            f"no amplitude gives vd an rms top displacement of {1e3 * rms_top_m:.3g} mm",
            "give the amplitude, or another reference_rms_top_m",
        )
    return best


def _rms_top(response: Response, excitation: Excitation) -> float:
    first, last = excitation.steady_s
    steady = (response.time_s >= first) & (response.time_s < last)
    return float(np.sqrt(np.mean(response.displacement[steady, response.top] ** 2)))
