"""The base amplitude at which viscous damping gives the thesis' response (5.5.1)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control.controller import Controller
from mrpipe.dampers.plant import Chain
from mrpipe.errors import UserError
from mrpipe.simulation.excitation import Excitation, amplitude_for
from mrpipe.simulation.loop import LoopOptions, Response, simulate_law
from mrpipe.structures import Frame


def adjusted_amplitude(
    frame: Frame,
    chain: Chain,
    viscous: Controller,
    excite: Callable[[float], Excitation],
    options: LoopOptions,
    *,
    position: FloatArray,
    rms_top_m: float,
    rounds: int = 6,
) -> tuple[float, Response]:
    """Return the base amplitude [m/s^2] at which law vd gives that rms top displacement, and its response there.

    Parameters
    ----------
    frame, chain, options, position
        As in :func:`~mrpipe.simulation.loop.simulate_law`; without sensor noise.
    viscous
        Controller of law vd with the reference gain.
    excite
        From an amplitude to the excitation.
    rms_top_m
        Wanted.
    rounds
        Most simulations; each scales the amplitude by what is missing.

    Raises
    ------
    UserError
        If the amplitude does not settle within half a percent.
    """
    amplitude = amplitude_for(frame, position, viscous.gains.c_n_s_m, excite(1.0).frequency_rad_s, rms_top_m)
    for _ in range(rounds):
        excitation = excite(amplitude)
        response = simulate_law(frame, chain, viscous, excitation, options, position=position)
        first, last = excitation.steady_s
        steady = (response.time_s >= first) & (response.time_s < last)
        rms = float(np.sqrt(np.mean(response.displacement[steady, -1] ** 2)))
        if abs(rms / rms_top_m - 1.0) < 2e-3:
            return amplitude, response
        amplitude *= rms_top_m / rms
    if abs(rms / rms_top_m - 1.0) < 5e-3:
        return amplitude, response
    raise UserError(
        "simulate.excitation",
        "base_amplitude_m_s2",
        f"no amplitude gives vd an rms top displacement of {1e3 * rms_top_m:.3g} mm",
        "give the amplitude, or another reference_rms_top_m",
    )
