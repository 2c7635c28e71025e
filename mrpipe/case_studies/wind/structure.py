"""The 76-storey tower in wind (6.3, appendix C): published matrices, or a condensed cantilever."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.linalg import block_diag, eigh
from scipy.optimize import least_squares

from mrpipe.artifacts import FloatArray, ParameterSet, load_parameter_set
from mrpipe.case_studies.model import BenchmarkModel, Origin, published_frame
from mrpipe.case_studies.public_files import named_file
from mrpipe.errors import UserError
from mrpipe.structures import Frame

FLOORS = 76
HEIGHT_M, WIDTH_M = 306.1, 42.0
STIFFNESS_KNOTS = 9
"""Heights at which the surrogate's bending stiffness is calibrated."""
REDUCED_FLOORS = (3, 6, 10, 13, 16, 20, 23, 26, 30, 33, 36, 40, 43, 46, 50, 53, 56, 60, 63, 66, 70, 73, 76)
"""The 23 floors whose displacement and velocity are the 46 states of (C.2)."""

Position = Literal["ground", "outrigger", "tuned-mass"]
DEFAULT_DAMPERS: dict[str, float] = {"ground": 1.0, "outrigger": 8.0, "tuned-mass": 0.1}
"""Dampers of 1000 kN at each place: one as the thesis, four to a side of an outrigger, one a tenth as strong."""

DEFAULT_CAPACITIES: dict[str, tuple[float, ...]] = {
    "ground": (1.0, 10.0, 100.0),
    "outrigger": (0.25, 0.5, 1.0, 2.0, 4.0),
    "tuned-mass": (0.25, 0.5, 1.0, 2.0, 4.0),
}
"""Multiples of these at which the sensitivity is computed."""


def element_matrices(stiffness: float, mass: float, length: float) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and consistent mass of a Bernoulli-Euler element, shape (4, 4), for (v1, r1, v2, r2).

    Parameters
    ----------
    stiffness
        EI [N m^2].
    mass
        Per length [kg/m].
    length
        Length of the element [m].
    """
    L = length
    K = np.array(
        [
            [12.0, 6 * L, -12.0, 6 * L],
            [6 * L, 4 * L**2, -6 * L, 2 * L**2],
            [-12.0, -6 * L, 12.0, -6 * L],
            [6 * L, 2 * L**2, -6 * L, 4 * L**2],
        ]
    )
    M = np.array(
        [
            [156.0, 22 * L, 54.0, -13 * L],
            [22 * L, 4 * L**2, 13 * L, -3 * L**2],
            [54.0, 13 * L, 156.0, -22 * L],
            [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
        ]
    )
    return stiffness / L**3 * K, mass * L / 420.0 * M


def condensed_cantilever(stiffnesses: FloatArray, masses: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Return mass and stiffness of the floors' displacements, rotations condensed statically; shape (n, n).

    Parameters
    ----------
    stiffnesses, masses
        EI [N m^2] and mass per length [kg/m] of each storey, shape (n,).
    length
        Height of a storey [m].
    """
    n = len(stiffnesses)
    K, M = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    for storey in range(n):
        k, m = element_matrices(float(stiffnesses[storey]), float(masses[storey]), length)
        place = slice(2 * storey, 2 * storey + 4)
        K[place, place] += k
        M[place, place] += m
    K, M = K[2:, 2:], M[2:, 2:]
    rotations = -np.linalg.solve(K[1::2, 1::2], K[1::2, ::2])
    T = np.zeros((2 * n, n))
    T[::2] = np.eye(n)
    T[1::2] = rotations
    condensed_mass, condensed_stiffness = T.T @ M @ T, T.T @ K @ T
    return 0.5 * (condensed_mass + condensed_mass.T), 0.5 * (condensed_stiffness + condensed_stiffness.T)


