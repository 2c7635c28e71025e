"""The closed loop and its design in a notebook, from a structure and a damper in memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mrpipe.api.options import settings_of, silent
from mrpipe.api.structure import IdentifiedFrame
from mrpipe.control.assembly import ControllerFactory, calibrated_from
from mrpipe.control.calibration import CalibrationOptions, calibrate, plant_of
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law, Plant
from mrpipe.control.laws import all_laws, law_named
from mrpipe.control.operation import forces_at
from mrpipe.control.settings import ControllerSettings
from mrpipe.dampers.model import DamperModel
from mrpipe.law_design.run import Result
from mrpipe.simulation.excitation import Excitation, harmonic
from mrpipe.simulation.loop import LoopOptions, Response
from mrpipe.simulation.rig import Rig
from mrpipe.structures import Frame, floor_position

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

EXPECTED_SHARE = 0.5
"""Expected amplitude of the damper over the largest stroke of its tests."""


@dataclass(frozen=True)
class Simulated:
    """The response of a closed loop.

    Attributes
    ----------
    law, gains
        Control law and its gains.
    indices
        RMS values, peaks, damping and more, as `mrpipe simulate --json` prints them.
    response
        Histories of the run.
    """

    law: str
    gains: Gains
    indices: dict[str, Any]
    response: Response

    def __str__(self) -> str:
        return (
            f"{self.law}: rms x_top {1e3 * self.indices['rms_x_top_m']:.2f} mm, "
            f"x1 {1e3 * self.indices['rms_x1_m']:.2f} mm, a1 {self.indices['rms_a1_m_s2']:.3g} m/s²"
        )

    def to_frame(self) -> pd.DataFrame:
        """Return the histories: time, top displacement, damper displacement, force, desired force and drive."""
        import pandas as pd

        found = self.response
        return pd.DataFrame(
            {
                "time_s": found.time_s,
                "top_displacement_m": found.displacement[:, found.top],
                "damper_displacement_m": found.damper_displacement,
                "force_n": found.force,
                "desired_force_n": found.desired_force,
                "drive": found.drive,
            }
        )

    def plot(self) -> Figure:
        """Return the damper force over its displacement and velocity."""
        from mrpipe.reporting.simulation import loops

        found = self.response
        last = slice(int(0.9 * len(found.time_s)), None)
        return loops(
            found.damper_displacement[last],
            found.damper_velocity[last],
            found.force[last],
            found.desired_force[last],
            self.law,
        )


@dataclass(frozen=True)
class Designed:
    """The best law and gains.

    Attributes
    ----------
    best
        Name of the law.
    gains
        Gains of the law.
    summary
        The summary that `mrpipe design --json` prints.
    result
        Everything that was found.
    """

    best: str
    gains: Gains
    summary: dict[str, Any]
    result: Result

    def __str__(self) -> str:
        from mrpipe.reporting.design_words import in_plain_words

        return in_plain_words(self.summary)

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each law, best first."""
        from mrpipe.reporting.design import laws_table

        return laws_table(self.summary)

    def plot(self) -> Figure:
        """Return the response over frequency of each law."""
        from mrpipe.reporting.design import curves_figure

        return curves_figure(self.result)


def simulate(
    frame: Frame | IdentifiedFrame,
    damper: DamperModel,
    *,
    law: str = "vd",
    gains: Gains | None = None,
    base_amplitude_m_s2: float = 1.0,
    frequency_rad_s: float | None = None,
    excitation: Excitation | None = None,
    floor: int = 1,
    options: LoopOptions | None = None,
    **controller: Any,
) -> Simulated:
    """Run the closed loop with the damper between ground and a floor.

    Parameters
    ----------
    frame, damper
        Structure and damper; a damper from :func:`mrpipe.trace` has its effects.
    law
        Control law, see docs/control-laws.md.
    gains
        Gains of the law; None: those with the largest damping by the exact complex eigenvalue.
    base_amplitude_m_s2, frequency_rad_s
        Harmonic base acceleration [m/s^2], [rad/s]; the frequency is that of the first mode where it is None.
    excitation
        Excitation that replaces the harmonic one, from :mod:`mrpipe.simulation.excitation`.
    floor
        Floor that the damper acts on, from 1.
    options
        Options of the simulation of the loop.
    controller
        Settings of the section `simulate.controller`; the inverse is the damper model itself.

    Raises
    ------
    UserError
        If the law is unknown or needs a trained network.
    DivergedError
        If the response grows without bound.
    """
    from mrpipe.simulation.indices import indices

    rig, _ = _rig(_plain(frame), damper, floor, (law_named(law),), options, controller)
    used = rig.controllers.calibrated.gains_of(law) if gains is None else gains
    if excitation is None:
        omega = frequency_rad_s or rig.controllers.calibrated.omega_0
        excitation = harmonic(base_amplitude_m_s2, omega, decay_s=6.0 * 2.0 * np.pi / omega)
    response = rig.run(rig.controller(law, used), excitation)
    values = indices(
        response,
        excitation,
        residual_force_n=float(damper.quasi_static_force(_speed(response), 0.0)),
        drive_limit=damper.drive_limit,
    )
    return Simulated(law, used, values, response)


