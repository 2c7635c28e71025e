"""Choice of the laws of the drive by leaving out whole levels, because a damper also works between the tested levels.

For given steps of the base form the force is linear in the yield force F_y(u) and the viscosity c0(u). Sums of products
of the signals over each level of drive are therefore sufficient to fit any law, and hundreds of fits take milliseconds.

A law is judged by its error on levels that were not used in its fit. Only levels inside the range are left out, because
the ends would require extrapolation, which no law of the drive supports. Of laws with similar errors the one with the
fewest coefficients is taken. A law has at most as many coefficients as there are levels. A law with as many
coefficients as levels cannot be judged in this way, and is taken only if every simpler law misses the levels
themselves.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.laws import Law, LawShape, for_blocks
from mrpipe.fitting.drive_cells import Cells, cells_of
from mrpipe.fitting.engine import Fit
from mrpipe.fitting.solution import bounded_solution
from mrpipe.words import in_percent

SCALE_SHARES = (0.1, 0.15, 0.22, 0.33, 0.5, 0.75, 1.1, 1.7, 2.5, 5.0)
"""Scales of saturating laws that are tried first, as shares of the largest drive."""

FINER = (1.18, 1.09, 1.045, 1.02, 1.01, 1.005, 1.002, 1.001)
"""Factors by which the best scale is then multiplied and divided."""

YIELD_LAWS = (
    LawShape("polynomial", 0), LawShape("polynomial", 1), LawShape("tanh"), LawShape("langevin"),
    LawShape("froehlich"), LawShape("monotone", 2), LawShape("polynomial", 2), LawShape("monotone", 3),
    LawShape("polynomial", 3), LawShape("monotone", 4), LawShape("monotone", 5),
)  # fmt: skip
VISCOSITY_LAWS = YIELD_LAWS[:7]


@dataclass(frozen=True)
class Judged:
    """A pair of laws, for yield force and viscosity, with its errors.

    Attributes
    ----------
    laws
        Shapes of yield force and viscosity.
    inside
        Logarithm of squared error over squared force for each level, by a fit to all levels, shape (levels,).
    left_out
        The same for each inner level, by a fit without this level, shape (levels - 2,); empty if the laws have more
        coefficients than the remaining levels determine.
    """

    laws: tuple[LawShape, LawShape]
    inside: FloatArray
    left_out: FloatArray

    @property
    def numbers(self) -> int:
        """Number of coefficients of both laws."""
        return self.laws[0].numbers + self.laws[1].numbers


@dataclass(frozen=True)
class LawChoice:
    """The chosen laws, and the uncertainty of their predictions.

    Attributes
    ----------
    laws
        Shapes of yield force and viscosity.
    reason
        Reason for the choice, a sentence.
    candidates
        All laws of the yield force that were judged: name, typical error on levels left out (None if it cannot be
        judged), and typical error on the fitted levels.
    drives
        Drives at which the laws are tabulated, shape (d,) [A or V]: the levels, drives between them, and up to 20 %
        beyond.
    values, deviations
        Value of each law and its standard deviation at these drives, shape (2, d). The deviation comes from fits that
        leave out each level in turn, and from other laws with a similar error.
    """

    laws: tuple[LawShape, LawShape]
    reason: str
    candidates: tuple[tuple[str, float | None, float], ...]
    drives: FloatArray
    values: FloatArray
    deviations: FloatArray


def fit_laws(
    cells: Cells, laws: tuple[LawShape, LawShape], keep: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Fit two laws to the kept levels; return squared errors of all cells, coefficients, and scales as shares."""
    weight = np.ones(len(cells.drive)) if keep is None else keep
    grids = [SCALE_SHARES if law.saturates else (1.0,) for law in laws]
    best = min(
        (_at_scales(cells, laws, pair, weight) for pair in itertools.product(*grids)), key=lambda item: item.cost
    )
    for width in FINER:
        for place, law in enumerate(laws):
            if law.saturates:
                for factor in (1.0 / width, width):
                    scales = [*best.scales]
                    scales[place] *= factor
                    best = min(best, _at_scales(cells, laws, tuple(scales), weight), key=lambda item: item.cost)
    return best.errors, best.linear, (best.scales[0], best.scales[1])


@dataclass(frozen=True)
class _Solved:
    cost: float
    errors: FloatArray
    linear: FloatArray
    scales: tuple[float, ...]


def _at_scales(cells: Cells, laws: tuple[LawShape, LawShape], scales: tuple[float, ...], weight: FloatArray) -> _Solved:
    bases = [law.basis(cells.drive, scale) for law, scale in zip(laws, scales, strict=True)]
    stacked = np.concatenate(bases)
    owner = np.repeat([0, 1], [len(basis) for basis in bases])
    pairs = cells.gram[:, owner][:, :, owner]
    gram = np.einsum("k,kab,ak,bk->ab", weight, pairs, stacked, stacked)
    right = np.einsum("k,ka,ak->a", weight, cells.right[:, owner], stacked)
    linear = bounded_solution(gram, right, np.zeros(len(right)), np.full(len(right), np.inf))[0]
    values = linear[:, None] * stacked
    error = cells.power - 2.0 * np.einsum("ka,ak->k", cells.right[:, owner], values)
    error = error + np.einsum("kab,ak,bk->k", pairs, values, values)
    return _Solved(float(np.sum(weight * error)), error, linear, scales)


