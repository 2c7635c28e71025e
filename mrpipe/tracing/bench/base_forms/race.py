"""The race: a comparison of all base forms, without effects and with the effects that they need, on all training tests.

A wrong base form and a missing effect can cause the same residual. Therefore no effect is judged under one base form
alone. There are many models, so they are fitted to a share of the tests, the draft, and then compared on all training
tests. Most samples of this comparison were not used in the fit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.fitting.engine import Fit, fit
from mrpipe.fitting.problem import Problem
from mrpipe.fitting.solution import regressors
from mrpipe.fitting.weighting import centred, weighting
from mrpipe.tracing.bench.base_forms.fits_of_forms import with_effects_of
from mrpipe.tracing.bench.base_forms.sufficient_error import nrmse_of_noise, sufficient_chi_square
from mrpipe.tracing.bench.selection.select import Selection, excess_over_noise
from mrpipe.tracing.bench.selection.terms import other_places, with_terms_in_order
from mrpipe.tracing.rules import RaceRules

SEARCHED_FORMS = 3
"""Numerical technique: base forms, in addition to the declared one, under which effects are searched."""

SCREENED = 8
"""Numerical technique: number of base forms that are fitted further with the effects of another form."""

COMPARED = 60
"""Numerical technique: number of models, the best ones on the draft, that are compared on all training tests."""

UNSTABLE = 1e100
"""Numerical technique: weighted squared error of a model on a test on which its simulation is unstable."""

Search = Callable[[Fit], Selection]


@dataclass(frozen=True, eq=False)
class Model:
    """A base form with effects, fitted to a share of the tests.

    Attributes
    ----------
    fit
        The fit on the draft.
    squares
        Weighted squared error on each training test, without the offset of the test, shape (tests,).
    """

    fit: Fit
    squares: FloatArray

    @property
    def form(self) -> str:
        """Name of the base form."""
        return self.fit.problem.base.name

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects, in the order in which they were found."""
        return tuple(term.effect.name for term in self.fit.problem.terms)

    @property
    def claims(self) -> int:
        """See :func:`claims_of`."""
        return claims_of(self.fit.problem)


def claims_of(problem: Problem) -> int:
    """Return the number of fitted numbers, plus three for each effect: a penalty for complexity."""
    return len(problem.searched) + len(problem.amplitudes) + problem.base.columns + 3 * len(problem.terms)


