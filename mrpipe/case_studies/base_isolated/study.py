"""The base-isolated building under two-component ground motions: laws, dampers, indices J1 to J9 (section 6.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.base_isolated.design import isolation_gains, isolation_lqg
from mrpipe.case_studies.base_isolated.structure import FLOORS, IsolatedBuilding
from mrpipe.case_studies.indices import IsolatedResponse, base_isolated_indices
from mrpipe.case_studies.laws import LawGains, controller_of
from mrpipe.case_studies.lqg import SampledController
from mrpipe.case_studies.model import ModalModel, modal_model
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice, Controller, Response, simulate
from mrpipe.networks.network import Network
from mrpipe.structures.records import GroundMotion

REASON = (
    "Two dampers of 1000 kN (1.4 MN at 10 V and 0.55 m/s) stand against some 15 to 25 MN of base shear, so J6 of MR "
    "dampers cannot exceed about 0.1 (lqg has ideal actuators without a limit) and J3 and J7 cannot change as printed; "
    "J9 is a share of energy and cannot exceed 1, as the printed 1.89 does (errata row 20). Table 6.1 is in volts, 0 "
    "to 10, where the thesis has kN/A and kN/V (row 17). The thesis does not print its gains; here vd, vdns and fdns "
    "give the isolation modes one damping ratio, by complex eigenvalues; the closed forms (4.13) to (4.25) take a "
    "device that changes the mode little, which does not hold here."
)
"""Why our figures differ from the printed ones."""

STRUCTURE = "the base-isolated building"
"""Name of the structure in messages."""


@dataclass(frozen=True)
class IsolationStudy:
    """The building, calibrated; see :func:`isolation_study`."""

    building: IsolatedBuilding
    modal: ModalModel
    gains: LawGains
    device: BinghamDevice
    network: Network | None
    observer: SampledController
    time_step_s: float
    dampers: float = 1.0

    def controller(self, law: str) -> Controller:
        """Return the controller of a law of :data:`~mrpipe.case_studies.laws.LAWS`.

        Raises
        ------
        UserError
            If the law does not exist.
        """
        mr = Controller("kelvin", "bingham", device=self.device, network=self.network, dampers=self.dampers)
        return controller_of(law, mr, self.gains, self.observer, STRUCTURE)

    def ideal(self, law: str) -> Controller:
        """Return the law with dampers that give any dissipative force at once."""
        mr = self.controller(law)
        return replace(mr, realisation="semi-active", network=None)

    def run(self, motion: GroundMotion, controller: Controller | None = None, refine: int = 1) -> Response:
        """Run the building under a motion of two components; `refine` shortens the step."""
        ratio = max(1, round(motion.interval_s / self.time_step_s)) * refine
        return simulate(self.modal, motion.acceleration_m_s2[:, :2], motion.interval_s, controller, ratio=ratio)

    def indices(self, response: Response, uncontrolled: Response) -> dict[str, float]:
        """Return J1 to J9."""
        pair = (isolated_response(self.building, item) for item in (response, uncontrolled))
        return base_isolated_indices(*pair)


def isolated_response(building: IsolatedBuilding, response: Response) -> IsolatedResponse:
    """Return the histories from which the indices of appendix B are computed.

    The base shear is all that the ground gives the building: bearings and devices.
    """
    x, v = response.displacement(), response.velocity()
    base_x, base_v = x[:, -3:], v[:, -3:]
    ground = response.loads
    relative = x[:, :-3].reshape(len(x), FLOORS, 3)
    bearings = base_x @ building.isolation_stiffness.T + base_v @ building.isolation_damping.T
    storey = x[:, :-3] @ building.superstructure_stiffness.T + v[:, :-3] @ building.superstructure_damping.T
    floor_acceleration: FloatArray = -storey @ np.linalg.inv(building.superstructure_mass).T
    shear = storey.reshape(len(x), FLOORS, 3).sum(axis=1)
    corners = building.corners_m
    points = base_x[:, None, :2] + base_x[:, None, 2:] * np.stack([-corners[:, 1], corners[:, 0]], axis=1)
    steps = 0.5 * (ground[1:] + ground[:-1]) * np.diff(response.time_s)[:, None]
    velocity = np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return IsolatedResponse(
        time_s=response.time_s,
        base_shear_n=bearings[:, :2] + response.forces,
        storey_shear_n=shear[:, :2],
        base_displacement_m=points,
        drift=np.diff(relative[:, :, :2], axis=1, prepend=0.0),
        floor_acceleration_m_s2=floor_acceleration.reshape(len(x), FLOORS, 3)[:, :, :2],
        device_force_n=response.forces,
        device_velocity_m_s=response.rod_velocity(),
        device_work_j=float(response.energies[-1, 2]),
        ground_velocity_m_s=velocity,
    )


def isolation_study(
    building: IsolatedBuilding,
    *,
    device: BinghamDevice,
    network: Network | None,
    damping_ratio: float,
    stiffness_share: float,
    lqg: LqgWeights,
    time_step_s: float = 0.001,
    dampers: float = 1.0,
) -> IsolationStudy:
    """Calibrate all laws for a building.

    Parameters
    ----------
    building
        Published or surrogate.
    device, network
        The damper and its neural inverse (the formula if None).
    damping_ratio, stiffness_share
        See :func:`isolation_gains`.
    lqg
        Weights of the LQG controller.
    time_step_s
        Longest step [s].
    dampers
        Dampers at each of the two positions.
    """
    modal = modal_model(building.model)
    gains = isolation_gains(building, modal, damping_ratio=damping_ratio, stiffness_share=stiffness_share)
    observer = isolation_lqg(building, modal, lqg)
    return IsolationStudy(building, modal, gains, device, network, observer, time_step_s, dampers)


@dataclass(frozen=True)
class IsolationCase:
    """Run of the building under one law and one motion."""

    motion: str
    law: str
    indices: dict[str, float]
    response: Response

    @property
    def summary(self) -> dict[str, float]:
        """Peak force [N], peak rod velocity [m/s], peak stroke [m] and energy balance error [1]."""
        response = self.response
        return {
            "peak_force_n": float(np.abs(response.forces).max()),
            "peak_rod_velocity_m_s": float(np.abs(response.rod_velocity()).max()),
            "peak_stroke_m": float(np.abs(response.stroke()).max()),
            "energy_balance_error": response.energy_balance_error,
        }


def run_cases(
    study: IsolationStudy, motion: GroundMotion, laws: Sequence[str], jobs: int = 1
) -> tuple[Response, list[IsolationCase]]:
    """Run the building without dampers and under each law.

    Parameters
    ----------
    study
        The building.
    motion
        Two components.
    laws
        Names of laws of :data:`~mrpipe.case_studies.laws.LAWS`.
    jobs
        Threads: the compiled loop runs free of the interpreter.
    """
    controllers = [study.controller(law) for law in laws]
    free = study.run(motion)

    def one(law: str, controller: Controller) -> IsolationCase:
        response = study.run(motion, controller)
        return IsolationCase(motion.name, law, study.indices(response, free), response)

    pairs = zip(laws, controllers, strict=True)
    cases = Parallel(n_jobs=max(1, jobs), backend="threading")(delayed(one)(law, item) for law, item in pairs)
    return free, list(cases)


def run_motions(
    study: IsolationStudy, motions: Sequence[GroundMotion], laws: Sequence[str], jobs: int = 1
) -> dict[str, dict[str, dict[str, float]]]:
    """Return motion -> law -> indices and energy balance error, motions spread over threads."""
    for law in laws:
        study.controller(law)

    def one(motion: GroundMotion) -> dict[str, dict[str, float]]:
        _, cases = run_cases(study, motion, laws)
        return {
            case.law: {**case.indices, "energy_balance_error": case.response.energy_balance_error} for case in cases
        }

    done = Parallel(n_jobs=max(1, jobs), backend="threading")(delayed(one)(motion) for motion in motions)
    return dict(zip((motion.name for motion in motions), done, strict=True))


def capacity_sensitivity(
    study: IsolationStudy, motion: GroundMotion, law: str, dampers: Sequence[float]
) -> dict[float, dict[str, float]]:
    """Return the indices of a law for several numbers of dampers at each position."""
    free = study.run(motion)
    result = {}
    for number in dampers:
        other = replace(study, dampers=number)
        result[number] = other.indices(other.run(motion, other.controller(law)), free)
    return result
