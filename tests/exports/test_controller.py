"""The exported C does what the Python controller does."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mrpipe.control import ControllerOptions, Gains, build_controller, inverse_table
from mrpipe.control.calibration import CalibrationOptions, plant_of
from mrpipe.control.controller import Controller
from mrpipe.control.kernel import (
    COMMAND_DRIVE,
    MEASURED_ACCELERATION,
    MEASURED_DISPLACEMENT,
    MEASURED_FLOORS,
    MEASURED_FORCE,
    MEASURED_VELOCITY,
)
from mrpipe.control.laws import law_named, law_names
from mrpipe.control.lqg import Weights, lqg_observer
from mrpipe.exports.controller import controller_files
from tests.control.conftest import random_network
from tests.control.stepped import commands_of
from tests.exports.building import self_test

MAIN = """
#include <stdio.h>
#include "controller.h"
int main(void) {
    double state[RIG_STATE_SIZE], measured[RIG_MEASURED_SIZE], command[RIG_COMMAND_SIZE] = {0.0};
    rig_controller_reset(state);
    for (;;) {
        for (int i = 0; i < RIG_MEASURED_SIZE; ++i)
            if (scanf("%la", &measured[i]) != 1) return 0;
        rig_controller_step(state, measured, command);
        for (int i = 0; i < RIG_COMMAND_SIZE; ++i) printf("%a ", command[i]);
        printf("\\n");
    }
}
"""


def recorded_signal(width: int, rate_hz: float) -> np.ndarray:
    """Return harmonic motion, then a decay, as sensors read it with noise; all floors move with the damper."""
    rng = np.random.default_rng(3)
    t = np.arange(int(6.0 * rate_hz)) / rate_hz
    envelope = np.where(t < 3.0, 1.0, np.exp(-1.2 * (t - 3.0)))
    x = 0.009 * envelope * np.sin(8.0 * t)
    signal = 0.1 * rng.standard_normal((len(t), width))
    signal[:, MEASURED_DISPLACEMENT] = x + 2e-5 * rng.standard_normal(len(t))
    signal[:, MEASURED_VELOCITY] = np.gradient(x, t)
    signal[:, MEASURED_FORCE] += 50.0 * np.tanh(signal[:, MEASURED_VELOCITY] / 0.01)
    for place in (MEASURED_ACCELERATION, *range(MEASURED_FLOORS, width)):
        signal[:, place] += -64.0 * x
    return signal


def in_c(controller: Controller, signal: np.ndarray, folder: Path) -> np.ndarray:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler here")
    for name, text in controller_files(controller, "rig", {}).items():
        (folder / name).write_text(text)
    (folder / "main.c").write_text(MAIN)
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
    # each law leaves some of the shared functions or macros alone, none of the code unused
    subprocess.run([compiler, *flags, "controller.c", "main.c", "-o", "rig", "-lm"], cwd=folder, check=True)
    text = "\n".join(" ".join(float(value).hex() for value in row) for row in signal)
    run = subprocess.run([str(folder / "rig")], input=text, capture_output=True, text=True, check=True)
    return np.array([[float.fromhex(word) for word in line.split()] for line in run.stdout.splitlines()])


WITH_NETWORK = ("vd", "fdns", "nnc", "lqg")
"""Laws whose inverse is tried as a network, too; the inverse is the same code in all of them."""

CASES = [*((law, "table") for law in law_names()), *((law, "network") for law in WITH_NETWORK)]
KNOWN = {"vd": Gains(650.0), "vdns": Gains(250.0, -4500.0), "fdns": Gains(alpha_n_m=3000.0)}


def controller_of(law: str, kind: str, frame, position, damper, **more) -> Controller:
    """Return a controller that reads the motion of `recorded_signal` in all its parts."""
    entry, rate = law_named(law), 500.0 if law == "fdns" else 200.0
    plant = plant_of(frame, position, CalibrationOptions(mode=1))
    gains = KNOWN.get(law) or next(iter(entry.candidates(plant).values()), Gains())
    bounds = {"residual_force_n": 12.0, "saturation_force_n": 40.0} if law == "fdns-bounded" else {}
    options = ControllerOptions(
        rate_hz=rate,
        drive_limit=4.0,
        bias_drift_m_s2=0.01,
        dead_band_m_s=1e-3,
        inverse_request="history",
        **{**bounds, **more},
    )
    return build_controller(
        law,
        gains,
        options,
        inverse=random_network(("velocity", "force"), "drive", 3, True) if kind == "network" else inverse_table(damper),
        reference=random_network(("displacement", "velocity"), "force", 5, False) if "network" in entry.needs else None,
        observer=entry.observer(frame, position, Weights(), 1.0 / rate) if entry.observer else None,
        position=position if "floor-accelerations" in entry.needs else None,
    )


@pytest.mark.oracle
def test_a_force_that_is_zero_to_rounding_does_not_fail_the_self_test(tmp_path, set_c):
    """In single precision fdns gives 0 in place of -1e-11 N at an extremum, and then nothing is clipped."""
    options = ControllerOptions(
        rate_hz=170.0, velocity="measured", friction_rounding_m_s=0.004, extremum_step_m=1e-4, drive_limit=4.0,
        residual_force_n=20.0, low_pass_hz=None, extremum_memory_s=0.27752,
    )  # fmt: skip
    controller = build_controller("fdns", Gains(alpha_n_m=9000.0), options, inverse=inverse_table(set_c))
    for name, text in controller_files(controller, "rig", {"stroke_m": 0.01}).items():
        (tmp_path / name).write_text(text)
    self_test(tmp_path, "controller", "RIG")


@pytest.mark.oracle
def test_a_wrong_flag_fails_the_self_test(tmp_path, set_c):
    controller = build_controller("vd", Gains(650.0), ControllerOptions(drive_limit=4.0), inverse=inverse_table(set_c))
    for name, text in controller_files(controller, "rig", {}).items():
        changed = text.replace("command[COMMAND_SWITCHED] = ", "command[COMMAND_SWITCHED] = 1 - ")
        (tmp_path / name).write_text(changed if name == "controller.c" else text)
        assert name != "controller.c" or changed != text
    with pytest.raises(AssertionError, match="largest deviation"):
        self_test(tmp_path, "controller", "RIG")


@pytest.mark.oracle
@pytest.mark.parametrize(("law", "kind"), CASES)
def test_c_equals_python(law, kind, tmp_path, thesis_frame, floor_one, set_c):
    controller = controller_of(law, kind, thesis_frame, floor_one, set_c)
    signal = recorded_signal(controller.measured_size, controller.options.rate_hz)
    python, c = commands_of(controller, signal), in_c(controller, signal, tmp_path)
    self_test(tmp_path, "controller", "RIG")
    assert python.shape == c.shape
    assert np.ptp(python[:, COMMAND_DRIVE]) > 0.5 or law.startswith("passive")
    np.testing.assert_allclose(c, python, rtol=1e-11, atol=1e-12)


@pytest.mark.oracle
def test_c_equals_python_without_a_load_cell(tmp_path, thesis_frame, floor_one, set_c):
    bounds = {"residual_force_n": 12.0, "saturation_force_n": 40.0}
    parts = thesis_frame, floor_one, set_c
    controller = controller_of("lqg", "table", *parts, observer_force="expected", **bounds)
    signal = recorded_signal(controller.measured_size, controller.options.rate_hz)
    python, c = commands_of(controller, signal), in_c(controller, signal, tmp_path)
    np.testing.assert_allclose(c, python, rtol=1e-11, atol=1e-12)
    # the reading of the force has no effect, and the bounds have one
    signal[:, MEASURED_FORCE] = np.nan
    np.testing.assert_array_equal(commands_of(controller, signal), python)
    free = controller_of("lqg", "table", *parts, observer_force="expected")
    assert not np.allclose(commands_of(free, signal)[:, COMMAND_DRIVE], python[:, COMMAND_DRIVE])


@pytest.mark.golden
def test_the_drive_has_the_unit_of_the_damper(set_c):
    controller = build_controller("vd", Gains(650.0), ControllerOptions(), inverse=inverse_table(set_c))
    files = controller_files(controller, "rig", {"drive_unit": "V"})
    parameters = json.loads(files["controller.json"])["parameters"]
    assert parameters["drive_limit"]["unit"] == "V" and parameters["k_n_m"]["unit"] == "N/m"
    assert "largest drive [V]" in files["controller.h"] and "[drive]" not in "".join(files.values())


def _files(law: str, frame, position, damper, **options) -> dict[str, str]:
    controller = build_controller(
        law,
        Gains(alpha_n_m=3000.0) if law == "fdns" else Gains(),
        ControllerOptions(drive_limit=4.0, **options),
        inverse=inverse_table(damper),
        observer=lqg_observer(frame, position, Weights(), 0.005),
        position=position,
    )
    return controller_files(controller, "rig", {"drive_unit": "A"})


@pytest.mark.golden
@pytest.mark.parametrize(
    ("law", "options", "read"),
    [
        ("fdns", {}, ("DISPLACEMENT", "ACCELERATION")),
        ("fdns", {"velocity": "difference"}, ("DISPLACEMENT",)),
        ("lqg", {"velocity": "measured"}, ("DISPLACEMENT", "VELOCITY", "GROUND", "FORCE", "FLOORS")),
        ("lqg", {"observer_force": "expected"}, ("DISPLACEMENT", "ACCELERATION", "GROUND", "FLOORS")),
        ("energy-dissipation", {}, ("DISPLACEMENT", "ACCELERATION", "FORCE")),
    ],
)
def test_readme_and_header_name_the_readings_of_the_law(law, options, read, thesis_frame, floor_one, set_c) -> None:
    """The force of the damper had not been named, and every law had seemed to read the velocity."""
    files = _files(law, thesis_frame, floor_one, set_c, **options)
    for name in ("DISPLACEMENT", "ACCELERATION", "VELOCITY", "GROUND", "FORCE", "FLOORS"):
        assert (f"- `RIG_MEASURED_{name}`" in files["README.md"]) == (name in read), name
        line = next(row for row in files["controller.h"].splitlines() if f"RIG_MEASURED_{name} " in row)
        assert ("not used by this controller" in line) == (name not in read), name


@pytest.mark.golden
def test_the_header_says_which_gains_have_no_effect(thesis_frame, floor_one, set_c) -> None:
    lines = _files("fdns", thesis_frame, floor_one, set_c)["controller.h"].splitlines()
    idle = {
        name: any(f"PARAMETER_{name} " in row and "no effect" in row for row in lines)
        for name in ("C_N_S_M", "ALPHA_N_M")
    }
    assert idle == {"C_N_S_M": True, "ALPHA_N_M": False}


@pytest.mark.golden
def test_description_is_json_with_all_numbers(set_c):
    controller = build_controller("vd", Gains(650.0), ControllerOptions(), inverse=inverse_table(set_c))
    files = controller_files(controller, "rig", {"drive_unit": "A"})
    content = json.loads(files["controller.json"])
    assert content["law"] == "vd" and content["gains"]["c_n_s_m"] == 650.0 and content["drive_unit"] == "A"
    assert content["numbers"] == list(controller.numbers)
    assert "rig_controller_step" in files["README.md"] and "rig_controller_step" in files["controller.h"]
