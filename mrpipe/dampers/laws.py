"""Laws of the drive: yield force and viscosity as polynomials or saturating functions, none of them negative.

A magnetic circuit saturates, so the yield force first rises with the drive and then levels off. A few measured levels
determine only a few coefficients; :mod:`mrpipe.fitting.drive_laws` chooses a law by leaving out whole levels.

Every law is linear in its coefficients, except for one scale of the drive. Polynomials are in the Bernstein basis on
0..limit. If their coefficients are not negative, the polynomial is not negative on that range. The monotone basis
consists of sums of Bernstein polynomials; with coefficients that are not negative the polynomial does not fall.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numba import boolean, float64, njit, void

from mrpipe.artifacts import FloatArray

Kind = Literal["polynomial", "tanh", "langevin", "froehlich"]
KINDS: tuple[Kind, ...] = ("polynomial", "tanh", "langevin", "froehlich")
"""Kinds of laws; the index of a kind is its code in compiled steps."""

LARGEST_ORDER = 5
LETTERS = "abcdef"
LAW_SIZE = 2 + LARGEST_ORDER
"""Number of values of a law in a compiled step: its code and up to six coefficients."""


def saturation(kind: str, ratio: FloatArray | float) -> FloatArray:
    """Return the saturating function of a kind at drive over scale; it rises to the limit 1.

    `tanh`; `langevin`: coth x - 1/x (Langevin 1905); `froehlich`: x/(1 + x) (Froehlich 1881, magnetisation of iron).
    """
    x = np.asarray(ratio, dtype=np.float64)
    if kind == "tanh":
        return np.asarray(np.tanh(x))
    if kind == "froehlich":
        return np.asarray(x / (1.0 + np.abs(x)))
    small = np.abs(x) < 1e-2
    safe = np.where(small, 1.0, x)
    return np.asarray(np.where(small, x / 3.0 - x**3 / 45.0, 1.0 / np.tanh(safe) - 1.0 / safe))


@dataclass(frozen=True)
class Law:
    """A law of the drive with its numbers.

    Attributes
    ----------
    kind
        One of :data:`KINDS`.
    numbers
        Polynomial: up to six coefficients, constant first. Saturating: the constant, the part that saturates, and the
        scale of the drive: a + b g(u/scale).
    """

    kind: Kind
    numbers: tuple[float, ...]

    def __call__(self, drive: FloatArray | float) -> FloatArray:
        """Return the value at a drive, with the shape of the drive."""
        u = np.asarray(drive, dtype=np.float64)
        if self.kind == "polynomial":
            return np.asarray(np.polynomial.polynomial.polyval(u, np.asarray(self.numbers)), dtype=np.float64)
        constant, saturating, scale = self.numbers
        return np.asarray(constant + saturating * saturation(self.kind, u / scale), dtype=np.float64)

    @property
    def packed(self) -> FloatArray:
        """Return code and numbers in the layout of compiled steps, shape (LAW_SIZE,)."""
        found = np.zeros(LAW_SIZE)
        found[0] = KINDS.index(self.kind)
        found[1 : 1 + len(self.numbers)] = self.numbers
        return found

    def scaled(self, factor: float) -> Law:
        """Return the law times a factor."""
        if self.kind == "polynomial":
            return Law("polynomial", tuple(factor * value for value in self.numbers))
        return Law(self.kind, (factor * self.numbers[0], factor * self.numbers[1], self.numbers[2]))


def constant_law(value: float) -> Law:
    """Return a law that does not depend on the drive."""
    return Law("polynomial", (float(value),))


@dataclass(frozen=True)
class LawShape:
    """A law without numbers: basis functions whose coefficients are fitted.

    Attributes
    ----------
    kind
        `polynomial` (Bernstein's basis), `monotone` (a polynomial that does not fall) or a saturating kind.
    order
        Degree of the polynomial; 1 for saturating kinds.
    """

    kind: Literal["polynomial", "monotone", "tanh", "langevin", "froehlich"] = "polynomial"
    order: int = 1

    @property
    def count(self) -> int:
        """Number of linear coefficients."""
        return self.order + 1

    @property
    def saturates(self) -> bool:
        """Whether the law has a scale of the drive in addition to its coefficients."""
        return self.kind in ("tanh", "langevin", "froehlich")

    @property
    def numbers(self) -> int:
        """Number of coefficients, including the scale."""
        return self.count + int(self.saturates)

    @property
    def name(self) -> str:
        """Return the name in messages, such as `polynomial of degree 2`."""
        if self.saturates:
            return self.kind
        words = {0: "constant", 1: "linear"}
        if self.order in words:
            return words[self.order]
        return f"{self.kind if self.kind == 'monotone' else 'polynomial'} of degree {self.order}"

    def basis(self, share: FloatArray, scale_share: float = 1.0) -> FloatArray:
        """Return the basis functions, shape (count, n); their coefficients must not be negative.

        Parameters
        ----------
        share
            Drive over its limit, shape (n,).
        scale_share
            Scale of a saturating law over the drive limit.
        """
        if self.saturates:
            full = saturation(self.kind, 1.0 / scale_share)
            return np.stack([np.ones_like(share), saturation(self.kind, share / scale_share) / full])
        return bernstein(share, self.order, monotone=self.kind == "monotone")

    def matrix(self, limit: float, scale_share: float = 1.0) -> FloatArray:
        """Return the matrix from coefficients of the basis to the numbers of a :class:`Law`, shape (count, count)."""
        if self.saturates:
            return np.diag([1.0, 1.0 / float(saturation(self.kind, 1.0 / scale_share))])
        powers = bernstein_to_power(self.order, limit)
        return powers if self.kind == "polynomial" else powers @ np.tril(np.ones((self.count, self.count)))

    def law(self, coefficients: FloatArray, limit: float, scale_share: float = 1.0) -> Law:
        """Return the law with these coefficients of the basis; `limit` is the largest drive [A or V]."""
        numbers = tuple(float(value) for value in self.matrix(limit, scale_share) @ coefficients)
        if self.saturates:
            return Law(KINDS[KINDS.index(self.kind)], (*numbers, scale_share * limit))
        return Law("polynomial", numbers)


def bernstein(share: FloatArray, order: int, *, monotone: bool = False) -> FloatArray:
    """Return the Bernstein polynomials of degree `order` at `share` (0..1 on the drive's range), shape (order + 1, n).

    Parameters
    ----------
    share
        Drive over its limit, shape (n,).
    order
        Degree.
    monotone
        Whether row k is the sum of the polynomials k to `order`, which does not fall.
    """
    rows = np.empty((order + 1, len(share)))
    _bernstein(np.ascontiguousarray(share), _binomials(order), monotone, rows)
    return rows


@cache
def _binomials(order: int) -> FloatArray:
    return np.array([math.comb(order, k) for k in range(order + 1)], dtype=np.float64)


@njit(void(float64[::1], float64[::1], boolean, float64[:, ::1]), cache=True, nogil=True)
def _bernstein(share: FloatArray, binomials: FloatArray, monotone: bool, rows: FloatArray) -> None:
    last = len(binomials) - 1
    for at in range(len(share)):
        rising, falling = 1.0, 1.0
        for k in range(last + 1):
            rows[k, at] = binomials[k] * rising
            rising *= share[at]
        for k in range(last, -1, -1):
            rows[k, at] *= falling
            falling *= 1.0 - share[at]
            if monotone and k < last:
                rows[k, at] += rows[k + 1, at]


def bernstein_to_power(order: int, limit: float) -> FloatArray:
    """Return the (order + 1)-square matrix from Bernstein coefficients on 0..limit to those of powers of the drive."""
    matrix = np.zeros((order + 1, order + 1))
    for k in range(order + 1):
        for power in range(k, order + 1):
            sign = (-1.0) ** (power - k)
            matrix[power, k] = sign * math.comb(order, k) * math.comb(order - k, power - k) / limit**power
    return matrix


def law_names(block: str, law: Law) -> tuple[str, ...]:
    """Return the parameter names of a block's law: `<block>_a`, `_b`, ... or `_a`, `_saturating`, `_scale`."""
    if law.kind == "polynomial":
        return tuple(f"{block}_{letter}" for letter in LETTERS[: len(law.numbers)])
    return f"{block}_a", f"{block}_saturating", f"{block}_scale"


def law_of(block: str, parameters: Mapping[str, float], kind: str = "polynomial") -> Law:
    """Return the law of a block from named parameters; coefficients that are left out are 0.

    Raises
    ------
    KeyError
        If a saturating law lacks its scale.
    """
    if kind == "polynomial":
        values = [parameters.get(f"{block}_{letter}", 0.0) for letter in LETTERS]
        while len(values) > 4 and values[-1] == 0.0:
            values.pop()
        return Law("polynomial", tuple(values))
    constant = parameters.get(f"{block}_a", 0.0)
    chosen = KINDS[KINDS.index(kind)]
    return Law(chosen, (constant, parameters[f"{block}_saturating"], parameters[f"{block}_scale"]))


def law_unit(block_unit: str, suffix: str, drive_unit: str) -> str:
    """Return the SI unit of a law's parameter from that of the block and the suffix of the parameter's name."""
    if suffix == "scale":
        return drive_unit
    if suffix == "saturating" or suffix == "a":
        return block_unit
    power = LETTERS.index(suffix)
    return f"{block_unit}/{drive_unit}" + ("" if power == 1 else f"^{power}")


def for_blocks(laws: Sequence[LawShape], count: int) -> tuple[LawShape, ...]:
    """Return one law for each of `count` blocks of a base form; blocks beyond the given laws get the first one."""
    return (*laws[:count], *[laws[0]] * (count - len(laws)))
