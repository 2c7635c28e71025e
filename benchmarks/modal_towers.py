"""Modes of virtual towers: forced tests with hidden modes, clock errors and floors without sensors; ambient tests.

    python -m benchmarks.modal_towers [--draws 10] [--first-seed 0] [--kind forced|ambient|both]

Aims: all modes found and none invented. Forced: frequency 0.5 %, damping 10 %, modal assurance 0.98. Ambient: 1 %,
25 % and 0.97. Each draw has 5 to 8 floors, a mass driver on any floor, one or two modes without a visible peak, 3 %
coupling between floors that are no neighbours, 3 % cross-talk and 3 % noise, clock offsets of up to 10 ms and drifts
of up to 20 parts per million, and one or two floors without a sensor. For each forced
draw a second line has the least standard error of a damping ratio that the noise allows (Cramer-Rao bound). Where it
is near the aim of 10 % or above, a draw can fail by chance with any method.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from benchmarks.modal_bounds import least_errors
from mrpipe.errors import UserError
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.records import FrameTest, FrameTests, Place
from tests.modal.towers import Sensors, ambient_test, forced_test, hidden_modes, random_tower, tower_with_hidden_modes

SENSORS = Sensors(noise=0.03, crosstalk=0.03, input_noise=0.01, offset_s=0.01, drift=20e-6)
LIMITS = {"forced": (0.5, 10.0, 0.98), "ambient": (1.0, 25.0, 0.97)}


def assurance(first, second):
    return float(np.abs(first @ second) ** 2 / (first @ first) / (second @ second))


def rate_for(tower, least=50.0):
    """Return a sampling rate [Hz] that shows all modes; some draws have modes beyond 25 Hz."""
    return max(least, float(np.ceil(2.5 * tower.frequencies_hz[-1])))


def forced_draw(seed, duration_s=600.0):
    """Return the tower, its tests and a label."""
    rng = np.random.default_rng(seed)
    tower, floor = tower_with_hidden_modes(rng)
    rate = rate_for(tower)
    missing = set(rng.choice(tower.floors, rng.integers(1, 3), replace=False) + 1)
    if tower.floors - len(missing) < 4:
        missing = {min(missing)}
    tests = []
    for kind in ("sweep", "random"):
        force, seen = forced_test(tower, rng, SENSORS, floor, rate=rate, duration_s=duration_s, kind=kind)
        keep = [i for i in range(tower.floors) if i + 1 not in missing]
        places = tuple(Place(i + 1) for i in keep)
        tests.append(FrameTest(kind, kind, rate, force, seen[:, keep], (False,) * len(keep), floor, places=places))
    hidden, absent = hidden_modes(tower, floor), sorted(map(int, missing))
    label = f"{tower.floors} floors, shaker {floor}, hidden {hidden}, no sensor {absent}"
    return tower, FrameTests(tuple(tests), (), tower.mass, Path("tower")), label


def ambient_draw(seed, duration_s=3600.0):
    """Return the tower, its ambient test and a label."""
    rng = np.random.default_rng(seed)
    tower = random_tower(rng)
    rate = rate_for(tower)
    seen = ambient_test(tower, rng, Sensors(noise=0.03, crosstalk=0.03), rate=rate, duration_s=duration_s)
    places = tuple(Place(i + 1) for i in range(tower.floors))
    test = FrameTest("ambient", "ambient", rate, None, seen, (False,) * tower.floors, places=places)
    return tower, FrameTests((), (), tower.mass, Path("tower"), (test,)), f"{tower.floors} floors"


def judge(tower, tests):
    """Return how many modes were found, missed and invented, and the largest errors of those found."""
    result = identify_frame(tests)
    frequency = np.array([item.value for item in result.frequencies]) / (2 * np.pi)
    damping = np.array([item.value for item in result.damping])
    found, errors, covered = set(), [], np.zeros(2, dtype=int)
    for index, value in enumerate(frequency):
        mode = int(np.argmin(np.abs(tower.frequencies_hz - value)))
        known = np.isfinite(result.mode_shapes[:, index])
        shape = assurance(result.mode_shapes[known, index], tower.shapes[known, mode])
        close = abs(value / tower.frequencies_hz[mode] - 1) < 0.02 and shape > 0.8
        if mode not in found and close:
            found.add(mode)
            for row, (item, true) in enumerate(
                (
                    (result.frequencies[index], 2 * np.pi * tower.frequencies_hz[mode]),
                    (result.damping[index], tower.damping_ratios[mode]),
                )
            ):
                covered[row] += item.low <= true <= item.high
            errors.append(
                (
                    100 * abs(value / tower.frequencies_hz[mode] - 1),
                    100 * abs(damping[index] / tower.damping_ratios[mode] - 1),
                    # a shape that is withheld at a floor is not a found one
                    shape if known.all() else 0.0,
                )
            )
    worst = np.array(errors) if errors else np.full((1, 3), np.nan)
    return {
        "missed": sorted(int(i) + 1 for i in set(range(tower.floors)) - found),
        "invented": frequency.size - len(found),
        "frequency_percent": float(worst[:, 0].max()),
        "damping_percent": float(worst[:, 1].max()),
        "assurance": float(worst[:, 2].min()),
        "modes": len(found),
        "covered": covered,
        "findings": result.findings,
    }


def bound_text(tower, tests):
    """Return the mode whose damping ratio the noise of the tests determines least, and with which standard error."""
    damping = 100 * least_errors(tower, tests.forced, SENSORS.noise)[1]
    mode = int(damping.argmax())
    return f"noise allows no standard error of a damping ratio below {damping[mode]:.1f} % (mode {mode + 1})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--kind", choices=("forced", "ambient", "both"), default="both")
    parser.add_argument("--verbose", action="store_true")
    options = parser.parse_args()
    for kind in ("forced", "ambient") if options.kind == "both" else (options.kind,):
        passed, modes, covered = 0, 0, np.zeros(2, dtype=int)
        for seed in range(options.first_seed, options.first_seed + options.draws):
            tower, tests, label = (forced_draw if kind == "forced" else ambient_draw)(seed)
            begin = time.perf_counter()
            try:
                row = judge(tower, tests)
            except UserError as error:
                print(f"{kind} {seed}: {label}: {error}")
                continue
            limit = LIMITS[kind]
            good = (
                not row["missed"]
                and not row["invented"]
                and row["frequency_percent"] <= limit[0]
                and row["damping_percent"] <= limit[1]
                and row["assurance"] >= limit[2]
            )
            passed += good
            modes += row["modes"]
            covered += row["covered"]
            print(
                f"{kind} {seed}: {'pass' if good else 'FAIL'} {label}; missed {row['missed']}, "
                f"invented {row['invented']}, frequency {row['frequency_percent']:.3f} %, damping "
                f"{row['damping_percent']:.1f} %, MAC {row['assurance']:.4f}, "
                f"in the 95 % interval {row['covered'][0]} frequencies and "
                f"{row['covered'][1]} damping ratios of {row['modes']}, {time.perf_counter() - begin:.1f} s",
                flush=True,
            )
            if kind == "forced":
                print(f"    {bound_text(tower, tests)}")
            if options.verbose:
                print("   ", "\n    ".join(row["findings"]))
        print(
            f"{kind}: {passed} of {options.draws} draws within the aims; of {modes} modes found, {covered[0]} "
            f"frequencies and {covered[1]} damping ratios are inside their 95 % intervals"
        )


if __name__ == "__main__":
    main()
