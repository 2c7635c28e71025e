"""Calibration of the laws of the tower on its first mode, and its LQG controller."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.case_studies.gains import exact_viscous, lowest_damping, two_component
from mrpipe.case_studies.indices import WIND_FLOORS
from mrpipe.case_studies.laws import LawGains
from mrpipe.case_studies.lqg import (
    Outputs,
    SampledController,
    output_observer_gain,
    output_regulator_gain,
    sampled_controller,
    sampled_loop_radius,
)
from mrpipe.case_studies.model import ModalModel
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.wind.load import WindLoad
from mrpipe.case_studies.wind.structure import Tower
from mrpipe.errors import UserError

CORRELATION_S = 4.0
"""Time over which the observer takes the wind as white [s]."""
SENSOR_DENSITY = 1e-4
"""Spectral density of the sensors' noise [(m/s)^2 s], [(m/s^2)^2 s]."""


@dataclass(frozen=True)
class WindGains(LawGains):
    """Gains of the laws of the tower; with a tuned mass the damping ratio is the smaller one of its two modes.

    Attributes
    ----------
    capacity_share
        Factor on the optimal gains of VD that reduces them to the force of the dampers.
    """

    capacity_share: float = 1.0

    def within(self, capacity_n: float, velocity_m_s: float, displacement_m: float) -> WindGains:
        """Return the gains, reduced so that no law requires more than the dampers' force at this motion.

        A law far above its dampers' capacity switches them on and off at every reversal.
        """
        viscous = min(1.0, capacity_n / (self.viscous * velocity_m_s))
        asked = np.hypot(self.negative_viscous * velocity_m_s, self.negative_stiffness * displacement_m)
        negative = min(1.0, capacity_n / float(asked))
        return WindGains(
            viscous=self.viscous * viscous,
            negative_stiffness=self.negative_stiffness * negative,
            negative_viscous=self.negative_viscous * negative,
            friction=min(self.friction, 0.5 * capacity_n / displacement_m),
            damping_ratio=self.damping_ratio,
            capacity_share=viscous,
        )


def wind_gains(tower: Tower, modal: ModalModel, *, stiffness_share: float, tuned_mass_kg: float) -> WindGains:
    """Calibrate on the first mode: (4.13), (4.16), (4.25) in the structure, exact eigenvalues for a tuned mass.

    Parameters
    ----------
    tower, modal
        The tower and its kept modes.
    stiffness_share
        Share of the static stiffness at the device (of the tuned mass' spring) that VDNS takes away.
    tuned_mass_kg
        Scale of the gains of a tuned mass [kg].
    """
    static = 1.0 / float(np.sum(modal.devices[:, 0] ** 2 / modal.angular_frequencies**2))
    if tower.position != "tuned-mass":
        limits = two_component(modal)
        k = -stiffness_share * static
        c = limits.viscous()
        # (4.16) may turn negative for a large k: then the exact optimum is taken
        negative = limits.viscous(k) if limits.viscous(k) > 0.0 else exact_viscous(modal, k, c)
        return WindGains(c, k, negative, limits.friction(), lowest_damping(modal, c, 0.0))
    omega = float(modal.angular_frequencies[0])
    scale = 2.0 * omega * tuned_mass_kg
    c = exact_viscous(modal, 0.0, 0.1 * scale, modes=2)
    k = -0.1 * stiffness_share * tuned_mass_kg * omega**2
    return WindGains(
        viscous=c,
        negative_stiffness=k,
        negative_viscous=exact_viscous(modal, k, 0.1 * scale, modes=2),
        friction=0.25 * np.pi * omega * c,
        damping_ratio=lowest_damping(modal, c, 0.0, modes=2),
    )


def wind_outputs(modal: ModalModel) -> tuple[Outputs, Outputs]:
    """Return z and y of (C.3), (C.4): displacements, velocities, accelerations of nine floors; and without the first.

    Disturbances are the wind forces; F is that of the floors' mean force, enough for the observer's cross term.
    """
    n = modal.modes
    shapes = modal.shapes[np.array(WIND_FLOORS) - 1]
    none = np.zeros_like(shapes)
    displacement, velocity = np.hstack([shapes, none]), np.hstack([none, shapes])
    A = modal.state_matrix()
    acceleration = shapes @ A[n:]
    D = shapes @ modal.devices
    F = shapes @ modal.load
    zero_d, zero_f = np.zeros_like(D), np.zeros_like(F)
    z_d, z_f = np.vstack([zero_d, zero_d, D]), np.vstack([zero_f, zero_f, F])
    regulated = Outputs(np.vstack([displacement, velocity, acceleration]), z_d, z_f)
    measured = Outputs(np.vstack([velocity, acceleration]), np.vstack([zero_d, D]), np.vstack([zero_f, F]))
    return regulated, measured


def wind_lqg(modal: ModalModel, weights: LqgWeights, load: WindLoad) -> tuple[SampledController, float]:
    """Design the LQG controller of appendix E on the reduced model; return it and the force that weighs 1 [N].

    Accelerations of a collocated force reach up to the highest kept mode. Where the sampled loop would be unstable, the
    weight of the force is raised until it is not, and then doubled.

    Parameters
    ----------
    modal
        The tower's kept modes.
    weights
        Weights of floor displacements and accelerations.
    load
        Wind load, whose variance is that of the disturbance.

    Raises
    ------
    UserError
        If no weight makes the sampled loop stable.
    """
    A, B = modal.state_matrix(), modal.input_matrix(modal.devices)
    regulated, measured = wind_outputs(modal)
    nine = len(WIND_FLOORS)
    Q = np.diag([weights.displacement] * nine + [0.0] * nine + [weights.acceleration] * nine)
    # the wind as white noise of the same variance over a few seconds of correlation
    covariance = np.cov(load.forces_n.T) * CORRELATION_S
    gain = output_observer_gain(
        A, modal.input_matrix(modal.load), measured, covariance, SENSOR_DENSITY * np.eye(2 * nine)
    )

    def design(force_n: float) -> SampledController:
        feedback = output_regulator_gain(A, B, regulated, Q, np.eye(1) / force_n**2)
        return sampled_controller(A, B, measured, feedback, gain, weights.interval_s)

    force = weights.force_n
    controller = design(force)
    if sampled_loop_radius(A, B, controller) < 1.0:
        return controller, force
    for _ in range(40):
        force /= 1.5
        if sampled_loop_radius(A, B, design(force)) < 1.0:
            return design(0.5 * force), 0.5 * force
    raise UserError("benchmark.wind.lqg", "", "no stable sampled loop", "a shorter interval_s, or less weight")
