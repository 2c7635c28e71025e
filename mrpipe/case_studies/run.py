"""Runs of a benchmark structure: from a modal model, loads and a controller to histories and their energy balance."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from mrpipe.artifacts import FloatArray, load_parameter_set
from mrpipe.case_studies import devices as packed
from mrpipe.case_studies.kernel import run
from mrpipe.case_studies.lqg import SampledController
from mrpipe.case_studies.model import ModalModel
from mrpipe.dampers.plant import Chain, build_chain
from mrpipe.errors import DivergedError
from mrpipe.networks.network import Network
from mrpipe.signals.discretisation import discretise_first_order, discretise_zero_order

Law = Literal["none", "kelvin", "friction", "lqg", "constant"]
Realisation = Literal["active", "semi-active", "bingham", "chain"]
_LAWS: dict[str, int] = {
    "none": packed.NONE,
    "kelvin": packed.KELVIN,
    "friction": packed.FRICTION,
    "lqg": packed.LQG,
    "constant": packed.CONSTANT,
}
_REALISATIONS: dict[str, int] = {
    "active": packed.ACTIVE,
    "semi-active": packed.SEMI_ACTIVE,
    "bingham": packed.BINGHAM,
    "chain": packed.CHAIN,
}


@dataclass(frozen=True)
class BinghamDevice:
    """One damper of P4 (6), per volt.

    Attributes
    ----------
    force, force_per_volt, viscosity, viscosity_per_volt
        N, N/V, N s/m, N s/m/V.
    highest_voltage
        Voltage at which the damper saturates [V].
    """

    force: float = 100e3
    force_per_volt: float = 75e3
    viscosity: float = 81e3
    viscosity_per_volt: float = 90e3
    highest_voltage: float = 10.0


def bingham_device(name: str) -> BinghamDevice:
    """Return the damper of a parameter set of `dampers`."""
    values = load_parameter_set("dampers", name)
    parts = ("yield_force_a", "yield_force_b", "c0_a", "c0_b", "drive_limit")
    return BinghamDevice(*(values.scalar(part) for part in parts))


@dataclass(frozen=True)
class Controller:
    """Control law that drives the devices, and how its force is realised.

    Attributes
    ----------
    law
        `none` (no device), `kelvin` (4.14), `friction` (4.18 with 4.20), `lqg`, or `constant` voltage.
    realisation
        `active` (the force as asked), `semi-active` (an ideal damper: clipped to resisting forces), `bingham` (the
        damper of P4 (6) under a voltage), `chain` (a damper as a chain of steps, one position only).
    viscous, stiffness, friction, voltage
        Gains c [N s/m], k_d [N/m], alpha [N/m] and constant voltage [V]; one for all positions, or one for each.
    capacity
        Largest force at a position of the ideal realisations [N].
    dampers
        Dampers side by side at each position.
    filter_rate
        lambda of the voltage filter P4 (24) [1/s]; 0 for none.
    fade_velocity
        Rod velocity [m/s] below which the force that a voltage is commanded for fades to nothing; 0: a command jumps at
        reversals.
    interval_s
        Sample of the controller that commands voltages [s]; that of LQG is the observer's.
    device
        Bingham damper: its force, and the inverse that gives the voltage.
    chain
        Damper model where the realisation is `chain`.
    network
        Inverse network of |v| and |f| in place of the formula.
    observer
        The LQG controller, its sample a whole number of steps.
    noise
        Noise of the measurements, shape (samples, outputs); it is repeated when it ends.
    """

    law: Law = "none"
    realisation: Realisation = "active"
    viscous: float | tuple[float, ...] = 0.0
    stiffness: float | tuple[float, ...] = 0.0
    friction: float | tuple[float, ...] = 0.0
    voltage: float | tuple[float, ...] = 0.0
    capacity: float = 1e30
    dampers: float = 1.0
    filter_rate: float = 0.0
    fade_velocity: float = 0.0
    interval_s: float = 0.001
    device: BinghamDevice = field(default_factory=BinghamDevice)
    chain: Chain | None = None
    network: Network | None = None
    observer: SampledController | None = None
    noise: FloatArray | None = None


@dataclass(frozen=True)
class Response:
    """Histories at the saved samples.

    Attributes
    ----------
    modal
        The structure they belong to.
    time_s
        Shape (N,).
    positions, velocities
        Modal coordinates, shape (N, n).
    loads
        w at these times, shape (N, m).
    forces, voltages, desired
        Histories of the devices: mean force of the step before [N], voltage [V], desired force [N]; shape (N, k).
    energies
        Input, structural damping, devices [J], shape (N, 3).
    """

    modal: ModalModel
    time_s: FloatArray
    positions: FloatArray
    velocities: FloatArray
    loads: FloatArray
    forces: FloatArray
    voltages: FloatArray
    desired: FloatArray
    energies: FloatArray

    def displacement(self, rows: FloatArray | None = None) -> FloatArray:
        """Return `rows` x (all degrees of freedom if left out) [m], shape (N, r)."""
        return self.positions @ self._shapes(rows).T

    def velocity(self, rows: FloatArray | None = None) -> FloatArray:
        """Return the rate of :meth:`displacement` [m/s]."""
        return self.velocities @ self._shapes(rows).T

    def acceleration(self, rows: FloatArray | None = None) -> FloatArray:
        """Return the second rate of :meth:`displacement` [m/s^2], relative as the model is."""
        modal = self.modal
        second = (
            self.loads @ modal.load.T
            - self.positions * modal.angular_frequencies**2
            - self.velocities @ modal.damping.T
            - self.forces @ modal.devices.T
        )
        return second @ self._shapes(rows).T

    def stroke(self) -> FloatArray:
        """Return the displacement of each device's rod [m], shape (N, k)."""
        return self.positions @ self.modal.devices

    def rod_velocity(self) -> FloatArray:
        """Return the velocity of each device's rod [m/s], shape (N, k)."""
        return self.velocities @ self.modal.devices

    def stored_energy(self) -> FloatArray:
        """Return kinetic and elastic energy of the motion [J], shape (N,)."""
        elastic = np.sum((self.positions * self.modal.angular_frequencies) ** 2, axis=1)
        return np.asarray(0.5 * (np.sum(self.velocities**2, axis=1) + elastic))

    @property
    def energy_balance_error(self) -> float:
        """Largest gap of the energy balance over the largest energy that has come in [1]."""
        gap = self.energies[:, 0] - self.energies[:, 1] - self.energies[:, 2] - self.stored_energy()
        scale = max(float(np.abs(self.energies[:, 0]).max()), float(self.stored_energy().max()), 1e-300)
        return float(np.abs(gap).max()) / scale

    def _shapes(self, rows: FloatArray | None) -> FloatArray:
        return self.modal.shapes if rows is None else np.asarray(rows) @ self.modal.shapes


