"""Files of a test bench, a shaking table and closed-loop tests as a laboratory leaves them: data of a tutorial.

    python docs/examples/foreign_rig.py essais

French and English headers, decimal commas, and cm, daN, ms beside inches, pounds, mA and s. Damper, structure and
controller are simulated here, without mrpipe, so that the true values are known. The damper has quadratic drag.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from numba import njit
from scipy.signal import butter, chirp, sosfiltfilt

RATE, STEPS = 1000, 4
GRAVITY, POUND, INCH = 9.80665, 4.4482216, 0.0254
DRAG = 2500.0
"""Coefficient of the drag [N s^2/m^2]: the effect that the model lacks."""
MASSES = np.array([150.0, 150.0, 130.0])
STIFFNESSES = (60e3, 55e3, 50e3)
RATIOS = (0.008, 0.010, 0.012)
VD_GAIN, LIMIT = 1800.0, 1.2
"""Gain of the recorded law vd [N s/m], and limit of the current [A]."""


@njit
def damper(element: float, current: float, velocity: float, command: float, step: float) -> tuple[float, float, float]:
    """Advance a Bouc-Wen element and the coil (lag 10 ms) by one step; return both and the force (SI)."""
    current += (command - current) * (1.0 - math.exp(-step / 0.010))
    way = velocity * step / 6e-4
    element += way * (1.0 - abs(element) ** 2 * (1.0 if element * way > 0.0 else 0.0))
    element = min(max(element, -1.0), 1.0)
    force = (25.0 + 70.0 * current) * element + (250.0 + 90.0 * current) * velocity + DRAG * velocity * abs(velocity)
    return element, current, force


@njit
def on_the_bench(displacement: np.ndarray, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return force and current of a damper that is moved."""
    force, current = np.zeros(len(displacement)), np.zeros(len(displacement))
    element, level = 0.0, command[0]
    for row in range(len(displacement) - 1):
        velocity = (displacement[row + 1] - displacement[row]) * RATE
        for _ in range(STEPS):
            element, level, value = damper(element, level, velocity, command[row], 1.0 / (RATE * STEPS))
        force[row], current[row] = value, level
    force[-1], current[-1] = force[-2], current[-2]
    return force, current


