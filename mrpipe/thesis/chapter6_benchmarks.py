"""Benchmark figures that need public records: P4's Table 2, and the base shear of the base-isolated building."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mrpipe.artifacts import load_parameter_set, public_data_directory
from mrpipe.case_studies.base_isolated.structure import published_building
from mrpipe.case_studies.base_isolated.study import isolated_response
from mrpipe.case_studies.model import modal_model
from mrpipe.case_studies.motion import load_motion
from mrpipe.case_studies.run import BinghamDevice, simulate
from mrpipe.case_studies.ten_storey.structure import ten_storey
from mrpipe.case_studies.ten_storey.study import THESIS, ten_storey_study
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.thesis.claim import Claim, cannot, compare

_MISSING = "the public records are not here: set MRPIPE_DATA to their folder"
_PRINTED_J6 = [0.67, 0.48, 0.33, 0.12]
_RATED_N = 1.0e6


def _public(*parts: str) -> Path | None:
    folder = public_data_directory()
    path = None if folder is None else folder.joinpath(*parts)
    return path if path is not None and path.exists() else None


def _device() -> BinghamDevice:
    values = load_parameter_set("dampers", "bingham-1000kn")
    return BinghamDevice(
        *(values.scalar(name) for name in ("yield_force_a", "yield_force_b", "c0_a", "c0_b", "drive_limit"))
    )


def ten_storey_claims() -> list[Claim]:
    """Return Table 2 of P4 compared with our runs under the 1940 El Centro record."""
    record = _public("ground_motions", "elcentro_NS.dat")
    if record is None:
        return [
            cannot(f"P4-{law}", 6, f"P4 Table 2, {law}: J1 to J4", list(row.values()), _MISSING)
            for law, row in THESIS.items()
        ]
    motion = load_motion(str(record), np.random.default_rng(0), unit="g").in_components(1)
    chain = damper_from_parameter_set(load_parameter_set("dampers", "p4-1000kn")).chain()
    study = ten_storey_study(ten_storey("ten-storey"), motion, device=_device(), chain=chain)
    why = (
        "mass and stiffness of P4 do not belong together (row 16), the frame's damping, the gains and the part of the "
        "record are not printed; ours is the undamped frame of 2 pi rad/s with gains by the closed forms"
    )
    return [
        compare(
            f"P4-{law}",
            6,
            f"P4 Table 2, {law}: J1 to J4",
            list(row.values()),
            list(study.case(law).indices.values()),
            0.1,
            why,
        )
        for law, row in THESIS.items()
    ]


def isolated_claims() -> list[Claim]:
    """Return what two dampers of 1000 kN can be against the uncontrolled base shear under El Centro."""
    what = "J6 of Table 6.2 (four controllers) against two dampers of 1000 kN over the base shear under El Centro"
    file, record = _public("asce_base_isolated", "STRUC.mat"), _public("asce_base_isolated")
    motions = sorted(record.glob("**/*lcentro*")) if record is not None else []
    if file is None or not motions:
        return [cannot("A20a", 6, what, _PRINTED_J6, _MISSING)]
    building = published_building(file)
    motion = load_motion(str(motions[0]), np.random.default_rng(0), unit="cm/s^2").in_components(2)
    modal = modal_model(building.model)
    free = simulate(modal, motion.acceleration_m_s2[:, :2], motion.interval_s, ratio=5)
    shear = float(np.linalg.norm(isolated_response(building, free).base_shear_n, axis=1).max())
    share = 2.0 * _RATED_N / shear
    why = (
        f"uncontrolled the base shear is {shear / 1e6:.1f} MN on the published building with linear bearings: two "
        "dampers of 1 MN cannot reach more than this share"
    )
    return [compare("A20a", 6, what, _PRINTED_J6, [share] * 4, 0.1, why)]
