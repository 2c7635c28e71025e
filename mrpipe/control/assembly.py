"""Assembly of controllers from settings, structure, damper and calibration.

Simulation, export, the virtual laboratory, the tracing and the design of laws build their controllers here::

    factory = ControllerFactory(frame, damper, calibrated, ControllerSettings(inverse="model"))
    controller = factory.build("vdns", Gains(c_n_s_m=250.0, k_n_m=-4500.0))
    response = simulate_law(frame, damper.chain(), controller, excitation, LoopOptions(), position=calibrated.position)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from scipy.optimize import brentq

from mrpipe.artifacts import Artifact
from mrpipe.control.calibration import Calibration
from mrpipe.control.controller import Controller, build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import InverseTable, inverse_table
from mrpipe.control.law import Law
from mrpipe.control.laws import all_laws, law_named
from mrpipe.control.limits import LimitingModes, optimal_viscosity
from mrpipe.control.lqg import Weights
from mrpipe.control.settings import ControllerSettings
from mrpipe.control.storage import Calibrated
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError
from mrpipe.networks.network import Network, read_network
from mrpipe.structures import Frame

RATES_HZ = (200.0, 500.0)
"""Sampling rates of the thesis [Hz]: with the damper, and with a perfect damper."""

PERFECT_ROUNDING = 1.5
"""Ratio of the rounding speed of friction with a perfect damper to that with a real damper. It is larger than 1,
because no yielding rounds the force of a perfect damper.
"""


FORCE_MARGIN = 10.0
"""Ratio of the largest plausible reading of the damper force to the largest force of the model."""

EXTREMUM_NOISE = 5.0
"""Ratio of the return distance that confirms an extremum to the noise of the displacement."""


@dataclass(frozen=True)
class ControllerFactory:
    """Builds the controller of any law for one structure and one damper.

    Attributes
    ----------
    frame, damper
        Structure, and model of the damper that the controller uses.
    calibrated
        Position of the damper, gains and weights.
    settings
        Settings of the controllers.
    inverse
        Inverse network of the damper; None: the inverse is a table of the post-yield force of the model.
    ideal_rounding_m_s
        Speed over which friction changes its sign with a perfect damper [m/s]; None: :data:`PERFECT_ROUNDING` times the
        calibrated speed.

    Raises
    ------
    UserError
        If the calibration was made for another number of floors.
    """

    frame: Frame
    damper: DamperModel
    calibrated: Calibrated
    settings: ControllerSettings
    inverse: Network | None = None
    ideal_rounding_m_s: float | None = None

    def __post_init__(self) -> None:
        floors = len(self.calibrated.position)
        if floors != self.frame.floors:
            raise UserError(
                "simulate.frame", self.frame.name, f"has {self.frame.floors} floors", f"calibrated for {floors}"
            )

    def build(
        self,
        law: str | Law,
        gains: Gains | None = None,
        *,
        perfect: bool = False,
        inverse: Network | InverseTable | None = None,
        residual_force_n: float | None = None,
    ) -> Controller:
        """Return the controller of a law.

        Parameters
        ----------
        law
            A law or its name.
        gains
            Gains that replace the calibrated ones; None: the calibrated ones.
        perfect
            Whether the damper and the sensors are perfect. The controller then reads the velocity, and it runs at 500
            Hz if the settings give no rate.
        inverse, residual_force_n
            Inverse, and force [N] below which the drive is 0, that replace those of the factory; None: those of the
            factory.

        Raises
        ------
        UserError
            If the law is unknown or lacks what it needs.
        """
        entry = law_named(law) if isinstance(law, str) else law
        known = self.calibrated
        options = self.options(perfect=perfect, residual_force_n=residual_force_n)
        if inverse is None:
            inverse = self.inverse or inverse_table(self.damper, drive_limit=self.settings.drive_limit)
        chosen = known.gains_of(entry.name) if gains is None else gains
        observer = None
        if entry.observer is not None:
            observer = entry.observer(self.frame, known.position, known.weights, 1.0 / options.rate_hz)
        return build_controller(
            entry,
            chosen,
            options,
            inverse=inverse,
            reference=self._reference(entry, chosen),
            observer=observer,
            position=known.position,
        )

    @property
    def switch_force_n(self) -> float:
        """Desired force below which the drive is zero [N]."""
        given = self.settings.residual_force_n
        return self.calibrated.residual_force_n if given is None else given

    def available(self) -> list[str]:
        """Return the names of the laws whose gains and networks are all available."""
        known = self.calibrated
        return [
            name
            for name, law in all_laws().items()
            if (name in known.gains or not law.calibrated)
            and ("network" not in law.needs or known.reference is not None)
        ]

    def options(self, *, perfect: bool = False, residual_force_n: float | None = None) -> ControllerOptions:
        """Return the options of the controllers; arguments as in :meth:`build`."""
        settings = self.settings
        rounding = settings.friction_rounding_m_s
        if rounding is None:
            rounding = self.calibrated.friction_rounding_m_s
        if perfect:
            given = self.ideal_rounding_m_s
            rounding = PERFECT_ROUNDING * rounding if given is None else given
        limit = settings.drive_limit or self.damper.drive_limit
        saturation = self._largest_force(limit)
        return ControllerOptions(
            rate_hz=settings.rate_hz or RATES_HZ[perfect],
            velocity="measured" if perfect else settings.velocity,
            displacement_noise_m=settings.kalman_displacement_noise_m,
            acceleration_noise_m_s2=settings.kalman_acceleration_noise_m_s2,
            bias_drift_m_s2=settings.kalman_bias_drift_m_s2,
            inverse_request=settings.inverse_request,
            observer_force=settings.observer_force,
            residual_force_n=self.switch_force_n if residual_force_n is None else residual_force_n,
            low_pass_hz=settings.cutoff_hz,
            drive_limit=limit,
            dead_band_m_s=settings.dead_band_m_s,
            extremum_step_m=settings.extremum_step_m or EXTREMUM_NOISE * settings.kalman_displacement_noise_m,
            friction_rounding_m_s=rounding,
            extremum_share=settings.extremum_share,
            largest_displacement_m=settings.largest_displacement_m,
            largest_velocity_m_s=settings.largest_velocity_m_s,
            largest_acceleration_m_s2=settings.largest_acceleration_m_s2,
            largest_force_n=settings.largest_force_n or (FORCE_MARGIN * saturation if saturation else None),
            saturation_force_n=saturation,
            fault_hold_s=settings.fault_hold_s,
            safe_drive=min(settings.safe_drive, limit),
            extremum_memory_s=settings.extremum_memory_periods * 2.0 * math.pi / self.calibrated.omega_0,
        )

    def _largest_force(self, limit: float) -> float | None:
        """Return the force [N] at the drive limit and the expected amplitude; None if it is infinite or zero."""
        speed = self.calibrated.amplitude_m * self.calibrated.omega_0
        force = float(self.damper.quasi_static_force(speed, limit))
        return force if math.isfinite(force) and force > 0.0 else None

    def _reference(self, law: Law, gains: Gains) -> Network | None:
        """Return the reference network for these gains: its force is proportional to the tuned gain of the law."""
        known = self.calibrated
        if "network" not in law.needs or known.reference is None:
            return None
        trained = known.gains.get(law.name, gains).get(law.tuned_gain, 0.0)
        factor = gains.get(law.tuned_gain, 0.0) / trained if trained else 1.0
        if factor == 1.0:
            return known.reference
        network = known.reference
        return replace(network, output_scale=factor * network.output_scale, output_shift=factor * network.output_shift)


def inverse_network(settings: ControllerSettings, trained: Callable[[], Artifact]) -> Network | None:
    """Return the trained inverse network if the settings require it, else None.

    Parameters
    ----------
    settings
        Settings of the controller.
    trained
        Function that opens the artifact of `train-inverse`. It is called only if a network is needed.
    """
    return read_network(trained(), "network") if settings.inverse == "network" else None


def expected_amplitude(damper: DamperModel, tested: Mapping[str, float], modes: LimitingModes) -> float:
    """Return the amplitude of the damper for which laws are calibrated [m].

    It is half the largest displacement of the bench tests, so that the model is still valid at twice the amplitude.
    Without bench tests, it is the amplitude at which optimal viscous damping needs three times the residual force.

    Parameters
    ----------
    damper
        Model of the damper.
    tested
        Largest |displacement| of the bench tests [m] under the key `displacement`; empty if it is not known.
    modes
        Modes of the target.
    """
    if tested.get("displacement", 0.0) > 0.0:
        return 0.5 * tested["displacement"]
    rate = optimal_viscosity(modes) * modes.omega_0
    return float(brentq(lambda a: rate * a - 3.0 * _residual(damper, a, modes) - 1e-12, 1e-9, 1e6))


def _residual(damper: DamperModel, amplitude_m: float, modes: LimitingModes) -> float:
    return float(damper.quasi_static_force(amplitude_m * modes.omega_0, 0.0))


def calibrated_from(
    calibration: Calibration,
    weights: Weights,
    damper: DamperModel,
    *,
    amplitude_m: float,
    friction_rounding_share: float = 1.0 / 6.0,
    reference: Network | None = None,
) -> Calibrated:
    """Return a calibration in the form that :class:`ControllerFactory` reads, without a file.

    Parameters
    ----------
    calibration, weights, damper
        Calibration of the laws, weights of the regulators, and model of the damper.
    amplitude_m
        Expected amplitude of the damper [m].
    friction_rounding_share
        Ratio of the speed over which friction changes its sign to the peak speed at this amplitude.
    reference
        Network of the laws that need one.
    """
    return Calibrated(
        position=calibration.position,
        omega_0=calibration.modes.omega_0,
        u_0=calibration.modes.u_0,
        top_0=calibration.modes.top_0,
        amplitude_m=amplitude_m,
        residual_force_n=_residual(damper, amplitude_m, calibration.modes),
        friction_rounding_m_s=friction_rounding_share * amplitude_m * calibration.modes.omega_0,
        weights=weights,
        gains={law: item.gains for law, item in calibration.laws.items()},
        reference=reference,
        skipped=calibration.skipped,
    )
