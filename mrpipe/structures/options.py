"""Settings of a structure that is given by matrices, a storey table or modes instead of being identified."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from pydantic import Field, field_validator

from mrpipe.options import Section


class Storey(Section):
    """One row of a storey table, lowest storey first."""

    mass_kg: float = Field(..., gt=0.0, description="Mass of the floor above the storey.")
    stiffness_n_m: float = Field(..., gt=0.0, description="Lateral stiffness of the storey.")
    height_m: float | None = Field(
        None,
        gt=0.0,
        description="Height of the storey; if all storeys have one, the report draws the mode shapes over the height.",
    )
    repeat: int = Field(1, ge=1, description="Number of successive storeys with these properties.")


class StoreyColumn(Section):
    """One quantity of a storey table, with its unit."""

    name: str = Field("", description="Column in `storey_table.file`.")
    values: tuple[float, ...] = Field((), description="Values, lowest storey first, if there is no file.")
    unit: str = Field(
        "",
        description="Unit, such as t, kip*s^2/in, kN/mm, ft; empty: that in the name of the column, else SI, which a "
        "warning states.",
    )


class StoreyTable(Section):
    """A storey table with units, from a file or as lists."""

    file: str = Field("", description="File with a row for each storey, lowest storey first (.csv, .mat, .h5, .json).")
    mass: StoreyColumn = Field(StoreyColumn(name="mass"), description="Mass of the floor above each storey.")
    stiffness: StoreyColumn = Field(StoreyColumn(name="stiffness"), description="Lateral stiffness of each storey.")
    height: StoreyColumn = Field(StoreyColumn(), description="Height of each storey; without name and values: unknown.")

    @property
    def given(self) -> bool:
        """Whether a table is given."""
        return bool(self.file or self.mass.values)


class MatrixEntry(Section):
    """Where a matrix is, and its unit."""

    file: str = Field("", description="File of the matrix (.mat, .csv, .h5, .json); empty: `structure.file`.")
    name: str = Field(
        "", description="Variable in the file, such as M or model.K; empty for a CSV file that holds this matrix only."
    )
    unit: str = Field("", description="Unit of the entries, such as kg, t, kN/m; empty: SI, which a warning states.")


class DamperSettings(Section):
    """One damper of a structure: where it sits, what it is, and which law drives it."""

    name: str = Field("", description="Name in tables and files; empty: `damper 1` and so on.")
    between: tuple[str | int, str | int] = Field(
        ...,
        description="The two degrees of freedom that it connects, by name or number from 1; `ground` for the ground.",
    )
    brace_stiffness_n_m: float | None = Field(
        None, gt=0.0, description="Stiffness of the brace in series with the damper; null: rigid."
    )
    damper: str = Field(
        "", description="Damper model, as in `calibrate.damper`; empty: the damper of `calibrate.damper`."
    )
    law: str = Field(
        "vd",
        description="Control law. All dampers with `lqg` share one regulator and one observer; every other law reads "
        "the sensors of its damper only.",
    )
    gains: dict[str, float] = Field(
        {}, description="Gains of the law by name, such as {c_n_s_m: 250}; gains that are left out are calibrated."
    )
    target_mode: int | None = Field(
        None, ge=1, description="Mode that this damper is calibrated for; null: `calibrate.target_mode`."
    )
    expected_amplitude_m: float | None = Field(
        None, gt=0.0, description="Expected amplitude of this damper; null: `calibrate.expected_amplitude_m`."
    )
    sensors: tuple[Literal["displacement", "acceleration", "velocity"], ...] = Field(
        ("displacement", "acceleration"),
        min_length=1,
        description="Sensors at this damper. `displacement` and `acceleration` feed the Kalman filter, `displacement` "
        "alone gives the velocity by differences, and `velocity` is a velocity sensor. A law that reads the damper "
        "force has a load cell.",
    )


class ReductionSettings(Section):
    """Reduction of a large structure to few degrees of freedom."""

    method: Literal["none", "guyan", "craig-bampton", "modal", "balanced"] = Field(
        "none",
        description="`guyan`: static condensation; `craig-bampton`: static condensation plus fixed-interface modes; "
        "`modal`: the lowest modes; `balanced`: the shapes that ground motion and forces on `keep` excite most. The "
        "degrees of freedom in `keep` stay.",
    )
    keep: tuple[str | int, ...] = Field((), description="Degrees of freedom that stay, by name or number from 1.")
    modes: int = Field(
        10,
        ge=1,
        description="Number of modes that are kept (craig-bampton: fixed-interface modes; balanced: all coordinates).",
    )
    band_high_hz: float | None = Field(
        None,
        gt=0.0,
        description="Highest frequency at which the error is stated; null: that of the last mode kept (`modal`), else "
        "half the last frequency of the reduced structure, and at least 1.5 times its first one.",
    )


class StructureSettings(Section):
    """A linear structure from a file, a parameter set, a storey table or modes; else `identify-frame` identifies it."""

    frame: str = Field("", description="Parameter set of configs/frames, such as `thesis`, or its YAML file.")
    file: str = Field(
        "",
        description="File of the matrices (.mat, .csv, .h5, .json), or an openseespy script (.py), which is run.",
    )
    mass: MatrixEntry = Field(MatrixEntry(name="M"), description="Mass matrix.")
    stiffness: MatrixEntry = Field(MatrixEntry(name="K"), description="Stiffness matrix.")
    damping: MatrixEntry = Field(
        MatrixEntry(), description="Damping matrix; without a name and a file: modal damping by `damping_ratio`."
    )
    damping_ratio: tuple[float, ...] = Field(
        (0.01,), min_length=1, description="Damping ratio of the modes; the last one is valid for all further modes."
    )
    storeys: tuple[Storey, ...] = Field((), description="Storey table of a shear frame, lowest storey first.")
    storey_table: StoreyTable = Field(StoreyTable(), description="Storey table with units, or from a file.")
    frequencies_hz: tuple[float, ...] = Field((), description="Natural frequencies, with `mode_shapes` and masses.")
    mode_shapes: tuple[tuple[float, ...], ...] = Field(
        (), description="A row per degree of freedom, a column per mode; as many modes as degrees of freedom."
    )
    masses_kg: tuple[float, ...] = Field((), description="Masses of the degrees of freedom, with `mode_shapes`.")
    degrees_of_freedom: tuple[str, ...] = Field(
        (), description="Names of the degrees of freedom; empty: floor 1, floor 2, ..."
    )
    influence: tuple[float, ...] = Field(
        (),
        description="Displacement of each degree of freedom when the ground moves by 1 m; empty: 1 for all. A rotation "
        "or a direction across the motion has 0.",
    )
    influence_y: tuple[float, ...] = Field(
        (), description="The same for ground motion in the second direction; empty: the structure has one direction."
    )
    reduction: ReductionSettings = Field(ReductionSettings(), description="Reduction of a large structure.")
    dampers: tuple[DamperSettings, ...] = Field(
        (),
        description="Dampers of the structure, each with a separate law. Empty: the structure has the one damper of "
        "the section `calibrate`.",
    )
    accelerometers: tuple[str | int, ...] = Field(
        (),
        description="Degrees of freedom with an accelerometer that the observer of `lqg` reads, with `dampers`; "
        "empty: all but amplitudes of modes.",
    )

    @field_validator("damping_ratio")
    @classmethod
    def _ratios_are_shares(cls, ratios: tuple[float, ...]) -> tuple[float, ...]:
        if not all(0.0 <= ratio < 1.0 for ratio in ratios):
            raise ValueError("numbers from 0 to below 1 expected; 2 % is 0.02")
        return ratios

    @field_validator("influence", "influence_y")
    @classmethod
    def _influence_is_finite(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if not all(math.isfinite(value) for value in values):
            raise ValueError("finite numbers expected")
        return values

    @field_validator("frequencies_hz")
    @classmethod
    def _frequencies_are_positive(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if not all(0.0 < value < math.inf for value in values):
            raise ValueError("positive frequencies in Hz expected")
        return values

    @field_validator("mode_shapes")
    @classmethod
    def _rows_have_one_length(cls, rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
        if len({len(row) for row in rows}) > 1:
            raise ValueError("a row for each degree of freedom expected, all of one length")
        return rows

    @property
    def given(self) -> bool:
        """Whether a structure is given at all."""
        tables = self.storeys or self.storey_table.given or self.mode_shapes
        return bool(self.frame or self.file or tables or self.mass.file or self.stiffness.file)

    @property
    def described(self) -> bool:
        """Whether a setting describes the matrices, which has no meaning for a structure that is identified."""
        keys = ("mass", "stiffness", "damping", "damping_ratio", "degrees_of_freedom", "influence", "influence_y")
        return any(getattr(self, key) != type(self).model_fields[key].default for key in (*keys, "reduction"))

    def in_folder(self, folder: Path) -> StructureSettings:
        """Return the same settings with the paths of all files resolved against a folder."""

        def resolved(file: str) -> str:
            return str((folder / file).resolve()) if file else ""

        entries = {
            key: entry.changed(file=resolved(entry.file))
            for key, entry in (("mass", self.mass), ("stiffness", self.stiffness), ("damping", self.damping))
        }
        frame = resolved(self.frame) if self.frame.endswith((".yaml", ".yml")) else self.frame
        table = self.storey_table.changed(file=resolved(self.storey_table.file))
        return self.changed(frame=frame, file=resolved(self.file), storey_table=table, **entries)