def judge(cells: Cells, laws: tuple[LawShape, LawShape]) -> Judged:
    """Return the errors of a pair of laws on the fitted levels and on levels left out."""
    # every level has equal weight: otherwise the level with the largest force would decide
    power = np.bincount(cells.level, weights=cells.power)
    alike = 1.0 / np.maximum(power, 1e-12 * power.max())[cells.level]
    inside = _by_level(cells, fit_laws(cells, laws, alike)[0])
    left_out = []
    if max(law.numbers for law in laws) < cells.levels:
        for level in range(1, cells.levels - 1):
            error = fit_laws(cells, laws, np.where(cells.level == level, 0.0, alike))[0]
            left_out.append(_by_level(cells, error)[level])
    return Judged(laws, inside, np.array(left_out))


def _by_level(cells: Cells, error: FloatArray) -> FloatArray:
    power = np.bincount(cells.level, weights=cells.power)
    errors = np.maximum(np.bincount(cells.level, weights=error), 1e-9 * power)
    return np.asarray(np.log(errors / np.maximum(power, 1e-300)))


def _risk(item: Judged) -> FloatArray:
    """Return the errors by which a law is judged: on inner levels left out, and on all fitted levels."""
    return np.concatenate([item.left_out, item.inside])


def _best(judged: Sequence[Judged]) -> Judged:
    """Return the law with the fewest coefficients among those within one standard error of the best."""
    best = min(judged, key=lambda item: float(np.mean(_risk(item))))
    close = []
    for item in judged:
        difference = _risk(item) - _risk(best)
        error = float(np.std(difference, ddof=1)) / np.sqrt(len(difference)) if len(difference) > 1 else 0.0
        # errors that differ by less than a tenth of their square count as equal, whatever their spread
        if float(np.mean(difference)) <= max(error, 0.1) and float(np.mean(difference)) < 0.5:
            close.append(item)
    return min(close, key=lambda item: (item.numbers, float(np.mean(_risk(item)))))


def choose_laws(
    found: Fit, *, largest_yield_order: int = 5, largest_viscosity_order: int = 2, saturating: bool = True
) -> LawChoice:
    """Choose the laws of yield force and viscosity.

    Parameters
    ----------
    found
        A fit of a base form to all training tests, with laws that have at least as many coefficients as the levels
        determine.
    largest_yield_order, largest_viscosity_order
        Highest degree of polynomials.
    saturating
        Whether laws that saturate are considered too.
    """
    cells = cells_of(found)
    levels = cells.levels

    def offered(laws: Sequence[LawShape], order: int) -> list[LawShape]:
        return [
            law
            for law in laws
            if law.numbers <= levels and (saturating if law.saturates else law.order <= order)
        ]  # fmt: skip

    yields = offered(YIELD_LAWS, largest_yield_order)
    viscous = offered(VISCOSITY_LAWS, largest_viscosity_order)
    viscosity = LawShape("polynomial", min(1, levels - 1, largest_viscosity_order))
    strongest, judged = yields[0], []
    for _ in range(2):
        judged = [judge(cells, (law, viscosity)) for law in yields]
        strongest = _pick(judged, levels).laws[0]
        viscosity = _pick([judge(cells, (strongest, law)) for law in viscous], levels).laws[1]
    chosen = strongest, viscosity
    drives, values, deviations = _predictions(cells, chosen, [item for item in judged if len(item.left_out)])
    table = tuple(
        (item.laws[0].name, _typical(item.left_out) if len(item.left_out) else None, _typical(item.inside) or 0.0)
        for item in judged
    )
    return LawChoice(chosen, _reason(chosen, judged, levels), table, drives, values, deviations)


def _pick(judged: Sequence[Judged], levels: int) -> Judged:
    testable = [item for item in judged if len(item.left_out)]
    if levels < 3 or not testable:
        return _best([replace(item, left_out=np.zeros(0)) for item in judged])
    best = _best(testable)
    others = [item for item in judged if not len(item.left_out)]
    if not others:
        return best
    # a law that misses the levels it was fitted to is rejected, whether or not a richer law can be judged
    richest = min(others, key=lambda item: (float(np.round(np.mean(item.inside), 1)), item.numbers))
    missed = best.inside - richest.inside
    error = float(np.std(missed, ddof=1)) / np.sqrt(len(missed))
    return richest if float(np.mean(missed)) > max(error, 0.3) else best


def _typical(errors: FloatArray) -> float | None:
    return float(np.exp(0.5 * np.mean(errors))) if len(errors) else None