@dataclass(frozen=True)
class Race:
    """All models of a race.

    Attributes
    ----------
    models
        The models that are compared.
    declared
        Name of the declared base form.
    own
        Names of the effects that belong to the baseline.
    searches
        Base form -> selection of effects under this form, on the draft.
    counts
        Number of samples that are compared in each training test, shape (tests,).
    noise
        Mean squared weighted residual that noise leaves.
    coupled
        Names of the base forms whose equations contain the laws of the drive, so that they are nonlinear in the
        coefficients of the laws. These laws are kept fixed during the race.
    rules
        Decision thresholds.
    noise_nrmse
        The noise as a share of the RMS force.
    """

    models: tuple[Model, ...]
    declared: str
    own: tuple[str, ...]
    searches: Mapping[str, Selection]
    counts: FloatArray
    noise: float
    coupled: frozenset[str] = frozenset()
    rules: RaceRules = field(default_factory=RaceRules)
    noise_nrmse: float = 0.0

    def costs(self, weights: FloatArray | None = None) -> FloatArray:
        """Return the cost of each model, shape (models,): excess of its squared error over noise, times a penalty.

        An error that is at most slightly larger than noise is sufficient, and a share of the noise is added to every
        excess. The penalty grows with the number of fitted numbers and of effects (:func:`claims_of`).

        Parameters
        ----------
        weights
            Weight of each training test, shape (tests,); None: 1.
        """
        w = np.ones(len(self.counts)) if weights is None else weights
        squares = np.stack([model.squares for model in self.models])
        chi_square = squares @ w / max(float(self.counts @ w), 1.0)
        enough = sufficient_chi_square(self.noise, self.noise_nrmse, self.rules)
        left = np.maximum(chi_square - enough, 0.0) + self.rules.noise_share * self.noise
        return np.asarray(left * (1.0 + self.rules.claim_cost * np.array([model.claims for model in self.models])))

    def winner(self, lead: float, weights: FloatArray | None = None) -> Model:
        """Return the model with the fewest effects among those that are not clearly worse than the best one.

        An effect is therefore named only if every model without it, with any base form, is clearly worse.

        Parameters
        ----------
        lead
            A model is clearly worse if its cost exceeds the least one by this share.
        weights
            Weight of each training test, see :meth:`costs`.
        """
        costs = self.costs(weights)
        least = float(np.min(costs))

        def order(place: int) -> tuple[int, float]:
            model = self.models[place]
            declared = model.form == self.declared
            return len(model.effects), float(costs[place]) * (1.0 if declared else 1.0 + self.rules.form_lead)

        near = [place for place in range(len(self.models)) if costs[place] <= (1.0 + lead) * least]
        return self.models[min(near, key=order)]

    def tied_forms(self, winner: Model, lead: float) -> tuple[str, ...]:
        """Return other base forms that are not clearly worse with the same effects, the best first."""
        costs = self.costs()
        own = costs[self.models.index(winner)]
        found: dict[str, float] = {}
        for model, cost in zip(self.models, costs, strict=True):
            if set(model.effects) == set(winner.effects) and model.form != winner.form and cost <= (1.0 + lead) * own:
                found[model.form] = min(float(cost), found.get(model.form, np.inf))
        return tuple(sorted(found, key=lambda name: found[name]))

    def plain(self, form: str) -> Model:
        """Return the best model of a base form with the effects of the baseline alone."""
        able = [model for model in self.models if model.form == form and model.effects == self.own]
        return min(able, key=lambda model: float(model.squares.sum()))

    def extended(self, winner: Model) -> Model:
        """Return the cheapest model with the form and effects of the winner and further effects; else the winner."""
        costs = self.costs()
        count = len(winner.effects)
        able = [
            place
            for place, model in enumerate(self.models)
            if model.form == winner.form and model.effects[:count] == winner.effects
        ]
        return self.models[min(able, key=lambda place: float(costs[place]))]

    def support(self, effect: str, lead: float, *, draws: int, rng: np.random.Generator) -> float:
        """Return the share of bootstrap samples of the tests in which the winner has an effect."""
        tests = len(self.counts)
        present = np.flatnonzero(self.counts)
        held = 0
        for _ in range(draws):
            weights = np.bincount(rng.choice(present, size=len(present)), minlength=tests).astype(np.float64)
            held += effect in self.winner(lead, weights).effects
        return held / max(draws, 1)


