"""The isolated building and the tower against integrations of scipy from their matrices, indices included.

The dampers of P4 (6) at a constant voltage have the force F sign(v) + c v. Here sign(v) is tanh(v/v0); the difference
is proportional to v0, which is far below the velocities that occur.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.signal import lsim
from scipy.spatial import ConvexHull

from mrpipe.case_studies.base_isolated.structure import surrogate_building
from mrpipe.case_studies.base_isolated.study import IsolationStudy, isolation_study
from mrpipe.case_studies.motion import spectrum_compatible_motion
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice
from mrpipe.case_studies.wind.load import synthetic_wind
from mrpipe.case_studies.wind.structure import HEIGHT_M, WIDTH_M, place_device, surrogate_tower
from mrpipe.case_studies.wind.study import WindStudy, wind_study

YIELD, YIELD_PER_VOLT, VISCOSITY, VISCOSITY_PER_VOLT = 100e3, 75e3, 81e3, 90e3
"""The damper of paper P4 (configs/dampers/bingham-1000kn.yaml): N, N/V, N s/m, N s/m/V."""
SAVED = 0.001


def damper(volts: float, count: float, rounding: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return the force of `count` dampers side by side over the velocity of their rods."""
    yielding, viscosity = count * (YIELD + YIELD_PER_VOLT * volts), count * (VISCOSITY + VISCOSITY_PER_VOLT * volts)
    return lambda v: yielding * np.tanh(v / rounding) + viscosity * v


def peak(vectors: np.ndarray) -> float:
    return float(np.max(np.hypot(vectors[..., 0], vectors[..., 1])))


def largest_rms(vectors: np.ndarray) -> float:
    return float(np.max(np.sqrt(np.mean(vectors[..., 0] ** 2 + vectors[..., 1] ** 2, axis=0))))


# --- the base-isolated building ---


