"""The controller survives bad readings: refused, held, safe, recovered; the C code does the same, bit for bit."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.control import ControllerOptions, Gains, build_controller, inverse_table
from mrpipe.control.controller import Controller
from mrpipe.control.controller_options import DYNAMIC_RANGE
from mrpipe.control.kernel import (
    COMMAND_DRIVE,
    COMMAND_FAULT,
    COMMAND_INVERSE,
    COMMAND_VELOCITY,
)
from mrpipe.control.laws import all_laws, law_names
from mrpipe.control.lqg import Weights
from mrpipe.exports.controller import controller_files
from tests.control.conftest import random_network
from tests.control.stepped import commands_of
from tests.exports.test_controller import recorded_signal

LIMIT = 0.3
GAINS = {
    "vd": Gains(650.0),
    "vdps": Gains(400.0, 2500.0),
    "vdns": Gains(250.0, -4500.0),
    "fdns": Gains(alpha_n_m=3000.0),
    "fdns-bounded": Gains(alpha_n_m=3000.0),
    "bang-bang": Gains(corner_rad_s=20.0),
    "sky-hook": Gains(c_n_s_m=1e6, corner_rad_s=20.0),
}
BAD = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e12)

MAIN = """
#include <math.h>
#include <stdio.h>
#include "controller.h"
int main(void) {
    double state[RIG_STATE_SIZE], measured[RIG_MEASURED_SIZE], command[RIG_COMMAND_SIZE] = {0.0};
    rig_controller_reset(state);
    for (;;) {
        for (int i = 0; i < RIG_MEASURED_SIZE; ++i)
            if (scanf("%la", &measured[i]) != 1) return 0;
        rig_controller_step(state, measured, command);
        for (int i = 0; i < RIG_STATE_SIZE; ++i)
            if (!isfinite(state[i])) return 3;
        for (int i = 0; i < RIG_COMMAND_SIZE; ++i) printf("%a ", command[i]);
        printf("\\n");
    }
}
"""


@pytest.fixture
def built(thesis_frame, floor_one, set_c):
    """Return the controller of a law with a drive limit that the inverse exceeds."""

    def build(law: str, kind: str = "table", **options) -> Controller:
        chosen = ControllerOptions(drive_limit=LIMIT, **options)
        entry = all_laws()[law]
        observer = None
        if entry.observer is not None:
            observer = entry.observer(thesis_frame, floor_one, Weights(), 1.0 / chosen.rate_hz)
        gains = GAINS.get(law, Gains(**{gain.name: 1000.0 for gain in entry.gains}))
        # an inverse that demands more than the limit, whatever the force
        network = replace(random_network(("velocity", "force"), "drive", 3, True), output_scale=0.1, output_shift=0.6)
        return build_controller(
            law,
            gains,
            chosen,
            inverse=network if kind == "network" else inverse_table(set_c),
            reference=random_network(("displacement", "velocity"), "force", 5, False),
            observer=observer,
            position=floor_one,
        )

    return build


def with_faults(controller: Controller, seed: int, seconds: float = 6.0) -> np.ndarray:
    """Motion with single bad readings, short and long gaps in every channel, and a bad start."""
    rng = np.random.default_rng(seed)
    signal = recorded_signal(controller.measured_size, controller.options.rate_hz)
    signal = signal[: int(seconds * controller.options.rate_hz)]
    signal[0, 0] = np.nan
    for _ in range(60):
        start, length = rng.integers(0, len(signal)), int(rng.choice([1, 1, 1, 2, 4, 5, 20]))
        channel = rng.integers(0, signal.shape[1])
        signal[start : start + length, channel] = rng.choice(BAD)
    return signal


@pytest.mark.property
@pytest.mark.parametrize("law", law_names())
def test_one_bad_reading_is_forgotten(law, built):
    """A single bad reading in any channel: the command is the same again soon after, and the flag says when."""
    controller = built(law)
    clean = recorded_signal(controller.measured_size, 200.0)[:900]
    wanted = commands_of(controller, clean)
    for channel in range(controller.measured_size):
        read = controller.numbers[controller.layout[16] + channel] > 0.0
        for value in (np.nan, np.inf, -1e308):
            signal = clean.copy()
            signal[400, channel] = value
            found = commands_of(controller, signal)
            assert list(np.flatnonzero(found[:, COMMAND_FAULT])) == ([400] if read else [])
            assert np.max(np.abs(found[600:, COMMAND_DRIVE] - wanted[600:, COMMAND_DRIVE])) < 0.02 * LIMIT


@pytest.mark.property
@pytest.mark.parametrize("law", ["vd", "fdns", "nnc", "lqg", "passive-on"])
def test_a_long_gap_leads_to_the_safe_drive_and_back(law, built):
    controller = built(law, safe_drive=0.25)
    signal = recorded_signal(controller.measured_size, 200.0)[:1100]
    clean = commands_of(controller, signal)
    signal[400:500, 0] = np.nan
    found = commands_of(controller, signal)
    flags = found[:, COMMAND_FAULT]
    # 20 ms are four samples at 200 Hz
    assert np.all(flags[400:404] == 1.0) and np.all(flags[404:500] == 2.0) and not flags[500:].any()
    assert np.all(found[404:500, COMMAND_DRIVE] == 0.25)
    assert np.max(np.abs(found[900:, COMMAND_VELOCITY] - clean[900:, COMMAND_VELOCITY])) < 2e-3
    # the memory starts anew: what comes after is what a fresh controller would do
    np.testing.assert_array_equal(found[500:], commands_of(controller, signal[500:]))


@pytest.mark.property
def test_nothing_is_commanded_before_the_first_good_sample(built):
    controller = built("vd")
    signal = recorded_signal(controller.measured_size, 200.0)
    signal[:3, 1] = np.inf
    flags = commands_of(controller, signal)[:, COMMAND_FAULT]
    assert list(flags[:5]) == [2.0, 2.0, 2.0, 0.0, 0.0]


@pytest.mark.property
def test_limits_are_those_given_or_of_the_sensors(built):
    signal = recorded_signal(5, 200.0)
    signal[500, 0] = 0.03
    assert not commands_of(built("vd"), signal)[:, COMMAND_FAULT].any()
    assert list(np.flatnonzero(commands_of(built("vd", largest_displacement_m=0.02), signal)[:, COMMAND_FAULT])) == [
        500
    ]
    controller = built("vd")
    assert controller.numbers[controller.layout[16]] == pytest.approx(DYNAMIC_RANGE * 20e-6)


@pytest.mark.property
@pytest.mark.parametrize("law", law_names())
@pytest.mark.parametrize("kind", ["network", "table"])
def test_the_drive_stays_within_its_limit(law, kind, built):
    controller = built(law, kind, low_pass_hz=None)
    commands = commands_of(controller, with_faults(controller, 1))
    assert np.all((commands[:, COMMAND_DRIVE] >= 0.0) & (commands[:, COMMAND_DRIVE] <= LIMIT))


@pytest.mark.oracle
@pytest.mark.parametrize("law", law_names())
@pytest.mark.parametrize("kind", ["network", "table"])
def test_c_survives_the_same_faults_bit_for_bit(law, kind, built, tmp_path):
    """Under the address and undefined-behaviour sanitisers; the state is looked at after every sample."""
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler here")
    controller = built(law, kind, fault_hold_s=0.015)
    signal = with_faults(controller, 2)
    python = commands_of(controller, signal)
    for name, text in controller_files(controller, "rig", {}).items():
        (tmp_path / name).write_text(text)
    (tmp_path / "main.c").write_text(MAIN)
    flags = ["-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off"]
    sanitised = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run(
        [compiler, *flags, *sanitised, "controller.c", "main.c", "-o", "rig", "-lm"], cwd=tmp_path, check=True
    )
    text = "\n".join(" ".join(_word(value) for value in row) for row in signal)
    done = subprocess.run([str(tmp_path / "rig")], input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    c = np.array([[float.fromhex(word) for word in line.split()] for line in done.stdout.splitlines()])
    assert {0.0, 1.0, 2.0} <= set(python[:, COMMAND_FAULT])
    if law != "passive-off":
        # the limit is at work, so C code without it differs
        assert python[:, COMMAND_INVERSE].max() > LIMIT or all_laws()[law].output == "drive"
        assert c[:, COMMAND_DRIVE].max() == LIMIT
    np.testing.assert_array_equal(c, python)


def _word(value: float) -> str:
    return float(value).hex() if np.isfinite(value) else str(value)


@pytest.mark.property
def test_the_readme_promises_it(built):
    readme = controller_files(built("vd", safe_drive=0.25), "rig", {})["README.md"]
    assert "Faulty readings" in readme and "RIG_COMMAND_FAULT" in readme and "the drive is 0.25" in readme
    assert "displacement 2 m, acceleration 1e+04 m/s2" in readme
