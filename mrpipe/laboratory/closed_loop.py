"""Shaking table with damper and controller: the closed loop of Figure 5.3 on the virtual rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns import TestFile
from mrpipe.control.controller import Controller
from mrpipe.errors import DivergedError, UserError
from mrpipe.laboratory import structure_kernel as kernel
from mrpipe.laboratory.coefficient_effects import INERTIA_GROWTH, INERTIA_PLAIN
from mrpipe.laboratory.damper import TrueDamper, packed_for
from mrpipe.laboratory.frame_rig import ACCELEROMETER_M_S2_PER_V, LASER_M_PER_V, LOAD_CELL_N_PER_V, TableRecord
from mrpipe.laboratory.motion import smooth_start
from mrpipe.laboratory.options import LoopRig
from mrpipe.laboratory.structure import TrueStructure, assemble


@dataclass(frozen=True)
class LoopHistories:
    """True histories at the sampling times of the recorder, shape (samples,) or (samples, floors), SI."""

    time_s: FloatArray
    ground: FloatArray
    displacement: FloatArray
    acceleration: FloatArray
    force: FloatArray
    drive: FloatArray
    desired: FloatArray


def base_motion(rig: LoopRig, factor: float = 1.0) -> FloatArray:
    """Return the ground acceleration on the fine clock: rest, harmonic motion, rest, shape (m,) [m/s2]."""
    total = rig.rest_s + rig.shaking_s + rig.decay_s
    time = np.arange(round(total / rig.step_s), dtype=np.float64) * rig.step_s - rig.rest_s
    period = 2.0 * np.pi / rig.frequency_rad_s
    stop = np.floor(rig.shaking_s / period) * period
    window = smooth_start(time, 2.0 * period) * smooth_start(stop - time, 0.05 * period)
    return np.asarray(-factor * rig.base_amplitude_m_s2 * window * np.sin(rig.frequency_rad_s * time))


def run_loop(
    damper: TrueDamper,
    structure: TrueStructure,
    controller: Controller,
    ground: FloatArray,
    rig: LoopRig,
    rng: np.random.Generator,
) -> LoopHistories:
    """Run the true rig under a controller.

    Parameters
    ----------
    damper, structure
        True damper and true structure.
    controller
        Controller of the program under test.
    ground
        Ground acceleration on the fine clock, shape (m,) [m/s2].
    rig
        Sampling and sensors; the noise of the sensors acts on the controller.
    rng
        Random generator of this noise.

    Raises
    ------
    UserError
        If the rate of the fine clock is not a multiple of the rate of the controller.
    DivergedError
        If the motion of the rig grows without bound.
    """
    ratio = controller.sample_time_s / rig.step_s
    every = round(ratio)
    if every < 1 or abs(ratio - every) > 1e-6:
        raise UserError(
            "simulate.controller.rate_hz",
            f"{controller.options.rate_hz:g}",
            f"does not divide the fine clock of the table ({1.0 / rig.step_s:g} Hz)",
            "choose a rate that does, or other laboratory.closed_loop.fine_steps",
        )
    plain = [item for item in damper.effects if item.form.code == INERTIA_PLAIN]
    assembled = assemble(structure, rig.step_s, added_mass_kg=sum(item.strength for item in plain))
    codes, values = packed_for(damper, 1.0)
    codes[codes == INERTIA_PLAIN] = INERTIA_GROWTH
    floors = assembled.floors
    ticks = ground.size // every + 1
    noise = rig.acceleration_noise_m_s2 * rng.standard_normal((ticks, 4 + floors))
    noise[:, 0] = rig.displacement_noise_m * rng.standard_normal(ticks)
    # acceleration of the damper: two accelerometers
    noise[:, 1] *= np.sqrt(2.0)
    delay = round(structure.control_delay_s / rig.step_s)
    with np.errstate(all="ignore"):
        displacement, acceleration, loop = kernel.run_structure(
            assembled.A, assembled.B, assembled.Ad, assembled.B0, assembled.B1, assembled.w, assembled.drift_rows,
            floors, ground, rig.step_s, rig.fine_steps, assembled.storey_codes, assembled.storey_values,
            True, damper.base, codes, values, every, delay,
            *controller.arguments, controller.new_state(), noise,
        )  # fmt: skip
    if not np.all(np.isfinite(displacement)) or float(np.abs(displacement).max()) > 10.0:
        raise DivergedError(f"the rig's motion grew without bound under law {controller.law}: check its gains")
    samples = displacement.shape[0]
    return LoopHistories(
        np.arange(samples) / rig.sampling_rate_hz,
        ground[:: rig.fine_steps],
        displacement[:, :floors],
        acceleration,
        loop[:, kernel.FORCE],
        loop[:, kernel.DRIVE],
        loop[:, kernel.DESIRED],
    )


def gains_of(controller: Controller) -> dict[str, float]:
    """Return the gains of a test for campaign.yaml, without gains of 0."""
    return {key: value for key, value in controller.gains.items() if value != 0.0}


def record_closed_loop(
    damper: TrueDamper,
    structure: TrueStructure,
    controllers: Mapping[str, Controller],
    rig: LoopRig,
    rng: np.random.Generator,
    progress: Progress = no_progress,
) -> TableRecord:
    """Record each law twice: a training test, and a validation test at another amplitude.

    Parameters
    ----------
    damper, structure
        True damper and true structure, including undeclared effects.
    controllers
        Law -> controller of the program.
    rig
        Table, sensors, excitation.
    rng
        Generator.
    progress
        Called with the completed share and a text.
    """
    floors = structure.frame.floors
    lasers = tuple(floor for floor in rig.laser_floors if 1 <= floor <= floors)
    scales = {"ground_acceleration": ACCELEROMETER_M_S2_PER_V}
    scales |= {f"floor_acceleration_{floor}": ACCELEROMETER_M_S2_PER_V for floor in range(1, floors + 1)}
    scales |= {f"floor_displacement_{floor}": LASER_M_PER_V for floor in lasers}
    scales |= {"damper_force": LOAD_CELL_N_PER_V, "drive": 1.0, "desired_force": 1.0}
    deviations = np.array([_deviation(rig, name) for name in scales])
    offsets = np.array([_offset(rig, name) for name in scales]) * rng.standard_normal(len(scales))
    tests, reached = [], {}
    orders = [(law, role) for law in controllers for role in ("training", "validation")]
    for number, (law, role) in enumerate(orders):
        factor = 1.0 if role == "training" else rig.validation_factor
        controller = controllers[law]
        true = run_loop(damper, structure, controller, base_motion(rig, factor), rig, rng)
        name = f"{law}-{'a' if role == 'training' else 'b'}"
        tests.append(_test(name, role, controller, true, rig, factor, lasers, scales, deviations, offsets, rng))
        reached[name] = _indices(true, rig)
        progress((number + 1) / len(orders), name)
    channels = {name: (f"ch{index + 1}", _UNITS[_kind(name)]) for index, name in enumerate(scales)}
    truth = {
        "damper": damper.name,
        "parameters": damper.numbers(),
        "effects": [item.described() for item in damper.effects],
        "frame": structure.frame.name,
        "frame_effects": [item.described() for item in structure.effects],
        "indices": reached,
        "offsets": dict(zip(scales, offsets.tolist(), strict=True)),
    }
    return TableRecord(tests, channels, scales, truth)


_UNITS = {"acceleration": "m/s^2", "displacement": "m", "force": "N", "drive": "A"}


def _kind(channel: str) -> str:
    return next(kind for kind in _UNITS if kind in channel)


def _deviation(rig: LoopRig, channel: str) -> float:
    if channel == "desired_force":
        return 0.0
    return {
        "acceleration": rig.acceleration_noise_m_s2,
        "displacement": rig.displacement_noise_m,
        "force": rig.force_noise_n,
        "drive": rig.current_noise_a,
    }[_kind(channel)]


def _offset(rig: LoopRig, channel: str) -> float:
    if channel == "damper_force":
        return rig.force_offset_n
    return rig.acceleration_offset_m_s2 if _kind(channel) == "acceleration" else 0.0


def _test(
    name: str,
    role: str,
    controller: Controller,
    true: LoopHistories,
    rig: LoopRig,
    factor: float,
    lasers: Sequence[int],
    scales: Mapping[str, float],
    deviations: FloatArray,
    offsets: FloatArray,
    rng: np.random.Generator,
) -> TestFile:
    exact = np.column_stack(
        [
            true.ground,
            true.acceleration,
            true.displacement[:, [floor - 1 for floor in lasers]],
            true.force,
            true.drive,
            true.desired,
        ]
    )
    seen = exact + offsets + deviations * rng.standard_normal(exact.shape)
    columns = {f"ch{index + 1}": seen[:, index] / scale for index, scale in enumerate(scales.values())}
    period = 2.0 * np.pi / rig.frequency_rad_s
    stop = rig.rest_s + float(np.floor(rig.shaking_s / period) * period)
    about = {
        "base_amplitude_m_s2": factor * rig.base_amplitude_m_s2,
        "frequency_rad_s": rig.frequency_rad_s,
        "steady_s": [round(stop - 15.0 * period, 4), round(stop, 4)],
        "decay_from_s": round(stop, 4),
        "controller_rate_hz": controller.options.rate_hz,
    }
    if controller.options.low_pass_hz is not None:
        about["command_filter_hz"] = controller.options.low_pass_hz
    details: dict[str, Any] = {"kind": "closed-loop", "law": controller.law, "about": about}
    gains = gains_of(controller)
    if gains:
        details["gains"] = gains
    return TestFile(name, role, columns, details)


def _indices(true: LoopHistories, rig: LoopRig) -> dict[str, float]:
    """Return the true rms values over the last fifteen cycles of the harmonic motion."""
    period = 2.0 * np.pi / rig.frequency_rad_s
    stop = rig.rest_s + float(np.floor(rig.shaking_s / period) * period)
    steady = (true.time_s >= stop - 15.0 * period) & (true.time_s < stop)

    def rms(values: FloatArray) -> float:
        return float(np.sqrt(np.mean(values[steady] ** 2)))

    return {
        "rms_x1_m": rms(true.displacement[:, 0]),
        "rms_x_top_m": rms(true.displacement[:, -1]),
        "rms_a1_m_s2": rms(true.acceleration[:, 0] - true.ground),
        "rms_a_top_m_s2": rms(true.acceleration[:, -1] - true.ground),
        "peak_force_n": float(np.abs(true.force[steady]).max()),
    }
