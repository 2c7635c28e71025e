"""Folders of measured files as laboratories leave them: foreign headers, decimal commas, mixed units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import StateSpace, chirp, lsim

from tests.campaigns.plausibility.rig import sound_tests

GRAVITY = 9.80665


def bench_folder(folder: Path, count: int = 8, *, samples: int = 4000) -> Path:
    """Write bench tests: German files with decimal commas, and every fourth in inches and pounds."""
    folder.mkdir(parents=True)
    for index, test in enumerate(sound_tests(count, seed=1)):
        columns = [test.time_s, test.displacement_m, test.drive, test.force_n]
        time, travel, drive, force = (values[:samples] for values in columns)
        path = folder / f"versuch_{index:02d}.csv"
        if index % 4 < 3:
            rows = np.column_stack([time, 1e3 * travel, 1e3 * drive, 1e-3 * force])
            lines = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in rows]
            header = "Messrechner 7\nPrüfer: NN\n\nZeit [s];Weg [mm];Strom [mA];Kraft (kN)\n"
            path.write_bytes((header + "\n".join(lines) + "\n").encode("latin-1"))
        else:
            rows = np.column_stack([1e3 * time, travel / 0.0254, drive, force / 4.4482216])
            lines = [",".join(f"{value:.7f}" for value in row) for row in rows]
            header = '"Time, rel (ms)","Disp, LVDT (in)","Current (A)","Load Cell (lbf)"\n'
            path.write_text(header + "\n".join(lines) + "\n")
    return folder


FREQUENCIES_HZ = (1.492, 3.974, 5.688)


def frame_folder(folder: Path, *, sweep_s: float = 60.0) -> Path:
    """Write two sweeps and three free decays of a three-storey frame, in g with decimal commas."""
    folder.mkdir(parents=True)
    mass = np.diag([200.0, 200.0, 180.0])
    k1, k2, k3 = 90e3, 80e3, 70e3
    stiffness = np.array([[k1 + k2, -k2, 0.0], [-k2, k2 + k3, -k3], [0.0, -k3, k3]])
    root = np.diag(1.0 / np.sqrt(np.diag(mass)))
    squares, vectors = np.linalg.eigh(root @ stiffness @ root)
    modes = root @ vectors
    damping = mass @ modes @ np.diag(2.0 * 0.006 * np.sqrt(squares)) @ modes.T @ mass
    inverse = np.linalg.inv(mass)
    state = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
    given = np.vstack([np.zeros((3, 1)), -np.ones((3, 1))])
    system = StateSpace(state, given, np.hstack([-inverse @ stiffness, -inverse @ damping]), np.zeros((3, 1)))
    rng = np.random.default_rng(3)

    def write(name: str, ground: np.ndarray, floors: np.ndarray) -> None:
        values = np.column_stack([ground, floors])
        values = (values + 2e-3 * rng.standard_normal(values.shape)) / GRAVITY
        rows = np.column_stack([np.arange(len(values)) / 200.0, values])
        lines = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in rows]
        text = "Zeit [s];Tisch (g);Etage 1 (g);Etage 2 (g);Etage 3 (g)\n" + "\n".join(lines) + "\n"
        (folder / name).write_text(text, encoding="utf-8")

    time = np.arange(0.0, sweep_s, 1.0 / 200.0)
    for index in (1, 2):
        ground = 0.35 * (-1.0) ** index * chirp(time, 0.5, sweep_s, 12.0)
        write(f"gleitsinus{index}.csv", ground, lsim(system, ground, time)[1])
    time = np.arange(0.0, 30.0, 1.0 / 200.0)
    for index, pull in enumerate((0.02, 0.006, 0.003)):
        shape = modes[:, index] / np.abs(modes[:, index]).max()
        start = np.concatenate([pull * shape, np.zeros(3)])
        floors = lsim(system, np.zeros(time.size), time, X0=start)[1]
        rest = np.zeros((200, 3))
        write(f"ausschwing_mode{index + 1}.csv", np.zeros(time.size + 200), np.vstack([rest, floors]))
    return folder