def design(
    frame: Frame | IdentifiedFrame,
    damper: DamperModel,
    *,
    base_amplitude_m_s2: float = 1.0,
    floor: int = 1,
    seed: int = 2011,
    jobs: int = 1,
    laws: Sequence[str] = ("vd", "vdns", "fdns", "passive-off", "passive-on"),
    **settings: Any,
) -> Designed:
    """Find the law and gains with the smallest largest response over frequency and amplitude.

    Parameters
    ----------
    frame, damper
        Structure and damper.
    base_amplitude_m_s2
        Nominal amplitude of the base acceleration.
    floor
        Floor that the damper acts on, from 1.
    seed, jobs
        Seed of the draws, and number of processes.
    laws
        Laws in the race.
    settings
        Settings of the section `design`.
    """
    from mrpipe.law_design.options import DesignSettings
    from mrpipe.law_design.results import design_as_json
    from mrpipe.law_design.run import load_of, run_design
    from mrpipe.law_design.uncertainty import DamperUncertainty, FrameUncertainty
    from mrpipe.simulation.resonance import band_of

    chosen = settings_of(DesignSettings, "design", {"laws": tuple(laws), **settings})
    rig, plant = _rig(_plain(frame), damper, floor, tuple(law_named(name) for name in ("vd", *laws)), None, {})
    band = chosen.band_rad_s or band_of(plant.modes.omega_0, plant.modes.omega_inf)
    result = run_design(
        rig,
        plant,
        chosen,
        load_of(chosen, base_amplitude_m_s2, band),
        (FrameUncertainty.none(rig.frame.floors), DamperUncertainty.without_covariance(0.05)),
        absolute=False,
        rng=np.random.default_rng(seed),
        jobs=jobs,
        progress=silent,
    )
    summary = design_as_json(result, chosen)
    best = result.designed[result.best].best
    return Designed(best.law, best.gains, summary, result)


def _plain(frame: Frame | IdentifiedFrame) -> Frame:
    return frame.frame if isinstance(frame, IdentifiedFrame) else frame


def _rig(
    frame: Frame,
    damper: DamperModel,
    floor: int,
    laws: Sequence[Law],
    options: LoopOptions | None,
    controller: dict[str, Any],
) -> tuple[Rig, Plant]:
    from mrpipe.errors import UserError

    for law in laws:
        if "network" in law.needs:
            raise UserError("law", law.name, "needs a trained network", f"use mrpipe simulate --law {law.name}")
    position = floor_position(frame.floors, floor)
    plant, amplitude = plant_of(frame, position, CalibrationOptions()), EXPECTED_SHARE * damper.stroke_m
    # as the stage calibrate does: default weights of the regulator are out of proportion for most structures
    residual, _ = forces_at(damper, amplitude, plant.modes)
    plant = replace(plant, weights=replace(plant.weights, force_noise_n=residual))
    known = [law for law in all_laws().values() if law in laws or law.name == "vd"]
    calibration = calibrate(frame, position, CalibrationOptions(weights=plant.weights), known)
    calibrated = calibrated_from(calibration, plant.weights, damper, amplitude_m=amplitude)
    factory = ControllerFactory(
        frame,
        damper,
        calibrated,
        settings_of(ControllerSettings, "simulate.controller", {"inverse": "model", **controller}),
    )
    return Rig(frame, damper, factory, options or LoopOptions()), plant


def _speed(response: Response) -> float:
    """Return the RMS velocity of the damper [m/s], at which the residual force is stated."""
    return float(np.sqrt(np.mean(response.damper_velocity**2)))