def _reason(chosen: tuple[LawShape, LawShape], judged: Sequence[Judged], levels: int) -> str:
    item = next(item for item in judged if item.laws[0] == chosen[0])
    names = f"yield force {chosen[0].name}, viscosity {chosen[1].name} in the drive"
    if levels == 1:
        return f"{names}: all tests have the same level of drive"
    if not len(item.left_out):
        return f"{names}: {levels} levels of drive are too few to judge a law on a level left out"
    error = _typical(item.left_out) or 0.0
    return (
        f"{names}: the fewest coefficients among laws that predict levels left out equally well "
        f"(error {in_percent(error, 1)})"
    )


def _predictions(
    cells: Cells, chosen: tuple[LawShape, LawShape], others: Sequence[Judged]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return drives, and the values and standard deviations of both laws at these drives."""
    at = np.unique(np.round([float(np.mean(cells.drive[cells.level == k])) for k in range(cells.levels)], 6))
    share = np.unique(np.concatenate([at, 0.5 * (at[1:] + at[:-1]), [at[-1] + 0.2 * max(at[-1], 0.0)]]))

    def values(laws: tuple[LawShape, LawShape], keep: FloatArray | None) -> FloatArray:
        _, linear, scales = fit_laws(cells, laws, keep)
        split = laws[0].count
        pieces = linear[:split], linear[split:]
        found: list[Callable[[FloatArray], FloatArray]] = [
            law.law(piece, 1.0, scale) for law, piece, scale in zip(laws, pieces, scales, strict=True)
        ]
        return np.stack([law(share) for law in found])

    whole = values(chosen, None)
    spread = np.zeros_like(whole)
    if cells.levels > max(law.numbers for law in chosen) and cells.levels > 1:
        without = np.stack([values(chosen, (cells.level != level).astype(np.float64)) for level in range(cells.levels)])
        spread = np.sum((without - whole) ** 2, axis=0) * (cells.levels - 1) / cells.levels
    alike = _alike(others, chosen)
    if alike:
        rivals = np.stack([values((laws[0], chosen[1]), None) for laws in alike])
        spread = spread + np.mean((rivals - whole) ** 2, axis=0)
    return share * cells.limit, whole, np.sqrt(spread)


def _alike(judged: Sequence[Judged], chosen: tuple[LawShape, LawShape]) -> list[tuple[LawShape, LawShape]]:
    own = next((item for item in judged if item.laws[0] == chosen[0]), None)
    if own is None:
        return [item.laws for item in judged]
    limit = float(np.mean(_risk(own))) + 0.5
    return [item.laws for item in judged if item is not own and float(np.mean(_risk(item))) < limit]


def adequate_laws(found: Fit) -> tuple[LawShape, ...]:
    """Return the simplest laws that fit as well as the present ones, as the start of a search for missing effects.

    A law that is too simple leaves a residual that an effect can imitate. A law must therefore fit the levels as well
    as the law of the problem, within 5 % of the noise (which sets the weights of the problem) plus 2 % of the residual.
    Among laws with the same number of coefficients the one that best predicts inner levels left out is taken; if they
    are equal, one that does not fall with the drive, because it is plausible between the levels. Laws that saturate
    compete only if a polynomial has as many coefficients as there are levels, because such a polynomial fits any
    levels. Otherwise saturation is left to the effects.

    Parameters
    ----------
    found
        A weighted fit with polynomial laws.
    """
    base = found.problem.base
    cells = cells_of(found)
    saturating = [law for law in YIELD_LAWS if law.saturates and law.numbers < cells.levels]
    offered = [
        [LawShape(kind, order) for order in range(law.order + 1) for kind in ("polynomial", "monotone")]
        + (saturating if law.count == cells.levels else [])
        for law in base.laws[:2]
    ]
    pairs: list[tuple[LawShape, LawShape]] = list(itertools.product(offered[0], offered[1]))
    errors = {pair: float(np.sum(fit_laws(cells, pair)[0])) for pair in pairs}
    least = max(min(errors.values()), 0.0)
    samples = int(np.count_nonzero(found.problem.root_weight))
    within = least + min(0.02 * least, 0.05 * samples)
    able = [pair for pair, error in errors.items() if error <= within]
    fewest = min(pair[0].numbers + pair[1].numbers for pair in able)
    simple = [judge(cells, pair) for pair in able if pair[0].numbers + pair[1].numbers == fewest]
    best = min(simple, key=lambda item: (float(np.mean(_risk(item))), item.laws[0].kind == "polynomial"))
    return for_blocks(best.laws, len(base.laws))


def law_values(choice: LawChoice, laws: Sequence[Law]) -> list[dict[str, float]]:
    """Return one row per drive of a choice: drive, values of the fitted laws, and their standard deviations, in SI."""
    return [
        {
            "drive": float(drive),
            "yield_force_n": float(laws[0](float(drive))),
            "yield_force_deviation_n": float(choice.deviations[0, place]),
            "c0_n_s_m": float(laws[1](float(drive))),
            "c0_deviation_n_s_m": float(choice.deviations[1, place]),
        }
        for place, drive in enumerate(choice.drives)
    ]
