"""Folders of measured files as laboratories leave them: the data of the tutorials.

    python docs/examples/foreign_measurements.py damper FOLDER
    python docs/examples/foreign_measurements.py frame FOLDER
    python docs/examples/foreign_measurements.py both FOLDER

The files have German headers, decimal commas and several units. Damper and frame are simulated here, without mrpipe,
so that the true values are known: the damper contains a gas spring, the frame friction in the joints of storey 2.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, chirp, sosfiltfilt

RATE = 1000
GRAVITY = 9.80665
INCH, POUND = 0.0254, 4.4482216
GAS_SPRING = 4000.0
"""Stiffness of the gas spring in the damper [N/m]: the effect that the model lacks."""
JOINT_FRICTION = 12.0
"""Friction force in storey 2 of the frame [N]: the effect that a linear frame lacks."""
MASSES = (200.0, 200.0, 180.0)
STIFFNESSES = (90e3, 80e3, 70e3)
VD_GAIN = 2000.0
"""Gain of the recorded law vd [N s/m]."""


class Damper:
    """A Bouc-Wen element whose yield force grows with the current, viscous damping and a gas spring (SI)."""

    def __init__(self) -> None:
        self.element, self.current = 0.0, 0.0

    def force(self, displacement: float, velocity: float, command: float, step: float) -> float:
        """Advance by one step and return the force; the coil follows the command with a lag of 12 ms."""
        self.current += (command - self.current) * (1.0 - math.exp(-step / 0.012))
        way = velocity * step / 1e-3
        self.element += way * (1.0 - self.element**2 * (self.element * way > 0.0))
        self.element = min(max(self.element, -1.0), 1.0)
        level = self.current
        return (20.0 + 80.0 * level) * self.element + (150.0 + 80.0 * level) * velocity + GAS_SPRING * displacement


def _german(path: Path, header: str, columns: list[np.ndarray], *, heading: str = "") -> None:
    lines = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in np.column_stack(columns)]
    path.write_bytes((heading + header + "\n" + "\n".join(lines) + "\n").encode("latin-1"))


def damper_tests(folder: Path) -> None:
    """Write 14 tests of 6 s: sines at four currents and two strokes, and random motion with a changing current."""
    rng = np.random.default_rng(11)
    time = np.arange(6 * RATE) / RATE
    for index in range(14):
        if index < 12:
            stroke, frequency = (5e-3, 9e-3)[index // 4 % 2], (1.0, 1.0, 2.0)[index // 4]
            displacement = stroke * np.sin(2.0 * np.pi * frequency * time)
            command = np.full(time.size, 0.5 * (index % 4))
        else:
            noise = sosfiltfilt(
                butter(2, [0.4, 3.0], "bandpass", fs=RATE, output="sos"), rng.standard_normal(time.size)
            )
            displacement = 2e-3 * noise / np.std(noise)
            command = np.repeat(rng.uniform(0.0, 1.5, 20), time.size // 20)
        damper = Damper()
        velocity = np.gradient(displacement, 1.0 / RATE)
        pairs = zip(displacement.tolist(), velocity.tolist(), command.tolist(), strict=True)
        force = np.array([damper.force(x, v, i, 1.0 / RATE) for x, v, i in pairs])
        force += 0.4 * rng.standard_normal(time.size)
        travel = displacement + 5e-6 * rng.standard_normal(time.size)
        current = command + 2e-3 * rng.standard_normal(time.size)
        if index % 5 == 3:
            rows = np.column_stack([1e3 * time, travel / INCH, current, force / POUND])
            lines = [",".join(f"{value:.7f}" for value in row) for row in rows]
            header = '"Time, rel (ms)","Disp, LVDT (in)","Current (A)","Load Cell (lbf)"'
            (folder / f"versuch_{index:02d}.csv").write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
        else:
            columns = [time, 1e3 * travel, 1e3 * current, 1e-3 * force]
            heading = "Messrechner 7\nPrüfer: NN\n\n"
            _german(
                folder / f"versuch_{index:02d}.csv", "Zeit [s];Weg [mm];Strom [mA];Kraft (kN)", columns, heading=heading
            )


class FrameRig:
    """A three-storey shear frame on a table, with friction in storey 2 and room for a damper below floor 1 (SI)."""

    def __init__(self) -> None:
        k1, k2, k3 = STIFFNESSES
        self.mass = np.diag(MASSES)
        stiffness = np.array([[k1 + k2, -k2, 0.0], [-k2, k2 + k3, -k3], [0.0, -k3, k3]])
        root = np.diag(1.0 / np.sqrt(np.diag(self.mass)))
        squares, vectors = np.linalg.eigh(root @ stiffness @ root)
        self.modes = root @ vectors
        damping = self.mass @ self.modes @ np.diag(0.012 * np.sqrt(squares)) @ self.modes.T @ self.mass
        inverse = np.linalg.inv(self.mass)
        self.state = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
        forces = inverse @ np.array([[-1.0, 1.0], [0.0, -1.0], [0.0, 0.0]])
        self.given = np.vstack([np.zeros((3, 3)), np.column_stack([-np.ones(3), forces])])

    def run(
        self,
        ground: np.ndarray,
        start: np.ndarray | None = None,
        control: Callable[[float, float], tuple[float, float]] | None = None,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return absolute accelerations and relative displacements, shape (n, 3), and the damper's signals, (n, 2)."""
        step = 1.0 / RATE
        whole = expm(np.block([[self.state, self.given], [np.zeros((3, 9))]]) * step)
        advance, drive = whole[:6, :6], whole[:6, 6:]
        state = np.zeros(6) if start is None else start
        slider, rows = 0.0, []
        for value in ground.tolist():
            way = (state[4] - state[3]) * step / 5e-5
            slider = min(max(slider + way, -1.0), 1.0)
            force, current = control(state[0], state[3]) if control else (0.0, 0.0)
            inputs = np.array([value, force, JOINT_FRICTION * slider])
            acceleration = (self.state @ state + self.given @ inputs)[3:] + value
            rows.append((*acceleration, *state[:3], force, current))
            state = advance @ state + drive @ inputs
        table = np.array(rows)
        return table[:, :3], table[:, 3:6], table[:, 6:]


