"""What a model form is: nonlinear parameters to search, and blocks that are linear in their coefficients.

A form's force is a sum of *blocks*, each a signal (the hysteretic variable, the velocity, tanh(v/v0)) times a
polynomial of the effective drive. The polynomials are linear in their coefficients and are projected out of the fit; a
few nonlinear parameters remain. Polynomials are written in Bernstein's basis on 0..drive limit: well conditioned, and
where its coefficients are not negative neither is the polynomial on that range, so no damper comes out that feeds
energy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.dampers.drive import lag_series
from mrpipe.dampers.model import DamperModel, parameter_unit
from mrpipe.dampers.motion import Motion

Values = Mapping[str, float]


@dataclass(frozen=True)
class Scales:
    """What guesses, bounds and orders follow from.

    Attributes
    ----------
    stroke
        Half the peak-to-peak displacement, median over tests [m].
    peak_speed
        Largest speed [m/s].
    peak_force
        Largest force [N].
    drive_limit
        Upper end of the drive's range [A or V].
    drive_unit
        `A` or `V`.
    yield_order, viscosity_order
        Degrees of the polynomials in the drive.
    lag_known
        The drive varies within tests, so that its lag can be told.
    assumed_eta
        Lag of the drive [1/s] where it cannot be told; measurements at constant drive say nothing of it.
    """

    stroke: float
    peak_speed: float
    peak_force: float
    drive_limit: float
    drive_unit: str = "A"
    yield_order: int = 3
    viscosity_order: int = 1
    lag_known: bool = True
    assumed_eta: float = 100.0


@dataclass(frozen=True)
class NonlinearParameter:
    """A parameter that the fit searches.

    Attributes
    ----------
    name
        As in :class:`~mrpipe.dampers.model.DamperModel`.
    starts
        Values to start from, the most likely first.
    lower, upper
        Bounds.
    logarithmic
        Searched as its logarithm (a positive scale).
    """

    name: str
    starts: tuple[float, ...]
    lower: float
    upper: float
    logarithmic: bool = True

    @property
    def guess(self) -> float:
        """The first start."""
        return self.starts[0]


def nothing_fixed(_scales: Scales) -> dict[str, float]:
    """Return no fixed parameters."""
    return {}


def yield_and_viscosity(scales: Scales) -> dict[str, int]:
    """Return the degrees of the two polynomials of (2.3)."""
    return {"yield_force": scales.yield_order, "c0": scales.viscosity_order}


@dataclass(frozen=True)
class Form:
    """One model form.

    Attributes
    ----------
    name, summary
        Key in :data:`mrpipe.dampers.forms.FORMS` and what it is, in a line.
    model_form
        Form of the :class:`~mrpipe.dampers.model.DamperModel` that it makes.
    nonlinear
        Scales -> parameters that the fit searches (without the lag, which all forms share).
    blocks
        (values, motion) -> block name (`yield_force`, `c0`, ...) -> signal, shape (n,).
    fixed
        Scales -> parameters that are not searched.
    orders
        Scales -> degree of each block's polynomial.
    known
        (values, motion, effective drive, scales) -> a force without linear coefficients, shape (n,); None for most.
    motion_limit
        Where a trial takes long: the form is fitted on recordings thinned to about so many samples.
    """

    name: str
    summary: str
    model_form: str
    nonlinear: Callable[[Scales], tuple[NonlinearParameter, ...]]
    blocks: Callable[[Values, Motion], dict[str, FloatArray]]
    fixed: Callable[[Scales], dict[str, float]] = nothing_fixed
    orders: Callable[[Scales], dict[str, int]] = yield_and_viscosity
    known: Callable[[Values, Motion, FloatArray, Scales], FloatArray] | None = None
    motion_limit: int | None = None

    def parameters(self, scales: Scales) -> tuple[NonlinearParameter, ...]:
        """Return all that the fit searches; the lag of the drive only where the drive varies within tests."""
        searched = self.nonlinear(scales)
        return (lag_parameter(), *searched) if scales.lag_known else searched

    def regressors(self, values: Values, motion: Motion, scales: Scales, at: IntArray | None = None) -> Regressors:
        """Return the columns of the linear coefficients at the samples `at` (all where None)."""
        chosen = slice(None) if at is None else at
        values = {**self.fixed(scales), **values}
        drive = motion.drive
        if math.isfinite(values.get("eta", math.inf)):
            drive = lag_series(drive, motion.starts, motion.dt, values["eta"])
        signals = self.blocks(values, motion)
        columns = []
        for block, order in self.orders(scales).items():
            signal = signals[block][chosen]
            columns += [signal * basis for basis in bernstein(drive[chosen] / scales.drive_limit, order)]
        known = None if self.known is None else self.known(values, motion, drive, scales)[chosen]
        return Regressors(np.stack(columns), known)

    def model(self, values: Values, linear: FloatArray, scales: Scales) -> DamperModel:
        """Return the damper with these numbers; `linear` are the coefficients of :meth:`regressors`' columns."""
        names, matrix = self.transform(scales)
        searched = [values[parameter.name] for parameter in self.parameters(scales)]
        numbers = matrix @ np.concatenate([searched, linear])
        found = dict(zip(names, (float(number) for number in numbers), strict=True))
        assumed = {} if scales.lag_known else {"eta": scales.assumed_eta}
        numbers_by_name = {**self.fixed(scales), **assumed, **found}
        return DamperModel(self.model_form, numbers_by_name, scales.drive_unit, scales.drive_limit)

    def transform(self, scales: Scales) -> tuple[tuple[str, ...], FloatArray]:
        """Return the model's parameter names and the matrix that yields them from searched and linear numbers.

        It turns coefficients in Bernstein's basis into those of powers of the drive; the rest it passes on.
        """
        names: list[str] = []
        blocks: list[FloatArray] = []
        nodes: dict[str, int] = {}
        for parameter in self.parameters(scales):
            block, at, _ = parameter.name.partition("_at_")
            if at:
                nodes[block] = nodes.get(block, -1) + 1
                continue
            names.append(parameter.name)
            blocks.append(np.eye(1))
        orders = {**nodes, **self.orders(scales)}
        for block, order in orders.items():
            names += [f"{block}_{letter}" for letter in "abcd"[: order + 1]] if block != "k1" else ["k1"]
            blocks.append(bernstein_to_power(order, scales.drive_limit))
        return tuple(names), block_diagonal(blocks)


