"""Architecture sweep: all candidates are screened on few rows and the better ones are refined.

The cost is predicted before the sweep, and an interrupted sweep can be resumed.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import FloatArray, IntArray, Progress, atomic_path, no_progress
from mrpipe.networks.assembly import History, rows_at, window_starts
from mrpipe.networks.candidates import Candidate
from mrpipe.networks.held_out import splits
from mrpipe.networks.levenberg_marquardt import fit
from mrpipe.networks.options import SweepOptions
from mrpipe.networks.problem import Problem
from mrpipe.networks.scaling import NORMALISATION, Normalisation, scaling_of
from mrpipe.networks.sweep_cost import predicted_cost
from mrpipe.networks.training import in_parallel, initial_parameters
from mrpipe.words import duration

Crossings = Callable[[Mapping[Candidate, float]], list[Candidate]]
"""Function from the errors of the screened candidates to further candidates."""

_Fits = tuple[FloatArray, FloatArray]
"""Errors (starts,) and parameters (starts, P) of one candidate."""


@dataclass(frozen=True)
class Outcome:
    """Ratio of the RMS error of a candidate to the RMS of the held-out force, for each start (NaN: not refined).

    Each start has a split into fitted and held-out tests. All candidates have the same splits, so that their errors are
    compared start by start.
    """

    candidate: Candidate
    screened: FloatArray
    refined: FloatArray

    @property
    def is_refined(self) -> bool:
        """Whether the candidate was refined after the screening."""
        return bool(np.isfinite(self.refined).all())


@dataclass(frozen=True)
class SweepRun:
    """All outcomes in the order of the candidates; tests held out in each split; predicted and spent wall time [s]."""

    outcomes: tuple[Outcome, ...]
    held_out: tuple[tuple[str, ...], ...]
    predicted_seconds: float
    seconds: float


@dataclass(frozen=True)
class _Data:
    """The same rows of one split for every candidate: places in the histories for the two fits and for judging."""

    fit: History
    held: History
    screen: IntArray
    refine: IntArray
    judged: IntArray
    normalisation: Normalisation


def sweep(
    history: History,
    candidates: Sequence[Candidate],
    options: SweepOptions,
    seed: int,
    *,
    normalisation: Normalisation = NORMALISATION,
    jobs: int = 1,
    cache: Path | None = None,
    crossings: tuple[Crossings, int] | None = None,
    progress: Progress = no_progress,
    tell: Callable[[str], None] = lambda _: None,
) -> SweepRun:
    """Compare candidates on training records by cross-validation over motions and tests.

    Each start of a candidate is fitted to one split of the records (see :func:`mrpipe.networks.held_out.splits`) and
    judged on motions or tests that it was not fitted to.

    Parameters
    ----------
    history
        Training tests.
    candidates
        Candidates to compare.
    options
        Options of the sweep.
    seed
        Seed of the splits and the starts. The starts of a candidate depend on the candidate and the seed only.
    normalisation
        Normalisation of inputs and target, see :mod:`mrpipe.networks.scaling`.
    jobs
        Number of threads; the results do not depend on it.
    cache
        Folder in which each fit is stored when it is complete. The name of the file is derived from all inputs of the
        fit. A sweep that is resumed or extended reads the fits from this folder.
    crossings
        Function that returns further candidates after the first screening (see
        :meth:`mrpipe.networks.candidates.Grid.crossings`), and the largest number of them.
    progress, tell
        `progress` is called with the completed share and a text. `tell` is called with the predicted cost before the
        sweep.
    """
    began = time.perf_counter()
    data = _splits(history, candidates, options, seed, normalisation)
    fits = _StoredFits(data, options, seed, _digest_of(data, options, seed), cache, jobs)
    further = crossings[1] if crossings else 0
    screening, refining = _predicted(fits, candidates, further, tell)
    middle = screening / max(screening + refining, 1e-9)
    share = len(candidates) / (len(candidates) + further)
    screened = fits.screened(candidates, "screened", _part(progress, 0.0, share * middle))
    every = list(candidates)
    if crossings:
        scores = {item: _mean(errors) for item, (errors, _) in zip(candidates, screened, strict=True)}
        added = [item for item in crossings[0](scores) if item not in scores]
        screened += fits.screened(added, "screened combinations", _part(progress, share * middle, middle))
        every += added
    chosen = _to_refine([_mean(errors) for errors, _ in screened], len(candidates), options.refined)
    starts = [(every[index], screened[index][1]) for index in chosen]
    refined = fits.refined(starts, _part(progress, middle, 1.0))
    after = {index: errors for index, (errors, _) in zip(chosen, refined, strict=True)}
    absent = np.full(options.starts, np.nan)
    outcomes = tuple(
        Outcome(candidate, screened[index][0], after.get(index, absent)) for index, candidate in enumerate(every)
    )
    predicted = (screening + refining) / max(1, jobs)
    return SweepRun(outcomes, tuple(split.held.names for split in data), predicted, time.perf_counter() - began)


@dataclass(frozen=True)
class _StoredFits:
    """Fits of candidates to the splits, read from the folder `cache` where an earlier run made them.

    `digest` identifies everything but the candidate that determines a fit.
    """

    data: Sequence[_Data]
    options: SweepOptions
    seed: int
    digest: str
    cache: Path | None
    jobs: int

    def is_screened(self, candidate: Candidate) -> bool:
        """Return whether an earlier run screened a candidate."""
        return _kept_file(self.cache, f"screen-{self.digest}", candidate) is not None

    def screened(self, wanted: Sequence[Candidate], text: str, progress: Progress) -> list[_Fits]:
        """Return the fits of candidates on few rows."""

        def screen(index: int) -> _Fits:
            item = wanted[index]
            work = partial(_fit_all, self.data, item, self.options, self.seed)
            return _kept(self.cache, f"screen-{self.digest}", item, work)

        known = sum(map(self.is_screened, wanted))
        return _pass(screen, len(wanted), self.jobs, progress, text, known)

    def refined(self, wanted: Sequence[tuple[Candidate, FloatArray]], progress: Progress) -> list[_Fits]:
        """Return the fits of candidates on all rows, each from the parameters (starts, P) of its screening."""
        name = f"refine-{self.digest}"

        def refine(index: int) -> _Fits:
            item, starts = wanted[index]
            return _kept(self.cache, name, item, partial(_fit_all, self.data, item, self.options, self.seed, starts))

        known = sum(_kept_file(self.cache, name, item) is not None for item, _ in wanted)
        return _pass(refine, len(wanted), self.jobs, progress, "refined", known)


def _predicted(
    fits: _StoredFits, candidates: Sequence[Candidate], further: int, tell: Callable[[str], None]
) -> tuple[float, float]:
    """Return the predicted processor time [s] of screening and of refining, after a message on the whole sweep."""
    kept = [fits.is_screened(item) for item in candidates]
    with threadpool_limits(1):
        rng = np.random.default_rng([fits.seed, 3])
        screening, refining = predicted_cost(fits.data[0].fit, candidates, fits.options, rng, further, kept)
    more = f" and up to {further} combinations of the best" if further else ""
    more += f" ({sum(kept)} screened by an earlier run)" if any(kept) else ""
    time_needed = duration((screening + refining) / max(1, fits.jobs))
    cores = "1 free core" if fits.jobs <= 1 else f"{fits.jobs} free cores"
    tell(f"{len(candidates)} candidates{more} x {fits.options.starts} starts: about {time_needed} on {cores}")
    return screening, refining


def _to_refine(means: Sequence[float], planned: int, count: int) -> list[int]:
    """Return the indices of the candidates to refine.

    These are the first candidate, the best `count` of the planned ones, and the best third of the combinations.
    Combinations do not replace the candidates that the findings compare.
    """
    order = np.argsort(means, kind="stable")
    best = [int(place) for place in order if place < planned][:count]
    combined = [int(place) for place in order if place >= planned][: -(-count // 3)]
    return sorted({0, *best, *combined})


def _mean(errors: FloatArray) -> float:
    """Return the logarithm of the geometric mean, so that one failed start does not dominate."""
    return float(np.mean(np.log(errors)))


def _pass(
    work: Callable[[int], _Fits], count: int, jobs: int, progress: Progress, text: str, known: int = 0
) -> list[_Fits]:
    """Call `work` for 0 .. count - 1; the prediction of the remaining time excludes fits that are `known`."""
    began = time.perf_counter()

    def timed(fraction: float, message: str = "") -> None:
        fresh = round(fraction * count) - known
        if fresh > 0:
            message += f", {duration((time.perf_counter() - began) * (count - known - fresh) / fresh)} left"
        progress(fraction, message)

    return list(in_parallel(work, count, jobs, timed, text))  # type: ignore[arg-type]


def _part(progress: Progress, first: float, last: float) -> Progress:
    return lambda fraction, text="": progress(first + (last - first) * fraction, text)


def _splits(
    history: History, candidates: Sequence[Candidate], options: SweepOptions, seed: int, normalisation: Normalisation
) -> list[_Data]:
    rng = np.random.default_rng([seed, 1])
    longest = max(candidate.past_values for candidate in candidates)
    count = min(options.starts, max(2, round(1.0 / options.held_out_share)))
    found = []
    for fitted, held in splits(history, options.held_out_share, count, rng):
        shuffled = rng.permutation(window_starts(fitted, longest))
        judged = rng.permutation(window_starts(held, longest))
        found.append(
            _Data(
                fit=fitted,
                held=held,
                screen=np.sort(shuffled[: options.screen_rows]),
                refine=np.sort(shuffled[: options.refine_rows]),
                judged=np.sort(judged[: options.held_out_rows]),
                normalisation=normalisation,
            )
        )
    return found


def _fit_all(
    data: Sequence[_Data], candidate: Candidate, options: SweepOptions, seed: int, starts: FloatArray | None = None
) -> _Fits:
    """Fit every start of a candidate to its split; return held-out errors (starts,) and parameters (starts, P)."""
    rules = replace(
        options.rules, iterations=options.screen_iterations if starts is None else options.refine_iterations
    )
    rngs = np.random.default_rng([seed, 2, _number(_key(candidate))]).spawn(options.starts)
    problems = [_problems(split, candidate, options, screening=starts is None) for split in data]
    errors, parameters = [], []
    for index in range(options.starts):
        problem, held, scale = problems[index % len(problems)]
        guess = initial_parameters(problem, rngs[index], options.initial) if starts is None else starts[index]
        outcome = fit(problem, guess, method=options.method, rules=rules, held_out=held)
        errors.append(np.sqrt(outcome.held_out_mean_square) * scale)
        parameters.append(outcome.parameters)
    return np.array(errors), np.array(parameters)


def _problems(
    data: _Data, candidate: Candidate, options: SweepOptions, *, screening: bool
) -> tuple[Problem, Problem, float]:
    """Return the problem to fit and the problem for assessment of one split, and a factor.

    The factor converts a normalised RMS error to an NRMSE.
    """
    spec = candidate.spec(data.fit.sampling_rate_hz)
    features, target = rows_at(data.fit, spec, data.screen if screening else data.refine)
    # the parameters of the screening refer to the basis of its rows, so refining keeps that basis
    basis = (features, target) if screening else rows_at(data.fit, spec, data.screen)
    scaling = scaling_of(*basis, spec, data.normalisation, whitened=options.whitened)
    held_features, held_target = rows_at(data.held, spec, data.judged)
    size = float(np.sqrt(np.mean(held_target**2)))
    # errors of candidates are compared to two digits, so that single precision is sufficient
    return (
        Problem(scaling.inputs(features), scaling.target(target), candidate.layers, candidate.biases, single=True),
        Problem(scaling.inputs(held_features), scaling.target(held_target), candidate.layers, candidate.biases),
        scaling.output_scale / size,
    )


def _key(candidate: Candidate) -> str:
    return hashlib.sha256(json.dumps(asdict(candidate), sort_keys=True).encode()).hexdigest()[:24]


def _number(key: str) -> int:
    return int(key, 16) % 2**63


def _digest_of(data: Sequence[_Data], options: SweepOptions, seed: int) -> str:
    """Return a digest of all inputs of a fit except the candidate."""
    digest = hashlib.sha256()
    fits = options.model_dump(exclude={"refined", "design", "states", "past_values", "layers", "neurons", "biases"})
    digest.update(json.dumps([fits, data[0].normalisation, seed], sort_keys=True).encode())
    for history, places in (pair for split in data for pair in ((split.fit, split.refine), (split.held, split.judged))):
        digest.update(places.tobytes())
        for name in sorted(history.channels):
            digest.update(np.ascontiguousarray(history.channels[name]).tobytes())
    return digest.hexdigest()[:16]


def _kept(
    cache: Path | None, name: str, candidate: Candidate, work: Callable[[], tuple[FloatArray, FloatArray]]
) -> tuple[FloatArray, FloatArray]:
    """Return the stored fits of an earlier run; without them, compute the fits and store them."""
    found = _kept_file(cache, name, candidate)
    if found is not None:
        # a damaged file is treated as missing
        damaged = (OSError, ValueError, KeyError, EOFError, BadZipFile)
        with suppress(*damaged), np.load(found, allow_pickle=False) as stored:
            return stored["errors"], stored["parameters"]
    errors, parameters = work()
    if cache is not None:
        with atomic_path(cache / _file_name(name, candidate)) as temporary, temporary.open("wb") as handle:
            np.savez(handle, errors=errors, parameters=parameters)
    return errors, parameters


def _file_name(name: str, candidate: Candidate) -> str:
    return f"{name}-{_key(candidate)}.npz"


def _kept_file(cache: Path | None, name: str, candidate: Candidate) -> Path | None:
    """Return the file in which an earlier run stored the fits of a candidate; None if it does not exist."""
    path = None if cache is None else cache / _file_name(name, candidate)
    return path if path is not None and path.is_file() else None
