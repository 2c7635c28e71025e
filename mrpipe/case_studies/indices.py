"""The indices J of the benchmark problems, from plain arrays (P4 (23), appendices B and D of the thesis)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray


def root_mean_square(signal: FloatArray) -> FloatArray:
    """Return the RMS over time of each column, shape (columns,)."""
    return np.asarray(np.sqrt(np.mean(np.square(signal), axis=0)))


def largest(signal: FloatArray) -> float:
    """Return the largest magnitude of all columns and times."""
    return float(np.abs(signal).max())


@dataclass(frozen=True)
class FloorResponse:
    """Histories of the floors.

    Attributes
    ----------
    displacement, acceleration
        Shape (n, floors) [m], [m/s^2].
    """

    displacement: FloatArray
    acceleration: FloatArray


def ten_storey_indices(controlled: FloorResponse, uncontrolled: FloorResponse) -> dict[str, float]:
    """Return J1 to J4 of P4 (23): largest and largest RMS displacement and acceleration over all floors."""
    x, a = controlled.displacement, controlled.acceleration
    xu, au = uncontrolled.displacement, uncontrolled.acceleration
    return {
        "J1": largest(x) / largest(xu),
        "J2": largest(a) / largest(au),
        "J3": float(root_mean_square(x).max() / root_mean_square(xu).max()),
        "J4": float(root_mean_square(a).max() / root_mean_square(au).max()),
    }


@dataclass(frozen=True)
class IsolatedResponse:
    """Histories of the base-isolated building, x and y in the last axis.

    Attributes
    ----------
    time_s
        Shape (n,).
    base_shear_n, storey_shear_n
        Shear between ground and base (bearings and devices), and above the base; shape (n, 2).
    base_displacement_m
        Displacement of the points where it is judged (corners and centre), shape (n, points, 2).
    drift
        Storey drifts, shape (n, storeys, 2) [m].
    floor_acceleration_m_s2
        Absolute, floors 1 to 8, shape (n, floors, 2).
    device_force_n, device_velocity_m_s
        Shape (n, 2).
    device_work_j
        All devices together, at the end.
    ground_velocity_m_s
        Shape (n, 2).
    """

    time_s: FloatArray
    base_shear_n: FloatArray
    storey_shear_n: FloatArray
    base_displacement_m: FloatArray
    drift: FloatArray
    floor_acceleration_m_s2: FloatArray
    device_force_n: FloatArray
    device_velocity_m_s: FloatArray
    device_work_j: float
    ground_velocity_m_s: FloatArray

    @property
    def input_energy_j(self) -> float:
        """Work of the base shear on the moving ground, the denominator of J9 [J]."""
        power = -np.sum(self.base_shear_n * self.ground_velocity_m_s, axis=1)
        return float(np.trapezoid(power, self.time_s))


def peak_magnitude(vectors: FloatArray) -> float:
    """Return the largest length of two-component vectors, shape (..., 2)."""
    return float(np.sqrt(np.max(np.sum(np.square(vectors), axis=-1))))


def _rms_magnitude(vectors: FloatArray) -> float:
    """Return the largest over points of sqrt(rms_x^2 + rms_y^2), shape (n, points, 2)."""
    return float(np.sqrt(np.max(np.sum(np.mean(np.square(vectors), axis=0), axis=-1))))


def base_isolated_indices(controlled: IsolatedResponse, uncontrolled: IsolatedResponse) -> dict[str, float]:
    """Return J1 to J9 of appendix B.

    J6 is the peak of the devices' joint force over the peak base shear of the controlled building; J9 the energy that
    the devices take over the energy that the ground puts in (absolute), at most 1 by the energy balance.
    """
    c, u = controlled, uncontrolled
    return {
        "J1": peak_magnitude(c.base_shear_n) / peak_magnitude(u.base_shear_n),
        "J2": peak_magnitude(c.storey_shear_n) / peak_magnitude(u.storey_shear_n),
        "J3": peak_magnitude(c.base_displacement_m) / peak_magnitude(u.base_displacement_m),
        "J4": peak_magnitude(c.drift) / peak_magnitude(u.drift),
        "J5": peak_magnitude(c.floor_acceleration_m_s2) / peak_magnitude(u.floor_acceleration_m_s2),
        "J6": peak_magnitude(c.device_force_n) / peak_magnitude(c.base_shear_n),
        "J7": _rms_magnitude(c.base_displacement_m) / _rms_magnitude(u.base_displacement_m),
        "J8": _rms_magnitude(c.floor_acceleration_m_s2) / _rms_magnitude(u.floor_acceleration_m_s2),
        "J9": c.device_work_j / c.input_energy_j,
    }


ACCELERATION_FLOORS = (1, 30, 50, 55, 60, 65, 70, 75)
"""Floors whose acceleration is judged (appendix D)."""
UPPER_FLOORS = (50, 55, 60, 65, 70, 75)
"""Floors of the averages J2 and J8; with 76 those of J4 and J10."""
WIND_FLOORS = (1, 30, 50, 55, 60, 65, 70, 75, 76)
"""Floors whose motion is kept."""


@dataclass(frozen=True)
class WindResponse:
    """Histories of the tall building at :data:`WIND_FLOORS`.

    Attributes
    ----------
    displacement_m, acceleration_m_s2
        Shape (n, 9).
    stroke_m, device_velocity_m_s, device_force_n
        Stroke, velocity and force of the device, shape (n,).
    """

    displacement_m: FloatArray
    acceleration_m_s2: FloatArray
    stroke_m: FloatArray
    device_velocity_m_s: FloatArray
    device_force_n: FloatArray


def wind_indices(controlled: WindResponse, uncontrolled: WindResponse) -> dict[str, float]:
    """Return J1 to J12 of appendix D; J6 [kN m/s] and J12 [kN m/s] are powers, all others ratios."""
    c, u = controlled, uncontrolled
    column = {floor: index for index, floor in enumerate(WIND_FLOORS)}
    occupied = [column[floor] for floor in ACCELERATION_FLOORS]
    upper = [column[floor] for floor in UPPER_FLOORS]
    top = column[76]
    high = [*upper, top]
    ac, au = root_mean_square(c.acceleration_m_s2), root_mean_square(u.acceleration_m_s2)
    xc, xu = root_mean_square(c.displacement_m), root_mean_square(u.displacement_m)
    apc, apu = np.abs(c.acceleration_m_s2).max(axis=0), np.abs(u.acceleration_m_s2).max(axis=0)
    xpc, xpu = np.abs(c.displacement_m).max(axis=0), np.abs(u.displacement_m).max(axis=0)
    power = c.device_velocity_m_s * c.device_force_n * 1e-3
    return {
        "J1": float(ac[occupied].max() / au[column[75]]),
        "J2": float(np.mean(ac[upper] / au[upper])),
        "J3": float(xc[top] / xu[top]),
        "J4": float(np.mean(xc[high] / xu[high])),
        "J5": float(np.sqrt(np.mean(c.stroke_m**2)) / xu[top]),
        "J6": float(np.sqrt(np.mean(power**2))),
        "J7": float(apc[occupied].max() / apu[column[75]]),
        "J8": float(np.mean(apc[upper] / apu[upper])),
        "J9": float(xpc[top] / xpu[top]),
        "J10": float(np.mean(xpc[high] / xpu[high])),
        "J11": float(np.abs(c.stroke_m).max() / xpu[top]),
        "J12": float(np.abs(power).max()),
    }
