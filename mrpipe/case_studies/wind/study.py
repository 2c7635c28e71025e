"""The 76-storey tower in wind: reduced model, laws, devices at three places, indices J1 to J12 (section 6.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.indices import WIND_FLOORS, WindResponse, wind_indices
from mrpipe.case_studies.laws import controller_of
from mrpipe.case_studies.lqg import SampledController
from mrpipe.case_studies.model import ModalModel, modal_model
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice, Controller, Response, simulate
from mrpipe.case_studies.wind.design import WindGains, wind_gains, wind_lqg
from mrpipe.case_studies.wind.load import WindLoad
from mrpipe.case_studies.wind.structure import REDUCED_FLOORS, Tower
from mrpipe.networks.network import Network

REASON = (
    "A damper between ground and floor 1 of a cantilever moves by 4e-4 (surrogate) to 2e-3 (published model) of the "
    "top motion, so J5 and J11 are of that order, and no law of 1 MN changes J1 to J4 and J7 to J10 by more than a "
    "percent (errata row 20): the printed J5 of 0.41 to 0.55 is the stroke of a tuned mass, not of this damper. The "
    "thesis prints a damping ratio of 0.001, the benchmark has 0.01 (row 19). The wind-tunnel record is not public: "
    "the load is synthesised, so that only the ratios compare. A damper can work on an outrigger or at a tuned mass."
)
"""Why our figures differ from the printed ones."""

FADE_SHARE = 0.01
"""Share of the peak velocity of the rod in the uncontrolled tower; commands fade below this velocity. They do not fade
at a tuned mass, whose rod always moves."""

STRUCTURE = "the tower"
"""Name of the structure in messages."""


@dataclass(frozen=True)
class WindStudy:
    """The tower under one load, calibrated; see :func:`wind_study`."""

    tower: Tower
    modal: ModalModel
    reference: ModalModel
    optimum: WindGains
    device: BinghamDevice
    network: Network | None
    observer: SampledController
    load: WindLoad
    uncontrolled: Response
    time_step_s: float
    dampers: float
    lqg_force_n: float
    filter_rate: float = 0.0

    @property
    def rod_velocity_m_s(self) -> float:
        """Peak velocity of the rod in the uncontrolled tower [m/s]; 0 for a tuned mass, which that has not."""
        if self.tower.position == "tuned-mass":
            return 0.0
        return float(np.abs(self.uncontrolled.velocity(self.tower.model.devices.T)).max())

    @property
    def gains(self) -> WindGains:
        """Return the gains within what the dampers can give in this wind (a tuned mass': the optimum)."""
        if self.tower.position == "tuned-mass":
            return self.optimum
        device, shapes, velocity = self.device, self.tower.model.devices.T, self.rod_velocity_m_s
        displacement = float(np.abs(self.uncontrolled.displacement(shapes)).max())
        volts = device.highest_voltage
        force = device.force + device.force_per_volt * volts
        force += (device.viscosity + device.viscosity_per_volt * volts) * velocity
        return self.optimum.within(self.dampers * force, velocity, displacement)

    def controller(self, law: str) -> Controller:
        """Return the controller of a law of :data:`~mrpipe.case_studies.laws.LAWS`.

        Raises
        ------
        UserError
            If the law does not exist.
        """
        mr = Controller(
            "kelvin",
            "bingham",
            device=self.device,
            network=self.network,
            dampers=self.dampers,
            filter_rate=self.filter_rate,
            fade_velocity=FADE_SHARE * self.rod_velocity_m_s,
        )
        return controller_of(law, mr, self.gains, self.observer, STRUCTURE)

    def run(self, controller: Controller, *, refine: int = 1) -> Response:
        """Run the tower with its device; `refine` shortens the step."""
        return run_tower(self.modal, self.load, controller, self.time_step_s / refine)

    def indices(self, response: Response) -> dict[str, float]:
        """Return J1 to J12."""
        return wind_indices(wind_response(response), wind_response(self.uncontrolled))


def run_tower(modal: ModalModel, load: WindLoad, controller: Controller | None, time_step_s: float) -> Response:
    """Run a tower; histories are kept at a hundredth of a second or so.

    Parameters
    ----------
    modal
        Modes of the tower that are kept.
    load
        Forces on the floors, straight between samples.
    controller
        Controller of the device; None: there is no device.
    time_step_s
        Longest step [s].
    """
    ratio = max(1, round(load.interval_s / time_step_s))
    save = max(1, round(0.01 * ratio / load.interval_s))
    while ratio % save:
        save -= 1
    return simulate(modal, load.forces_n, load.interval_s, controller, ratio=ratio, save_every=save)


def wind_response(response: Response) -> WindResponse:
    """Return the histories from which the indices of appendix D are computed."""
    places = np.array(WIND_FLOORS) - 1
    rows = np.zeros((len(places), response.modal.shapes.shape[0]))
    rows[np.arange(len(places)), places] = 1.0
    return WindResponse(
        displacement_m=response.displacement(rows),
        acceleration_m_s2=response.acceleration(rows),
        stroke_m=response.stroke()[:, 0],
        device_velocity_m_s=response.rod_velocity()[:, 0],
        device_force_n=response.forces[:, 0],
    )


def wind_study(
    reference: Tower,
    tower: Tower,
    load: WindLoad,
    *,
    device: BinghamDevice,
    network: Network | None,
    stiffness_share: float,
    tuned_mass_kg: float,
    lqg: LqgWeights,
    modes: int = len(REDUCED_FLOORS),
    time_step_s: float = 0.001,
    dampers: float = 1.0,
    filter_rate: float = 31.4,
) -> WindStudy:
    """Reduce the tower and calibrate all laws.

    Parameters
    ----------
    reference
        The tower as it is without a device (and without a tuned mass).
    tower
        The tower with its device.
    load
        Wind forces on the floors.
    device, network
        The damper and its neural inverse (the formula if None).
    stiffness_share, tuned_mass_kg
        See :func:`wind_gains`.
    lqg
        Weights of LQG; its force is that of one damper.
    modes
        Kept modes of the tower; a tuned mass adds one.
    time_step_s
        Longest step [s].
    dampers
        Dampers side by side.
    filter_rate
        lambda of the voltage filter P4 (24) [1/s]; 0 for none.
    """
    kept = modes + (1 if tower.position == "tuned-mass" else 0)
    modal = modal_model(tower.model, kept)
    optimum = wind_gains(tower, modal, stiffness_share=stiffness_share, tuned_mass_kg=tuned_mass_kg)
    observer, force_n = wind_lqg(modal, lqg.changed(force_n=lqg.force_n * dampers), load)
    plain = modal_model(reference.model, modes)
    free = run_tower(plain, load, None, time_step_s)
    return WindStudy(
        tower, modal, plain, optimum, device, network, observer, load, free, time_step_s, dampers, force_n, filter_rate
    )


@dataclass(frozen=True)
class WindCase:
    """Run of the tower under one law."""

    law: str
    indices: dict[str, float]
    response: Response

    @property
    def summary(self) -> dict[str, float]:
        """Peak force [N], peak stroke [m], stroke over top motion [1], and energy balance error [1]."""
        response = self.response
        top = response.displacement(_row(response, 76))
        stroke = response.stroke()[:, 0]
        return {
            "peak_force_n": float(np.abs(response.forces).max()),
            "peak_stroke_m": float(np.abs(stroke).max()),
            "rms_stroke_over_rms_top": float(np.sqrt(np.mean(stroke**2) / np.mean(top**2))),
            "energy_balance_error": response.energy_balance_error,
        }


def _row(response: Response, floor: int) -> FloatArray:
    row = np.zeros((1, response.modal.shapes.shape[0]))
    row[0, floor - 1] = 1.0
    return row


def run_wind_cases(study: WindStudy, laws: Sequence[str], jobs: int = 1) -> list[WindCase]:
    """Run the tower under each law, over threads."""
    controllers = [study.controller(law) for law in laws]

    def one(law: str, controller: Controller) -> WindCase:
        response = study.run(controller)
        return WindCase(law, study.indices(response), response)

    pairs = zip(laws, controllers, strict=True)
    return list(Parallel(n_jobs=max(1, jobs), backend="threading")(delayed(one)(law, item) for law, item in pairs))


def wind_sensitivity(
    study: WindStudy, law: str, dampers: Sequence[float], jobs: int = 1
) -> dict[float, dict[str, float]]:
    """Return the indices of a law for several numbers of dampers side by side."""

    def one(number: float) -> dict[str, float]:
        other = replace(study, dampers=number)
        return other.indices(other.run(other.controller(law)))

    done = Parallel(n_jobs=max(1, jobs), backend="threading")(delayed(one)(number) for number in dampers)
    return dict(zip(dampers, done, strict=True))
