"""The base-isolated benchmark building (appendix A): published matrices, or a surrogate model.

Degrees of freedom: floors 1 to 8, each (x, y, rotation) relative to the base, then the base (x, y, rotation) relative
to the ground: (A.18) in rising order.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag, eigh

from mrpipe.artifacts import FloatArray, ParameterSet, load_parameter_set
from mrpipe.case_studies.model import BenchmarkModel, Origin, ground_load, published_frame
from mrpipe.case_studies.public_files import named_file
from mrpipe.errors import UserError
from mrpipe.structures import Frame
from mrpipe.structures.given_storage import read_matrix

FLOORS = 8
BEARING_STIFFNESS = 919.422e3
"""N/m of one linear bearing of the published building."""
BEARING_VISCOSITY = 27.717e3
"""N s/m of one linear bearing of the published building."""


@dataclass(frozen=True)
class IsolatedBuilding:
    """The building and what its indices need.

    Attributes
    ----------
    model
        27 degrees of freedom; loads are ground accelerations in x and y; devices in x and y at the base's centre.
    superstructure_mass, superstructure_damping, superstructure_stiffness
        Shape (24, 24), floor 1 first.
    base_mass
        Shape (3, 3).
    isolation_stiffness, isolation_damping
        Stiffness and damping of all bearings about the centre of mass, shape (3, 3).
    bearings_m
        Positions about the centre of mass, shape (92, 2); the corners of the plan where the file does not give them.
    """

    model: BenchmarkModel
    superstructure_mass: FloatArray
    superstructure_damping: FloatArray
    superstructure_stiffness: FloatArray
    base_mass: FloatArray
    isolation_stiffness: FloatArray
    isolation_damping: FloatArray
    bearings_m: FloatArray

    @property
    def fixed_base_periods_s(self) -> FloatArray:
        """Periods of the superstructure on a fixed base, longest first, shape (24,)."""
        squared = eigh(self.superstructure_stiffness, self.superstructure_mass, eigvals_only=True)
        return np.asarray(2.0 * np.pi / np.sqrt(squared))

    @property
    def isolation_period_s(self) -> float:
        """Period of the rigid building on its bearings along x, 2 pi sqrt(M/k): the published `isolated period`."""
        return float(2.0 * np.pi * np.sqrt(self.model.total_mass_kg / self.isolation_stiffness[0, 0]))

    @property
    def isolation_damping_ratio(self) -> float:
        """Damping ratio of the rigid building on its bearings along x."""
        k, c = self.isolation_stiffness[0, 0], self.isolation_damping[0, 0]
        return float(c / (2.0 * np.sqrt(k * self.model.total_mass_kg)))

    @property
    def rigid_isolation_periods_s(self) -> FloatArray:
        """Periods of the rigid building on its bearings in the plane (x, y, rotation), longest first, shape (3,).

        Equal bearings leave the translation towards their centre free of rotation, so that one of the three is
        :attr:`isolation_period_s`. By Rayleigh's principle each mode of the flexible building is slower than these;
        by Dunkerley's the slowest has T^2 below the sum of its rigid T^2 and that of the fixed base.
        """
        squared = eigh(self.isolation_stiffness, self.model.mass[-3:, -3:], eigvals_only=True)
        return np.asarray(2.0 * np.pi / np.sqrt(squared))

    @property
    def corners_m(self) -> FloatArray:
        """Corners of the plan and its centre of mass, where the base displacement is judged; shape (points, 2)."""
        from scipy.spatial import ConvexHull

        hull = self.bearings_m[ConvexHull(self.bearings_m).vertices]
        return np.vstack([np.zeros((1, 2)), hull])


def location_matrix(positions_m: FloatArray) -> FloatArray:
    """Return sum r'r of (A.13) over bearings of unit stiffness in x and y, shape (3, 3).

    Parameters
    ----------
    positions_m
        Shape (n, 2), about the centre of mass.
    """
    x, y = positions_m[:, 0], positions_m[:, 1]
    count = float(len(x))
    return np.array(
        [
            [count, 0.0, -y.sum()],
            [0.0, count, x.sum()],
            [-y.sum(), x.sum(), float(np.sum(x**2 + y**2))],
        ]
    )


def isolated_building(
    mass: FloatArray,
    damping: FloatArray,
    stiffness: FloatArray,
    base_mass: FloatArray,
    isolation: tuple[FloatArray, FloatArray],
    bearings_m: FloatArray,
    *,
    origin: Origin,
    source: str,
) -> IsolatedBuilding:
    """Put superstructure and isolation together by (A.19).

    Parameters
    ----------
    mass, damping, stiffness
        Matrices of the superstructure, shape (24, 24), SI.
    base_mass
        Shape (3, 3).
    isolation
        Stiffness and damping of all bearings, shapes (3, 3).
    bearings_m
        Positions, shape (n, 2).
    origin, source
        Origin and source of the numbers, see :class:`BenchmarkModel`.
    """
    spread = np.tile(np.eye(3), (FLOORS, 1))
    moved = base_mass + spread.T @ mass @ spread
    M = np.block([[mass, mass @ spread], [spread.T @ mass, moved]])
    planar = np.eye(3)[:, :2]
    along, across = (np.append(np.zeros(mass.shape[0]), planar[:, axis]) for axis in (0, 1))
    frame = Frame(
        M,
        block_diag(damping, isolation[1]),
        block_diag(stiffness, isolation[0]),
        "base-isolated",
        influence=along,
        influence_y=across,
    )
    devices = np.zeros((M.shape[0], 2))
    devices[-3:, :] = planar
    model = BenchmarkModel(
        name="base-isolated",
        origin=origin,
        source=source,
        frame=frame,
        load=ground_load(frame),
        devices=devices,
        total_mass_kg=float(moved[0, 0]),
    )
    return IsolatedBuilding(model, mass, damping, stiffness, base_mass, isolation[0], isolation[1], bearings_m)


def published_building(
    path: Path, *, bearing_stiffness: float = BEARING_STIFFNESS, bearing_viscosity: float = BEARING_VISCOSITY
) -> IsolatedBuilding:
    """Read the published model: `STRUC.mat` with M, K, C, m, H (t, m, kN, s).

    Parameters
    ----------
    path
        The file; `bearing_locations_id_x_y_m.csv` in the same folder gives the positions.
    bearing_stiffness, bearing_viscosity
        Stiffness and viscosity of each of the 92 linear bearings [N/m], [N s/m].

    Raises
    ------
    UserError
        If the file is not there, is not such a model, or its matrices do not fit.
    """
    if not path.is_file():
        raise UserError(path, "", "no such model", "give the STRUC.mat of the benchmark")
    above = published_frame(path, "superstructure", "STRUC.M", "STRUC.C", "STRUC.K")
    m, H = (np.asarray(read_matrix(path, f"STRUC.{key}"), dtype=np.float64) for key in ("m", "H"))
    for name, matrix, size in (("M", above.mass, 3 * FLOORS), ("m", m, 3), ("H", H, 3)):
        if matrix.shape != (size, size) or not np.all(np.isfinite(matrix)):
            raise UserError(path, f"STRUC.{name}", f"has shape {matrix.shape}", f"finite and ({size}, {size}) expected")
    bearings = _bearings_beside(path, H)
    isolation = (bearing_stiffness * H, bearing_viscosity * H)
    return isolated_building(
        above.mass,
        0.5 * (above.damping + above.damping.T),
        above.stiffness,
        1e3 * m,
        isolation,
        bearings,
        origin="published",
        source=f"published model {path.name}, 92 linear bearings of {bearing_stiffness / 1e3:g} kN/m and "
        f"{bearing_viscosity / 1e3:g} kN s/m",
    )


def _bearings_beside(path: Path, location: FloatArray) -> FloatArray:
    table = path.with_name("bearing_locations_id_x_y_m.csv")
    if not table.is_file():
        values = load_parameter_set("structures", "base-isolated-surrogate").values
        x, y = values["plan_x"], values["plan_y"]
        return np.array([[x[0], y[0]], [x[1], y[0]], [x[2], y[1]], [x[2], y[2]], [x[0], y[2]]])
    positions = np.loadtxt(table, delimiter=",")[:, 1:]
    if not np.allclose(location_matrix(positions), location, rtol=1e-6, atol=1e-3):
        raise UserError(table, "", "does not give the matrix H of the model", "use files of the same release")
    return np.asarray(positions)


def bearing_grid(plan_x: FloatArray, plan_y: FloatArray) -> FloatArray:
    """Return 92 positions on the L-shaped plan, shape (92, 2) [m]: 4 x 15 in the long leg, 4 x 8 in the short one."""
    long_x = np.linspace(plan_x[0], plan_x[1], 4)
    long_y = np.linspace(plan_y[0], plan_y[2], 15)
    short_x = np.linspace(plan_x[1], plan_x[2], 5)[1:]
    short_y = np.linspace(plan_y[1], plan_y[2], 8)
    long_leg = np.array([(x, y) for x in long_x for y in long_y])
    short_leg = np.array([(x, y) for x in short_x for y in short_y])
    return np.vstack([long_leg, short_leg])


def _scaled_storeys(masses: FloatArray, period_s: float) -> FloatArray:
    """Return storey stiffnesses that fall with the shear of a uniform acceleration and give the first period."""
    from mrpipe.structures.shear_frames import shear_stiffness

    shear = np.cumsum(masses[::-1])[::-1]
    pattern = shear_stiffness(np.sqrt(shear / shear[0]))
    lowest = eigh(pattern, np.diag(masses), eigvals_only=True)[0]
    return np.asarray(pattern * (2.0 * np.pi / period_s) ** 2 / lowest)


def surrogate_building(parameters: ParameterSet | str = "base-isolated-surrogate") -> IsolatedBuilding:
    """Assemble the surrogate from published facts; see `configs/structures/base-isolated-surrogate.yaml`.

    Three uncoupled shear buildings (x, y, rotation) make the superstructure; the bearings' eccentricity couples them on
    the isolation.

    Raises
    ------
    UserError
        If a fact is missing.
    """
    values = parameters if isinstance(parameters, ParameterSet) else load_parameter_set("structures", parameters)
    try:
        facts = values.values
        masses, rotational = facts["floor_masses"], facts["floor_rotational_masses"]
        base, base_rotational = values.scalar("base_mass"), values.scalar("base_rotational_mass")
        periods, isolated = facts["fixed_base_periods"], values.scalar("isolated_period")
        ratio, isolation_ratio = values.scalar("superstructure_damping_ratio"), values.scalar("isolation_damping_ratio")
        bearings = bearing_grid(facts["plan_x"], facts["plan_y"])
    except KeyError as error:
        raise UserError(values.name, f"parameters.{error.args[0]}", "is missing", "give value and unit") from error
    M, K = np.zeros((24, 24)), np.zeros((24, 24))
    for axis, (inertia, period) in enumerate(zip((masses, masses, rotational), periods, strict=True)):
        M[axis::3, axis::3] = np.diag(inertia)
        K[axis::3, axis::3] = _scaled_storeys(inertia, float(period))
    squared, shapes = eigh(K, M)
    C = M @ shapes @ np.diag(2.0 * ratio * np.sqrt(squared)) @ shapes.T @ M
    total = float(masses.sum() + base)
    omega = 2.0 * np.pi / isolated
    stiffness = total * omega**2 / len(bearings)
    viscosity = 2.0 * isolation_ratio * omega * total / len(bearings)
    location = location_matrix(bearings)
    return isolated_building(
        M,
        np.asarray(C),
        K,
        np.diag([base, base, base_rotational]),
        (stiffness * location, viscosity * location),
        bearings,
        origin="surrogate",
        source=values.source,
    )


def building_of(
    model: str | None, surrogate: str, *, bearing_stiffness: float, bearing_viscosity: float
) -> IsolatedBuilding:
    """Return the published building where `model` names its file (or `published`), else the surrogate.

    Parameters
    ----------
    model
        Path of STRUC.mat; `published` for that of the public data; None for the surrogate.
    surrogate
        Parameter set of the surrogate.
    bearing_stiffness, bearing_viscosity
        Stiffness and viscosity of each bearing of the published model [N/m], [N s/m].

    Raises
    ------
    UserError
        If the file is missing or no such model.
    """
    if model is None:
        return surrogate_building(surrogate)
    path = named_file("--model", model, {"published": "asce_base_isolated/STRUC.mat"})
    return published_building(path, bearing_stiffness=bearing_stiffness, bearing_viscosity=bearing_viscosity)
