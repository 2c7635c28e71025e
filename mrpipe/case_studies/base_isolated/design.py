"""Calibration of the laws of the base-isolated building on its isolation modes, and its LQG controller."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.base_isolated.structure import FLOORS, IsolatedBuilding
from mrpipe.case_studies.gains import damped_modes, viscous_for_damping
from mrpipe.case_studies.laws import LawGains
from mrpipe.case_studies.lqg import (
    Outputs,
    SampledController,
    output_observer_gain,
    output_regulator_gain,
    sampled_controller,
)
from mrpipe.case_studies.model import ModalModel
from mrpipe.case_studies.options import LqgWeights


def friction_for_damping(modal: ModalModel, ratio: float, omega: float, scale: float) -> float:
    """Return alpha [N/m] of FDNS that gives the two lowest modes a damping ratio: c = 4 alpha/(pi w), k = -alpha.

    Parameters
    ----------
    modal
        The building.
    ratio
        Damping ratio that both modes shall have.
    omega
        Frequency of the isolation [rad/s].
    scale
        Upper bound of alpha [N/m].
    """
    low, high = 0.0, scale
    for _ in range(60):
        middle = 0.5 * (low + high)
        viscous, stiffness = np.full(2, 4.0 * middle / (np.pi * omega)), np.full(2, -middle)
        sizes, ratios = damped_modes(modal, viscous, stiffness)
        reached = len(ratios) > 1 and ratios[:2].min() >= ratio and sizes[0] > 0.1 * omega
        low, high = (low, middle) if reached else (middle, high)
    return high


def isolation_gains(
    building: IsolatedBuilding, modal: ModalModel, *, damping_ratio: float, stiffness_share: float
) -> LawGains:
    """Calibrate the laws on the isolation modes by complex eigenvalues; the gains are the same along x and y.

    Each of the three laws gives the two lowest modes the same damping ratio. FDNS is represented by its
    energy-equivalent viscous damper (4.21) to (4.24).

    Parameters
    ----------
    building, modal
        The building and all its modes.
    damping_ratio
        Damping ratio that the two lowest modes shall have.
    stiffness_share
        Share of the isolation's stiffness that VDNS takes away.
    """
    omega = 2.0 * np.pi / building.isolation_period_s
    critical = 2.0 * omega * building.model.total_mass_kg
    k = -stiffness_share * float(building.isolation_stiffness[0, 0])
    return LawGains(
        viscous=viscous_for_damping(modal, 0.0, damping_ratio, critical, modes=2),
        negative_stiffness=k,
        negative_viscous=viscous_for_damping(modal, k, damping_ratio, critical, modes=2),
        friction=friction_for_damping(modal, damping_ratio, omega, 0.5 * float(building.isolation_stiffness[0, 0])),
        damping_ratio=damping_ratio,
    )


def isolation_outputs(building: IsolatedBuilding, modal: ModalModel) -> tuple[Outputs, Outputs]:
    """Return regulated and measured outputs of the modal state, forces u = -f pushing.

    Regulated: base displacement, absolute acceleration of floors 1 and 8, in x and y. Measured: base displacement
    and velocity, absolute accelerations of the base and of floor 8, in x and y.
    """
    n, dof = modal.modes, building.model.degrees_of_freedom
    Minv = np.linalg.inv(building.model.mass)
    position, rate = modal.shapes, modal.shapes
    relative_x = -Minv @ building.model.stiffness @ position
    relative_v = -Minv @ building.model.damping @ rate
    forces = Minv @ building.model.devices

    def absolute(rows: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """Return C and D of floors' absolute accelerations: relative to the base, plus the base's own absolute one.

        x_b'' + x_g'' and x_s'' follow from the equations of motion with the ground's part cancelled.
        """
        chosen = np.zeros((len(rows), dof))
        for place, row in enumerate(rows):
            chosen[place, row] = 1.0
            if row < dof - 3:
                chosen[place, dof - 3 + row % 3] = 1.0
        return np.hstack([chosen @ relative_x, chosen @ relative_v]), chosen @ forces

    base = [dof - 3, dof - 2]
    top, first = [3 * FLOORS - 3, 3 * FLOORS - 2], [0, 1]
    displacement = np.hstack([modal.shapes[base], np.zeros((2, n))])
    velocity = np.hstack([np.zeros((2, n)), modal.shapes[base]])
    C_a, D_a = absolute([*first, *top])
    regulated = Outputs(np.vstack([displacement, C_a]), np.vstack([np.zeros((2, 2)), D_a]), np.zeros((6, 2)))
    C_m, D_m = absolute([*base, *top])
    measured = Outputs(np.vstack([displacement, velocity, C_m]), np.vstack([np.zeros((4, 2)), D_m]), np.zeros((8, 2)))
    return regulated, measured


def isolation_lqg(
    building: IsolatedBuilding,
    modal: ModalModel,
    weights: LqgWeights,
) -> SampledController:
    """Design the LQG controller of appendix E for the building.

    Parameters
    ----------
    building, modal
        The building and all its modes.
    weights
        Weights of displacement, acceleration and force.
    """
    A, B = modal.state_matrix(), modal.input_matrix(modal.devices)
    regulated, measured = isolation_outputs(building, modal)
    Q = np.diag([weights.displacement] * 2 + [weights.acceleration] * 4)
    feedback = output_regulator_gain(A, B, regulated, Q, np.eye(2) / weights.force_n**2)
    noise = np.diag([1e-4**2] * 2 + [1e-3**2] * 2 + [1e-2**2] * 4) * weights.interval_s
    gain = output_observer_gain(A, modal.input_matrix(modal.load), measured, 0.1 * np.eye(2), noise)
    return sampled_controller(A, B, measured, feedback, gain, weights.interval_s)