def _structure(modal: ModalModel, loads: FloatArray, dt: float) -> tuple[FloatArray, ...]:
    """Return the exact step of the structure in the arrays that the kernel takes."""
    n, classical = modal.modes, modal.classical
    A = modal.state_matrix()
    devices = modal.input_matrix(modal.devices)
    blocks, pulses, load = np.zeros((n, 4)), np.zeros((n, 4)), modal.load
    dense, now, after = np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1))
    if classical:
        for mode in range(n):
            rate, omega = modal.damping[mode, mode], modal.angular_frequencies[mode]
            single = np.array([[0.0, 1.0], [-(omega**2), -rate]])
            step, first, second = discretise_first_order(single, np.array([[0.0], [1.0]]), dt)
            blocks[mode] = step.ravel()
            pulses[mode] = [first[0, 0], second[0, 0], first[1, 0], second[1, 0]]
        reaction = _classical_reaction(modal, dt)
        loads = loads @ modal.load.T
    else:
        if load.shape[1] > n:
            # fewer modal forces than loads: the loop then sums over modes
            loads, load = loads @ load.T, np.eye(n)
        step, first, second = discretise_first_order(A, modal.input_matrix(load), dt)
        dense, now, after = step.T, first.T, second.T
        reaction = discretise_zero_order(A, devices, dt)[1]
    compliance = np.vstack([modal.devices.T @ reaction[:n], modal.devices.T @ reaction[n:]])
    arrays = (
        dense, now, after, blocks, pulses, reaction.T, modal.devices.T, compliance, modal.damping, load.T, loads
    )  # fmt: skip
    return tuple(np.ascontiguousarray(item, dtype=np.float64) for item in arrays)


def _classical_reaction(modal: ModalModel, dt: float) -> FloatArray:
    n = modal.modes
    reaction = np.zeros((2 * n, modal.devices.shape[1]))
    for mode in range(n):
        rate, omega = modal.damping[mode, mode], modal.angular_frequencies[mode]
        single = np.array([[0.0, 1.0], [-(omega**2), -rate]])
        pulse = discretise_zero_order(single, np.array([[0.0], [1.0]]), dt)[1][:, 0]
        reaction[mode] = pulse[0] * modal.devices[mode]
        reaction[n + mode] = pulse[1] * modal.devices[mode]
    return reaction


