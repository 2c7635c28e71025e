"""Chapter 6, P4 and appendices A to E: the benchmark structures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from mrpipe.artifacts import FloatArray, Progress, load_parameter_set, public_data_directory
from mrpipe.case_studies.base_isolated.structure import published_building, surrogate_building
from mrpipe.case_studies.base_isolated.study import isolated_response, isolation_study, run_cases
from mrpipe.case_studies.model import modal_model
from mrpipe.case_studies.motion import load_motion
from mrpipe.case_studies.options import LqgWeights, WindClimate
from mrpipe.case_studies.run import bingham_device
from mrpipe.case_studies.ten_storey.structure import ten_storey
from mrpipe.case_studies.ten_storey.study import TenStoreyCase, ten_storey_study
from mrpipe.case_studies.wind.load import synthetic_wind
from mrpipe.case_studies.wind.structure import FLOORS, HEIGHT_M, WIDTH_M, Tower, tower_of
from mrpipe.case_studies.wind.study import run_wind_cases, wind_study
from mrpipe.control.lqg import Weights, frame_regulator_gain
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.structures import Frame, floor_position, shear_stiffness, state_space
from mrpipe.structures.records import GroundMotion
from mrpipe.thesis.claim import Missing, Outcomes, Value
from mrpipe.thesis.entries import printed_columns, table_id
from mrpipe.units import same_unit_dimension
from mrpipe.words import listed

_FLOORS, _MASS, _STIFFNESS = 10, 5000.0, 1.5e7
_RATED_N = 1.0e6
_WIND_STEP_S = 0.002
"""Longest step of the tower [s]; `mrpipe benchmark wind` takes half of it and twice the time."""
_LAWS = ("vd", "vdns", "fdns", "lqg")
_DEVICE = "bingham-1000kn"
NO_DATA = (
    "the public data are not here (MRPIPE_DATA): {what}; a surrogate and a synthetic motion would give other numbers"
)


@dataclass(frozen=True)
class CaseOptions:
    """Options of the benchmark structures; the settings `benchmark` of the configuration.

    Attributes
    ----------
    isolation_damping_ratio, isolation_stiffness_share, isolation_lqg
        Settings of the base-isolated building.
    wind_stiffness_share, wind_lqg, wind_modes, tuned_mass_kg
        Settings of the tower.
    climate, wind_duration_s, wind_interval_s
        Settings of the wind load.
    filter_rate
        Rate of the voltage filter of P4 (24) [1/s].
    seed
        Seed of the synthetic ground motion and wind load. It is not that of the run, so that the ledger is the same for
        every run.
    """

    isolation_damping_ratio: float = 0.1
    isolation_stiffness_share: float = 0.2
    isolation_lqg: LqgWeights = field(default_factory=LqgWeights)
    wind_stiffness_share: float = 0.5
    wind_lqg: LqgWeights = field(default_factory=lambda: LqgWeights(displacement=1000.0, acceleration=10.0))
    wind_modes: int = 23
    tuned_mass_kg: float = 500e3
    climate: WindClimate = field(default_factory=WindClimate)
    wind_duration_s: float = 900.0
    wind_interval_s: float = 0.05
    filter_rate: float = 31.4
    seed: int = 0


def _has(*parts: str) -> bool:
    folder = public_data_directory()
    return folder is not None and folder.joinpath(*parts).exists()


def _ten_storey_structure() -> Outcomes:
    K = shear_stiffness(np.full(_FLOORS, _STIFFNESS))
    M = _MASS * np.eye(_FLOORS)
    lowest = float(np.sqrt(eigh(K, M, eigvals_only=True)[0]))
    corner = K.copy()
    corner[-1, 0] = -_STIFFNESS
    symmetric = corner.copy()
    symmetric[0, -1] = -_STIFFNESS
    smallest = float(eigh(symmetric, M, eigvals_only=True)[0])
    by = "printed mass and stiffness of P4"
    return {
        "A16a": Value(lowest, by),
        "A16b": Value(ten_storey("ten-storey").notes["storey_stiffness_n_m"], "calibrated to 2 pi rad/s"),
        "A16c": Value(ten_storey("ten-storey-heavy").notes["storey_stiffness_n_m"], "calibrated to 2 pi rad/s"),
        "A16d": Value(
            float(abs(np.linalg.det(corner / _STIFFNESS))),
            by,
            f"on both sides it makes K indefinite (eigenvalue {smallest:.3g} rad^2/s^2)",
        ),
    }


def unit_of_command(coefficient: str, product: str) -> str:
    """Return the unit of a command, A or V, that times a coefficient gives a product; all three as units."""
    return next(unit for unit in ("A", "V") if same_unit_dimension(f"({coefficient})*{unit}", product))


def _units() -> Outcomes:
    values = load_parameter_set("dampers", "bingham-1000kn")
    said = f"it is taken in {values.units['drive_limit']}, 0 to {values.scalar('drive_limit'):g}"
    # f_b and c_b of Table 6.1 are slopes of force and viscosity over the command
    found = sorted({unit_of_command("kN/A", "kN"), unit_of_command("kN*s/m/V", "kN*s/m")})
    words = "one unit" if len(found) == 1 else listed(found)
    return {"A17": Value(words, "units of the terms with the command", said)}


def _regulator(frame: Frame) -> Outcomes:
    position = floor_position(frame.floors)
    space = state_space(frame, position)
    gain = frame_regulator_gain(frame, position, Weights())
    B = space.B[:, 1]

    def loop(sign: float) -> tuple[str, str]:
        fastest = float(np.linalg.eigvals(space.A + sign * np.outer(B, gain)).real.max())
        return ("unstable" if fastest > 0.0 else "stable"), f"largest real part of a pole {fastest:+.3g} 1/s"

    by = "LQG regulator of the printed frame"
    # (E.5) u = -K x with (E.6) K = -R^-1 (...): the two minus signs make u = +k x
    double, single = loop(1.0), loop(-1.0)
    return {"A18a": Value(double[0], by, double[1]), "A18b": Value(single[0], by, single[1])}


def _ten_storey(options: CaseOptions) -> Outcomes:
    """Return Table 2 of P4 under the 1940 El Centro record."""
    printed = printed_columns("P4 Table 2", "P4-T2")
    names = [table_id("P4-T2", law, row) for law, rows in printed.items() for row in rows]
    if not _has("ground_motions", "elcentro_NS.dat"):
        reason = Missing(NO_DATA.format(what="the El Centro record"))
        return dict.fromkeys([*names, "F6-p4-indices", "F6-p4-voltage"], reason)
    motion = load_motion("elcentro-ns", np.random.default_rng(options.seed), unit="g").in_components(1)
    chain = damper_from_parameter_set(load_parameter_set("dampers", "p4-1000kn")).chain()
    study = ten_storey_study(
        ten_storey("ten-storey"), motion, device=bingham_device(_DEVICE), chain=chain, filter_rate=options.filter_rate
    )
    cases = {law: study.case(law) for law in printed}
    by = "ten-storey frame of 2 pi rad/s, modified Bouc-Wen damper, 1940 El Centro record"
    found: Outcomes = {
        table_id("P4-T2", law, row): Value(cases[law].indices[row], by) for law, rows in printed.items() for row in rows
    }
    strong, plain = cases["kelvin-0.7"], cases["vd"]
    found["F6-p4-indices"] = Value([strong.indices[row] / plain.indices[row] for row in printed["vd"]], by)

    def voltage(case: TenStoreyCase) -> float:
        return float(np.mean(np.abs(case.response.voltages)))

    found["F6-p4-voltage"] = Value([voltage(cases[law]) / voltage(plain) for law in ("kelvin-0.3", "kelvin-0.7")], by)
    return found


def _falls(indices: Mapping[str, Mapping[str, float]], first: str, second: str) -> tuple[float, str]:
    """Return how many indices are smaller under the second law, and which are not."""
    rising = [name for name, value in indices[first].items() if indices[second][name] >= value]
    return float(len(indices[first]) - len(rising)), f"not {', '.join(rising)}" if rising else ""


def _benchmark_findings(
    prefix: str, part: str, table: str, indices: Mapping[str, Mapping[str, float]], by: str, compared: tuple[str, ...]
) -> Outcomes:
    """Return the numbers of a table of chapter 6 and what the thesis says of them."""
    found: Outcomes = {
        table_id(part, law, row): Value(indices[law][row], by)
        for law, rows in printed_columns(table, part).items()
        for row in rows
    }
    for name, first, second in (("vdns", "vd", "vdns"), ("fdns", *_second_pair(prefix))):
        count, said = _falls(indices, first, second)
        found[f"{prefix}-{name}"] = Value(count, by, said)
    found[f"{prefix}-lqg"] = Value([indices["fdns"][row] / indices["lqg"][row] for row in compared], by)
    return found


def _second_pair(prefix: str) -> tuple[str, str]:
    # section 6.2.2 compares fdns with vdns, section 6.3.2 with vd
    return ("vdns", "fdns") if prefix == "F6-isolated" else ("vd", "fdns")


def _isolated(options: CaseOptions) -> Outcomes:
    """Return Table 6.2: the linear building of appendix A with two dampers, by the formula of the inverse."""
    published = _has("asce_base_isolated", "STRUC.mat") and _has("asce_base_isolated", "elcentro.txt")
    folder = public_data_directory()
    building = (
        published_building(folder / "asce_base_isolated" / "STRUC.mat")
        if published and folder is not None
        else surrogate_building()
    )
    motion: GroundMotion = load_motion(
        "elcentro" if published else "synthetic", np.random.default_rng(options.seed)
    ).in_components(2)
    study = isolation_study(
        building,
        device=bingham_device(_DEVICE),
        network=None,
        damping_ratio=options.isolation_damping_ratio,
        stiffness_share=options.isolation_stiffness_share,
        lqg=options.isolation_lqg,
    )
    free, cases = run_cases(study, motion, _LAWS)
    model = "published matrices, El Centro" if published else "surrogate of the building, synthetic motion"
    by = f"building of appendix A with linear bearings ({model})"
    found = _benchmark_findings(
        "F6-isolated", "T6.2", "Table 6.2", {case.law: case.indices for case in cases}, by, ("J1", "J3", "J5", "J7")
    )
    shear = float(np.linalg.norm(isolated_response(building, free).base_shear_n, axis=1).max())
    found["A20a"] = Value(2.0 * _RATED_N / shear, by, f"the base shear without dampers is {shear / 1e6:.1f} MN")
    return found


def _tower_modes(tower: Tower) -> tuple[FloatArray, FloatArray, float]:
    """Return frequencies [Hz] and damping ratios of the first five modes, and floor 1 over the top in the first."""
    model = modal_model(tower.model, 5)
    share = abs(float(model.shapes[0, 0] / model.shapes[-1, 0]))
    return model.angular_frequencies / (2.0 * np.pi), model.damping_ratios, share


def _wind(options: CaseOptions) -> Outcomes:
    """Return Table 6.3: the tower with one damper between ground and first floor in synthetic across-wind."""
    published = _has("tall76", "76dof_MKC_matrix.mat")
    reference = tower_of("published" if published else None, "wind-surrogate")
    model = "published matrices" if published else "surrogate of the tower"
    found: Outcomes = {}
    hertz, zeta, share = _tower_modes(reference)
    if published:
        by = f"tower ({model})"
        found |= {"A19": Value(zeta, by), "T6-frequencies": Value(hertz, by), "A20b": Value(share, by)}
    else:
        # the surrogate is fitted to the printed frequencies and to the damping of the benchmark
        missing = Missing(NO_DATA.format(what="the matrices of the tower"))
        found |= dict.fromkeys(("A19", "T6-frequencies", "A20b"), missing)
    load = synthetic_wind(
        np.random.default_rng(options.seed),
        FLOORS,
        HEIGHT_M,
        WIDTH_M,
        duration_s=options.wind_duration_s,
        interval_s=options.wind_interval_s,
        climate=options.climate,
    )
    study = wind_study(
        reference,
        reference,
        load,
        device=bingham_device(_DEVICE),
        network=None,
        stiffness_share=options.wind_stiffness_share,
        tuned_mass_kg=options.tuned_mass_kg,
        lqg=options.wind_lqg,
        modes=options.wind_modes,
        time_step_s=_WIND_STEP_S,
        filter_rate=options.filter_rate,
    )
    cases = run_wind_cases(study, _LAWS)
    by = f"tower with a damper at the ground ({model}), synthetic wind of {options.wind_duration_s:g} s"
    return found | _benchmark_findings(
        "F6-wind", "T6.3", "Table 6.3", {case.law: case.indices for case in cases}, by, ("J1", "J3", "J7", "J9")
    )


def chapter_6(frame: Frame, options: CaseOptions, progress: Progress) -> Outcomes:
    """Return the outcomes of chapter 6, P4 and the appendices.

    Parameters
    ----------
    frame
        Frame of the regulator of appendix E.
    options
        Options of the benchmark structures.
    progress
        Receives the share that is done.
    """
    found: Outcomes = {**_ten_storey_structure(), **_units(), **_regulator(frame)}
    parts: tuple[tuple[str, Callable[[CaseOptions], Outcomes]], ...] = (
        ("ten storeys", _ten_storey),
        ("base-isolated building", _isolated),
        ("tower in wind", _wind),
    )
    for number, (name, part) in enumerate(parts):
        progress(number / len(parts), name)
        found |= part(options)
    return found
