"""Training of one architecture from several starts: first on a subsample, then on all rows.

The result is the network with the smallest error on held-out records.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.networks.assembly import History
from mrpipe.networks.held_out import TrainingData, training_data
from mrpipe.networks.levenberg_marquardt import FitResult, fit
from mrpipe.networks.network import FeatureSpec, Network, averaged
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.problem import Problem, pack, unpack
from mrpipe.networks.scaling import NORMALISATION, Normalisation
from mrpipe.networks.stopping import StoppingRules

HELD_OUT_ROWS = 10000
"""Number of rows of the held-out records that early stopping uses while a subsample is fitted."""


@dataclass(frozen=True)
class Start:
    """Result of one start.

    Attributes
    ----------
    subsample_nrmse, held_out_nrmse
        Ratio of RMS error to RMS target after the first phase, on the training rows and on the held-out records.
    refined_held_out_nrmse
        The same ratio on the held-out records after the second phase; NaN without a second phase.
    iterations
        Number of iterations of both phases.
    reason
        Reason why the last phase ended.
    seconds
        Wall time of both phases [s].
    """

    subsample_nrmse: float
    held_out_nrmse: float
    refined_held_out_nrmse: float
    iterations: int
    reason: str
    seconds: float


@dataclass(frozen=True)
class Trained:
    """A trained network and its training.

    Attributes
    ----------
    network
        Network with the smallest error on the held-out records, or average of several.
    starts
        Results of the starts.
    held_out
        Names of the held-out records.
    path
        Ratio of RMS error to RMS target after each iteration of the chosen start.
    iterations, seconds
        Number of iterations of the chosen start; wall time of all starts [s].
    """

    network: Network
    starts: tuple[Start, ...]
    held_out: tuple[str, ...]
    path: FloatArray
    iterations: int
    seconds: float


def initial_parameters(
    problem: Problem, rng: np.random.Generator, kind: Literal["random", "perceptron"] = "random"
) -> FloatArray:
    """Return initial parameters: uniform within +-0.5, or the result of a short fit by scikit-learn's MLPRegressor."""
    if kind == "random":
        return rng.uniform(-0.5, 0.5, problem.size)
    from sklearn.neural_network import MLPRegressor

    # rows at equal spacing, because the first rows are those of the first tests only
    stride = max(1, problem.rows // 4000)
    perceptron = MLPRegressor(
        hidden_layer_sizes=problem.layers[1:-1],
        activation="tanh",
        solver="lbfgs",
        alpha=0.0,
        max_iter=100,
        tol=1e-9,
        random_state=int(rng.integers(2**31)),
    )
    perceptron.fit(problem.inputs[:, ::stride].T, problem.target[::stride])
    weights = [np.asarray(matrix, dtype=np.float64).T for matrix in perceptron.coefs_]
    return pack(weights, [np.asarray(item, dtype=np.float64) for item in perceptron.intercepts_], problem.biases)


def to_network(parameters: FloatArray, data: TrainingData, hidden: tuple[int, ...], biases: bool) -> Network:
    """Return the network of trained parameters, with the whitening multiplied into the first layer."""
    weights, offsets = unpack(parameters, data.layers(hidden), biases)
    scaling = data.scaling
    return Network(
        weights=(weights[0] @ scaling.basis, *(matrix.copy() for matrix in weights[1:])),
        biases=tuple(bias.copy() for bias in offsets),
        input_scale=scaling.input_scale,
        input_shift=scaling.input_shift,
        output_scale=scaling.output_scale,
        output_shift=scaling.output_shift,
        features=data.spec,
        feature_minimum=scaling.minimum,
        feature_maximum=scaling.maximum,
        has_biases=biases,
    )


def in_parallel(
    work: Callable[[int], object], count: int, jobs: int, progress: Progress, text: str
) -> Sequence[object]:
    """Call `work(0) .. work(count - 1)` on some threads, one BLAS thread each, and return the results in order.

    Training consists of matrix products and hyperbolic tangents, in which numpy releases the lock of the interpreter.
    Threads are therefore as fast as processes, and they share the data.
    """
    results = []
    with threadpool_limits(1):
        runner = Parallel(n_jobs=max(1, min(jobs, count)), backend="threading", return_as="generator")
        for done, result in enumerate(runner(delayed(work)(index) for index in range(count)), start=1):
            results.append(result)
            progress(done / count, f"{text} {done} of {count}")
    return results


def train(
    history: History,
    spec: FeatureSpec,
    options: TrainingOptions,
    rng: np.random.Generator,
    *,
    normalisation: Normalisation = NORMALISATION,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Trained:
    """Train a network on the training records of a history.

    Parameters
    ----------
    history
        Tests of role training; validation tests are not used.
    spec
        Definition of the features.
    options
        Options of the training.
    rng
        Random generator of the split and the starts; the result does not depend on `jobs`.
    normalisation
        Normalisation of inputs and target, see :mod:`mrpipe.networks.scaling`.
    jobs
        Threads.
    progress
        Called with the completed share and a text.
    """
    data = training_data(
        history, spec, options.held_out_share, rng, normalisation=normalisation, whitened=options.whitened
    )
    return train_on(data, options, rng, jobs=jobs, progress=progress)


def train_on(
    data: TrainingData,
    options: TrainingOptions,
    rng: np.random.Generator,
    *,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Trained:
    """Train a network on rows that are already normalised and divided; arguments as in :func:`train`."""
    began = time.perf_counter()
    layers = data.layers(options.hidden)
    rows = np.sort(rng.permutation(len(data.fit_rows.target))[: options.subsample_rows])
    seeds = rng.spawn(options.starts)
    small = replace(data.problem(layers, options.biases, rows), weight_decay=options.weight_decay)
    monitor = _monitor(data, layers, options.biases, rng)

    def first(index: int) -> tuple[FitResult, float]:
        started = time.perf_counter()
        guess = initial_parameters(small, seeds[index], options.initial)
        rules = _limited(options.rules, options.subsample_iterations)
        return fit(small, guess, method=options.method, rules=rules, held_out=monitor), time.perf_counter() - started

    # warning filters are global to the process, so that they are set here and not in the threads
    with warnings.catch_warnings():
        # the perceptron is only a start, so that it need not converge
        warnings.filterwarnings("ignore", message="lbfgs failed to converge")
        early: list[tuple[FitResult, float]] = list(
            in_parallel(first, options.starts, jobs, lambda f, t="": progress(0.6 * f, t), "start")  # type: ignore[arg-type]
        )
    order = np.argsort([_judged(outcome) for outcome, _ in early], kind="stable")
    chosen = [int(index) for index in order[: max(1, options.refined_starts)]]
    late: list[tuple[FitResult, float]] = []
    if options.iterations > 0:
        whole, held = _second_phase(data, layers, options, rng)
        # threads without a start share the rows of another start
        whole = replace(whole, threads=max(1, jobs // len(chosen)))

        def second(place: int) -> tuple[FitResult, float]:
            started = time.perf_counter()
            guess = early[chosen[place]][0].parameters
            rules = _limited(options.rules, options.iterations)
            outcome = fit(whole, guess, method=options.method, rules=rules, held_out=held)
            return outcome, time.perf_counter() - started

        late = list(
            in_parallel(second, len(chosen), jobs, lambda f, t="": progress(0.6 + 0.4 * f, t), "refined")  # type: ignore[arg-type]
        )
    return _finish(data, options, early, chosen, late, time.perf_counter() - began)


def _second_phase(
    data: TrainingData, layers: tuple[int, ...], options: TrainingOptions, rng: np.random.Generator
) -> tuple[Problem, Problem | None]:
    """Return the problem that the second phase fits, and the problem that stops it."""
    learns = options.refine_on == "every"
    available = len((data.every_row if learns else data.fit_rows).target)
    rows = None
    if options.refined_rows is not None and options.refined_rows < available:
        rows = np.sort(rng.permutation(available)[: options.refined_rows])
    whole = data.problem(layers, options.biases, rows, part="every" if learns else "fit")
    held = None if learns or not len(data.held_rows.target) else data.problem(layers, options.biases, part="held")
    return replace(whole, weight_decay=options.weight_decay), held


def _limited(rules: StoppingRules, iterations: int) -> StoppingRules:
    return replace(rules, iterations=min(rules.iterations, iterations))


def _monitor(data: TrainingData, layers: tuple[int, ...], biases: bool, rng: np.random.Generator) -> Problem | None:
    available = len(data.held_rows.target)
    if not available:
        return None
    return data.problem(layers, biases, np.sort(rng.permutation(available)[:HELD_OUT_ROWS]), part="held")


def _judged(outcome: FitResult) -> float:
    """Return the error that ranks the starts: held-out error, or training error without held-out rows."""
    return outcome.mean_square if np.isnan(outcome.held_out_mean_square) else outcome.held_out_mean_square


def _finish(
    data: TrainingData,
    options: TrainingOptions,
    early: list[tuple[FitResult, float]],
    chosen: list[int],
    late: list[tuple[FitResult, float]],
    seconds: float,
) -> Trained:
    refined = dict(zip(chosen, late, strict=False))
    starts = []
    for index, (outcome, spent) in enumerate(early):
        again, more = refined.get(index, (None, 0.0))
        starts.append(
            Start(
                subsample_nrmse=data.relative(outcome.mean_square),
                held_out_nrmse=data.relative(outcome.held_out_mean_square, held=True),
                refined_held_out_nrmse=data.relative(again.held_out_mean_square, held=True)
                if again is not None
                else float("nan"),
                iterations=outcome.iterations + (again.iterations if again is not None else 0),
                reason=again.reason if again is not None else outcome.reason,
                seconds=spent + more,
            )
        )
    finals = [refined[index][0] if index in refined else early[index][0] for index in chosen]
    order = np.argsort([_judged(outcome) for outcome in finals], kind="stable")
    best = int(order[0])
    taken = [finals[int(place)] for place in order[: options.averaged]]
    path = list(early[chosen[best]][0].path) + (list(finals[best].path[1:]) if refined else [])
    return Trained(
        network=averaged([to_network(outcome.parameters, data, options.hidden, options.biases) for outcome in taken]),
        starts=tuple(starts),
        held_out=data.held_out,
        path=np.array([data.relative(value) for value in path]),
        iterations=starts[chosen[best]].iterations,
        seconds=seconds,
    )
