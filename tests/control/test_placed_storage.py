"""Several dampers from the settings to control.h5 and back."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from mrpipe.control.calibration import CalibrationOptions
from mrpipe.control.placed import calibrate_placed
from mrpipe.control.placed_storage import accelerometers_of, placed_dampers, read_placed
from mrpipe.errors import UserError
from mrpipe.structures import natural_modes, shear_frame
from mrpipe.structures.reduction import craig_bampton
from tests.control.placed import AMPLITUDE_M, FRAME, RESIDUAL_N, TWO, structure, write_artifacts

pytestmark = pytest.mark.property


def test_settings_become_places_names_and_braces() -> None:
    low, high = placed_dampers(FRAME, TWO.dampers, 2)
    assert (low.name, high.name) == ("low", "damper 2")
    assert np.array_equal(low.position, [1.0, 0.0, 0.0]) and np.array_equal(high.position, [0.0, -1.0, 1.0])
    assert low.brace_n_m == 4.0e5 and math.isinf(high.brace_n_m)
    assert low.mode == high.mode == 2


@pytest.mark.parametrize(
    ("dampers", "problem"),
    [
        ([{"between": (1, "ground"), "law": "vdd"}], "is not a control law"),
        ([{"between": (1, "ground"), "sensors": ("velocity",)}], "lack the displacement"),
        ([{"between": (1, "ground"), "name": "a"}, {"between": (2, 1), "name": "a"}], "occurs more than once"),
        ([{"between": (1, "ground")}, {"between": (2, 1), "name": "damper 1"}], "occurs more than once"),
        ([{"between": (9, "ground")}], r"structure\.dampers\[0\]\.between"),
    ],
)
def test_mistakes_name_the_damper(dampers: list[dict[str, Any]], problem: str) -> None:
    with pytest.raises(UserError, match=problem):
        placed_dampers(FRAME, structure(*dampers).dampers, 1)


@pytest.mark.parametrize(
    ("damper", "problem"),
    [
        ({"law": "vd", "gains": {"k_n_m": 5.0}}, r"^structure\.dampers: damper 1: gains\.k_n_m: law vd has no such"),
        ({"law": "passive-on", "gains": {"c_n_s_m": 5.0}}, r"^structure\.dampers: damper 1: gains\.c_n_s_m: "),
        ({"law": "vd", "gains": {"c_n_s_m": -5.0}}, r"^structure\.dampers: damper 1: gains\.c_n_s_m: is -5"),
        ({"law": "vd", "gains": {"c_n_s_m": 0.0}}, r"^structure\.dampers: damper 1: gains\.c_n_s_m: is 0; .* positive"),
        ({"law": "vd", "target_mode": 9}, r"^structure\.dampers: damper 1: target_mode: is 9; .* 1 to 2"),
    ],
)
def test_mistakes_of_gains_and_modes_name_the_damper(damper: dict[str, Any], problem: str) -> None:
    placed = placed_dampers(FRAME, structure({"between": (1, "ground"), **damper}).dampers, 1)
    with pytest.raises(UserError, match=problem):
        calibrate_placed(FRAME, placed, CalibrationOptions())


def test_an_amplitude_of_a_mode_has_no_accelerometer() -> None:
    reduced = craig_bampton(shear_frame(np.full(5, 10.0), np.full(5, 1e4), 0.01), (0, 4), 2).frame
    assert accelerometers_of(reduced, []) == (0, 1)
    with pytest.raises(UserError, match="mode 1: is the amplitude of a mode, which has no place; name one of floor 1"):
        accelerometers_of(reduced, ["floor 5", "mode 1"])


def test_accelerometers_are_counted_from_zero() -> None:
    assert accelerometers_of(FRAME, ()) == (0, 1, 2)
    assert accelerometers_of(FRAME, (3, 1)) == (2, 0)
    with pytest.raises(UserError, match=r"structure\.accelerometers"):
        accelerometers_of(FRAME, (4,))
    with pytest.raises(UserError, match=r"structure\.accelerometers: floor 2: is named more than once"):
        accelerometers_of(FRAME, (2, "floor 2"))


def test_what_was_written_builds_the_same_controllers(tmp_path) -> None:
    artifact = write_artifacts(tmp_path)["calibrate"]
    low, high = read_placed(artifact)
    assert (low.name, low.law, low.brace_n_m) == ("low", "vd", 4.0e5)
    assert (high.name, high.law) == ("damper 2", "fdns") and math.isinf(high.brace_n_m)
    assert low.calibrated.gains_of("vd").c_n_s_m > 0.0 and high.calibrated.gains_of("fdns").alpha_n_m > 0.0
    assert low.calibrated.amplitude_m == AMPLITUDE_M and high.calibrated.residual_force_n == RESIDUAL_N
    # the free frequency of the target mode is that of the frame, and a locked damper raises it
    omega = natural_modes(FRAME).angular_frequencies[0]
    assert low.calibrated.omega_0 == pytest.approx(omega)
    assert low.omega_inf > omega
    assert low.calibrated.weights.force > 0.0


def test_the_loop_runs_with_the_gains_for_all_dampers_together(tmp_path) -> None:
    artifact = write_artifacts(tmp_path)["calibrate"]
    for item, row, name in zip(read_placed(artifact), artifact.json("dampers"), ("c_n_s_m", "alpha_n_m"), strict=True):
        assert item.calibrated.gains[item.law][name] == row["gains"][name]
        assert row["gains"][name] != pytest.approx(row["gains_alone"][name], rel=0.01)


def test_no_infinity_reaches_the_json(tmp_path) -> None:
    rows = write_artifacts(tmp_path)["calibrate"].json("dampers")
    json.dumps(rows, allow_nan=False)
    assert rows[1]["brace_stiffness_n_m"] is None


def test_joint_gains_damp_more_than_none(tmp_path) -> None:
    together = write_artifacts(tmp_path)["calibrate"].json("together")
    assert together["stable"] and together["modes"] == [1, 2]
    assert together["damping_ratios"][0] > 0.03
    assert together["omega_free"] == pytest.approx(natural_modes(FRAME).angular_frequencies[:2].tolist())
