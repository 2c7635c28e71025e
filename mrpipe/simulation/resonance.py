"""The resonance of a loop at one or several amplitudes, from the settings of a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import Artifact, Progress
from mrpipe.control.controller import Controller
from mrpipe.control.limits import highest_frequency
from mrpipe.errors import UserError
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.inputs import ground_amplitude
from mrpipe.simulation.loop import Response
from mrpipe.simulation.response_curve import ResponseCurve, response_curve
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.settings import ResonanceSettings
from mrpipe.simulation.steady_state import CurveOptions, Run
from mrpipe.words import in_percent

BAND = (0.75, 1.2)
"""Default band: lowest frequency relative to the natural frequency of the target mode without damper force, and highest
one relative to that with a locked damper. The resonance of any loop with a passive damper force lies between these two
natural frequencies.
"""

WARNED = 1.1
"""A standard error is reported if it exceeds the demanded one by this factor."""

REFINEMENTS, FLATNESS = 12, 0.01
"""Largest number of frequencies that refine one maximum, and largest relative difference to its neighbours at the end
[1].
"""


@dataclass(frozen=True)
class Curves:
    """Response curves of one law.

    Attributes
    ----------
    factors
        Amplitudes in multiples of the nominal one, in the order of the settings.
    curves
        One per amplitude.
    warnings
        Messages for the user.
    """

    factors: tuple[float, ...]
    curves: tuple[ResponseCurve, ...]
    warnings: tuple[str, ...]

    @property
    def nominal(self) -> ResponseCurve:
        """The curve whose amplitude is nearest to the nominal one."""
        return self.curves[int(np.argmin(np.abs(np.log(self.factors))))]

    def as_json(self) -> dict[str, Any]:
        """Return the nominal curve, and the peaks of all amplitudes."""
        rows = [
            {
                "amplitude_factor": factor,
                **curve.peaks_as_json(),
            }
            for factor, curve in zip(self.factors, self.curves, strict=True)
        ]
        return {**self.nominal.as_json(), "amplitudes": rows}


def default_band(calibration: Artifact) -> tuple[float, float]:
    """Return the band around the free and the locked frequency of the calibrated mode [rad/s]."""
    return band_of(calibration.scalar("omega_0"), calibration.scalar("omega_inf"))


def band_of(omega_0: float, omega_inf: float) -> tuple[float, float]:
    """Return the band around the free and the locked frequency of a mode [rad/s]; the locked one may be infinite."""
    low, high = BAND
    return low * omega_0, high * highest_frequency(omega_0, omega_inf)


def curve_options(settings: ResonanceSettings, *, absolute: bool) -> CurveOptions:
    """Return the options of the response curves."""
    return CurveOptions(
        points=settings.points,
        tolerance=settings.tolerance,
        window_cycles=settings.window_cycles,
        most_cycles=settings.most_cycles,
        refinements=REFINEMENTS,
        flatness=FLATNESS,
        standard_error=settings.standard_error,
        most_averaged_cycles=settings.most_averaged_cycles,
        absolute=absolute,
    )


def runner(rig: Rig, controller: Controller, rng: np.random.Generator) -> Run:
    """Return the function that runs the loop under an excitation; every run has the same sensor noise."""
    seed = int(rng.integers(2**32))
    chain = rig.damper.chain()

    def run(excitation: Excitation) -> Response:
        return rig.run(controller, excitation, chain=chain, rng=np.random.default_rng(seed))

    return run


def measure_resonance(
    rig: Rig,
    law: str,
    excitation: Excitation,
    band_rad_s: tuple[float, float],
    settings: ResonanceSettings,
    absolute: bool,
    rng: np.random.Generator,
    progress: Progress,
    jobs: int = 1,
) -> Curves:
    """Measure the response over frequency at each amplitude.

    Parameters
    ----------
    rig, law
        The loop.
    excitation
        Excitation that gives the nominal amplitude of the base acceleration.
    band_rad_s
        Lowest and highest frequency [rad/s].
    settings
        Grid, amplitudes and accuracy.
    absolute
        Whether accelerations are absolute.
    rng
        Generator of the sensor noise.
    progress
        Receives the share that is done.
    jobs
        Threads for irregular responses; the result does not depend on their number.

    Raises
    ------
    UserError
        If the band is empty, or the excitation has no amplitude.
    """
    if not 0.0 < band_rad_s[0] < band_rad_s[1]:
        raise UserError(
            "resonance.band_rad_s",
            "",
            f"is {band_rad_s[0]:g} to {band_rad_s[1]:g}",
            "give a positive rising band, the lowest frequency first",
        )
    amplitude = ground_amplitude(excitation.details, "a response over frequency")
    run = runner(rig, rig.controller(law), rng)
    options = curve_options(settings, absolute=absolute)
    curves = []
    for number, factor in enumerate(settings.amplitude_factors):
        progress(number / len(settings.amplitude_factors), f"response over frequency at {factor:g} times the amplitude")
        # the linear algebra of a run is so small that a second thread would only slow down other programs
        with threadpool_limits(1):
            curves.append(response_curve(run, factor * amplitude, band_rad_s, options, jobs=jobs))
    warnings = _warnings(curves, band_rad_s, settings.standard_error)
    return Curves(settings.amplitude_factors, tuple(curves), tuple(warnings))


def _warnings(curves: Sequence[ResponseCurve], band: tuple[float, float], standard_error: float) -> list[str]:
    found = []
    for curve in curves:
        level = f"at {curve.base_amplitude_m_s2:.3g} m/s²"
        if not math.isfinite(curve.peak("rms_x_top_m")):
            found.append(f"{level} the response grows without bound at some frequency; lower the negative stiffness")
            continue
        if curve.resonance_rad_s in (curve.frequency_rad_s[0], curve.frequency_rad_s[-1]):
            found.append(
                f"{level} the largest response is at the edge of the band, {curve.resonance_rad_s:.3g} rad/s; "
                f"widen resonance.band_rad_s ({band[0]:.3g} to {band[1]:.3g})"
            )
        error = max(curve.peak_error(name) / curve.peak(name) for name in CurveOptions().refined if curve.peak(name))
        if error > WARNED * standard_error:
            found.append(
                f"{level} the response does not become periodic, and the standard error of a largest value is "
                f"{in_percent(error, 1)}; raise resonance.most_averaged_cycles for more accurate ones"
            )
    return found