def with_fixed(form: Form, values: Mapping[str, float]) -> Form:
    """Return the form with some of its searched parameters held at these values."""
    return replace(
        form,
        nonlinear=lambda scales: tuple(p for p in form.nonlinear(scales) if p.name not in values),
        fixed=lambda scales: {**form.fixed(scales), **values},
    )


@dataclass(frozen=True)
class Regressors:
    """Columns of the linear coefficients, shape (m, n) with a row a coefficient, and the force without any, (n,)."""

    columns: FloatArray
    known: FloatArray | None = field(default=None)


def block_diagonal(blocks: list[FloatArray]) -> FloatArray:
    """Return square matrices along one diagonal."""
    size = sum(len(block) for block in blocks)
    matrix = np.zeros((size, size))
    row = 0
    for block in blocks:
        matrix[row : row + len(block), row : row + len(block)] = block
        row += len(block)
    return matrix


def bernstein(share: FloatArray, order: int) -> list[FloatArray]:
    """Return the Bernstein polynomials of degree `order` at `share` (0..1 on the drive's range)."""
    rest = 1.0 - share
    return [math.comb(order, k) * share**k * rest ** (order - k) for k in range(order + 1)]


def bernstein_to_power(order: int, limit: float) -> FloatArray:
    """Return the (order + 1)-square matrix from Bernstein coefficients on 0..limit to those of powers of the drive."""
    matrix = np.zeros((order + 1, order + 1))
    for k in range(order + 1):
        for power in range(k, order + 1):
            sign = (-1.0) ** (power - k)
            matrix[power, k] = sign * math.comb(order, k) * math.comb(order - k, power - k) / limit**power
    return matrix


def lag_parameter() -> NonlinearParameter:
    """Return the lag of the drive, eta of (2.4) [1/s]."""
    return NonlinearParameter("eta", (100.0, 30.0), 2.0, 3000.0)


def unit_of(name: str, scales: Scales) -> str:
    """Return the unit of a nonlinear or linear parameter of any form."""
    return parameter_unit(name, scales.drive_unit)
