"""Small campaigns on disk for the tests of this folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml

RATE = 1000.0


def motion(seconds: float = 4.0, rate: float = RATE, *, seed: int = 0, drive: float = 1.0) -> dict[str, np.ndarray]:
    """Return columns t [s], x [mm], a [m/s^2], i [A], F [N] of a sine test on a viscoplastic damper."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    omega = 2 * np.pi * 1.0
    x = 5e-3 * np.sin(omega * t)
    v = 5e-3 * omega * np.cos(omega * t)
    force = (20 + 60 * drive) * np.tanh(v / 2e-3) + 100 * v
    return {
        "t": t,
        "x": 1e3 * x + 0.02 * rng.standard_normal(t.size),
        "a": -(omega**2) * x + 0.1 * rng.standard_normal(t.size),
        "i": np.full(t.size, drive) + 0.01 * rng.standard_normal(t.size),
        "F": force + 0.5 * rng.standard_normal(t.size),
    }


CHANNELS = {
    "time": {"column": "t", "unit": "s"},
    "displacement": {"column": "x", "unit": "mm"},
    "acceleration": {"column": "a", "unit": "m/s^2"},
    "drive": {"column": "i", "unit": "A"},
    "force": {"column": "F", "unit": "N"},
}


def write_csv(path: Path, columns: dict[str, np.ndarray], *, header: bool = True) -> None:
    np.savetxt(
        path,
        np.column_stack(list(columns.values())),
        delimiter=",",
        header=",".join(columns) if header else "",
        comments="",
        fmt="%.10g",
    )


def content(**changes: Any) -> dict[str, Any]:
    """Return a campaign.yaml with two tests; `changes` replace top-level keys (None takes one out)."""
    base: dict[str, Any] = {
        "campaign": "rig",
        "rig": "damper-bench",
        "sampling_rate_hz": RATE,
        "channels": {key: dict(value) for key, value in CHANNELS.items()},
        "tests": [
            {"name": "one", "file": "one.csv", "role": "training"},
            {"name": "two", "file": "two.csv", "role": "validation"},
        ],
    }
    base.update(changes)
    return {key: value for key, value in base.items() if value is not None}


def campaign(directory: Path, columns: dict[str, np.ndarray] | None = None, /, **changes: Any) -> Path:
    """Write campaign.yaml, one.csv and two.csv and return the directory; `columns` replaces those of one.csv."""
    directory.mkdir(parents=True, exist_ok=True)
    write_csv(directory / "one.csv", motion(drive=1.0) if columns is None else columns)
    write_csv(directory / "two.csv", motion(drive=2.0, seed=1))
    (directory / "campaign.yaml").write_text(yaml.safe_dump(content(**changes), sort_keys=False), encoding="utf-8")
    return directory
