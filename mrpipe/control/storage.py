"""Calibration in control.h5 and as JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.control.calibration import Calibration
from mrpipe.control.gains import NAMES, Gains, GainsSource
from mrpipe.control.laws import law_named
from mrpipe.control.limits import attainable_damping, attainable_damping_friction, optimal_force_ratio
from mrpipe.control.lqg import Weights
from mrpipe.control.neural import ReferenceNetwork
from mrpipe.errors import UserError
from mrpipe.networks.network import Network, read_network, write_network


def finite(value: float) -> float | None:
    """Return a number that JSON can hold; None for NaN and infinities."""
    return float(value) if math.isfinite(value) else None


def calibration_to_json(calibration: Calibration) -> dict[str, Any]:
    """Return the calibration as `--json` prints it: limiting frequencies and every law."""
    modes = calibration.modes
    laws: dict[str, Any] = {}
    for name, item in calibration.laws.items():
        law = law_named(name)
        laws[name] = {
            **law.gains_as_json(item.gains),
            "damping_ratio_estimate": finite(item.damping_ratio_estimate),
            "damping_ratio_exact": finite(item.damping_ratio_exact),
            "damping_ratio_exact_with_frame": finite(item.damping_ratio_with_frame),
            "damping_ratio_clipped": finite(item.damping_ratio_clipped),
            "fastest_pole_1_s": finite(item.unstable_pole_1_s),
            "candidates": {source: law.gains_as_json(gains) for source, gains in item.candidates.items()},
        }
    return {
        "target_mode": modes.mode,
        "omega_0": modes.omega_0,
        "omega_inf": finite(modes.omega_inf),
        "nu": modes.nu,
        "u_0": modes.u_0,
        "kappa": modes.kappa,
        "static_stiffness_n_m": calibration.static_stiffness_n_m,
        "attainable_damping_ratio": _attainable(calibration),
        "optimal_force_ratio_n_m": optimal_force_ratio(modes),
        "laws": laws,
        "skipped": dict(calibration.skipped),
    }


def _attainable(calibration: Calibration) -> dict[str, float | None]:
    modes, laws = calibration.modes, calibration.laws
    found: dict[str, float | None] = {"vd": attainable_damping(modes), "fdns": attainable_damping_friction(modes)}
    if "vdns" in laws:
        found["vdns"] = finite(attainable_damping(modes, laws["vdns"].gains.k_n_m))
    return found


def write_calibration(
    artifact: ArtifactWriter,
    calibration: Calibration,
    position: FloatArray,
    weights: Weights,
    reference: ReferenceNetwork | None,
    friction_rounding_m_s: float,
    amplitude_m: float,
    residual_force_n: float,
) -> None:
    """Write modes, gains, regulator, reference network, and the speed over which friction changes its sign."""
    modes = calibration.modes
    for name, unit in (("omega_0", "rad/s"), ("omega_inf", "rad/s"), ("nu", "m/N"), ("u_0", "kg^-1/2"), ("kappa", "1")):
        artifact.put(name, getattr(modes, name), unit=unit)
    artifact.put("static_stiffness", calibration.static_stiffness_n_m, unit="N/m")
    artifact.put("friction_rounding", friction_rounding_m_s, unit="m/s")
    artifact.put("amplitude", amplitude_m, unit="m")
    artifact.put("residual_force", residual_force_n, unit="N")
    artifact.put_json("skipped", dict(calibration.skipped))
    artifact.put("position", position, unit="1", dims=("floor",))
    artifact.put("top_0", modes.top_0, unit="kg^-1/2")
    artifact.put("shape_0", modes.shape_0, unit="kg^-1/2", dims=("floor",))
    artifact.put("shape_inf", modes.shape_inf, unit="kg^-1/2", dims=("floor",))
    artifact.put("lqg/regulator_gain", calibration.regulator_gain, unit="N/m and N*s/m", dims=("state",))
    artifact.put_json("lqg/weights", asdict(weights))
    for law, item in calibration.laws.items():
        for key, unit in zip(NAMES, ("N*s/m", "N/m", "N/m"), strict=True):
            artifact.put(f"laws/{law}/{key}", item.gains[key], unit=unit)
        artifact.put_json(f"laws/{law}/gains", dict(item.gains))
        for key in ("damping_ratio_estimate", "damping_ratio_exact", "damping_ratio_with_frame"):
            artifact.put(f"laws/{law}/{key}", getattr(item, key), unit="1")
    if reference is not None:
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
    return Gains(**artifact.json(f"laws/{law}/gains"))


@dataclass(frozen=True)
class Calibrated:
    """Contents of control.h5 from which controllers are built.

    Attributes
    ----------
    position
        Connectivity vector w of the damper, shape (n,).
    omega_0, u_0
        Free frequency [rad/s] and amplitude at the damper [1/sqrt(kg)] of the target mode.
    top_0
        Amplitude of the target mode at the top floor [1/sqrt(kg)].
    amplitude_m, residual_force_n
        Expected amplitude of the damper [m], and its force without drive at this amplitude [N].
    friction_rounding_m_s
        Speed over which friction changes its sign [m/s].
    weights
        Weights of the laws that are optimal regulators.
    gains
        Law -> its calibrated gains.
    reference
        Network of the laws that need one; None if it was not trained.
    skipped
        Law that could not be calibrated -> reason.
    path
        Path of the file, for messages.
    designed
        Law -> gains of the stage `design`, which replace the calibrated ones; empty: none.
    """

    position: FloatArray
    omega_0: float
    u_0: float
    top_0: float
    amplitude_m: float
    residual_force_n: float
    friction_rounding_m_s: float
    weights: Weights
    gains: Mapping[str, Gains]
    reference: Network | None
    skipped: Mapping[str, str] = field(default_factory=dict)
    path: str = "control.h5"
    designed: Mapping[str, Gains] = field(default_factory=dict)

    def gains_of(self, law: str) -> Gains:
        """Return the gains of a law; empty for a law without calibration.

        Raises
        ------
        UserError
            If the law needs a calibration that does not exist.
        """
        if law in self.designed:
            return self.designed[law]
        if self.designed and law_named(law).gains:
            raise UserError("--gains", "design", f"the design has no gains of law {law}", "add it to design.laws")
        if law in self.gains:
            return self.gains[law]
        if law_named(law).calibrated:
            if law in self.skipped:
                raise UserError(self.path, f"laws/{law}", f"was skipped: {self.skipped[law]}", "choose another law")
            known = ", ".join(self.gains) or "none"
            raise UserError(self.path, f"laws/{law}", "this law is not calibrated", f"calibrated: {known}")
        return Gains()


def read_calibrated(artifact: Artifact) -> Calibrated:
    """Read the data from which controllers are built.

    Raises
    ------
    UserError
        If the file holds the calibration of several dampers.
    """
    if "dampers" in artifact.members():
        remedy = "use mrpipe simulate without --law, or mrpipe design; or leave structure.dampers out"
        raise UserError(artifact.path, "dampers", "holds the calibration of several dampers", remedy)
    trained = "nnc" in artifact.members()
    return Calibrated(
        position=artifact.array("position"),
        omega_0=artifact.scalar("omega_0"),
        u_0=artifact.scalar("u_0"),
        top_0=artifact.scalar("top_0"),
        amplitude_m=artifact.scalar("amplitude"),
        residual_force_n=artifact.scalar("residual_force"),
        friction_rounding_m_s=artifact.scalar("friction_rounding"),
        weights=Weights(**artifact.json("lqg/weights")),
        gains={law: read_gains(artifact, law) for law in artifact.members("laws")},
        reference=read_network(artifact, "nnc/network") if trained else None,
        skipped=artifact.json("skipped"),
        path=str(artifact.path),
    )


def read_calibrated_with(artifact: Callable[[str], Artifact], source: GainsSource) -> Calibrated:
    """Return the data from which controllers are built, with the gains of a source.

    Parameters
    ----------
    artifact
        Function that opens the artifact of a stage by its name. It opens `design` only if the gains of the design are
        used.
    source
        Source of the gains.
    """
    found = read_calibrated(artifact("calibrate"))
    if source == "calibrated":
        return found
    design = artifact("design")
    return replace(found, designed={law: Gains(**design.json(f"laws/{law}/gains")) for law in design.members("laws")})
