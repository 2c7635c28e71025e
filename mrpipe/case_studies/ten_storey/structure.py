"""The ten-storey shear frame of paper P4, section 6."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import ParameterSet, load_parameter_set
from mrpipe.case_studies.model import BenchmarkModel, ground_load
from mrpipe.errors import UserError
from mrpipe.structures.dynamics import floor_position
from mrpipe.structures.shear_frames import shear_frame


def lowest_factor(floors: int) -> float:
    """Return omega_1/sqrt(k/m) of a uniform shear frame: 2 sin(pi/(2(2n + 1)))."""
    return float(2.0 * np.sin(np.pi / (2.0 * (2 * floors + 1))))


def ten_storey(parameters: ParameterSet | str = "ten-storey") -> BenchmarkModel:
    """Return the undamped frame of P4 (7), a damper between ground and floor 1.

    The storey stiffness is what the printed lowest frequency needs; P4's k = 1.5e7 gives 8.186 rad/s and the -1 in the
    corner of its K makes it singular (errata row 16).

    Raises
    ------
    UserError
        If the parameter set is of another model or lacks a value.
    """
    values = parameters if isinstance(parameters, ParameterSet) else load_parameter_set("structures", parameters)
    if values.model != "uniform-shear-frame":
        raise UserError(values.name, "model", f"is {values.model!r}", "uniform-shear-frame expected")
    try:
        floors, mass = int(values.scalar("floors")), values.scalar("floor_mass")
        stiffness = mass * (values.scalar("lowest_angular_frequency") / lowest_factor(floors)) ** 2
    except KeyError as error:
        raise UserError(values.name, f"parameters.{error.args[0]}", "is missing", "give value and unit") from error
    frame = shear_frame([mass] * floors, [stiffness] * floors, [0.0] * floors, name="ten-storey", source=values.name)
    return BenchmarkModel(
        name="ten-storey",
        origin="published",
        source=values.source,
        frame=frame,
        load=ground_load(frame),
        devices=floor_position(floors, 1)[:, None],
        total_mass_kg=float(frame.mass.sum()),
        notes={"storey_stiffness_n_m": stiffness, "floor_mass_kg": mass},
    )
