"""Writes the measurements that the notebooks read: CSV files of a bench with a damper, and of a three-storey frame.

The recordings are computed and not measured, so that they may be part of the documentation. A damper and a frame of your
own replace them: the notebooks need a folder with CSV files and a campaign.yaml.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from mrpipe.dampers.model import DamperModel
from mrpipe.signals.discretisation import discretise_zero_order
from mrpipe.structures.dynamics import state_space
from mrpipe.structures.shear_frames import shear_frame

BENCH_RATE_HZ = 500.0
FRAME_RATE_HZ = 200.0
FORCE_NOISE_N = 0.4
GAS_SPRING_N_M = 2500.0
"""Stiffness of the gas cushion, which the models of the notebooks do not contain."""


def damper() -> DamperModel:
    """Return the damper of the bench."""
    numbers = {
        "yield_displacement": 6e-4, "gamma_share": 0.5, "exponent": 2.0, "eta": 80.0,
        "yield_force_a": 20.0, "yield_force_b": 35.0, "c0_a": 150.0, "c0_b": 60.0,
    }  # fmt: skip
    return DamperModel("bouc-wen", numbers, drive_unit="A", drive_limit=2.0, stroke_m=0.01)


def write_bench(folder: Path) -> Path:
    """Write twelve tests: three amplitudes and frequencies, constant and changing currents."""
    rng = np.random.default_rng(1)
    folder.mkdir(parents=True, exist_ok=True)
    tests = []
    time = np.arange(round(4.0 * BENCH_RATE_HZ)) / BENCH_RATE_HZ
    motions = ((10e-3, 1.0), (6e-3, 2.0), (8e-3, 1.5))
    for number, (amplitude, frequency) in enumerate(motions):
        omega = 2.0 * np.pi * frequency
        x, v = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
        for place, current in enumerate((0.0, 1.0, 2.0, None)):
            drive = 1.0 + np.sign(np.sin(0.83 * omega * time)) if current is None else np.full_like(time, current)
            force = damper().force(x, v, -omega * omega * x, drive, 1.0 / BENCH_RATE_HZ) + GAS_SPRING_N_M * x
            name = f"{1e3 * amplitude:.0f}mm_{frequency:g}Hz_{'steps' if current is None else f'{current:g}A'}"
            columns = {
                "t_s": time,
                "x_mm": 1e3 * x + 2e-3 * rng.standard_normal(len(time)),
                "i_A": drive + 2e-3 * rng.standard_normal(len(time)),
                "F_N": force + FORCE_NOISE_N * rng.standard_normal(len(time)),
            }
            _write(folder / f"{name}.csv", columns)
            role = "validation" if number == 2 and place % 2 else "training"
            tests.append({"name": name, "file": f"{name}.csv", "role": role})
    channels = {
        "time": {"column": "t_s", "unit": "s"},
        "displacement": {"column": "x_mm", "unit": "mm"},
        "drive": {"column": "i_A", "unit": "A"},
        "force": {"column": "F_N", "unit": "N"},
    }
    return _campaign(folder, {"campaign": "my-damper", "rig": "damper-bench", "channels": channels, "tests": tests})


def write_frame(folder: Path) -> Path:
    """Write a sweep of a shake table and the free decay of each mode of a frame with three storeys."""
    rng = np.random.default_rng(2)
    folder.mkdir(parents=True, exist_ok=True)
    frame = shear_frame([20.0, 20.0, 18.0], [9000.0, 8000.0, 7000.0], [0.01, 0.012, 0.015])
    continuous = state_space(frame)
    transition, given = discretise_zero_order(continuous.A, continuous.B, 1.0 / FRAME_RATE_HZ)
    of_state, _ = continuous.absolute_acceleration()

    def record(name: str, ground: np.ndarray, state: np.ndarray) -> None:
        accelerations = np.zeros((len(ground), 3))
        for row, value in enumerate(ground):
            accelerations[row] = of_state @ state
            state = transition @ state + given[:, 0] * value
        columns = {"t_s": np.arange(len(ground)) / FRAME_RATE_HZ, "ag": ground}
        columns |= {f"a{floor + 1}": accelerations[:, floor] for floor in range(3)}
        noisy = {
            key: values + (0.0 if key == "t_s" else 2e-3 * rng.standard_normal(len(ground)))
            for key, values in columns.items()
        }
        _write(folder / f"{name}.csv", noisy)

    time = np.arange(round(40.0 * FRAME_RATE_HZ)) / FRAME_RATE_HZ
    phase = 2.0 * np.pi * (0.8 * time + (8.0 - 0.8) * time**2 / (2.0 * time[-1]))
    record("sweep", 0.3 * np.sin(phase), np.zeros(6))
    tests: list[dict[str, object]] = [{"name": "sweep", "file": "sweep.csv", "kind": "sweep", "role": "training"}]
    from mrpipe.structures.dynamics import natural_modes

    shapes = natural_modes(frame).mode_shapes
    for mode in range(3):
        start = np.concatenate([0.01 * shapes[:, mode] / np.max(np.abs(shapes[:, mode])), np.zeros(3)])
        record(f"decay{mode + 1}", np.zeros(round(15.0 * FRAME_RATE_HZ)), start)
        tests.append(
            {
                "name": f"decay{mode + 1}",
                "file": f"decay{mode + 1}.csv",
                "kind": "free-decay",
                "mode": mode + 1,
                "role": "training",
            }
        )
    channels = {"time": {"column": "t_s", "unit": "s"}, "ground_acceleration": {"column": "ag", "unit": "m/s^2"}}
    channels |= {f"floor_acceleration_{k}": {"column": f"a{k}", "unit": "m/s^2"} for k in (1, 2, 3)}
    masses = {"floor_masses_kg": [20.0, 20.0, 18.0]}
    content = {"campaign": "my-frame", "rig": "shear-frame", "frame": masses, "channels": channels, "tests": tests}
    return _campaign(folder, content)


def _write(path: Path, columns: dict[str, np.ndarray]) -> None:
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.7g")


def _campaign(folder: Path, content: dict[str, object]) -> Path:
    (folder / "campaign.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return folder
