"""Errors of a frame with effects on training records that were left out of its fit.

An effect with more parameters fits the training records better, whether or not it is the right one. Left-out records
decide between effects that fit equally well, and whether each of several effects is needed.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.gain import Gain
from mrpipe.tracing.structure.candidates import Fitted, Surroundings
from mrpipe.tracing.structure.fit import Base, Design, design_of
from mrpipe.tracing.structure.groups import LINES_OF_A_GROUP
from mrpipe.tracing.structure.model import model_of
from mrpipe.tracing.structure.spectra import Spectra

FOLDS = 3
"""Numerical technique: largest number of parts of the training records that are left out in turn."""


@dataclass(frozen=True)
class Folds:
    """Training records in parts; each part is left out once.

    Attributes
    ----------
    designs
        Linear frame fitted to the records that are kept, part after part.
    records
        Records that are left out, part after part.
    about
        Scales of the structure.
    """

    designs: tuple[Design, ...]
    records: tuple[tuple[Spectra, ...], ...]
    about: Surroundings

    def errors(self, chosen: Sequence[Fitted], storey: int | None = None) -> FloatArray:
        """Return the weighted squared error of each group of lines of all left-out records.

        Shape parameters are kept; amplitudes and linear coefficients are fitted without the records of the part.

        Parameters
        ----------
        chosen
            Effects.
        storey
            Storey, from 0, whose errors are returned; None: all storeys.
        """
        found: list[FloatArray] = []
        for design, records in zip(self.designs, self.records, strict=True):
            found.extend(left_out_errors(design, chosen, records, self.about, storey))
        return np.concatenate(found)

    def error(self, chosen: Sequence[Fitted]) -> float:
        """Return the weighted squared error of all left-out records."""
        return float(self.errors(chosen).sum())


def folds_of(base: Base, training: Sequence[Spectra], about: Surroundings) -> Folds | None:
    """Divide training records into parts that are left out in turn; None if there are fewer than two records.

    The record with the largest drift is never left out, because a nonlinear effect cannot be extrapolated.

    Parameters
    ----------
    base
        The linear frame.
    training
        Spectra of the training records.
    about
        Scales of the structure.
    """
    if len(training) < 2:
        return None
    drifts = [float(np.std(item.motion.drift, axis=1).max()) for item in training]
    # the record with the largest drift stays: an effect is judged within the range of its fit
    smaller = [k for k in range(len(training)) if k != int(np.argmax(drifts))]
    parts = [smaller[fold::FOLDS] for fold in range(min(FOLDS, len(smaller)))]
    designs = [design_of(base, [item for k, item in enumerate(training) if k not in part]) for part in parts]
    return Folds(tuple(designs), tuple(tuple(training[k] for k in part) for part in parts), about)


def left_out_errors(
    design: Design,
    chosen: Sequence[Fitted],
    records: Sequence[Spectra],
    about: Surroundings,
    storey: int | None = None,
) -> list[FloatArray]:
    """Return the weighted squared error of each group of lines, for records that were not used for the design.

    Parameters
    ----------
    design
        Linear frame, fitted to other records.
    chosen
        Effects.
    records
        The records.
    about
        Scales of the structure.
    storey
        Storey, from 0, whose errors are returned; None: all storeys.
    """
    model = model_of(design, chosen, about)
    errors = []
    for record in records:
        squares = np.abs((record.target - model.predict(record)) * record.weight) ** 2
        squares = squares if storey is None else squares[storey : storey + 1]
        edges = np.arange(0, squares.shape[1], LINES_OF_A_GROUP)
        errors.append(np.add.reduceat(squares, edges, axis=1).ravel())
    return errors


def gains_of(
    folds: Folds | None, chosen: Sequence[Fitted], declared: int, rng: np.random.Generator, draws: int
) -> tuple[Gain, ...]:
    """Return the gain on left-out records of each effect that is not declared, in the order of choice.

    Parameters
    ----------
    folds
        Records that are left out in turn; None: no gain is known.
    chosen, declared
        The effects; the first ones are declared.
    rng
        Source of randomness.
    draws
        Number of draws of the bootstrap.
    """
    if folds is None:
        return ()
    sums = [folds.errors(chosen[:k]) for k in range(declared, len(chosen) + 1)]
    return tuple(gain_between(before, after, rng, draws) for before, after in itertools.pairwise(sums))


def gain_between(before: FloatArray, after: FloatArray, rng: np.random.Generator, draws: int) -> Gain:
    """Return the share by which squared errors fall, with its interval.

    Parameters
    ----------
    before, after
        Squared errors of the same groups of lines, shape (g,) each.
    rng
        Source of randomness.
    draws
        Number of draws of the bootstrap.
    """
    drawn = rng.integers(len(before), size=(draws, len(before)))
    shares = 1.0 - after[drawn].sum(axis=1) / np.maximum(before[drawn].sum(axis=1), 1e-300)
    low, high = np.quantile(shares, [0.025, 0.975])
    return Gain(float(1.0 - after.sum() / before.sum()), (float(low), float(high)))
