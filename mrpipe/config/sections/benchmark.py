"""Settings of the benchmark structures."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.case_studies.options import LqgWeights, MotionSettings, WindClimate
from mrpipe.options import Section


class TenStoreySettings(Section):
    """The ten-storey frame of paper P4."""

    motion: MotionSettings = Field(MotionSettings(), description="Ground motion.")
    laws: tuple[str, ...] = Field(
        ("vd", "kelvin-0.3", "kelvin-0.7", "passive-off", "passive-on"),
        description="Laws: vd, kelvin-SHARE (that share of the storey stiffness as negative stiffness), passive-off, "
        "passive-on.",
    )
    structures: tuple[str, ...] = Field(
        ("ten-storey", "ten-storey-heavy"),
        min_length=1,
        description="Parameter sets in configs/structures (or YAML files); the first one is the result, the others are "
        "shown for comparison. They have the printed mass, and the mass that suits a 1000 kN damper (errata, row 16).",
    )
    damper: str = Field(
        "p4-1000kn",
        description="Parameter set in configs/dampers for the damper, or a damper artifact (.h5).",
    )
    inverse: str = Field("bingham-1000kn", description="Bingham parameter set in configs/dampers that is inverted.")
    filter_rate_1_s: float = Field(31.4, ge=0.0, description="Rate lambda of the voltage filter (24) [1/s]; 0: none.")
    time_step_s: float = Field(0.0005, gt=0.0, le=0.005, description="Longest time step [s].")
    dampers: tuple[float, ...] = Field(
        (0.25, 0.5, 1.0, 2.0, 4.0), description="Numbers of parallel dampers for which the sensitivity is computed."
    )


class BaseIsolatedSettings(Section):
    """The base-isolated building of section 6.2."""

    model: str | None = Field(
        None,
        description="Path of the published STRUC.mat; `published` for that of the public data; null: the surrogate.",
    )
    surrogate: str = Field(
        "base-isolated-surrogate", description="Parameter set in configs/structures (or YAML file) of the surrogate."
    )
    bearing_stiffness_n_m: float = Field(
        919.422e3, gt=0.0, description="Stiffness of each bearing of the published model [N/m]."
    )
    bearing_viscosity_n_s_m: float = Field(
        27.717e3, ge=0.0, description="Viscosity of each bearing of the published model [N s/m]."
    )
    motion: MotionSettings = Field(MotionSettings(), description="Ground motion of two components.")
    all_motions: bool = Field(False, description="Whether all seven public motions are run (--all).")
    laws: tuple[str, ...] = Field(
        ("vd", "vdns", "fdns", "lqg", "lqg-clipped", "passive-off", "passive-on"),
        min_length=1,
        description="Laws: vd, vdns, fdns (MR dampers), lqg (ideal actuators), lqg-clipped (MR dampers), passive-off, "
        "passive-on.",
    )
    damper: str = Field("bingham-1000kn", description="Bingham parameter set in configs/dampers.")
    neural_inverse: bool = Field(
        True,
        description="Whether the voltage comes from a neural inverse of the damper, as in the thesis; otherwise from "
        "the formula.",
    )
    hidden_neurons: int = Field(6, ge=2, le=20, description="Neurons of both hidden layers of the neural inverse.")
    damping_ratio: float = Field(
        0.1, gt=0.0, lt=0.6, description="Damping ratio of the isolation modes to which vd, vdns and fdns are set."
    )
    stiffness_share: float = Field(
        0.2, ge=0.0, lt=0.9, description="Share of the stiffness of the isolation that vdns compensates."
    )
    lqg: LqgWeights = Field(LqgWeights(), description="Weights of LQG.")
    time_step_s: float = Field(0.001, gt=0.0, le=0.005, description="Longest time step [s].")
    dampers: tuple[float, ...] = Field(
        (1.0, 2.0, 5.0, 10.0, 20.0),
        description="Numbers of dampers at each of the two positions for which the sensitivity is computed.",
    )


class WindLoadSettings(WindClimate):
    """Across-wind forces on the floors."""

    file: str = Field(
        "synthetic",
        description="`synthetic` (spectral representation, seeded) or a file of forces on the 76 floors (text, csv, "
        "mat, npy; one row per sample, the first column may be the time).",
    )
    unit: str = Field("kN", description="Unit of the forces in a file.")
    interval_s: float | None = Field(None, gt=0.0, description="Sampling interval of a file without a clock [s].")
    duration_s: float = Field(900.0, gt=10.0, description="Length of the synthetic load [s].")
    synthetic_interval_s: float = Field(0.05, gt=0.0, le=0.2, description="Sampling of the synthetic load [s].")


class WindSettings(Section):
    """The 76-storey tower of section 6.3."""

    model: str | None = Field(
        None,
        description="Path of the published matrices (M76, C76, K76); `published` for those of the public data; null: "
        "the surrogate model.",
    )
    surrogate: str = Field(
        "wind-surrogate", description="Parameter set in configs/structures (or YAML file) of the surrogate."
    )
    load: WindLoadSettings = Field(WindLoadSettings(), description="The across-wind load on the floors.")
    laws: tuple[str, ...] = Field(
        ("vd", "vdns", "fdns", "lqg", "lqg-clipped", "passive-off", "passive-on"),
        min_length=1,
        description="Laws: vd, vdns, fdns (MR dampers), lqg (ideal actuator), lqg-clipped (MR dampers), passive-off, "
        "passive-on.",
    )
    position: Literal["ground", "outrigger", "tuned-mass"] = Field(
        "ground",
        description="Position of the damper: `ground` (between ground and floor 1, as the thesis), `outrigger`, or "
        "`tuned-mass` (between the top floor and a tuned mass, as the original benchmark).",
    )
    dampers: float | None = Field(
        None,
        gt=0.0,
        description="Number of parallel 1000 kN dampers; null: 1 (ground), 8 (outrigger), 0.1 (tuned mass).",
    )
    outrigger_floor: int = Field(40, ge=2, le=75, description="Floor of the outrigger.")
    outrigger_arm_m: float = Field(21.0, gt=0.0, description="Distance from the core to the damper [m].")
    tuned_mass_kg: float = Field(500e3, gt=0.0, description="Tuned mass on the top floor [kg].")
    tuned_frequency_ratio: float = Field(
        0.99, gt=0.5, lt=1.5, description="Frequency of the tuned mass over the first one of the tower."
    )
    damper: str = Field("bingham-1000kn", description="Bingham parameter set in configs/dampers.")
    neural_inverse: bool = Field(
        True,
        description="Whether the voltage comes from a neural inverse of the damper, as in the thesis; otherwise from "
        "the formula.",
    )
    hidden_neurons: int = Field(6, ge=2, le=20, description="Neurons of both hidden layers of the neural inverse.")
    filter_rate_1_s: float = Field(
        31.4, ge=0.0, description="Rate of the voltage filter, (24) of P4 [1/s]; 0: no filter, so that voltages jump."
    )
    stiffness_share: float = Field(
        0.5, ge=0.0, lt=0.95, description="Share of the static stiffness at the damper that vdns compensates."
    )
    lqg: LqgWeights = Field(
        LqgWeights(displacement=1000.0, acceleration=10.0, force_n=1e6, interval_s=0.001),
        description="Weights of LQG; the force is that of one damper.",
    )
    modes: int = Field(23, ge=5, le=76, description="Modes kept of the tower: twice as many states.")
    time_step_s: float = Field(0.001, gt=0.0, le=0.01, description="Longest time step [s].")
    capacities: tuple[float, ...] | None = Field(
        None,
        description="Multiples of the dampers at which the sensitivity is computed; null: 1 to 100 at the ground, 0.25 "
        "to 4 elsewhere.",
    )


class BenchmarkSettings(Section):
    """The benchmark structures of chapter 6 and paper P4."""

    ten_storey: TenStoreySettings = Field(TenStoreySettings(), description="The ten-storey frame of paper P4.")
    base_isolated: BaseIsolatedSettings = Field(
        BaseIsolatedSettings(), description="The base-isolated building of section 6.2."
    )
    wind: WindSettings = Field(WindSettings(), description="The 76-storey tower of section 6.3.")


Benchmark = Literal["ten-storey", "base-isolated", "wind"]
"""Names of the benchmarks."""