def _control(controller: Controller, devices: int, dt: float) -> tuple[tuple[FloatArray, ...], int]:
    columns = (controller.viscous, controller.stiffness, controller.friction, controller.voltage)
    gains = np.stack([np.broadcast_to(np.asarray(item, dtype=np.float64), devices) for item in columns], axis=1)
    observer = controller.observer
    if controller.law != "lqg" or observer is None:
        return (gains, *(np.zeros((1, 1)) for _ in range(7))), max(1, round(controller.interval_s / dt))
    every = max(1, round(observer.interval_s / dt))
    outputs = observer.gain.shape[1]
    noise = controller.noise if controller.noise is not None else np.zeros((1, outputs))
    arrays = (
        gains,
        observer.step.T,
        observer.step_force.T,
        observer.gain.T,
        observer.feedback,
        observer.measure.T,
        observer.measure_force.T,
        noise,
    )
    return tuple(np.ascontiguousarray(item, dtype=np.float64) for item in arrays), every


def _network(network: Network | None) -> tuple[FloatArray, ...]:
    if network is None:
        return packed.no_network()
    scales = [*network.input_scale, *network.input_shift, network.output_scale, network.output_shift]
    arrays = (
        network.weights[0],
        network.biases[0],
        network.weights[1],
        network.biases[1],
        network.weights[2][0],
        [*scales, float(network.biases[2][0])],
    )
    return tuple(np.ascontiguousarray(item, dtype=np.float64) for item in arrays)


def _settings(controller: Controller, dt: float, ratio: int, save: int, every: int, classical: bool) -> FloatArray:
    settings = np.zeros(packed.SETTINGS)
    device = controller.device
    entries = {
        packed.DT: dt,
        packed.RATIO: ratio,
        packed.SAVE: save,
        packed.CLASSICAL: float(classical),
        packed.LAW: _LAWS[controller.law],
        packed.REALISATION: _REALISATIONS["bingham" if controller.law == "constant" and not controller.chain
                                          else controller.realisation],
        packed.CAPACITY: controller.capacity,
        packed.COUNT: controller.dampers,
        packed.FILTER_RATE: controller.filter_rate,
        packed.CONTROL_EVERY: every,
        packed.FORCE_A: device.force,
        packed.FORCE_B: device.force_per_volt,
        packed.VISCOSITY_A: device.viscosity,
        packed.VISCOSITY_B: device.viscosity_per_volt,
        packed.HIGHEST_VOLTAGE: device.highest_voltage,
        packed.NEURAL: float(controller.network is not None),
        packed.CHAIN_COUNT: 3.0,
        packed.FADE: controller.fade_velocity,
    }  # fmt: skip
    for place, value in entries.items():
        settings[place] = value
    return settings


def simulate(
    modal: ModalModel,
    loads: FloatArray,
    load_interval_s: float,
    controller: Controller | None = None,
    *,
    ratio: int = 1,
    save_every: int = 1,
) -> Response:
    """Run a structure from rest.

    Parameters
    ----------
    modal
        The structure.
    loads
        w, shape (N, m), at equal intervals; straight between samples.
    load_interval_s
        Interval of the loads [s].
    controller
        Controller of the devices; None: there are no devices.
    ratio
        Steps for each load sample.
    save_every
        Steps for each sample of the histories.

    Raises
    ------
    DivergedError
        If the motion grows beyond all bounds.
    """
    controller = controller or Controller()
    dt = load_interval_s / ratio
    structure = _structure(modal, np.asarray(loads, dtype=np.float64), dt)
    devices, n = modal.devices.shape[1], modal.modes
    control, every = _control(controller, devices, dt)
    chain = controller.chain or build_chain([])
    steps = (len(loads) - 1) * ratio
    samples = steps // save_every + 1
    shapes = ((samples, 2 * n), (samples, devices), (samples, devices), (samples, devices), (samples, 3))
    result = tuple(np.zeros(shape) for shape in shapes)
    settings = _settings(controller, dt, ratio, save_every, every, modal.classical)
    run(settings, structure, control, _network(controller.network), chain.arguments, result)
    if not np.all(np.isfinite(result[0][-1])):
        raise DivergedError(f"{controller.law} ({controller.realisation}) diverged; take a shorter step")
    time: FloatArray = np.arange(samples, dtype=np.float64) * dt * save_every
    given = np.arange(len(loads)) * load_interval_s
    columns = [np.interp(time, given, column) for column in np.asarray(loads, dtype=np.float64).T]
    at_samples: FloatArray = np.asarray(np.stack(columns, axis=1), dtype=np.float64)
    return Response(modal, time, result[0][:, :n], result[0][:, n:], at_samples, *result[1:])
