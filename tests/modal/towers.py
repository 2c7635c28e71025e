"""Virtual towers that share no code with the program: floors, shakers, sensors with noise and clocks of their own.

The response is a sum of exactly integrated modes on a fine time grid. Each sensor then samples it with its own clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh
from scipy.signal import butter, chirp, lfilter, sosfiltfilt

FINE = 4
"""Steps of the simulation per sample of a sensor."""


@dataclass(frozen=True)
class Tower:
    """A linear tower: mass [kg] and stiffness [N/m] matrices, modes in rising order."""

    mass: np.ndarray
    stiffness: np.ndarray
    damping_ratios: np.ndarray
    frequencies_hz: np.ndarray = field(init=False)
    shapes: np.ndarray = field(init=False)

    def __post_init__(self):
        squared, shapes = eigh(self.stiffness, np.diag(self.mass))
        object.__setattr__(self, "frequencies_hz", np.sqrt(squared) / (2 * np.pi))
        object.__setattr__(self, "shapes", shapes)

    @property
    def floors(self):
        return self.mass.size


@dataclass(frozen=True)
class Sensors:
    """What the instruments add: relative noise, cross-talk, clock offsets [s] and drifts [1], missing floors."""

    noise: float = 0.03
    crosstalk: float = 0.0
    input_noise: float = 0.01
    offset_s: float = 0.0
    drift: float = 0.0
    missing: tuple[int, ...] = ()


def random_tower(rng, floors=None, coupling=0.03, damping=(0.006, 0.02)):
    """A shear tower of unequal storeys whose stiffness also couples floors that are not neighbours."""
    floors = floors or int(rng.integers(5, 9))
    mass = 45e3 * rng.uniform(0.8, 1.2, floors)
    storeys = rng.uniform(0.75, 1.25, floors) * np.linspace(1.2, 0.9, floors)
    stiffness = np.diag(storeys + np.append(storeys[1:], 0.0)) - np.diag(storeys[1:], 1) - np.diag(storeys[1:], -1)
    diagonal = np.sqrt(np.diag(stiffness))
    extra = coupling * np.triu(rng.uniform(-1.0, 1.0, (floors, floors)), 2)
    stiffness = stiffness + (extra + extra.T) * np.outer(diagonal, diagonal) * (1.0 if floors > 2 else 0.0)
    squared = eigh(stiffness, np.diag(mass), eigvals_only=True)[0]
    if squared <= 0.0:
        return random_tower(rng, floors, coupling, damping)
    first = np.sqrt(squared) / (2 * np.pi)
    stiffness = stiffness * (rng.uniform(0.7, 1.3) / first) ** 2
    return Tower(mass, stiffness, rng.uniform(*damping, floors))


def visibility(tower, shaker_floor):
    """Response of each mode to the shaker at its own frequency over that of all others, largest over floors."""
    omega, shapes = 2 * np.pi * tower.frequencies_hz, tower.shapes
    line = omega[:, None]
    modal = shapes[shaker_floor - 1] / (omega**2 - line**2 + 2j * tower.damping_ratios * omega * line)
    largest = []
    for mode in range(tower.floors):
        parts = shapes * modal[mode]
        own = np.abs(parts[:, mode])
        others = np.abs(parts.sum(axis=1) - parts[:, mode])
        largest.append(float((own / others).max()))
    return np.array(largest)


def hidden_modes(tower, shaker_floor):
    """Modes (from 1) without a visible peak: nowhere is their response half of that of the other modes."""
    return [int(i) + 1 for i in np.flatnonzero(visibility(tower, shaker_floor) < 0.5)]


def tower_with_hidden_modes(rng, fewest=1, most=2, weakest=0.05):
    """Draw towers and shaker floors until one or two modes show no peak, but contribute `weakest` at some floor."""
    while True:
        tower = random_tower(rng)
        for floor in rng.permutation(np.arange(1, tower.floors + 1)):
            hidden = hidden_modes(tower, int(floor))
            if fewest <= len(hidden) <= most and visibility(tower, int(floor)).min() > weakest:
                return tower, int(floor)


def respond(tower, forces, dt):
    """Absolute floor accelerations, shape (m, n), to forces on the floors, shape (m, n) [N]; from rest."""
    acceleration = forces / tower.mass
    result = acceleration.copy()
    modal = forces @ tower.shapes
    for mode, (f, zeta) in enumerate(zip(tower.frequencies_hz, tower.damping_ratios, strict=True)):
        omega = 2 * np.pi * f
        pole = complex(-zeta * omega, omega * np.sqrt(1 - zeta**2))
        step = np.exp(pole * dt)
        first = (step - 1) / pole
        second = (first - dt) / (pole * dt)
        drive = modal[:, mode] / (2j * pole.imag)
        driven = np.concatenate([[0], (first - second) * drive[:-1] + second * drive[1:]])
        z = lfilter([1.0], [1.0, -step], driven)
        displacement, velocity = 2 * z.real, 2 * (pole * z).real
        result -= np.outer(omega**2 * displacement + 2 * zeta * omega * velocity, tower.shapes[:, mode])
    return result


def sweep_force(tower, duration_s, dt, peak_n=2000.0, kind="sweep", rng=None):
    """A sweep, or random motion, from half the first frequency to a tenth above the last; shape (m,) [N]."""
    low, high = 0.5 * tower.frequencies_hz[0], 1.1 * tower.frequencies_hz[-1]
    time = np.arange(round(duration_s / dt)) * dt
    if kind == "sweep":
        return peak_n * chirp(time, low, duration_s, high)
    white = rng.standard_normal(time.size)
    values = sosfiltfilt(butter(4, [low, high], btype="bandpass", fs=1 / dt, output="sos"), white)
    return peak_n * values / values.std()


def sample(tower, rng, sensors, responses, excitation, rate):
    """Return excitation and responses as the instruments give them: clocks, cross-talk, noise."""
    count = responses.shape[0] // FINE
    ticks = np.arange(responses.shape[0]) / (rate * FINE)
    nominal = np.arange(count) / rate
    seen = np.empty((count, tower.floors))
    for floor in range(tower.floors):
        offset = sensors.offset_s * rng.uniform(-1.0, 1.0)
        clock = np.clip(nominal * (1.0 + sensors.drift * rng.uniform(-1.0, 1.0)) + offset, 0.0, ticks[-1])
        seen[:, floor] = CubicSpline(ticks, responses[:, floor])(clock)
    mixing = np.eye(tower.floors) + sensors.crosstalk * rng.uniform(-1.0, 1.0, (tower.floors, tower.floors))
    seen = seen @ mixing.T
    seen += sensors.noise * seen.std(axis=0) * rng.standard_normal(seen.shape) + rng.normal(0, 0.01, tower.floors)
    measured = excitation[::FINE][:count]
    measured = measured + sensors.input_noise * measured.std() * rng.standard_normal(count)
    return measured, seen


def forced_test(tower, rng, sensors, shaker_floor, *, rate=50.0, duration_s=600.0, kind="sweep"):
    """Return the force [N] and the measured accelerations of a shaker test."""
    dt = 1.0 / (rate * FINE)
    force = sweep_force(tower, duration_s, dt, kind=kind, rng=rng)
    forces = np.zeros((force.size, tower.floors))
    forces[:, shaker_floor - 1] = force
    return sample(tower, rng, sensors, respond(tower, forces, dt), force, rate)


def ambient_test(tower, rng, sensors, *, rate=50.0, duration_s=3600.0):
    """Return the accelerations under independent broad-band forces on all floors."""
    dt = 1.0 / (rate * FINE)
    size = round(duration_s / dt)
    sections = butter(4, 0.4 * rate, fs=1 / dt, output="sos")
    forces = sosfiltfilt(sections, 200.0 * rng.standard_normal((size, tower.floors)), axis=0)
    return sample(tower, rng, sensors, respond(tower, forces, dt), forces[:, 0], rate)[1]