@njit
def on_the_table(
    ground: np.ndarray, stiffness: np.ndarray, damping: np.ndarray, start: np.ndarray, law: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return accelerations, displacements and damper signals; law 0: no damper, 1: off, 2: full current, 3: vd."""
    step, count = 1.0 / (RATE * STEPS), len(ground)
    x, v, element, current, force = start.copy(), np.zeros(3), 0.0, LIMIT if law == 2 else 0.0, 0.0
    accelerations, displacements, signals = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 2))
    for row in range(count):
        command = LIMIT if law == 2 else 0.0
        if law == 3:
            speed = abs(v[0])
            surplus = VD_GAIN * speed - 25.0 - 250.0 * speed - DRAG * speed * speed
            command = min(max(surplus / (70.0 + 90.0 * speed), 0.0), LIMIT)
        for part in range(STEPS):
            if law > 0:
                element, current, force = damper(element, current, v[0], command, step)
            a = (-(stiffness @ x) - (damping @ v)) / MASSES - ground[row]
            a[0] -= force / MASSES[0]
            if part == 0:
                accelerations[row], displacements[row] = a + ground[row], x
                signals[row, 0], signals[row, 1] = force, current
            v = v + step * a
            x = x + step * v
    return accelerations, displacements, signals


def write_french(path: Path, heading: list[str], columns: list[np.ndarray]) -> None:
    """Write semicolons and decimal commas in the encoding of Windows."""
    rows = [";".join(f"{value:.6f}" for value in row).replace(".", ",") for row in np.column_stack(columns)]
    path.write_bytes(("\r\n".join([*heading, *rows]) + "\r\n").encode("cp1252"))


def write_english(path: Path, header: str, columns: list[np.ndarray]) -> None:
    """Write commas and decimal points."""
    rows = [",".join(f"{value:.7g}" for value in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


def band_limited(rng: np.random.Generator, size: int, first: float, last: float) -> np.ndarray:
    """Return noise of unit standard deviation between two frequencies [Hz]."""
    sections = butter(2, [first, last], "bandpass", fs=RATE, output="sos")
    noise = sosfiltfilt(sections, rng.standard_normal(size))
    return noise / np.std(noise)


def bench(folder: Path, rng: np.random.Generator) -> None:
    """Write twelve sines at three motions and four currents, and three random tests of 8 s."""
    heading = ["Banc d'essai;amortisseur MR", "Opérateur;LD", "", "Temps (ms);Course (cm);Courant (A);Effort (daN)"]
    time = np.arange(8 * RATE) / RATE

    def noise(size: float) -> np.ndarray:
        return size * rng.standard_normal(time.size)

    motions = [(stroke, frequency) for stroke, frequency in ((4e-3, 1.0), (8e-3, 1.5), (6e-3, 2.5)) for _ in range(4)]
    for number, (stroke, frequency) in enumerate(motions, start=1):
        displacement = stroke * np.sin(2.0 * np.pi * frequency * time)
        force, current = on_the_bench(displacement, np.full(time.size, 0.4 * ((number - 1) % 4)))
        force, travel, current = force + noise(0.5), displacement + noise(4e-6), current + noise(3e-3)
        if number % 4 == 0:
            header = '"Elapsed Time, s","Axial Displacement, in","Coil (mA)","Axial Force, lbf"'
            columns = [time, travel / INCH, 1e3 * current, force / POUND]
            write_english(folder / f"mts_{number:02d}.csv", header, columns)
        else:
            write_french(folder / f"essai_{number:02d}.csv", heading, [1e3 * time, 1e2 * travel, current, force / 10.0])
    for number in (1, 2, 3):
        displacement = 3e-3 * band_limited(rng, time.size, 0.5, 3.0)
        force, current = on_the_bench(displacement, np.repeat(rng.uniform(0.0, LIMIT, 16), time.size // 16))
        travel, current, force = displacement + noise(4e-6), current + noise(3e-3), force + noise(0.5)
        columns = [1e3 * time, 1e2 * travel, current, force / 10.0]
        write_french(folder / f"essai_alea_{number}.csv", heading, columns)


def structure(folder: Path, rng: np.random.Generator) -> None:
    """Write sweeps, a random test, free decays, and three closed-loop tests of a frame with three storeys."""
    k1, k2, k3 = STIFFNESSES
    stiffness = np.array([[k1 + k2, -k2, 0.0], [-k2, k2 + k3, -k3], [0.0, -k3, k3]])
    root = np.diag(MASSES**-0.5)
    squares, vectors = np.linalg.eigh(root @ stiffness @ root)
    modes, omega = root @ vectors, np.sqrt(squares)
    mass = np.diag(MASSES)
    damping = mass @ modes @ np.diag(2.0 * np.array(RATIOS) * omega) @ modes.T @ mass
    floors = [f"Niveau {floor} (g)" for floor in (1, 2, 3)]
    rest = np.zeros(3)

    def noisy(values: np.ndarray, size: float) -> np.ndarray:
        return values + size * rng.standard_normal(values.shape)

    def write(name: str, ground: np.ndarray, start: np.ndarray, *, french: bool = True) -> None:
        accelerations = on_the_table(ground, stiffness, damping, start, 0)[0]
        columns = [noisy(ground[::5], 2e-3), *noisy(accelerations[::5], 2e-3).T]
        time = np.arange(len(columns[0])) / (RATE / 5)
        if french:
            header = ";".join(["Temps (s)", "Table (g)", *floors])
            write_french(folder / name, [header], [time, *(values / GRAVITY for values in columns)])
        else:
            header = ",".join(["Time (s)", *(f"{item} acc (cm/s^2)" for item in ("Table", "Floor 1", "Floor 2", "Floor 3"))])
            write_english(folder / name, header, [time, *(1e2 * values for values in columns)])

    time = np.arange(60 * RATE) / RATE
    write("balayage_1.csv", 0.25 * chirp(time, 0.5, 60.0, 12.0), rest)
    write("balayage_2.csv", -0.25 * chirp(time, 0.5, 60.0, 12.0), rest)
    write("table_random.csv", 0.4 * band_limited(rng, time.size, 0.5, 12.0), rest, french=False)
    for mode, pull in enumerate((0.02, 0.006, 0.003)):
        shape = modes[:, mode] / np.max(np.abs(modes[:, mode]))
        write(f"decay_mode{mode + 1}.csv", np.zeros(25 * RATE), pull * shape)
    time = np.arange(40 * RATE) / RATE
    ground = 0.15 * np.minimum(time / 3.0, 1.0) * np.sin(1.02 * omega[0] * time)
    header = ["Temps (s)", "Table (g)", *floors, *(f"Déplacement {floor} (mm)" for floor in (1, 2, 3))]
    header += ["Effort amortisseur (daN)", "Courant (A)"]
    for law, name in ((1, "passive_off"), (2, "passive_on"), (3, "vd")):
        accelerations, displacements, signals = on_the_table(ground, stiffness, damping, rest, law)
        accelerations, displacements, signals = accelerations[::2], displacements[::2], signals[::2]
        columns = [time[::2], noisy(ground[::2], 2e-3) / GRAVITY, *(noisy(accelerations, 2e-3) / GRAVITY).T]
        columns += [*(1e3 * noisy(displacements, 1e-5)).T, noisy(signals[:, 0], 0.5) / 10.0, noisy(signals[:, 1], 3e-3)]
        write_french(folder / f"boucle_{name}.csv", [";".join(header)], columns)


def main(folder: Path) -> None:
    """Write all files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(77)
    bench(folder, rng)
    structure(folder, rng)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
