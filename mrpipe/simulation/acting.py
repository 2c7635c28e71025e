"""Excitation of a structure from the settings: one excitation, and further ones at the same time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.simulation import excitation as kinds
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.ground_record import HORIZONTAL, read_histories
from mrpipe.simulation.inputs import acting_as_forces, in_two_directions
from mrpipe.simulation.settings import ExcitationSettings, SingleExcitationSettings
from mrpipe.structures import Frame

SWEEP = (0.4, 2.4)
"""Default first and last frequency of a sweep, relative to the natural frequency without damper force."""

ADJUSTED = ("harmonic", "sweep", "random")
"""Kinds of motion whose amplitude is computed if the settings do not give it."""


def acting_together(settings: ExcitationSettings, frame: Frame, free_rad_s: float, amplitude: float) -> Excitation:
    """Return the sum of all excitations that act on a structure at the same time.

    Parameters
    ----------
    settings
        The excitation, and further ones in `also`.
    frame, free_rad_s
        Structure and free frequency of the target mode [rad/s].
    amplitude
        Amplitude of the excitation, as in :func:`excitation_at`; those of `also` have separate ones.

    Raises
    ------
    UserError
        If a record cannot be read, a place does not exist, or an amplitude is not given.
    """
    first = acting(excitation_at(settings, free_rad_s, amplitude), settings, frame)
    others = [
        _further(item, frame, free_rad_s, f"simulate.excitation.also[{n}]") for n, item in enumerate(settings.also)
    ]
    return superposed(first, others) if others else first


def _further(settings: SingleExcitationSettings, frame: Frame, free_rad_s: float, where: str) -> Excitation:
    if settings.kind == "free-decay":
        raise UserError(
            where, "kind", "is free-decay, which is an initial state", "give it in simulate.excitation.kind"
        )
    if settings.direction_deg:
        raise UserError(
            where, "direction_deg", "is given", "give simulate.excitation.direction_deg, which turns all motion"
        )
    amplitude = known_amplitude(settings, where)
    if amplitude is None and settings.kind in ADJUSTED:
        raise UserError(where, "base_amplitude_m_s2", "is not given", "give the amplitude of the motion [m/s^2]")
    return acting(excitation_at(settings, free_rad_s, amplitude or 0.0, where), settings, frame, where)


def superposed(first: Excitation, others: Sequence[Excitation]) -> Excitation:
    """Return excitations that act at the same time; their inputs are added, because the structure is linear in them.

    Parameters
    ----------
    first
        Excitation that gives the duration, the steady part and the details of the run.
    others
        Further excitations; each is zero after its end.
    """
    everything = (first, *others)

    def columns(item: Excitation, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        values = np.asarray(item.at(times), dtype=np.float64).reshape(len(times), -1)
        values = values * (times <= item.duration_s)[:, None]
        ground = values[:, 0] if item.shakes_ground else np.zeros(len(times))
        return ground, values[:, 1:] if item.shakes_ground else values

    def at(times: FloatArray) -> FloatArray:
        found = [columns(item, np.asarray(times)) for item in everything]
        return np.column_stack([np.sum([ground for ground, _ in found], axis=0), *(places for _, places in found)])

    places = tuple(place for item in everything for place in item.places)
    details = {**first.details, "also": [item.details for item in others]}
    # without places the inputs are a single history, as everywhere
    single = (lambda times: at(times)[:, 0]) if not places else at
    # with further excitations the motion is still driven after a harmonic stops
    return replace(first, at=single, places=places, shakes_ground=True, details=details, decay_from_s=math.nan)


def known_amplitude(settings: SingleExcitationSettings, where: str = "simulate.excitation") -> float | None:
    """Return the amplitude of motion [m/s^2] or force [N] in the settings; None if it has to be computed.

    Raises
    ------
    UserError
        If the amplitude of a force is not given, because only that of a base acceleration can be found, or if the
        amplitude given is that of the other kind of excitation.
    """
    if not settings.force_at:
        if settings.force_amplitude_n is not None:
            raise UserError(
                where,
                "force_amplitude_n",
                "is given, but no degree of freedom on which the force acts",
                f"name it in {where}.force_at",
            )
        return settings.base_amplitude_m_s2
    if settings.base_amplitude_m_s2 is not None:
        raise UserError(
            where,
            "base_amplitude_m_s2",
            f"is given, but {where}.force_at puts a force in the place of motion of the ground",
            "give force_amplitude_n [N], or give motion and force as two excitations (simulate.excitation.also)",
        )
    if settings.force_amplitude_n is None and settings.kind in ADJUSTED:
        raise UserError(where, "force_amplitude_n", "is not given", "give the amplitude of the force [N]")
    return settings.force_amplitude_n


def acting(
    excitation: Excitation, settings: SingleExcitationSettings, frame: Frame, where: str = "simulate.excitation"
) -> Excitation:
    """Return the excitation with the places where its histories act.

    Raises
    ------
    UserError
        If a place does not exist, or the structure has no second direction.
    """
    if settings.direction_deg:
        # readers of the response need the direction, because first floor and top are those that move along it
        details = {**excitation.details, "direction_deg": settings.direction_deg}
        excitation = replace(excitation, details=details)
    if settings.kind == "free-decay":
        return excitation
    if settings.force_at:
        return acting_as_forces(excitation, frame, settings.force_at, f"{where}.force_at")
    histories = int(excitation.at(np.zeros(1))[0].size)
    if histories == 1:
        return excitation
    if histories != HORIZONTAL:
        raise UserError(
            settings.file,
            "",
            f"holds {histories} histories",
            f"name one or two of them in {where}.file_channels",
        )
    return in_two_directions(excitation, frame, settings.file)


def excitation_at(
    settings: SingleExcitationSettings,
    free_rad_s: float,
    amplitude_m_s2: float,
    where: str = "simulate.excitation",
) -> Excitation:
    """Return the excitation for a known amplitude of harmonic motion or sweep.

    Parameters
    ----------
    settings
        Settings of the excitation.
    free_rad_s
        Free frequency of the target mode.
    amplitude_m_s2
        Amplitude of the base acceleration, before `settings.factor`; not used by other kinds of motion.
    where
        Setting that describes it, for messages.

    Raises
    ------
    UserError
        If a recorded motion cannot be read.
    """
    factor = settings.factor
    if settings.kind == "recorded":
        return kinds.recorded(*_record(settings, where), scale=factor)
    if settings.kind == "free-decay":
        return kinds.at_rest(settings.decay_s)
    if settings.kind == "sweep":
        first = settings.sweep_first_hz or SWEEP[0] * free_rad_s / (2.0 * np.pi)
        last = settings.sweep_last_hz or SWEEP[1] * free_rad_s / (2.0 * np.pi)
        return kinds.sweep(factor * amplitude_m_s2, first, last, settings.sweep_s)
    if settings.kind == "random":
        omega = settings.frequency_rad_s or free_rad_s
        period = 2.0 * np.pi / omega
        return kinds.narrow_band(
            factor * amplitude_m_s2 / math.sqrt(2.0),
            omega,
            settings.random_bandwidth,
            np.random.default_rng(settings.random_seed),
            duration_s=settings.random_s,
            settling_s=min(settings.settling_cycles * period, 0.5 * settings.random_s),
            ramp_s=settings.ramp_cycles * period,
        )
    return harmonic_excitation(settings, free_rad_s, factor * amplitude_m_s2)


def _record(settings: SingleExcitationSettings, where: str) -> tuple[FloatArray, FloatArray]:
    """Return time [s] and histories, shape (m,) for one history and (m, k) for several."""
    quantity = "force" if settings.force_at else "acceleration"
    time_s, histories = read_histories(
        Path(settings.file),
        settings.file_unit,
        channels=settings.file_channels,
        quantity=quantity,
        file_setting=f"{where}.file",
        unit_setting=f"{where}.file_unit",
        channels_setting=f"{where}.file_channels",
    )
    if settings.file_y:
        second = f"{where}.file_y"
        other_s, other = read_histories(Path(settings.file_y), settings.file_unit, file_setting=second)
        # on the clock of the first record; a record that ends earlier is zero after its end
        second_history = np.interp(time_s, other_s - other_s[0] + time_s[0], other[:, 0], right=0.0)
        histories = np.column_stack([histories[:, 0], second_history])
    return time_s, histories[:, 0] if histories.shape[1] == 1 else histories


def harmonic_excitation(settings: SingleExcitationSettings, free_rad_s: float, amplitude_m_s2: float) -> Excitation:
    """Return harmonic base motion of this amplitude; arguments as in :func:`excitation_at`."""
    return kinds.harmonic(
        amplitude_m_s2,
        settings.frequency_rad_s or free_rad_s,
        cycles=settings.cycles,
        settling_cycles=min(settings.settling_cycles, settings.cycles - 1),
        ramp_cycles=settings.ramp_cycles,
        decay_s=settings.decay_s,
    )
