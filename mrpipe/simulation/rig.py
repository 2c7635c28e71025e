"""The closed loop from the settings: structure, damper, options of the run, and excitation."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray
from mrpipe.control.assembly import ControllerFactory, inverse_network
from mrpipe.control.controller import Controller
from mrpipe.control.gains import Gains, GainsSource
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named
from mrpipe.control.storage import read_calibrated_with
from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import Chain
from mrpipe.effects.damper import damper_named
from mrpipe.simulation.acting import ADJUSTED, acting_together, harmonic_excitation, known_amplitude
from mrpipe.simulation.adjustment import SETTLED, adjusted_amplitude
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import RECORD_RATE_HZ, LoopOptions, Response, simulate_law
from mrpipe.simulation.release import calibrated_shape, released, top_amplitude
from mrpipe.simulation.sensors import MISSING, STUCK, ZERO, SensorFault, SensorNoise
from mrpipe.simulation.settings import ExcitationSettings, SensorFaultSettings, SimulateSettings
from mrpipe.simulation.several_dampers import LoopDamper, simulate_dampers
from mrpipe.structures import Frame, frame_from_parameter_set
from mrpipe.structures.over_amplitude import read_frame_at
from mrpipe.structures.records import IMPOSSIBLE_PEAK
from mrpipe.words import in_percent

DAMPERS = {"identified": "identify-damper", "traced": "close-loop"}
"""Name of a damper of a run -> stage whose artifact contains it."""

LARGEST_PLAUSIBLE_M_S2 = 9.81
"""Amplitude of the base acceleration above which a computed one is reported: strong-motion records seldom have a peak
above 1 g, and no structure is designed for many cycles at this level."""


@dataclass(frozen=True)
class Rig:
    """Structure, damper and controllers of one loop.

    Attributes
    ----------
    frame, damper
        Structure and damper that are simulated.
    controllers
        Builds the controller of any law for it.
    options
        Options of the loop.
    """

    frame: Frame
    damper: DamperModel
    controllers: ControllerFactory
    options: LoopOptions

    @property
    def position(self) -> FloatArray:
        """Connectivity vector w of the damper, shape (n,)."""
        return self.controllers.calibrated.position

    @property
    def residual_force_n(self) -> float:
        """Force of the damper without drive at the expected amplitude [N]."""
        known = self.controllers.calibrated
        return float(self.damper.quasi_static_force(known.amplitude_m * known.omega_0, 0.0))

    @property
    def perfect(self) -> bool:
        """Whether the damper gives every desired force, and the sensors are perfect."""
        return self.options.tracking == "ideal"

    def reason_to_skip(self, law: str) -> str:
        """Return why the loop cannot run under a law; empty if it can."""
        skipped = self.controllers.calibrated.skipped
        if law in skipped:
            return f"law {law} could not be calibrated: {skipped[law]}"
        if self.options.tracking != "damper" and law_named(law).output == "drive":
            return f"law {law} commands the drive, so that a perfect damper (simulate.tracking) has no desired force"
        return ""

    def controller(self, law: str | Law, gains: Gains | None = None) -> Controller:
        """Return the controller of a law, with its calibrated gains or others."""
        return self.controllers.build(law, gains, perfect=self.perfect)

    def run(
        self,
        controller: Controller,
        excitation: Excitation,
        *,
        chain: Chain | None = None,
        rng: np.random.Generator | None = None,
        initial_state: FloatArray | None = None,
    ) -> Response:
        """Run the loop under a controller; `chain` replaces the chain of the damper.

        Raises
        ------
        DivergedError
            If the response grows without bound.
        """
        if excitation.places:
            device = LoopDamper("damper", self.position, chain or self.damper.chain(), controller)
            return simulate_dampers(
                self.frame, [device], excitation, self.options, rng=rng, initial_state=initial_state
            ).first
        return simulate_law(
            self.frame,
            self.damper.chain() if chain is None else chain,
            controller,
            excitation,
            self.options,
            position=self.position,
            rng=rng,
            initial_state=initial_state,
        )


def read_rig(settings: SimulateSettings, artifact: Callable[[str], Artifact], gains: GainsSource = "calibrated") -> Rig:
    """Return the rig of a run.

    Parameters
    ----------
    settings
        Settings of the simulation: which frame, damper and controller.
    artifact
        Opens the artifact of a stage by its name: `identify-frame`, `identify-damper`, `calibrate`, `train-inverse`,
        `close-loop` for the traced damper, and `design` for its gains.
    gains
        Which gains the laws have.

    Raises
    ------
    UserError
        If a parameter set is not there.
    """
    if settings.frame == "identified":
        frame = read_frame_at(artifact("identify-frame"), settings.frame_amplitude_m)
    else:
        frame = frame_from_parameter_set(settings.frame)
    frame = frame.turned(settings.excitation.direction_deg)
    dampers = {name: partial(artifact, stage) for name, stage in DAMPERS.items()}
    damper = damper_named(settings.damper, dampers, "simulate.damper")
    controllers = ControllerFactory(
        frame,
        # the controller contains the damper that it was designed for, without effects that the tracing has found since
        damper_named("identified", dampers) if settings.damper == "traced" else damper,
        read_calibrated_with(artifact, gains),
        settings.controller,
        inverse_network(settings.controller, lambda: artifact("train-inverse")),
        settings.ideal_rounding_m_s,
    )
    return Rig(frame, damper, controllers, loop_options(settings))


def loop_options(settings: SimulateSettings) -> LoopOptions:
    """Return the options of the loop."""
    sensors = settings.sensors
    perfect = settings.tracking != "damper"
    noise = SensorNoise(sensors.displacement_noise_m, sensors.acceleration_noise_m_s2, sensors.acceleration_bias_m_s2)
    return LoopOptions(
        plant_rate_hz=settings.plant_rate_hz,
        tracking=settings.tracking,
        delay_s=settings.controller.delay_s,
        driver_time_constant_s=settings.driver_time_constant_s,
        noise=SensorNoise() if perfect else noise,
        fault=_fault(sensors.fault),
        record_rate_hz=settings.record_rate_hz or (settings.plant_rate_hz if perfect else RECORD_RATE_HZ),
    )


def _fault(settings: SensorFaultSettings) -> SensorFault | None:
    marks = {"missing": MISSING, "zero": ZERO, "stuck": STUCK}
    if settings.kind == "none":
        return None
    return SensorFault(marks[settings.kind], settings.sensor, settings.share, settings.samples)


def excitation_of(
    rig: Rig, settings: ExcitationSettings, warn: Callable[[str], None] | None = None
) -> tuple[Excitation, Response | None]:
    """Return the excitation and, where its amplitude was adjusted, the response of vd to it.

    Parameters
    ----------
    rig, settings
        Rig, and settings of the excitation.
    warn
        Called with a message if the adjustment does not reach a response that the settings do not demand, or if a
        record has an impossible peak.

    Raises
    ------
    UserError
        If a recorded motion cannot be read, or no amplitude gives the demanded response.
    """
    free = rig.controllers.calibrated.omega_0
    amplitude, viscous = known_amplitude(settings), None
    if amplitude is None and settings.kind in ADJUSTED:
        amplitude, viscous = _adjusted(rig, settings, lambda tried: harmonic_excitation(settings, free, tried), warn)
        viscous = viscous if settings.factor == 1.0 and settings.kind == "harmonic" and not settings.also else None
    excitation = acting_together(settings, rig.frame, free, amplitude or 0.0)
    if warn is not None and (impossible := record_warning(excitation.details)):
        warn(impossible)
    return excitation, viscous


def expected_top(rig: Rig) -> float:
    """Return the top displacement in the free mode at which the damper moves with the expected amplitude [m]."""
    known = rig.controllers.calibrated
    if rig.frame.influence_y is None:
        return known.amplitude_m * abs(known.top_0 / known.u_0)
    # the calibration does not know the direction of the ground motion, and therefore not the top degree of freedom
    shape = calibrated_shape(rig.frame, rig.position, known.omega_0)
    top = top_amplitude(rig.frame, shape, "base_amplitude_m_s2")
    return known.amplitude_m * abs(top / float(rig.position @ shape))


def _adjusted(
    rig: Rig,
    settings: ExcitationSettings,
    harmonic: Callable[[float], Excitation],
    warn: Callable[[str], None] | None,
) -> tuple[float, Response | None]:
    tracking = rig.options.tracking
    if settings.adjust_with == "ideal" and tracking == "damper":
        tracking = "ideal"
    options = replace(rig.options, noise=SensorNoise(), fault=None, tracking=tracking)
    known = rig.controllers.calibrated.gains.get("vd")
    gains = known if settings.reference_c_n_s_m is None else Gains(c_n_s_m=settings.reference_c_n_s_m)
    viscous = rig.controllers.build("vd", gains, perfect=tracking == "ideal")
    demanded = settings.reference_rms_top_m
    amplitude, response, error = adjusted_amplitude(
        rig.frame,
        rig.damper.chain(),
        viscous,
        harmonic,
        options,
        position=rig.position,
        rms_top_m=expected_top(rig) / math.sqrt(2.0) if demanded is None else demanded,
        must=demanded is not None,
    )
    if error > SETTLED and warn is not None:
        warn(
            f"under vd no base amplitude gives the expected motion: {amplitude:.3g} m/s² misses it by "
            f"{in_percent(error)}; give simulate.excitation.base_amplitude_m_s2 for another"
        )
    if warn is not None and (implausible := amplitude_warning(amplitude)):
        warn(implausible)
    return amplitude, response if options.tracking == rig.options.tracking else None


def drive_warning(damper: DamperModel, drive_limit: float | None) -> str:
    """Return a warning if the controller may exceed the largest drive of the damper's model; else an empty text.

    Parameters
    ----------
    damper
        The damper.
    drive_limit
        Setting of the controller [A or V]; None: the limit of the damper.
    """
    if drive_limit is None or drive_limit <= damper.drive_limit:
        return ""
    return (
        f"simulate.controller.drive_limit is {drive_limit:g} {damper.drive_unit}, and the model of the damper is valid "
        f"up to {damper.drive_limit:g} {damper.drive_unit}: laws that command the drive extrapolate the model, and the "
        "inverse of the model ends there"
    )


def record_warning(details: Mapping[str, Any]) -> str:
    """Return a warning if recorded ground motion has a peak that no ground motion reaches; else an empty text.

    Parameters
    ----------
    details
        Details of the excitation, with the peak of a record.
    """
    peak = float(details.get("peak_m_s2", 0.0))
    if peak <= IMPOSSIBLE_PEAK:
        return ""
    return (
        f"the recorded ground motion has a peak of {peak:.3g} m/s², more than {IMPOSSIBLE_PEAK:.3g} m/s² (3 g), "
        "which no recorded ground motion reaches. Check simulate.excitation.file_unit, and simulate.excitation.factor"
    )


def amplitude_warning(amplitude_m_s2: float) -> str:
    """Return a warning if a computed base amplitude [m/s^2] is implausible; else an empty text."""
    if amplitude_m_s2 <= LARGEST_PLAUSIBLE_M_S2:
        return ""
    return (
        f"the base acceleration that gives the expected motion has an amplitude of {amplitude_m_s2:.3g} m/s², "
        f"more than {LARGEST_PLAUSIBLE_M_S2:.3g} m/s², which hardly any ground motion reaches: the damper may be too "
        "weak for this structure, or may hardly move with the target mode. Give "
        "simulate.excitation.base_amplitude_m_s2, or simulate.excitation.reference_rms_top_m"
    )


def release_state(rig: Rig, settings: ExcitationSettings) -> FloatArray | None:
    """Return the initial state of a free decay in the calibrated mode, at rest; None for other kinds of motion."""
    if settings.kind != "free-decay":
        return None
    known = rig.controllers.calibrated
    return released(rig.frame, rig.position, known.omega_0, known.amplitude_m, settings.release_top_m)