class Building:
    """The building as second-order equations: 8 floors (x, y, rotation) relative to the base, then the base."""

    def __init__(self, study: IsolationStudy, ground: np.ndarray, interval: float) -> None:
        model = study.building.model
        self.M, self.C, self.K = model.mass, model.damping, model.stiffness
        self.floor_mass = study.building.superstructure_mass
        bearings = study.building.bearings_m
        self.points = np.vstack([[0.0, 0.0], bearings[ConvexHull(bearings).vertices]])
        self.ground, self.given = ground, np.arange(len(ground)) * interval
        self.time = np.arange(round(self.given[-1] / SAVED) + 1) * SAVED
        inverse, n = np.linalg.inv(self.M), 27
        self.A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.K, -inverse @ self.C]])
        # ground acceleration moves the base (x, y) and the damper forces act there
        self.by_ground, self.by_force = np.zeros((54, 2)), np.zeros((54, 2))
        self.by_ground[51, 0] = self.by_ground[52, 1] = -1.0
        self.by_force[27:] = -inverse[:, 24:26]

    def shaking(self, t: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(t, self.given, column) for column in self.ground.T])

    def free(self) -> np.ndarray:
        _, _, states = lsim((self.A, self.by_ground, np.eye(54), np.zeros((54, 2))), self.shaking(self.time), self.time)
        return np.asarray(states)

    def controlled(self, force: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        def slope(t: float, z: np.ndarray) -> np.ndarray:
            place = min(int(t / self.given[1]), len(self.given) - 2)
            share = t / self.given[1] - place
            now = (1.0 - share) * self.ground[place] + share * self.ground[place + 1]
            rate = self.A @ z + self.by_force @ force(z[51:53])
            rate[51:53] -= now
            return rate

        span = (0.0, self.time[-1])
        found = solve_ivp(slope, span, np.zeros(54), "LSODA", self.time, rtol=1e-7, atol=1e-9, max_step=self.given[1])
        return np.asarray(found.y.T)

    def quantities(self, z: np.ndarray, forces: np.ndarray) -> dict[str, float]:
        """Return what the table of docs/benchmarks.md divides, from the inertia of what each shear accelerates."""
        shaking = self.shaking(self.time)
        acceleration = (z @ self.A.T)[:, 27:] + shaking @ self.by_ground[27:].T + forces @ self.by_force[27:].T
        base = acceleration[:, 24:].copy()
        base[:, :2] += shaking
        floors = acceleration[:, :24].reshape(-1, 8, 3) + base[:, None, :]
        pushed = floors.reshape(-1, 24) @ self.floor_mass
        above = pushed.reshape(-1, 8, 3).sum(axis=1)[:, :2]
        base_mass = self.M[24:, 24:] - np.tile(np.eye(3), 8) @ self.floor_mass @ np.tile(np.eye(3), 8).T
        below = above + (base @ base_mass)[:, :2]
        x = z[:, 24:27]
        corners = x[:, None, :2] + x[:, None, 2:] * np.column_stack([-self.points[:, 1], self.points[:, 0]])
        places = z[:, :24].reshape(-1, 8, 3)[:, :, :2]
        velocity = np.array([np.concatenate([[0.0], np.cumsum(0.5 * SAVED * (a[1:] + a[:-1]))]) for a in shaking.T]).T
        taken = np.trapezoid(np.sum(forces * z[:, 51:53], axis=1), dx=SAVED)
        return {
            "J1": peak(below),
            "J2": peak(above),
            "J3": peak(corners),
            "J4": peak(np.diff(places, axis=1, prepend=0.0)),
            "J5": peak(floors[:, :, :2]),
            "J7": largest_rms(corners),
            "J8": largest_rms(floors[:, :, :2]),
            "force": peak(forces),
            # the ground moves the building with the shear that accelerates it
            "share": float(taken / np.trapezoid(np.sum(below * velocity, axis=1), dx=SAVED)),
        }

    def indices(self, z: np.ndarray, forces: np.ndarray, free: np.ndarray) -> dict[str, float]:
        ours, theirs = self.quantities(z, forces), self.quantities(free, np.zeros_like(forces))
        divided = {name: ours[name] / theirs[name] for name in ("J1", "J2", "J3", "J4", "J5", "J7", "J8")}
        return {**divided, "J6": ours["force"] / ours["J1"], "J9": ours["share"]}


@pytest.mark.oracle
def test_isolated_building_without_and_with_passive_dampers() -> None:
    study = isolation_study(
        surrogate_building(), device=BinghamDevice(), network=None, damping_ratio=0.1, stiffness_share=0.2,
        lqg=LqgWeights(), time_step_s=SAVED,
    )  # fmt: skip
    motion = spectrum_compatible_motion(np.random.default_rng(8), duration_s=8.0)
    building = Building(study, motion.acceleration_m_s2[:, :2], motion.interval_s)
    free, ours_free = building.free(), study.run(motion)
    scale = np.abs(free[:, :27]).max()
    np.testing.assert_allclose(ours_free.displacement(), free[:, :27], atol=1e-9 * scale)
    ours = study.run(motion, study.controller("passive-on"))
    force = damper(10.0, 1.0, 1e-6)
    passive = building.controlled(force)
    scale = np.abs(passive[:, :27]).max()
    np.testing.assert_allclose(ours.displacement(), passive[:, :27], atol=1e-5 * scale)
    expected = building.indices(passive, force(passive[:, 51:53]), free)
    assert expected["J3"] < 0.9, "the dampers matter"
    found, finer = (
        study.indices(study.run(motion, study.controller("passive-on"), refine=part), study.run(motion, refine=part))
        for part in (1, 2)
    )
    assert set(found) == set(expected)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=4e-4), name
        # the force of the dampers in the base shear is the mean of the step before, an error of first order
        assert 2.0 * finer[name] - found[name] == pytest.approx(value, rel=1e-4), name


# --- the tower ---

JUDGED = {"occupied": (1, 30, 50, 55, 60, 65, 70, 75), "upper": (50, 55, 60, 65, 70, 75)}
MODES, KEPT_EVERY = 8, 0.01


