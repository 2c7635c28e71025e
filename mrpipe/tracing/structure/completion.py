"""Motion of floors without a sensor, from the sensors of the other floors and the identified frame.

The tracing needs the motion of every floor. Once mass, damping and stiffness are identified, there are more equations
of motion than unknown motions, so that these follow by least squares at each frequency. The equations of the floors
without a sensor alone would also determine them (dynamic condensation; its limit at frequency zero is that of Guyan,
AIAA Journal 3, 380, 1965). They would however amplify the noise of the neighbouring floors at frequencies at which such
a floor resonates between them. Damping and stiffness have one common factor for each test, the one with the smallest
error of the equations, because a structure that loosens between tests must not be completed with its mean stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.campaigns.model import Campaign, Recording
from mrpipe.errors import UserError
from mrpipe.structures import Frame, natural_modes
from mrpipe.tracing.structure.records import COMPUTED, floor_of_force, without_sensor

_GROUND, _FORCE = "ground_acceleration", "input_force"
_ACCELERATION, _DISPLACEMENT = "floor_acceleration_", "floor_displacement_"

SOFTEST, STIFFEST = 0.6, 1.5
"""Numerical technique: limits of the factor of a test."""
LOWEST, HIGHEST = 0.3, 1.2
"""Numerical technique: band in which the factor is fitted, in multiples of the first and the last frequency."""


@dataclass(frozen=True)
class _Spectra:
    """Accelerations relative to the ground of the floors with sensors, ground and forces, in the frequency domain."""

    omega: FloatArray  # (f,)
    floors: NDArray[np.complex128]  # (f, s)
    ground: NDArray[np.complex128]  # (f,)
    forces: NDArray[np.complex128]  # (f, n)


def completed(campaign: Campaign, progress: Progress = no_progress) -> tuple[Campaign, list[str]]:
    """Return a campaign with the acceleration of every floor, and messages on the changes, one line each.

    Forced tests are completed. Free decays are not, because their motion before the release is not recorded, and
    tests with a damper are not.

    Parameters
    ----------
    campaign
        Campaign of a shear frame that moves in one direction; returned unchanged if all floors have a sensor or masses
        are not given.
    progress
        Progress callback for the identification of the frame.

    Raises
    ------
    UserError
        If no test records every floor, and the sensors do not determine the stiffness of the frame.
    """
    floors = len(campaign.floor_masses_kg)
    lacking = {item.name: without_sensor(item, floors) for item in campaign.recordings if _is_forced(item)}
    missing = sorted({floor for places in lacking.values() for floor in places if len(places) < floors})
    if not missing or not np.all(np.isfinite(np.asarray(campaign.floor_masses_kg, dtype=np.float64))):
        return campaign, []
    try:
        frame = _identified(campaign, missing, progress)
    except UserError:
        if all(lacking.values()):
            raise
        # tests that record all floors are sufficient; the others are left out
        return campaign, []
    tests, changes = [], []
    for item in campaign.recordings:
        places = lacking.get(item.name, [])
        if not 0 < len(places) < floors:
            tests.append(item)
            continue
        found, factor = _completed_test(item, frame, places)
        tests.append(found)
        changes.append(f"{item.name} {factor:.3f}")
    listed = ", ".join(map(str, missing))
    line = (
        f"floors without a sensor ({listed}): their motion is computed from the other floors and the identified frame "
        f"(factors on its stiffness: {', '.join(changes)}); an effect in the storey above or below them may be missed"
    )
    return replace(campaign, recordings=tuple(tests)), [line]


def _is_forced(test: Recording) -> bool:
    excited = _GROUND in test.channels or _FORCE in test.channels
    return excited and test.kind != "free-decay" and not {"damper_force", "drive"} & set(test.channels)


def _identified(campaign: Campaign, missing: Sequence[int], progress: Progress) -> Frame:
    from mrpipe.modal.identify import identify_frame
    from mrpipe.modal.options import IdentificationOptions
    from mrpipe.modal.recordings import frame_tests

    # one direction of a structure: its channels have no suffix, so that positions and inertias of plates do not apply
    declared = dict(campaign.declared)
    if "frame" in declared:
        plate = ("sensor_positions_m", "floor_inertias_kg_m2")
        declared["frame"] = {key: value for key, value in declared["frame"].items() if key not in plate}
    campaign = replace(campaign, declared=declared)
    result = identify_frame(frame_tests(campaign), IdentificationOptions(), progress)
    frame = result.frame
    # the motion of floors without a sensor cannot be computed from a frame that reproduces no test
    reproduced = any(np.median(item.fit_percent) > 0.0 for item in result.in_time)
    if frame is None or not np.all(np.isfinite(frame.stiffness)) or not reproduced:
        listed = ", ".join(map(str, missing))
        problem = f"floors without a sensor ({listed}), and the others do not determine the stiffness of the frame"
        raise UserError(campaign.file, "channels", problem, "record more floors or modes")
    return frame


def _completed_test(test: Recording, frame: Frame, places: Sequence[int]) -> tuple[Recording, float]:
    """Return a test with the absolute acceleration of all floors, and its factor on damping and stiffness."""
    hidden = np.array(places) - 1
    seen = np.setdiff1d(np.arange(frame.floors), hidden)
    size = test.time_s.size
    spectra = _spectra(test, frame, seen)
    factor = _factor(frame, spectra, seen, hidden)
    motion = np.fft.irfft(_hidden_motion(frame, spectra, seen, hidden, factor), axis=0)[:size]
    ground = _centred(test, _GROUND)
    channels = dict(test.channels)
    for place, history in zip(places, motion.T, strict=True):
        channels[f"{_ACCELERATION}{place}"] = history + ground
    # the motion before and after the record is not known, so that its ends are left out
    slowest_hz = float(natural_modes(frame).angular_frequencies[0]) / (2.0 * np.pi)
    end = round(test.sampling_rate_hz / slowest_hz)
    segments = tuple((max(a, end), min(b, size - end)) for a, b in test.segments or ((0, size),))
    kept = tuple((a, b) for a, b in segments if b > a)
    details = {**test.details, COMPUTED: tuple(places)}
    return replace(test, channels=channels, segments=kept or test.segments, details=details), factor


def _centred(test: Recording, name: str) -> FloatArray:
    values = test.channels.get(name)
    return np.zeros(test.time_s.size) if values is None else np.asarray(values - np.mean(values))


def _spectra(test: Recording, frame: Frame, seen: NDArray[np.intp]) -> _Spectra:
    size, dt = test.time_s.size, 1.0 / test.sampling_rate_hz
    length = 2 * size  # zeros are appended, so that the end of the record does not act on its beginning
    ground = _centred(test, _GROUND)
    columns = []
    for index in seen:
        name = f"{_ACCELERATION}{index + 1}"
        if name in test.channels:
            columns.append(_centred(test, name) - ground)
        else:
            shift = _centred(test, f"{_DISPLACEMENT}{index + 1}")
            columns.append(np.gradient(np.gradient(shift, dt), dt))
    forces = np.zeros((size, frame.floors))
    if _FORCE in test.channels:
        forces[:, floor_of_force(test) - 1] = _centred(test, _FORCE)
    omega = np.asarray(2.0 * np.pi * np.fft.rfftfreq(length, dt), dtype=np.float64)
    return _Spectra(
        omega,
        np.fft.rfft(np.column_stack(columns), length, axis=0),
        np.fft.rfft(ground, length),
        np.fft.rfft(forces, length, axis=0),
    )


def _stiffness(frame: Frame, omega: FloatArray, factor: float) -> NDArray[np.complex128]:
    """Return the dynamic stiffness of the frame, shape (f, n, n)."""
    restoring = frame.stiffness + 1j * omega[:, None, None] * frame.damping
    return np.asarray(factor * restoring - omega[:, None, None] ** 2 * frame.mass)


def _load(frame: Frame, spectra: _Spectra) -> NDArray[np.complex128]:
    """Return the load of ground motion and forces, times minus the squared frequency, shape (f, n)."""
    inertia = frame.mass @ frame.ground_influence
    return np.asarray(spectra.omega[:, None] ** 2 * (spectra.ground[:, None] * inertia - spectra.forces))


def _hidden_motion(
    frame: Frame, spectra: _Spectra, seen: NDArray[np.intp], hidden: NDArray[np.intp], factor: float
) -> NDArray[np.complex128]:
    """Return the relative acceleration of the floors without a sensor, shape (f, h): least squares of all equations."""
    dynamic, load = _stiffness(frame, spectra.omega, factor), _load(frame, spectra)
    right = load - np.einsum("fns,fs->fn", dynamic[:, :, seen], spectra.floors)
    columns = dynamic[:, :, hidden]
    adjoint = columns.conj().swapaxes(1, 2)
    return np.asarray(np.linalg.solve(adjoint @ columns, adjoint @ right[..., None])[..., 0])


def _factor(frame: Frame, spectra: _Spectra, seen: NDArray[np.intp], hidden: NDArray[np.intp]) -> float:
    """Return the factor on damping and stiffness with the smallest squared error of the equations of motion."""
    omega = natural_modes(frame).angular_frequencies
    used = (spectra.omega > LOWEST * omega[0]) & (spectra.omega < HIGHEST * omega[-1])
    band = _Spectra(spectra.omega[used], spectra.floors[used], spectra.ground[used], spectra.forces[used])
    load = _load(frame, band)

    def lacking(factor: float) -> float:
        dynamic = _stiffness(frame, band.omega, factor)
        motion = np.zeros((band.omega.size, frame.floors), dtype=np.complex128)
        motion[:, seen] = band.floors
        motion[:, hidden] = _hidden_motion(frame, band, seen, hidden, factor)
        force = (np.einsum("fij,fj->fi", dynamic, motion) - load) / band.omega[:, None] ** 2
        return float(np.sum(np.abs(force) ** 2))

    return float(minimize_scalar(lacking, bounds=(SOFTEST, STIFFEST), method="bounded", options={"xatol": 1e-5}).x)
