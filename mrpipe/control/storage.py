"""Calibration in control.h5 and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.control.calibration import Calibration, gains_to_json
from mrpipe.control.controller import Gains
from mrpipe.control.limits import attainable_damping, attainable_damping_friction, optimal_force_ratio
from mrpipe.control.lqg import Weights
from mrpipe.control.neural import ReferenceNetwork
from mrpipe.errors import UserError
from mrpipe.networks.network import Network, read_network, write_network


def finite(value: float) -> float | None:
    """Return a number that JSON can hold; None for NaN and infinities."""
    return float(value) if math.isfinite(value) else None


def calibration_to_json(calibration: Calibration) -> dict[str, Any]:
    """Return what `--json` prints: limiting frequencies and every law."""
    modes = calibration.modes
    laws: dict[str, Any] = {}
    for law, item in calibration.laws.items():
        laws[law] = {
            **({} if law == "lqg" else gains_to_json(law, item.gains)),
            "damping_ratio_estimate": finite(item.damping_ratio_estimate),
            "damping_ratio_exact": finite(item.damping_ratio_exact),
            "damping_ratio_exact_with_frame": finite(item.damping_ratio_with_frame),
            "damping_ratio_clipped": finite(item.damping_ratio_clipped),
            "fastest_pole_1_s": finite(item.unstable_pole_1_s),
            "candidates": {source: gains_to_json(law, gains) for source, gains in item.candidates.items()},
        }
    return {
        "target_mode": modes.mode,
        "omega_0": modes.omega_0,
        "omega_inf": modes.omega_inf,
        "nu": modes.nu,
        "u_0": modes.u_0,
        "kappa": modes.kappa,
        "static_stiffness_n_m": calibration.static_stiffness_n_m,
        "attainable_damping_ratio": {
            "vd": attainable_damping(modes),
            "vdns": finite(attainable_damping(modes, calibration.laws["vdns"].gains.k_n_m)),
            "fdns": attainable_damping_friction(modes),
        },
        "optimal_force_ratio_n_m": optimal_force_ratio(modes),
        "laws": laws,
    }


def write_calibration(
    artifact: ArtifactWriter,
    calibration: Calibration,
    position: FloatArray,
    weights: Weights,
    reference: ReferenceNetwork,
    friction_rounding_m_s: float,
) -> None:
    """Write modes, gains, regulator, the network of nnc, and the speed over which friction changes its sign [m/s]."""
    modes = calibration.modes
    for name, unit in (("omega_0", "rad/s"), ("omega_inf", "rad/s"), ("nu", "m/N"), ("u_0", "kg^-1/2"), ("kappa", "1")):
        artifact.put(name, getattr(modes, name), unit=unit)
    artifact.put("static_stiffness", calibration.static_stiffness_n_m, unit="N/m")
    artifact.put("friction_rounding", friction_rounding_m_s, unit="m/s")
    artifact.put("position", position, unit="1", dims=("floor",))
    artifact.put("shape_0", modes.shape_0, unit="kg^-1/2", dims=("floor",))
    artifact.put("shape_inf", modes.shape_inf, unit="kg^-1/2", dims=("floor",))
    artifact.put("lqg/regulator_gain", calibration.regulator_gain, unit="N/m and N*s/m", dims=("state",))
    artifact.put_json("lqg/weights", asdict(weights))
    for law, item in calibration.laws.items():
        for key, unit in (("c_n_s_m", "N*s/m"), ("k_n_m", "N/m"), ("alpha_n_m", "N/m")):
            artifact.put(f"laws/{law}/{key}", getattr(item.gains, key), unit=unit)
        for key in ("damping_ratio_estimate", "damping_ratio_exact", "damping_ratio_with_frame"):
            artifact.put(f"laws/{law}/{key}", getattr(item, key), unit="1")
    write_network(artifact, "nnc/network", reference.network)


def read_gains(artifact: Artifact, law: str) -> Gains:
    """Return the gains of a law.

    Raises
    ------
    UserError
        If the law was not calibrated.
    """
    if law not in artifact.members("laws"):
        known = ", ".join(artifact.members("laws")) or "none"
        raise UserError(artifact.path, f"laws/{law}", "this law is not calibrated", f"calibrated: {known}")
    return Gains(**{key: artifact.scalar(f"laws/{law}/{key}") for key in ("c_n_s_m", "k_n_m", "alpha_n_m")})


def read_reference(artifact: Artifact) -> Network:
    """Return the network of law nnc."""
    return read_network(artifact, "nnc/network")


def read_weights(artifact: Artifact) -> Weights:
    """Return the weights of law lqg."""
    return Weights(**artifact.json("lqg/weights"))


def map_rows(axes: Mapping[str, FloatArray], values: FloatArray) -> list[dict[str, float | None]]:
    """Return a map as rows for a table: each axis, then `damping_ratio`."""
    names = list(axes)
    grids = np.meshgrid(*axes.values(), indexing="ij")
    return [
        {**{name: float(grid[place]) for name, grid in zip(names, grids, strict=True)}, "damping_ratio": finite(value)}
        for place, value in np.ndenumerate(values)
    ]