class TowerInModes:
    """The tower in its first modes, under forces that are linear between their samples."""

    def __init__(self, study: WindStudy) -> None:
        model = study.tower.model
        squared, shapes = eigh(model.stiffness, model.mass)
        self.shapes = shapes[:, :MODES]
        self.rod = model.devices[:, 0] @ self.shapes
        self.A = np.zeros((2 * MODES, 2 * MODES))
        self.A[:MODES, MODES:] = np.eye(MODES)
        self.A[MODES:, :MODES] = -np.diag(squared[:MODES])
        self.A[MODES:, MODES:] = -self.shapes.T @ model.damping @ self.shapes
        self.forces = study.load.forces_n @ self.shapes
        self.given = np.arange(len(self.forces)) * study.load.interval_s
        self.time = np.arange(round(self.given[-1] / KEPT_EVERY) + 1) * KEPT_EVERY

    def blowing(self, t: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(t, self.given, column) for column in self.forces.T])

    def free(self) -> np.ndarray:
        B = np.vstack([np.zeros((MODES, MODES)), np.eye(MODES)])
        C, D = np.eye(2 * MODES), np.zeros((2 * MODES, MODES))
        return np.asarray(lsim((self.A, B, C, D), self.blowing(self.time), self.time)[2])

    def controlled(self, force: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        def slope(t: float, z: np.ndarray) -> np.ndarray:
            place = min(int(t / self.given[1]), len(self.given) - 2)
            share = t / self.given[1] - place
            rate = self.A @ z
            rate[MODES:] += (1.0 - share) * self.forces[place] + share * self.forces[place + 1]
            rate[MODES:] -= self.rod * force(self.rod @ z[MODES:])
            return rate

        span, start = (0.0, self.time[-1]), np.zeros(2 * MODES)
        return np.asarray(
            solve_ivp(slope, span, start, "LSODA", self.time, rtol=1e-7, atol=1e-10, max_step=self.given[1]).y.T
        )

    def floors(self, z: np.ndarray, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return displacement and acceleration of all floors."""
        modal = (z @ self.A.T)[:, MODES:] + self.blowing(self.time) - np.outer(forces, self.rod)
        return z[:, :MODES] @ self.shapes.T, modal @ self.shapes.T

    def indices(self, z: np.ndarray, forces: np.ndarray, free: np.ndarray) -> dict[str, float]:
        """Return J1 to J12 from the table of docs/benchmarks.md."""
        (x, a), (x0, a0) = self.floors(z, forces), self.floors(free, np.zeros(len(free)))
        occupied, upper = np.array(JUDGED["occupied"]) - 1, np.array(JUDGED["upper"]) - 1
        high = np.append(upper, 75)
        stroke, power = z[:, :MODES] @ self.rod, 1e-3 * forces * (z[:, MODES:] @ self.rod)
        values = {}
        sizes: tuple[Callable[[np.ndarray], np.ndarray], ...] = (
            lambda h: np.sqrt(np.mean(h**2, axis=0)),
            lambda h: np.abs(h).max(axis=0),
        )
        for first, size in zip((1, 7), sizes, strict=True):
            values[f"J{first}"] = size(a[:, occupied]).max() / size(a0)[74]
            values[f"J{first + 1}"] = np.mean(size(a[:, upper]) / size(a0[:, upper]))
            values[f"J{first + 2}"] = size(x)[75] / size(x0)[75]
            values[f"J{first + 3}"] = np.mean(size(x[:, high]) / size(x0[:, high]))
            values[f"J{first + 4}"] = size(stroke) / size(x0)[75]
            values[f"J{first + 5}"] = size(power)
        return {name: float(value) for name, value in values.items()}


@pytest.mark.oracle
def test_tower_without_and_with_passive_dampers_on_an_outrigger() -> None:
    load = synthetic_wind(np.random.default_rng(4), 76, HEIGHT_M, WIDTH_M, duration_s=20.0)
    plain = surrogate_tower()
    placed = place_device(plain, "outrigger", floor=40, arm_m=21.0, mass_kg=500e3, frequency_ratio=0.99)
    weights = LqgWeights(displacement=1000.0, acceleration=10.0, force_n=1e6, interval_s=0.001)
    study = wind_study(
        plain, placed, load, device=BinghamDevice(), network=None, stiffness_share=0.5, tuned_mass_kg=500e3,
        lqg=weights, modes=MODES, dampers=8.0,
    )  # fmt: skip
    tower = TowerInModes(study)
    free = tower.free()
    x, _ = tower.floors(free, np.zeros(len(free)))
    np.testing.assert_allclose(study.uncontrolled.displacement(), x, atol=1e-9 * np.abs(x).max())
    ours = study.run(study.controller("passive-off"))
    force = damper(0.0, 8.0, 1e-7)
    passive = tower.controlled(force)
    forces = force(passive[:, MODES:] @ tower.rod)
    x, _ = tower.floors(passive, forces)
    np.testing.assert_allclose(ours.displacement(), x, atol=1e-5 * np.abs(x).max())
    expected, found = tower.indices(passive, forces, free), study.indices(ours)
    assert set(found) == set(expected)
    # accelerations contain the force of the dampers, which is the mean of the step before and jumps at a reversal
    late = {"J1", "J2", "J7", "J8", "J12"}
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=3e-4 if name in late else 1e-5), name
    assert expected["J3"] < 0.95, "the dampers matter"
