"""Time of Levenberg-Marquardt on the forward network 8-6-6-1, on all rows of a set the size of Table 2.1.

    python benchmarks/levenberg_marquardt.py [--rows 182000] [--starts 10] [--jobs 2] [--plain]

Prints seconds an iteration of each method (and, with --plain, of scipy on the uncompressed problem), then the time of a
whole training: every start on a subsample of 20 000 rows first, then every start on all rows.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from mrpipe.networks.assembly import History
from mrpipe.networks.held_out import training_data
from mrpipe.networks.levenberg_marquardt import Method, StoppingRules, fit
from mrpipe.networks.network import FeatureSpec
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.problem import Problem
from mrpipe.networks.training import train

RATE = 200.0
METHODS: tuple[Method, ...] = ("mu-identity", "mu-diagonal", "least-squares")


def history_of(rows: int, tests: int = 95) -> History:
    """Return a made-up history: sines of several amplitudes, frequencies and currents, force with hysteresis."""
    rng = np.random.default_rng(1)
    length = rows // tests
    time_s = np.arange(length) / RATE
    channels: dict[str, list[np.ndarray]] = {name: [] for name in ("displacement", "velocity", "drive", "force")}
    for test in range(tests):
        frequency, amplitude = rng.choice([0.5, 1.0, 1.27, 1.8, 2.2]), rng.choice([0.005, 0.010])
        phase = 2.0 * np.pi * frequency * time_s + rng.uniform(0.0, 2.0 * np.pi)
        drive = np.full(length, float(test % 5)) if test % 2 else (test % 5) * np.abs(np.cos(phase))
        velocity = amplitude * 2.0 * np.pi * frequency * np.cos(phase)
        yielded = np.tanh(40.0 * (velocity + 0.1 * amplitude * np.sin(phase)))
        force = (22.0 + 15.0 * drive**1.5) * yielded + (50.0 + 75.0 * drive) * velocity
        made = (amplitude * np.sin(phase), velocity, drive, force + rng.normal(scale=0.5, size=length))
        for name, values in zip(channels, made, strict=True):
            channels[name].append(values)
    joined = {name: np.concatenate(parts) for name, parts in channels.items()}
    joined["acceleration"] = np.gradient(joined["velocity"]) * RATE
    return History(
        names=tuple(f"test-{test}" for test in range(tests)),
        channels=joined,
        starts=np.arange(tests + 1, dtype=np.int64) * length,
        drive_varies=tuple(test % 2 == 0 for test in range(tests)),
        sampling_rate_hz=RATE,
        drive_unit="A",
    )


def plain_seconds(problem: Problem, start: np.ndarray, iterations: int) -> float:
    """Return seconds an iteration of scipy on the problem without compression."""
    began = time.perf_counter()
    outcome = least_squares(
        problem.residual, start, jac=problem.jacobian, method="trf", x_scale="jac", max_nfev=iterations
    )
    return (time.perf_counter() - began) / int(outcome.nfev)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=182000)
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--plain", action="store_true", help="time scipy on the uncompressed problem too (1 GB)")
    arguments = parser.parse_args()
    history = history_of(arguments.rows)
    spec = FeatureSpec(("velocity", "drive"), 3, False, RATE, "force")
    options = TrainingOptions(
        architecture=(6, 6),
        biases=True,
        starts=arguments.starts,
        refined_starts=arguments.starts,
        iterations=50,
        held_out_share=0.0,
    )
    rng = np.random.default_rng(2)
    data = training_data(history, spec, options.held_out_share, rng)
    with threadpool_limits(1):
        for rows in (min(20000, arguments.rows), arguments.rows):
            problem = data.problem((8, 6, 6, 1), True, np.arange(min(rows, len(data.fit_rows.target))))
            start = rng.uniform(-0.5, 0.5, problem.size)
            for method in METHODS:
                began = time.perf_counter()
                outcome = fit(problem, start, method=method, rules=StoppingRules(iterations=10))
                spent = (time.perf_counter() - began) / max(1, outcome.iterations)
                print(f"{method:14s} {problem.rows:7d} rows: {spent:.4f} s an iteration, one core")
            if arguments.plain:
                print(f"{'scipy, plain':14s} {problem.rows:7d} rows: {plain_seconds(problem, start, 5):.4f} s")
    began = time.perf_counter()
    trained = train(history, spec, options, np.random.default_rng(3), jobs=arguments.jobs)
    errors = [start.subsample_nrmse for start in trained.starts]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(
        f"{arguments.starts} starts on all {arguments.rows} rows, {arguments.jobs} jobs: "
        f"{time.perf_counter() - began:.1f} s, peak memory {peak:.0f} MB, NRMSE after the subsample "
        f"{min(errors):.4f} to {max(errors):.4f}, best of all {trained.path[-1]:.4f}"
    )


if __name__ == "__main__":
    main()