def race(
    base: Fit,
    singles: Mapping[str, Fit],
    search: Search,
    noise: float,
    *,
    further: Callable[[Fit], Sequence[Fit]] | None = None,
    rules: RaceRules | None = None,
    jobs: int = 1,
    progress: Progress = no_progress,
) -> Race:
    """Search effects under the best base forms, and try the effects that were found under other forms.

    Parameters
    ----------
    base
        Fit of the declared form to all training tests.
    singles
        Fits of every base form of the library, including the declared one, without effects to the draft of `base`.
    search
        Function that searches effects from a fit without effects.
    noise
        Mean squared weighted residual that noise leaves.
    further
        Function that fits further models from the best one; None: no further models.
    rules
        Decision thresholds; their defaults if None.
    jobs
        Threads.
    progress
        Called with the share done and a text.
    """
    rules = rules or RaceRules()
    coupled = frozenset(name for name, item in singles.items() if item.problem.base.form.coupled)
    singles = {name: _held(item) if name in coupled else item for name, item in singles.items()}
    fits = list(singles.values())
    if min(item.chi_square for item in fits) <= sufficient_chi_square(noise, nrmse_of_noise(base, noise), rules):
        # the error of a base form without effects is that of noise, so no effect is needed
        return _compared(fits, base, {}, noise, coupled, rules, jobs)
    ordered = sorted(singles, key=lambda name: _draft_cost(singles[name], noise, rules))
    names = list(dict.fromkeys((base.problem.base.name, *ordered[:SEARCHED_FORMS])))
    searches: dict[str, Selection] = {}

    def searched(name: str) -> None:
        progress(0.25 + 0.1 * len(searches), f"effects with the base form {name}")
        searches[name] = search(singles[name])
        if searches[name].base is not singles[name]:
            # an effect led to a better optimum of the base form
            singles[name] = searches[name].base
            fits.append(singles[name])
        fits.extend(item.fit for candidates in searches[name].rounds for item in candidates)
        fits.append(searches[name].chosen)

    for name in names:
        searched(name)
    count = len(base.problem.terms)
    best = min(fits, key=lambda item: _draft_cost(item, noise, rules))
    if len(best.problem.terms) > count:
        # a large effect decides which base form is best alone, so the forms are ranked again with the effects
        ranked = sorted(
            with_effects_of(best, list(singles.values()), iterations=2, jobs=jobs),
            key=lambda item: _draft_cost(item, noise, rules),
        )
        closest = [item.problem.base.name for item in ranked[:SCREENED]]
        screened = [singles[name] for name in dict.fromkeys((base.problem.base.name, *closest))]
        fits += with_effects_of(best, screened, jobs=jobs)
        rival = min(fits, key=lambda item: _draft_cost(item, noise, rules)).problem.base.name
        if rival not in searches:
            searched(rival)
        best = min(fits, key=lambda item: _draft_cost(item, noise, rules))
        for place in range(count, len(best.problem.terms) if len(best.problem.terms) > count + 1 else count):
            # the effect may be needed under the best base form only
            shorter = with_terms_in_order(best, other_places(best, place), iterations=1)
            fits += with_effects_of(shorter, screened, jobs=jobs)
    if further is not None:
        fits += further(best)
        if len(best.problem.terms) > count:
            fits += further(singles[best.problem.base.name])
    fits.sort(key=lambda item: _draft_cost(item, noise, rules))
    kept = {id(item): item for item in [*fits[:COMPARED], *singles.values()]}
    return _compared(list(kept.values()), base, searches, noise, coupled, rules, jobs)


def _held(found: Fit) -> Fit:
    """Return a coupled form whose laws are kept fixed in its steps, which makes the search three times faster."""
    base = found.problem.base
    held = replace(base, form=replace(base.form, coupled=False))
    return fit(replace(found.problem, base=held, reference=found.laws), found.theta, iterations=0)


def _compared(
    fits: Sequence[Fit],
    base: Fit,
    searches: Mapping[str, Selection],
    noise: float,
    coupled: frozenset[str],
    rules: RaceRules,
    jobs: int,
) -> Race:
    """Return the race of these models on all training tests."""
    problem = base.problem
    with ThreadPoolExecutor(max_workers=max(1, jobs)) as pool:
        squares = pool.map(lambda item: _squares(item, problem), fits)
        models = tuple(Model(item, value) for item, value in zip(fits, squares, strict=True))
    used = problem.root_weight > 0.0
    counts = np.bincount(problem.recordings.test[used], minlength=problem.recordings.tests).astype(np.float64)
    # noise cannot exceed the residual of the best model: differences of repeats may be a missing effect
    noise = min(noise, min(float(np.sum(model.squares)) for model in models) / max(float(np.sum(counts)), 1.0))
    own = tuple(term.effect.name for term in problem.terms)
    return Race(models, problem.base.name, own, searches, counts, noise, coupled, rules, nrmse_of_noise(base, noise))


def _draft_cost(found: Fit, noise: float, rules: RaceRules) -> float:
    return excess_over_noise(found, noise, rules.noise_share) * (1.0 + rules.claim_cost * claims_of(found.problem))


def _squares(found: Fit, problem: Problem) -> FloatArray:
    """Return the weighted squared error of a model on each test of a problem; its coefficients are not fitted again."""
    whole = found.problem.on_samples_of(problem)
    w = weighting(whole)
    error = problem.recordings.force - found.linear @ regressors(whole, found.theta)
    residual = centred(error[None], w)[0][0]
    sums = np.bincount(problem.recordings.test[w.at], weights=residual**2, minlength=problem.recordings.tests)
    # a model can be unstable on a test that is not part of the draft
    return np.where(np.isfinite(sums), sums, UNSTABLE)
