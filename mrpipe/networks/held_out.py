"""Division of the training records into rows for fitting and held-out rows for stopping."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from mrpipe.artifacts import IntArray
from mrpipe.networks.assembly import History, Samples, samples
from mrpipe.networks.network import FeatureSpec
from mrpipe.networks.problem import Problem
from mrpipe.networks.scaling import NORMALISATION, Normalisation, Scaling, scaling_of

ALIKE = 1.0 / 12.0
"""Relative difference of RMS displacement and RMS velocity up to which two tests have the same motion."""


@dataclass(frozen=True)
class TrainingData:
    """Normalised rows of the fitted records, and of the held-out records.

    Attributes
    ----------
    spec
        Features and target.
    fit_rows, held_rows, every_row
        Feature rows and targets [SI]: of the fitted records, of the held-out records, and of all records.
    scaling
        Normalisation, computed from all training records.
    held_out
        Names of the held-out records.
    """

    spec: FeatureSpec
    fit_rows: Samples
    held_rows: Samples
    every_row: Samples
    scaling: Scaling
    held_out: tuple[str, ...]

    def problem(
        self,
        layers: tuple[int, ...],
        biases: bool,
        rows: IntArray | None = None,
        *,
        part: Literal["fit", "held", "every"] = "fit",
    ) -> Problem:
        """Return the least-squares problem of the rows `rows` of a part; None: all rows."""
        source = {"fit": self.fit_rows, "held": self.held_rows, "every": self.every_row}[part]
        features = source.features if rows is None else source.features[rows]
        target = source.target if rows is None else source.target[rows]
        return Problem(self.scaling.inputs(features), self.scaling.target(target), layers, biases)

    def layers(self, hidden: tuple[int, ...]) -> tuple[int, ...]:
        """Return the neurons of all layers of a network for these data."""
        return (self.spec.width, *hidden, 1)

    def relative(self, mean_square: float, *, held: bool = False) -> float:
        """Return the ratio of RMS error to RMS target from a mean squared normalised error.

        If the held-out records have no drive, the scale of the target is taken from the fitted ones.
        """
        target = self.held_rows.target if held else self.fit_rows.target
        size = float(np.sqrt(np.mean(target**2))) if len(target) else float("nan")
        size = size or float(np.sqrt(np.mean(self.fit_rows.target**2))) or 1.0
        return float(np.sqrt(mean_square)) * self.scaling.output_scale / size


def hold_out(history: History, share: float, rng: np.random.Generator) -> tuple[History, History]:
    """Split a history by record into one for fitting and one for stopping.

    The records are sorted by RMS force, and one is drawn from each group of neighbours, so that the held-out records
    cover the same range of forces as the others. (With 14 of 95 records drawn without this rule, the errors of networks
    were wrong by a third.) With fewer than five records, the last part of each record is held out, and no window of
    past values crosses the cut.
    """
    count = len(history.names)
    if share <= 0.0:
        return history, history.select([])
    if count >= 5:
        sizes = [float(np.sqrt(np.mean(history.record(index, "force") ** 2))) for index in range(count)]
        groups = np.array_split(np.argsort(sizes, kind="stable"), max(1, round(share * count)))
        held = sorted(int(rng.choice(group)) for group in groups)
        return history.select([index for index in range(count) if index not in held]), history.select(held)
    return _part(history, 0.0, 1.0 - share), _part(history, 1.0 - share, 1.0)


def folds(history: History, count: int, rng: np.random.Generator) -> list[tuple[History, History]]:
    """Split a history `count` times into one for fitting and one for judging, by motion.

    Tests with the same motion (frequency and amplitude) stay together, so that a network is judged on motions that it
    was not fitted to. The extreme motions stay in every fit (see :func:`extreme_motions`), because a network is to be
    judged between the motions of its training, not beyond them. The other motions are distributed over the folds by
    their number of samples. With fewer than three other motions, all motions are distributed. With fewer than three
    motions, the records are distributed instead. With fewer than five records, each record is cut as in
    :func:`hold_out`.

    Parameters
    ----------
    history
        Training tests.
    count
        Number of splits, at least 1. It is lowered to the number of motions or records.
    rng
        Random generator that assigns the motions to the splits.
    """
    records = len(history.names)
    groups = motions(history)
    extreme = extreme_motions(history, groups)
    if len(groups) - len(extreme) >= 3:
        groups = [group for place, group in enumerate(groups) if place not in extreme]
    elif len(groups) < 3:
        groups = [[index] for index in range(records)]
    if records < 5 or count < 2:
        share = 1.0 / max(count, 4)
        return [hold_out(history, share, rng)]
    samples_of = np.diff(history.starts)
    held: list[list[int]] = [[] for _ in range(min(count, len(groups)))]
    for place in sorted(rng.permutation(len(groups)), key=lambda item: -int(samples_of[groups[item]].sum())):
        min(held, key=lambda fold: int(samples_of[fold].sum()) if fold else 0).extend(groups[place])
    return [
        (history.select([index for index in range(records) if index not in fold]), history.select(sorted(fold)))
        for fold in held
    ]


def splits(history: History, share: float, count: int, rng: np.random.Generator) -> list[tuple[History, History]]:
    """Split a history `count` times; half of the splits leave out whole motions, the others single tests.

    A network is used at the motions of its training and between them. Splits of the first kind alone would reject
    inputs that need many motions. Splits of the second kind alone would accept networks that fail between the motions.

    Parameters
    ----------
    history
        Training tests.
    share
        Share of the tests left out of each split.
    count
        Largest number of splits, at least 1.
    rng
        Random generator that assigns the tests to the splits.
    """
    by_motion = folds(history, max(2, round(1.0 / share)), rng)[: max(1, -(-count // 2))]
    by_test = [hold_out(history, share, rng) for _ in range(count - len(by_motion))]
    pairs = itertools.zip_longest(by_motion, by_test)
    return [item for pair in pairs for item in pair if item is not None]


def extreme_motions(history: History, groups: Sequence[Sequence[int]]) -> set[int]:
    """Return the groups of tests at the corners of the range of amplitude and frequency, at most four.

    Parameters
    ----------
    history
        Training tests.
    groups
        Indices of the tests of each motion, as from :func:`motions`.
    """
    displacement, velocity = np.log(np.maximum([_size(history, group[0]) for group in groups], 1e-300)).T
    amplitude, frequency = (
        item / max(float(np.ptp(item)), float(np.log1p(ALIKE))) for item in (displacement, velocity - displacement)
    )
    corners = [amplitude + frequency, amplitude - frequency, frequency - amplitude, -amplitude - frequency]
    return {int(np.argmax(item)) for item in corners}


def _size(history: History, index: int) -> tuple[float, float]:
    """Return the RMS displacement and the RMS velocity of a test."""
    return (float(np.std(history.record(index, "displacement"))), float(np.std(history.record(index, "velocity"))))


def motions(history: History) -> list[list[int]]:
    """Return the indices of the tests, grouped by motion: RMS displacement and RMS velocity within a twelfth."""
    sizes = [_size(history, index) for index in range(len(history.names))]
    groups: list[list[int]] = []
    for index, size in enumerate(sizes):
        group = next((item for item in groups if np.allclose(size, sizes[item[0]], rtol=ALIKE, atol=0.0)), None)
        groups.append([index]) if group is None else group.append(index)
    return groups


def _part(history: History, first: float, last: float) -> History:
    lengths = np.diff(history.starts)
    ranges = [
        np.arange(start + round(first * length), start + round(last * length))
        for start, length in zip(history.starts[:-1], lengths, strict=True)
    ]
    places = np.concatenate([np.zeros(0, dtype=np.int64), *ranges]).astype(np.int64)
    return replace(
        history,
        channels={name: values[places] for name, values in history.channels.items()},
        starts=np.cumsum([0, *(len(part) for part in ranges)], dtype=np.int64),
    )


def training_data(
    history: History,
    spec: FeatureSpec,
    share: float,
    rng: np.random.Generator,
    *,
    normalisation: Normalisation = NORMALISATION,
    whitened: bool = True,
) -> TrainingData:
    """Hold a share of the records out, build feature rows and normalise them (see :mod:`mrpipe.networks.scaling`)."""
    fit_history, held_history = hold_out(history, share, rng)
    fit_rows = samples(fit_history, spec)
    every = samples(history, spec)
    scaling = scaling_of(every.features, every.target, spec, normalisation, whitened=whitened)
    return TrainingData(spec, fit_rows, samples(held_history, spec), every, scaling, held_history.names)
