"""What is fitted to what: the base form, the effects with it, the samples and their weights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.drive import driver_lag, driver_lag_apart, polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.plant import Step
from mrpipe.effects.contract import Effect, EffectForm, EffectScales, Parameter, shape
from mrpipe.fitting.recordings import Recordings


@dataclass(frozen=True)
class BaseForm:
    """The declared damper: Bouc-Wen hysteresis with its exponent fixed or free, or Dahl."""

    name: str = "bouc-wen"
    exponent: float = 2.0
    exponent_free: bool = False
    gamma_free: bool = True
    gamma_share: float = 0.5
    yield_order: int = 3
    viscosity_order: int = 1
    lag_known: bool = True
    lag_apart: bool = False

    def parameters(self) -> tuple[Parameter, ...]:
        """Return what is searched."""
        found = [shape("yield_displacement", "m", "displacement at which it yields", "stroke", 1e-3, 2.0, (0.04, 0.12))]
        if self.gamma_free:
            found.append(Parameter("gamma_share", "1", "gamma over gamma plus beta", "one", 0.02, 1.5, (0.5,)))
        if self.exponent_free:
            found.append(shape("exponent", "1", "n of (2.2)", "one", 1.0, 8.0, (1.9,)))
        if self.lag_known:
            found.append(shape("eta", "1/s", "rate of the drive's lag", "one", 2.0, 3000.0, (100.0,)))
        if self.lag_known and self.lag_apart:
            found.append(shape("eta_fall", "1/s", "rate where the drive falls", "one", 2.0, 3000.0, (100.0,)))
        return tuple(found)

    def steps(self, values: Mapping[str, float], yield_force: FloatArray, viscosity: FloatArray) -> list[Step]:
        """Return the steps with these polynomials (in powers of the drive)."""
        steps = [
            polynomial_coefficients(yield_force, viscosity),
            hysteresis(
                values["yield_displacement"],
                values.get("gamma_share", self.gamma_share),
                values.get("exponent", self.exponent),
            ),
        ]
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
    """What is fitted to what.

    Attributes
    ----------
    recordings
        The tests.
    base
        The base form.
    terms
        Effects fitted with it.
    root_weight
        Square root of the weight of each sample, 0 where it is not compared, shape (n,) [1/N].
    scales
        Scales of bounds and starts.
    reference
        Yield force and viscosity polynomials that effects scale with (see :class:`Fit`).
    window_share
        Moving average over this share of a period that the records went through.
    offsets
        An offset for each test; else one for all.
    """

    recordings: Recordings
    base: BaseForm
    terms: tuple[Term, ...]
    root_weight: FloatArray
    scales: EffectScales
    reference: tuple[FloatArray, FloatArray]
    window_share: float = 0.0
    offsets: bool = True

    @property
    def searched(self) -> list[tuple[int, Parameter]]:
        """Return (term index or -1 for the base, parameter) of all that is searched."""
        found = [(-1, parameter) for parameter in self.base.parameters()]
        for index, term in enumerate(self.terms):
            found += [(index, parameter) for parameter in term.form.searched]
        return found

    @property
    def amplitudes(self) -> list[tuple[int, Parameter]]:
        """Return (term index, parameter) of all amplitudes."""
        return [(index, item) for index, term in enumerate(self.terms) for item in term.form.amplitudes]

    def encode(self, values: Sequence[float]) -> FloatArray:
        """Return searched values as the search sees them."""
        pairs = zip(self.searched, values, strict=True)
        return np.array([np.log(v) if p.logarithmic else v / self.scales.of(p.scale) for (_, p), v in pairs])

    def decode(self, theta: FloatArray) -> list[float]:
        """Return the values behind what the search sees."""
        pairs = zip(self.searched, theta, strict=True)
        return [float(np.exp(t)) if p.logarithmic else float(t * self.scales.of(p.scale)) for (_, p), t in pairs]

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return bounds as the search sees them."""
        low, high = zip(*(p.bounds(self.scales) for _, p in self.searched), strict=True)
        return self.encode(low), self.encode(high)

    def values(self, theta: FloatArray) -> list[dict[str, float]]:
        """Return values by name: of the base first, then of each term, amplitudes 1."""
        found: list[dict[str, float]] = [{} for _ in range(len(self.terms) + 1)]
        for (index, parameter), value in zip(self.searched, self.decode(theta), strict=True):
            found[index + 1][parameter.name] = value
        for index, parameter in self.amplitudes:
            found[index + 1][parameter.name] = 1.0
        return found