def frame_tests(folder: Path) -> None:
    """Write two sweeps in g, a random test in cm/s^2 and three free decays, 200 samples per second."""
    rig, rng = FrameRig(), np.random.default_rng(12)

    def write(name: str, ground: np.ndarray, floors: np.ndarray, unit: str, size: float) -> None:
        values = np.column_stack([ground, floors])[:: RATE // 200]
        values = (values + 2e-3 * rng.standard_normal(values.shape)) / size
        header = f"Zeit [s];Tisch ({unit});Etage 1 ({unit});Etage 2 ({unit});Etage 3 ({unit})"
        _german(folder / name, header, [np.arange(len(values)) / 200.0, *values.T])

    time = np.arange(60 * RATE) / RATE
    for index, sign in enumerate((1.0, -1.0), start=1):
        ground = 0.35 * sign * chirp(time, 0.5, 60.0, 12.0)
        write(f"gleitsinus{index}.csv", ground, rig.run(ground)[0], "g", GRAVITY)
    band = butter(2, [0.5, 12.0], "bandpass", fs=RATE, output="sos")
    noise = sosfiltfilt(band, rng.standard_normal(time.size))
    ground = 0.4 * noise / np.std(noise)
    write("rauschen.csv", ground, rig.run(ground)[0], "cm/s²", 0.01)
    rest = np.zeros((RATE, 3))
    for mode, pull in enumerate((0.02, 0.006, 0.003)):
        shape = rig.modes[:, mode] / np.abs(rig.modes[:, mode]).max()
        floors = rig.run(np.zeros(30 * RATE), np.concatenate([pull * shape, np.zeros(3)]))[0]
        write(f"ausschwing_mode{mode + 1}.csv", np.zeros(31 * RATE), np.vstack([rest, floors]), "g", GRAVITY)


def controlled_tests(folder: Path) -> None:
    """Write two tests of the frame with the damper under the law vd: the damper shall act as a dashpot of VD_GAIN."""
    rng = np.random.default_rng(13)
    time = np.arange(25 * RATE) / RATE
    for index, (frequency, size) in enumerate(((1.5, 0.15), (1.7, 0.4)), start=1):
        rig, damper, memory = FrameRig(), Damper(), [0.0]

        def control(
            displacement: float, velocity: float, damper: Damper = damper, memory: list[float] = memory
        ) -> tuple[float, float]:
            wanted = abs(VD_GAIN * velocity)
            rest = 20.0 + 150.0 * abs(velocity)
            command = min(max((wanted - rest) / (80.0 + 80.0 * abs(velocity)), 0.0), 1.5)
            memory[0] = command
            return damper.force(displacement, velocity, command, 1.0 / RATE), command

        ground = size * np.sin(2.0 * np.pi * frequency * time) * np.minimum(time / 2.0, 1.0)
        floors, displacement, signals = rig.run(ground, None, control)
        every = slice(None, None, RATE // 200)
        noisy = np.column_stack([ground, floors])[every]
        noisy = (noisy + 2e-3 * rng.standard_normal(noisy.shape)) / GRAVITY
        travel = 1e3 * (displacement[every] + 2e-6 * rng.standard_normal(displacement[every].shape))
        force = signals[every, 0] + 0.4 * rng.standard_normal(len(travel))
        header = (
            "Zeit [s];Tisch (g);Etage 1 (g);Etage 2 (g);Etage 3 (g);Weg Etage 1 (mm);Weg Etage 2 (mm);Weg Etage 3 (mm);"
            "Kraft Dämpfer (N);Strom (A)"
        )
        columns = [np.arange(len(travel)) / 200.0, *noisy.T, *travel.T, force, signals[every, 1]]
        _german(folder / f"geregelt_vd_{index}.csv", header, columns)


def main(kind: str, place: str) -> None:
    """Write the files of one kind into a folder."""
    folder = Path(place)
    folder.mkdir(parents=True, exist_ok=True)
    parts = {"damper": [damper_tests], "frame": [frame_tests], "both": [damper_tests, frame_tests, controlled_tests]}
    for write in parts[kind]:
        write(folder)


if __name__ == "__main__":
    main(*sys.argv[1:3])
