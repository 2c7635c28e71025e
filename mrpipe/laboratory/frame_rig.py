"""Frame on its shaking table: sweeps, a free decay of each mode, random motion; sensors in volts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns import TestFile
from mrpipe.control.laws.passive_off import no_drive
from mrpipe.errors import UserError
from mrpipe.laboratory.damper import solve_strength
from mrpipe.laboratory.effects import Planted
from mrpipe.laboratory.kernel import PARAMETERS
from mrpipe.laboratory.motion import smooth_start
from mrpipe.laboratory.options import FrameRig
from mrpipe.laboratory.structure import BRACE, CONTROLLER_DELAY, Assembled, TrueStructure, assemble
from mrpipe.laboratory.structure_kernel import run_structure
from mrpipe.structures import natural_modes

ACCELEROMETER_M_S2_PER_V = 9.81
LASER_M_PER_V = 0.0109
LOAD_CELL_N_PER_V = 50.0
"""Conversion factors of Table 3.2."""
_CALIBRATION_S = 40.0


@dataclass(frozen=True)
class FrameTestOrder:
    """Test of the frame: ground acceleration on the fine clock, shape (m,)."""

    name: str
    role: str
    kind: str
    ground: FloatArray
    mode: int = 0


@dataclass(frozen=True)
class TableRecord:
    """Recorded campaign of the shaking table and its truth, before they are written."""

    tests: list[TestFile]
    channels: dict[str, tuple[str, str]]
    scales: dict[str, float]
    truth: dict[str, Any]


def shake(assembled: Assembled, ground: FloatArray, rig: FrameRig) -> tuple[FloatArray, FloatArray]:
    """Return displacements relative to the ground and absolute accelerations, shape (samples, floors)."""
    nothing = np.zeros(0)
    displacement, acceleration, _ = run_structure(
        assembled.A, assembled.B, assembled.Ad, assembled.B0, assembled.B1, assembled.w, assembled.drift_rows,
        assembled.floors, ground, rig.step_s, rig.fine_steps, assembled.storey_codes, assembled.storey_values,
        False, np.zeros(11), np.zeros(0, dtype=np.int64), np.zeros((0, PARAMETERS)), 0, 0,
        no_drive, nothing, np.zeros(1, dtype=np.int64), nothing, np.zeros((0, 4)),
    )  # fmt: skip
    return displacement[:, : assembled.floors], acceleration


def sweep_ground(rig: FrameRig, low_hz: float, high_hz: float, first_hz: float) -> FloatArray:
    """Return the ground acceleration of a logarithmic sweep with its tail of rest (a fifth), shape (m,)."""
    time = np.arange(round(rig.sweep_s / rig.step_s), dtype=np.float64) * rig.step_s
    active = 0.8 * rig.sweep_s
    rate = np.log(high_hz / low_hz) / active
    inside = np.minimum(time, active)
    angle = 2.0 * np.pi * low_hz * (np.exp(rate * inside) - 1.0) / rate
    frequency = low_hz * np.exp(rate * inside)
    amplitude = rig.sweep_acceleration_m_s2 * np.sqrt(frequency / first_hz)
    window = smooth_start(time, 4.0) * smooth_start(active - time, 2.0)
    return np.asarray(amplitude * np.sin(angle) * window)


def random_ground(rig: FrameRig, low_hz: float, high_hz: float, rng: np.random.Generator) -> FloatArray:
    """Return band-limited random ground acceleration with a tail of rest, shape (m,)."""
    count = round(rig.random_s / rig.step_s)
    white = rng.standard_normal(count)
    shape = signal.butter(4, [low_hz, high_hz], "bandpass", fs=1.0 / rig.step_s, output="sos")
    motion = signal.sosfilt(shape, white)
    motion *= rig.random_acceleration_m_s2 / np.sqrt(np.mean(motion**2))
    time = np.arange(count, dtype=np.float64) * rig.step_s
    return np.asarray(motion * smooth_start(time, 3.0) * smooth_start(0.85 * rig.random_s - time, 2.0))


def decay_ground(rig: FrameRig, structure: TrueStructure, mode: int, rng: np.random.Generator) -> FloatArray:
    """Return ground acceleration at the resonance of a mode (from 1), then rest for its decay, shape (m,).

    The amplitude is such that the largest floor acceleration is `decay_acceleration_m_s2`. The frequency deviates from
    the resonance by about a thousandth, as with manual tuning.
    """
    frame = structure.frame
    modes = natural_modes(frame)
    omega = float(modes.angular_frequencies[mode - 1])
    shape = modes.mode_shapes[:, mode - 1]
    ratio = float(shape @ frame.damping @ shape) / (2.0 * omega)
    push = abs(float(shape @ frame.mass @ np.ones(frame.floors)))
    build = float(np.clip(1.5 / (ratio * omega), 12.0, 60.0))
    rest = float(np.clip(4.0 / (ratio * omega), 30.0, 150.0))
    grown = 1.0 - np.exp(-ratio * omega * build)
    amplitude = rig.decay_acceleration_m_s2 * 2.0 * ratio / (push * float(np.abs(shape).max()) * grown)
    time = np.arange(round((build + rest) / rig.step_s), dtype=np.float64) * rig.step_s
    tuned = omega * (1.0 + 0.001 * rng.standard_normal() * min(1.0, ratio / 0.001))
    period = 2.0 * np.pi / omega
    window = smooth_start(time, 3.0 * period) * smooth_start(build - time, period)
    return np.asarray(amplitude * np.sin(tuned * time) * window)


def frame_tests(structure: TrueStructure, rig: FrameRig, rng: np.random.Generator) -> list[FrameTestOrder]:
    """Return the tests of a frame campaign: sweeps, decays, random motion."""
    frequencies = natural_modes(structure.frame).frequencies_hz
    low, high = 0.4 * float(frequencies[0]), 1.3 * float(frequencies[-1])
    orders = []
    for number in range(rig.sweeps):
        down = number % 2 == 1
        begin, end = (high, low) if down else (low, high)
        name = f"sweep-{number + 1}"
        ground = sweep_ground(rig, begin, end, float(frequencies[0]))
        orders.append(FrameTestOrder(name, "training" if number == 0 else "validation", "sweep", ground))
    for mode in range(1, structure.frame.floors + 1):
        ground = decay_ground(rig, structure, mode, rng)
        orders.append(FrameTestOrder(f"decay-{mode}", "training", "free-decay", ground, mode))
    if rig.random_s > 0.0:
        ground = random_ground(rig, low, high, rng)
        orders.append(FrameTestOrder("random-1", "validation", "random", ground))
    return orders


def _support_mode(ground: FloatArray, rig: FrameRig, omega: float) -> FloatArray:
    """Return the acceleration of the flexible support's mode at the recorder's clock, shape (samples,)."""
    numerator, denominator = [-1.0, 0.0, 0.0], [1.0, 2.0 * 0.01 * omega, omega**2]
    b, a, _ = signal.cont2discrete((numerator, denominator), rig.step_s, method="foh")
    return np.asarray(signal.lfilter(np.ravel(b), a, ground))[:: rig.fine_steps]


def record_frame(
    structure: TrueStructure, rig: FrameRig, rng: np.random.Generator, progress: Progress = no_progress
) -> TableRecord:
    """Record a frame campaign (chapter 3): absolute accelerometers of ground and floors, lasers on some floors.

    Parameters
    ----------
    structure
        The true frame; any number of floors.
    rig
        Table, sensors and tests.
    rng
        Generator of offsets, noise and random motion.
    progress
        Called with the completed share and a text.
    """
    assembled = assemble(structure, rig.step_s)
    n = structure.frame.floors
    lasers = tuple(floor for floor in rig.laser_floors if 1 <= floor <= n)
    quantities = ["ground_acceleration", *(f"floor_acceleration_{floor}" for floor in range(1, n + 1))]
    quantities += [f"floor_displacement_{floor}" for floor in lasers]
    units = [ACCELEROMETER_M_S2_PER_V] * (n + 1) + [LASER_M_PER_V] * len(lasers)
    noise_si = np.array([rig.acceleration_noise_m_s2] * (n + 1) + [rig.displacement_noise_m] * len(lasers))
    drift_si = np.array([rig.acceleration_offset_m_s2] * (n + 1) + [rig.displacement_offset_m] * len(lasers))
    offsets = drift_si * rng.standard_normal(len(quantities))
    errors = 1.0 + rig.sensitivity_error * rng.standard_normal(len(quantities))
    orders = frame_tests(structure, rig, rng)
    modes = natural_modes(structure.frame)
    support = 1.7 * float(modes.angular_frequencies[-1])
    bend = np.sin(np.pi * np.arange(1, n + 1) / (n + 1.0))
    tests = []
    for number, order in enumerate(orders):
        displacement, acceleration = shake(assembled, order.ground, rig)
        if rig.support_share > 0.0:
            own = rig.support_share * _support_mode(order.ground, rig, support)
            acceleration = acceleration + own[:, None] * bend
        exact = np.column_stack(
            [
                order.ground[:: rig.fine_steps],
                acceleration,
                displacement[:, [floor - 1 for floor in lasers]],
            ]
        )
        seen = exact * errors + offsets + noise_si * rng.standard_normal(exact.shape)
        columns = {f"ch{index + 1}": seen[:, index] / units[index] for index in range(len(quantities))}
        details: dict[str, Any] = {"kind": order.kind}
        if order.mode:
            details |= {"mode": order.mode, "frequency_hz": float(modes.frequencies_hz[order.mode - 1].round(2))}
        tests.append(TestFile(order.name, order.role, columns, details))
        progress((number + 1) / len(orders), order.name)
    channels = {
        name: (f"ch{index + 1}", "m" if "displacement" in name else "m/s^2") for index, name in enumerate(quantities)
    }
    truth = {
        "frame": structure.frame.name,
        "frequencies_hz": modes.frequencies_hz.tolist(),
        "mass_kg": structure.frame.mass.tolist(),
        "damping_n_s_m": structure.frame.damping.tolist(),
        "stiffness_n_m": structure.frame.stiffness.tolist(),
        "effects": [item.described() for item in structure.effects],
        "support_frequency_hz": support / (2.0 * np.pi) if rig.support_share > 0.0 else None,
        "offsets": dict(zip(quantities, offsets.tolist(), strict=True)),
        "sensitivity": dict(zip(quantities, errors.tolist(), strict=True)),
    }
    return TableRecord(tests, channels, dict(zip(quantities, units, strict=True)), truth)


def calibrated_structure(structure: TrueStructure, rig: FrameRig) -> TrueStructure:
    """Return the structure with the strengths of all effects that are given as shares, computed one after the other.

    The share is the ratio of the RMS of the change of all floor accelerations to their RMS, in a short sweep up to the
    third mode.

    Raises
    ------
    UserError
        If no strength gives the share, or the effect can be observed with a damper only.
    """
    frequencies = natural_modes(structure.frame).frequencies_hz
    short = rig.changed(sweep_s=_CALIBRATION_S)
    top = float(frequencies[min(2, len(frequencies) - 1)])
    ground = sweep_ground(short, 0.4 * float(frequencies[0]), 1.2 * top, float(frequencies[0]))

    def response(effects: Sequence[Planted]) -> FloatArray:
        return shake(assemble(structure.with_effects(effects), rig.step_s), ground, short)[1]

    effects = list(structure.effects)
    for index, effect in enumerate(effects):
        wanted = effect.strength_share
        if wanted is None:
            continue
        where = f"effect {effect.name} ({effect.form.form})"
        if effect.form.code in (BRACE, CONTROLLER_DELAY):
            raise UserError(where, "strength_share", "shows with a damper only", "give its parameters instead")
        plain = response(effects[:index] + effects[index + 1 :])
        scale = float(np.sqrt(np.mean(plain**2)))

        def share_of(strength: float, index: int = index, plain: FloatArray = plain, scale: float = scale) -> float:
            changed = response([*effects[:index], effects[index].with_strength(strength), *effects[index + 1 :]])
            return float(np.sqrt(np.mean((changed - plain) ** 2))) / scale

        strength = solve_strength(share_of, wanted, effect.strength, effect.form.strongest, 0.02)
        if strength is None:
            raise UserError(where, "strength_share", f"{wanted:g} cannot be reached", "choose a smaller share")
        effects[index] = effect.with_strength(strength)
    return structure.with_effects(effects)


def floor_masses(structure: TrueStructure) -> Sequence[float]:
    """Return the masses that campaign.yaml contains, because they were weighed [kg]."""
    return [float(mass) for mass in np.diag(structure.frame.mass)]
