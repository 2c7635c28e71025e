"""Processor time of an architecture sweep, predicted from a few iterations of three candidates."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.networks.assembly import History
from mrpipe.networks.candidates import Candidate
from mrpipe.networks.levenberg_marquardt import fit
from mrpipe.networks.options import SweepOptions
from mrpipe.networks.problem import Problem
from mrpipe.networks.stopping import StoppingRules


def predicted_cost(
    history: History,
    candidates: Sequence[Candidate],
    options: SweepOptions,
    rng: np.random.Generator,
    further: int = 0,
    kept: Sequence[bool] = (),
) -> tuple[float, float]:
    """Return the predicted time of screening and refining on one core [s], including `further` unknown candidates.

    Candidates in `kept` have been screened by an earlier run. `rng` draws the samples on which iterations are timed.

    Combinations and refined candidates are mostly in the larger half of the networks.
    """
    screen, refine = predicted_costs(history, candidates, options, rng)
    upper = slice(len(screen) // 2, None)
    typical, typical_refined = float(np.sort(screen)[upper].mean()), float(np.sort(refine)[upper].mean())
    count = min(options.refined, len(candidates)) + min(-(-options.refined // 3), further)
    left = screen[~np.array(kept, dtype=bool)] if len(kept) else screen
    return float(left.sum()) + further * typical, count * typical_refined


def predicted_costs(
    history: History, candidates: Sequence[Candidate], options: SweepOptions, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return the predicted times of screening and of refining each candidate on one core [s], shapes (candidates,).

    A few iterations of three candidates (the smallest, a middle and the largest) are timed; the others are
    interpolated by their number of parameters. `rng` draws the samples on which the iterations are timed.
    """
    sizes = np.array([candidate.parameters for candidate in candidates])
    order = np.argsort(sizes, kind="stable")
    probes = sorted({int(order[place]) for place in (0, len(order) // 2, len(order) - 1)}, key=lambda item: sizes[item])
    times = np.array([_iteration_seconds(candidates[probe], history.samples, options, rng) for probe in probes])
    # early stopping saves 0 to 60 % of the iterations
    effort = options.starts * 0.7
    screen, refine = (np.interp(sizes, sizes[probes], column) * effort for column in times.T)
    return screen * options.screen_iterations, refine * options.refine_iterations


def _iteration_seconds(
    candidate: Candidate, available: int, options: SweepOptions, rng: np.random.Generator
) -> tuple[float, float]:
    """Return the time of one iteration of screening and of refining [s], including the error of the held-out rows."""

    def problem(rows: int) -> Problem:
        inputs = rng.normal(size=(candidate.layers[0], min(rows, available)))
        return Problem(inputs, np.tanh(inputs[0]), candidate.layers, candidate.biases, single=True)

    held = problem(options.held_out_rows)
    start = rng.uniform(-0.5, 0.5, held.size)
    rules = StoppingRules(iterations=4, held_out_failures=5)
    seconds = []
    for rows in (options.screen_rows, options.refine_rows):
        fitted = problem(rows)
        # processor time, because the load of the machine in these iterations does not predict that of later hours
        began = time.thread_time()
        outcome = fit(fitted, start, method=options.method, rules=rules, held_out=held)
        seconds.append((time.thread_time() - began) / max(1, outcome.iterations))
    return seconds[0], seconds[1]
