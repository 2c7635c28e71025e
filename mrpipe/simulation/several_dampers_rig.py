"""The closed loop with several dampers from the settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray
from mrpipe.control.assembly import ControllerFactory
from mrpipe.control.central import CENTRAL, CentralRegulator, Sensors, central_regulator
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.control.limits import highest_frequency
from mrpipe.control.placed import CENTRAL_LAW
from mrpipe.control.placed_storage import KnownDamper, accelerometers_of, read_placed
from mrpipe.control.settings import ControllerSettings
from mrpipe.control.together import LinearDevice, ground_response, linear_device
from mrpipe.dampers.model import DamperModel
from mrpipe.effects.damper import damper_named
from mrpipe.errors import UserError
from mrpipe.simulation.acting import ADJUSTED, acting_together, known_amplitude
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import LoopOptions
from mrpipe.simulation.release import released
from mrpipe.simulation.resonance import BAND
from mrpipe.simulation.rig import loop_options
from mrpipe.simulation.settings import ExcitationSettings, SimulateSettings
from mrpipe.simulation.several_dampers import DampersResponse, LoopDamper, simulate_dampers
from mrpipe.structures import Frame, read_frame
from mrpipe.structures.options import DamperSettings, StructureSettings


@dataclass(frozen=True)
class RigDamper:
    """One damper of the rig.

    Attributes
    ----------
    known
        Place, law and calibration of the damper.
    model
        Model of the damper, which its controller uses too.
    controller
        Settings of its controller, with the sensors that it has.
    measured
        Whether its displacement is measured for the central regulator.
    """

    known: KnownDamper
    model: DamperModel
    controller: ControllerSettings
    measured: bool = True

    @property
    def gains(self) -> Gains:
        """Calibrated gains of its law."""
        return self.known.calibrated.gains[self.known.law]

    def device(self, gains: Gains) -> LinearDevice | None:
        """Return its linear equivalent at these gains; None where the law has none."""
        known = self.known
        calibrated = known.calibrated
        return linear_device(
            law_named(known.law),
            gains,
            calibrated.position,
            calibrated.omega_0,
            calibrated.amplitude_m,
            known.brace_n_m,
        )


@dataclass(frozen=True)
class DampersRig:
    """A structure with several dampers.

    Attributes
    ----------
    frame
        The structure.
    dampers
        Dampers in the order of the settings.
    options
        Options of the loop.
    accelerometers
        Degrees of freedom (from 0) that the observer of the central regulator reads.
    """

    frame: Frame
    dampers: tuple[RigDamper, ...]
    options: LoopOptions
    accelerometers: tuple[int, ...]

    @property
    def perfect(self) -> bool:
        """Whether the dampers give any force that is desired, and the sensors are perfect."""
        return self.options.tracking == "ideal"

    def gains(self, factors: Mapping[str, float] | None = None) -> list[Gains]:
        """Return the gains of the dampers; `factors` multiply the tuned gains of the dampers that they name."""
        return [
            law_named(item.known.law).scaled(item.gains, (factors or {}).get(item.known.name, 1.0))
            for item in self.dampers
        ]

    def loop_dampers(self, factors: Mapping[str, float] | None = None) -> list[LoopDamper]:
        """Return the dampers with their controllers; `factors` as in :meth:`gains`."""
        result = []
        for item, gains in zip(self.dampers, self.gains(factors), strict=True):
            known = item.known
            central = known.law == CENTRAL_LAW
            factory = ControllerFactory(self.frame, item.model, known.calibrated, item.controller)
            controller = factory.build(CENTRAL if central else known.law, gains, perfect=self.perfect)
            chain = None if self.options.tracking != "damper" else item.model.chain()
            result.append(
                LoopDamper(known.name, known.calibrated.position, chain, controller, known.brace_n_m, central)
            )
        return result

    def devices(self, factors: Mapping[str, float] | None = None) -> list[LinearDevice]:
        """Return the linear equivalents of the dampers that have one."""
        found = (item.device(gains) for item, gains in zip(self.dampers, self.gains(factors), strict=True))
        return [item for item in found if item is not None]

    def regulator(self, dampers: Sequence[LoopDamper]) -> CentralRegulator | None:
        """Return the central regulator of the dampers with law lqg; None where there is none.

        The linear dampers of other laws belong to the structure that it controls, with the gains that they have in
        `dampers`. Behind a brace, such a damper is replaced by the spring and the dashpot that are equal to both at the
        free frequency of its target mode.
        """
        members = [item for item in self.dampers if item.known.law == CENTRAL_LAW]
        if not members:
            return None
        damping = self.frame.damping.copy()
        stiffness = self.frame.stiffness.copy()
        for item, loop in zip(self.dampers, dampers, strict=True):
            device = item.device(loop.controller.gains)
            if device is None or device.equivalent:
                continue
            omega = item.known.calibrated.omega_0
            own = device.dynamic_stiffness(1j * omega)
            damping += own.imag / omega * np.outer(device.position, device.position)
            stiffness += own.real * np.outer(device.position, device.position)
        sensors = Sensors(self.accelerometers, tuple(place for place, item in enumerate(members) if item.measured))
        return central_regulator(
            replace(self.frame, damping=damping, stiffness=stiffness),
            np.column_stack([item.known.calibrated.position for item in members]),
            [item.known.calibrated.weights for item in members],
            sensors,
            1.0 / dampers[0].controller.options.rate_hz,
            flexibilities=[1.0 / item.known.brace_n_m for item in members],
        )

    def run(
        self,
        excitation: Excitation,
        dampers: Sequence[LoopDamper] | None = None,
        *,
        rng: np.random.Generator | None = None,
        initial_state: FloatArray | None = None,
    ) -> DampersResponse:
        """Run the loop, with the calibrated gains or with dampers of :meth:`loop_dampers`.

        Raises
        ------
        DivergedError
            If the response grows without bound.
        """
        dampers = self.loop_dampers() if dampers is None else dampers
        return simulate_dampers(
            self.frame,
            dampers,
            excitation,
            self.options,
            regulator=self.regulator(dampers),
            rng=rng,
            initial_state=initial_state,
        )


def read_dampers_rig(
    settings: SimulateSettings,
    structure: StructureSettings,
    damper_setting: str,
    artifact: Callable[[str], Artifact],
) -> DampersRig:
    """Return the rig of a run.

    Parameters
    ----------
    settings, structure
        Sections of the configuration.
    damper_setting
        `calibrate.damper`, the model of the dampers that name none.
    artifact
        Opens the artifact of a stage by its name.

    Raises
    ------
    UserError
        If the settings name a frame or a damper for a structure with a single damper.
    """
    for key, value in (("frame", settings.frame), ("damper", settings.damper)):
        if value != "identified":
            raise UserError(
                "simulate",
                key,
                f"is {value}, but the section structure gives the structure and its dampers",
                f"leave simulate.{key} out; give the model in structure.dampers",
            )
    frame = read_frame(artifact("identify-frame")).turned(settings.excitation.direction_deg)
    known = read_placed(artifact("calibrate"))
    dampers = tuple(
        RigDamper(
            item,
            damper_model(entry, damper_setting, artifact),
            controller_of(entry, settings.controller),
            "displacement" in entry.sensors,
        )
        for entry, item in zip(structure.dampers, known, strict=True)
    )
    return DampersRig(frame, dampers, loop_options(settings), accelerometers_of(frame, structure.accelerometers))


def damper_model(entry: DamperSettings, damper_setting: str, artifact: Callable[[str], Artifact]) -> DamperModel:
    """Return the model of a damper of the structure; arguments as in :func:`read_dampers_rig`."""
    return damper_named(entry.damper or damper_setting, {"identified": lambda: artifact("identify-damper")})


def controller_of(entry: DamperSettings, settings: ControllerSettings) -> ControllerSettings:
    """Return the settings of a controller that has these sensors and knows the model of its damper."""
    velocity = settings.velocity
    if "velocity" in entry.sensors:
        velocity = "measured"
    elif "acceleration" not in entry.sensors and velocity == "kalman":
        velocity = "difference"
    changes = {"velocity": velocity, "inverse": "model"}
    return settings.changed(**changes)


def dampers_excitation(rig: DampersRig, settings: ExcitationSettings) -> Excitation:
    """Return the excitation of the structure.

    Without `base_amplitude_m_s2`, the amplitude of harmonic motion and sweeps is the largest at which no damper moves
    more than its expected amplitude, by the linear equivalents at the frequency of the motion.

    Raises
    ------
    UserError
        If a recorded motion cannot be read, or no damper has a linear equivalent and the amplitude is not given.
    """
    free = rig.dampers[0].known.calibrated.omega_0
    amplitude = known_amplitude(settings)
    if amplitude is None and settings.kind in ADJUSTED:
        amplitude = _amplitude(rig, settings.frequency_rad_s or free)
    return acting_together(settings, rig.frame, free, amplitude or 0.0)


def _amplitude(rig: DampersRig, omega: float) -> float:
    movable = [
        (device, item.known.calibrated.amplitude_m)
        for item, device in ((item, item.device(item.gains)) for item in rig.dampers)
        if device is not None
    ]
    if not movable:
        raise UserError(
            "simulate.excitation",
            "base_amplitude_m_s2",
            "is not given, and no damper has a law with a linear equivalent",
            "give the amplitude of the base acceleration",
        )
    _, strokes = ground_response(rig.frame, [device for device, _ in movable], omega)
    return float(min(expected / abs(stroke) for (_, expected), stroke in zip(movable, strokes, strict=True)))


def dampers_release(rig: DampersRig, settings: ExcitationSettings) -> FloatArray | None:
    """Return the initial state of a free decay in the target mode of the first damper; None for other kinds of motion.

    Without `release_top_m` the first damper starts at its expected amplitude.
    """
    if settings.kind != "free-decay":
        return None
    known = rig.dampers[0].known.calibrated
    return released(rig.frame, known.position, known.omega_0, known.amplitude_m, settings.release_top_m)


def dampers_band(rig: DampersRig) -> tuple[float, float]:
    """Return the default band of frequencies of a design [rad/s].

    It runs from below the lowest free frequency of the target modes to above the highest one with a locked damper.
    """
    known = [item.known for item in rig.dampers]
    return (
        BAND[0] * min(item.calibrated.omega_0 for item in known),
        BAND[1] * max(highest_frequency(item.calibrated.omega_0, item.omega_inf) for item in known),
    )
