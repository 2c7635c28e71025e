"""Settings of the benchmark structures."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.config.section import Section


class MotionSettings(Section):
    """A ground motion."""

    file: str = Field(
        "synthetic",
        description="Record: `synthetic` (spectrum-compatible, seeded), a path (AT2, text, csv, mat), or the name of a "
        "public record where the public data are there: elcentro, erzikan, jiji, kobe, newhall, rinaldi, sylmar, "
        "elcentro-ns.",
    )
    second_file: str | None = Field(
        None, description="Record of the second horizontal component, where each has a file of its own (AT2)."
    )
    unit: str | None = Field(
        None, description="Unit of the samples (g, cm/s^2, m/s^2); null: as the header says or the peak shows."
    )
    interval_s: float | None = Field(
        None, gt=0.0, description="Sampling interval [s] of a record with neither clock nor DT; null: the file's."
    )
    resampled_interval_s: float | None = Field(
        None, gt=0.0, description="Bring the record to this interval [s] without aliasing; null: leave it."
    )
    peak_ground_g: float = Field(
        0.3, gt=0.0, description="Design ground acceleration on rock of the synthetic motion [g]."
    )
    duration_s: float = Field(30.0, gt=5.0, description="Length of the synthetic motion [s].")


class TenStoreySettings(Section):
    """The ten-storey frame of paper P4."""

    motion: MotionSettings = Field(default_factory=MotionSettings, description="Ground motion.")
    laws: tuple[str, ...] = Field(
        ("vd", "kelvin-0.3", "kelvin-0.7", "passive-off", "passive-on"),
        description="Laws: vd, kelvin-SHARE (that share of the storey stiffness as negative stiffness), passive-off, "
        "passive-on.",
    )
    structures: tuple[str, ...] = Field(
        ("ten-storey", "ten-storey-heavy"),
        min_length=1,
        description="Parameter sets in configs/structures (or YAML files); the first one is the result, the others are "
        "shown beside it. errata row 16: the printed mass, and the one that suits a 1000 kN damper.",
    )
    damper: str = Field("p4-1000kn", description="Parameter set in configs/dampers that stands for the damper.")
    inverse: str = Field("bingham-1000kn", description="Bingham parameter set in configs/dampers that is inverted.")
    filter_rate_1_s: float = Field(31.4, ge=0.0, description="Rate lambda of the voltage filter (24) [1/s]; 0: none.")
    time_step_s: float = Field(0.0005, gt=0.0, le=0.005, description="Longest time step [s].")
    dampers: tuple[float, ...] = Field(
        (0.25, 0.5, 1.0, 2.0, 4.0), description="Numbers of dampers side by side at which the sensitivity is computed."
    )


class BenchmarkSettings(Section):
    """The benchmark structures of chapter 6 and paper P4."""

    ten_storey: TenStoreySettings = Field(
        default_factory=TenStoreySettings, description="The ten-storey frame of paper P4."
    )
    inputs_digest: str = Field(
        "",
        description="Digest of the model and motion files that the command was given; the command sets it, so that a "
        "file that changed makes the stage stale.",
    )


Benchmark = Literal["ten-storey", "base-isolated", "wind"]
"""Names of the benchmarks."""
