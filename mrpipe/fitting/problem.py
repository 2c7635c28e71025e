"""The fitting problem: base form, effects, samples and their weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mrpipe.artifacts import BoolArray, FloatArray
from mrpipe.dampers.drive import coefficients, driver_lag, driver_lag_apart
from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.laws import Law, LawShape
from mrpipe.dampers.parameters import Parameter, Scales, shape
from mrpipe.dampers.plant import Step
from mrpipe.effects.contract import Effect, EffectForm
from mrpipe.fitting.recordings import Recordings

ETA = shape("eta", "1/s", "rate of the driver's lag (2.4)", "one", 2.0, 3000.0, (100.0, 30.0))
ETA_FALL = shape("eta_fall", "1/s", "rate where the drive falls", "one", 2.0, 3000.0, (100.0,))


@dataclass(frozen=True)
class Base:
    """The base form of a problem: a form of the library, the shapes of its laws of the drive, and the lag of the drive.

    Attributes
    ----------
    form
        The base form.
    laws
        Shape of the law of each block of the form.
    lag_known
        Whether the drive varies within tests, so that the measurements determine its lag.
    lag_apart
        Whether the lag has a separate rate for a falling drive.
    held
        Parameter -> value of parameters that are not searched: references of the form, and those that a caller fixes.
    """

    form: BaseForm
    laws: tuple[LawShape, ...]
    lag_known: bool = True
    lag_apart: bool = False
    held: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the form."""
        return self.form.name

    @property
    def columns(self) -> int:
        """Number of linear coefficients before the amplitudes: those of all laws, and one for a known force."""
        return sum(law.count for law in self.laws) + int(self.form.known)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters that are searched."""
        found = [item for item in self.form.searched if item.name not in self.held]
        for block, law in zip(self.form.blocks, self.laws, strict=True):
            if law.saturates:
                name = f"{block}_scale"
                found.append(shape(name, "drive", "drive at which the law saturates", "drive", 0.05, 20.0, (0.5,)))
        if self.lag_known:
            found.append(ETA)
        if self.lag_known and self.lag_apart:
            found.append(ETA_FALL)
        return tuple(found)

    def scale_shares(self, values: Mapping[str, float], drive: float) -> list[float]:
        """Return the scale of each law as a share of the drive limit; 1 for laws that do not saturate."""
        return [
            values[f"{block}_scale"] / drive if law.saturates else 1.0
            for block, law in zip(self.form.blocks, self.laws, strict=True)
        ]

    def laws_of(self, linear: FloatArray, values: Mapping[str, float], drive: float) -> tuple[Law, ...]:
        """Return the laws with these linear coefficients; `drive` is the largest drive [A or V]."""
        found, first = [], 0
        for law, share in zip(self.laws, self.scale_shares(values, drive), strict=True):
            found.append(law.law(linear[first : first + law.count], drive, share))
            first += law.count
        return tuple(found)

    def steps(self, values: Mapping[str, float], *laws: Law) -> list[Step]:
        """Return the steps of the base form for these parameter values."""
        steps = [coefficients(*laws), *self.form.steps(values)]
        if self.lag_known:
            apart = "eta_fall" in values
            steps.append(driver_lag_apart(values["eta"], values["eta_fall"]) if apart else driver_lag(values["eta"]))
        return steps


@dataclass(frozen=True)
class Term:
    """One effect in one form."""

    effect: Effect
    form: EffectForm

    @property
    def key(self) -> str:
        """Return `effect/form`."""
        return f"{self.effect.name}/{self.form.name}"


@dataclass(frozen=True)
class Problem:
    """A fitting problem: a model, recordings, and the weights of their samples.

    Attributes
    ----------
    recordings
        The tests.
    base
        The base form.
    terms
        Effects that are fitted together with the base form.
    root_weight
        Square root of the weight of each sample, 0 where it is not compared, shape (n,) [1/N].
    scales
        Scales of bounds and starts.
    reference
        Laws of the drive that effects are proportional to, and that coupled forms read.
    window_share
        Length of the moving average that the recorder applied, as a share of the period; 0: none.
    offsets
        Whether each test has its own force offset; otherwise all tests share one.
    """

    recordings: Recordings
    base: Base
    terms: tuple[Term, ...]
    root_weight: FloatArray
    scales: Scales
    reference: tuple[Law, ...]
    window_share: float = 0.0
    offsets: bool = True

    def on_samples_of(self, other: Problem) -> Problem:
        """Return the same model compared on the recordings of another problem, with its weights."""
        return replace(self, recordings=other.recordings, root_weight=other.root_weight)

    @cached_property
    def searched(self) -> tuple[tuple[int, Parameter], ...]:
        """Pairs (index of the term, or -1 for the base; parameter) of all searched parameters."""
        own = [(-1, parameter) for parameter in self.base.parameters()]
        return *own, *((index, item) for index, term in enumerate(self.terms) for item in term.form.searched)

    @cached_property
    def amplitudes(self) -> tuple[tuple[int, Parameter], ...]:
        """Pairs (index of the term, or -1 for the base; parameter) of all amplitudes."""
        own = [(-1, item) for item in self.base.form.amplitudes]
        return *own, *((index, item) for index, term in enumerate(self.terms) for item in term.form.amplitudes)

    @cached_property
    def _coordinates(self) -> tuple[BoolArray, FloatArray]:
        """Which searched parameters are searched by their logarithm, and the scale of each, shape (p,)."""
        parameters = [parameter for _, parameter in self.searched]
        logarithmic = np.array([item.logarithmic for item in parameters], dtype=bool)
        return logarithmic, np.array([self.scales.of(item.scale) for item in parameters], dtype=np.float64)

    def encode(self, values: Sequence[float]) -> FloatArray:
        """Return searched parameters in the coordinates of the search, shape (p,)."""
        given = np.asarray(values, dtype=np.float64)
        logarithmic, scale = self._coordinates
        found = given / scale
        found[logarithmic] = np.log(given[logarithmic])
        return found

    def decode(self, theta: FloatArray) -> list[float]:
        """Return the parameter values (SI) for coordinates of the search, shape (p,)."""
        logarithmic, scale = self._coordinates
        found = theta * scale
        found[logarithmic] = np.exp(theta[logarithmic])
        return [float(value) for value in found]

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper bounds in the coordinates of the search, shape (p,) each."""
        low, high = zip(*(p.bounds(self.scales) for _, p in self.searched), strict=True)
        return self.encode(low), self.encode(high)

    @cached_property
    def linear_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of the linear coefficients: laws of the drive are not negative, a known force has the factor 1."""
        known = int(self.base.form.known)
        free = self.base.columns - known
        bounds = [parameter.bounds(self.scales) for _, parameter in self.amplitudes]
        low = np.concatenate([np.zeros(free), np.ones(known), [item[0] for item in bounds]])
        return low, np.concatenate([np.full(free, np.inf), np.ones(known), [item[1] for item in bounds]])

    def values(self, theta: FloatArray) -> list[dict[str, float]]:
        """Return parameter -> value, for the base first and then for each term; amplitudes are 1."""
        found: list[dict[str, float]] = [{} for _ in range(len(self.terms) + 1)]
        found[0] |= self.base.held
        for (index, parameter), value in zip(self.searched, self.decode(theta), strict=True):
            found[index + 1][parameter.name] = value
        for index, parameter in self.amplitudes:
            found[index + 1][parameter.name] = 1.0
        return found