def calibrated_stiffness(
    masses: FloatArray, length: float, frequencies_hz: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return EI of each storey, shape (n,), and at the knots, that gives the wanted frequencies.

    The logarithm of EI is straight between equally spaced knots; of all that give the frequencies, a smooth one.

    Parameters
    ----------
    masses
        Per length [kg/m] of each storey, shape (n,).
    length
        Height of a storey [m].
    frequencies_hz
        Lowest natural frequencies, shape (m,).
    """
    n, m = len(masses), len(frequencies_hz)
    middle = (np.arange(n) + 0.5) / n
    knots = np.linspace(0.0, 1.0, STIFFNESS_KNOTS)
    target = (2.0 * np.pi * frequencies_hz) ** 2
    # a uniform cantilever: omega_1^2 = 3.516^2 EI/(m L^4)
    uniform = target[0] * masses.mean() * (n * length) ** 4 / 3.516**2

    def storeys(logarithms: FloatArray) -> FloatArray:
        return np.asarray(uniform * np.exp(np.interp(middle, knots, logarithms)))

    def gap(logarithms: FloatArray) -> FloatArray:
        M, K = condensed_cantilever(storeys(logarithms), masses, length)
        squared = eigh(K, M, eigvals_only=True, subset_by_index=(0, m - 1))
        return np.concatenate([np.log(squared / target), 1e-3 * np.diff(logarithms, 2)])

    # the lowest eigenvalue of so stiff a matrix is right to 1e-8 only, so that differences need a wide step
    fit = least_squares(
        gap, np.linspace(0.5, -2.0, STIFFNESS_KNOTS), diff_step=1e-3, xtol=1e-10, ftol=1e-10, gtol=1e-10, max_nfev=100
    )
    return storeys(fit.x), np.asarray(uniform * np.exp(fit.x))


@dataclass(frozen=True)
class Tower:
    """The tower and where its devices are.

    Attributes
    ----------
    model
        76 floors (77 degrees of freedom with a tuned mass); loads are the floors' wind forces [N].
    position
        Place where the device works.
    """

    model: BenchmarkModel
    position: Position = "ground"


def _tower(frame: Frame, origin: Origin, source: str) -> Tower:
    devices = np.zeros((FLOORS, 1))
    devices[0, 0] = 1.0
    model = BenchmarkModel(
        name="wind",
        origin=origin,
        source=source,
        frame=frame,
        load=np.eye(FLOORS),
        devices=devices,
        total_mass_kg=float(frame.mass.sum()),
    )
    return Tower(model)


def surrogate_tower(parameters: ParameterSet | str = "wind-surrogate") -> Tower:
    """Build the cantilever; see `configs/structures/wind-surrogate.yaml`.

    Raises
    ------
    UserError
        If a fact is missing.
    """
    values = parameters if isinstance(parameters, ParameterSet) else load_parameter_set("structures", parameters)
    try:
        floors, height, width = int(values.scalar("floors")), values.scalar("height"), values.scalar("width")
        masses = np.full(floors, values.scalar("mass_density") * width**2)
        frequencies, ratio = values.values["frequencies"], values.scalar("damping_ratio")
        modulus = values.scalar("elastic_modulus")
    except KeyError as error:
        raise UserError(values.name, f"parameters.{error.args[0]}", "is missing", "give value and unit") from error
    stiffness, knots = calibrated_stiffness(masses, height / floors, frequencies)
    M, K = condensed_cantilever(stiffness, masses, height / floors)
    squared, shapes = eigh(K, M)
    omega = np.sqrt(squared)
    kept = len(frequencies)
    ratios = ratio * np.maximum(omega / omega[kept - 1], 1.0)
    C = M @ shapes @ np.diag(2.0 * ratios * omega) @ shapes.T @ M
    tower = _tower(Frame(M, 0.5 * (C + C.T), K, "wind"), "surrogate", values.source)
    notes = {f"second_moment_{i}_m4": float(value / modulus) for i, value in enumerate(knots)}
    total = float(masses.sum() * height / floors)
    return replace(tower, model=replace(tower.model, notes=notes, total_mass_kg=total))


def published_tower(path: Path) -> Tower:
    """Read the published condensed matrices M76, K76, C76 (t, kN/m, kN s/m).

    Raises
    ------
    UserError
        If the file is not there or holds no such matrices.
    """
    if not path.is_file():
        raise UserError(path, "", "no such model", "give the 76dof_MKC_matrix.mat of the benchmark")
    frame = published_frame(path, "wind", "M76", "C76", "K76")
    if frame.floors != FLOORS:
        problem = f"holds a structure of {frame.floors} degrees of freedom"
        raise UserError(path, "M76, C76, K76", problem, "give the published 76-storey matrices")
    # rounding of the file leaves C not quite symmetric
    frame = replace(frame, damping=0.5 * (frame.damping + frame.damping.T))
    return _tower(frame, "published", f"published model {path.name}, 76 floors, rotations condensed")


def tower_of(model: str | None, surrogate: str) -> Tower:
    """Return the published tower where `model` names its file (or `published`), else the surrogate.

    Raises
    ------
    UserError
        If the file is missing or no such model.
    """
    if model is None:
        return surrogate_tower(surrogate)
    return published_tower(named_file("--model", model, {"published": "tall76/76dof_MKC_matrix.mat"}))


def with_outrigger(tower: Tower, floor: int, arm_m: float) -> Tower:
    """Return the tower with the device under the end of an outrigger: its rod moves by arm times the core's slope.

    Parameters
    ----------
    tower
        Device at the ground.
    floor
        The outrigger's floor, 2 to 75.
    arm_m
        Distance from the core to the damper [m].
    """
    if not 2 <= floor <= FLOORS - 1:
        raise UserError("benchmark.wind.outrigger_floor", str(floor), "is not a floor for an outrigger", "2 to 75")
    slope = np.zeros((tower.model.degrees_of_freedom, 1))
    storey = HEIGHT_M / FLOORS
    slope[floor, 0], slope[floor - 2, 0] = arm_m / (2.0 * storey), -arm_m / (2.0 * storey)
    return Tower(tower.model.with_devices(slope), "outrigger")


def with_tuned_mass(tower: Tower, mass_kg: float, frequency_ratio: float) -> Tower:
    """Return the tower with a mass on springs on its top floor and the device between the two.

    Parameters
    ----------
    tower
        76 floors.
    mass_kg
        Mass of the tuned mass [kg]; 500 t in the original benchmark.
    frequency_ratio
        Frequency of the tuned mass over the first one of the tower.
    """
    model = tower.model
    lowest = eigh(model.stiffness, model.mass, eigvals_only=True, subset_by_index=(0, 0))[0]
    omega = frequency_ratio * float(np.sqrt(lowest))
    spring = mass_kg * omega**2
    K = block_diag(model.stiffness, [[0.0]])
    joint = np.zeros((FLOORS + 1, 1))
    joint[FLOORS - 1, 0], joint[FLOORS, 0] = -1.0, 1.0
    grown = replace(
        model,
        frame=Frame(
            block_diag(model.mass, [[mass_kg]]),
            block_diag(model.damping, [[0.0]]),
            K + spring * joint @ joint.T,
            model.name,
        ),
        load=np.vstack([model.load, np.zeros((1, FLOORS))]),
        devices=joint,
    )
    return Tower(grown, "tuned-mass")


def place_device(
    tower: Tower, position: Position, *, floor: int, arm_m: float, mass_kg: float, frequency_ratio: float
) -> Tower:
    """Return the tower with its device at `position`; see :func:`with_outrigger` and :func:`with_tuned_mass`."""
    if position == "outrigger":
        return with_outrigger(tower, floor, arm_m)
    if position == "tuned-mass":
        return with_tuned_mass(tower, mass_kg, frequency_ratio)
    return tower
