"""Clusters of poles that keep frequency and shape over the model orders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.ambient.poles import Pole
from mrpipe.modal.spectra import ComplexArray

_FREQUENCY_TOLERANCE = 0.01
_LEAST_ASSURANCE = 0.9
_COPY_RANGE = 0.1
_COPY_ASSURANCE = 0.7


@dataclass(frozen=True)
class Cluster:
    """Poles of several orders that represent the same mode: medians, shape rotated to real, number of orders.

    Attributes
    ----------
    angular_frequency, damping_ratio
        [rad/s], [1].
    shape
        Shape (s,), of unit norm.
    collinearity
        1 where the shape is real up to a common phase, less otherwise.
    orders
        Number of model orders.
    """

    angular_frequency: float
    damping_ratio: float
    shape: FloatArray
    collinearity: float
    orders: int

    @property
    def pole(self) -> tuple[float, float]:
        """Angular frequency [rad/s] and damping ratio."""
        return self.angular_frequency, self.damping_ratio


def _assurance(first: ComplexArray, second: ComplexArray) -> float:
    return float(np.abs(np.vdot(first, second)) ** 2)


def _distance(pole: Pole, group: Sequence[Pole]) -> float:
    """Return the distance of a pole from a cluster, relative to the frequency; infinite if it cannot belong to it."""
    omega = float(np.median([item.angular_frequency for item in group]))
    zeta = float(np.median([item.damping_ratio for item in group]))
    assurance = _assurance(pole.shape, group[0].shape)
    gap = abs(pole.angular_frequency / omega - 1.0)
    if gap >= _FREQUENCY_TOLERANCE or assurance <= _LEAST_ASSURANCE:
        return np.inf
    return float(np.hypot(gap, pole.damping_ratio - zeta)) + 1.0 - assurance


def clustered(poles: Sequence[Pole]) -> list[Cluster]:
    """Group poles of neighbouring frequency and equal shape, at most one of each order in a group.

    Of each order the pole nearest to a group is taken first. High orders split a mode into a stable pole and one that
    changes with the order; in another sequence the second pole could replace the first.
    """
    groups: list[list[Pole]] = []
    for order in sorted({pole.order for pole in poles}, reverse=True):
        own = [pole for pole in poles if pole.order == order]
        known = len(groups)
        pairs = sorted((_distance(pole, groups[j]), i, j) for i, pole in enumerate(own) for j in range(known))
        taken: dict[int, int] = {}
        for distance, i, j in pairs:
            if np.isfinite(distance) and i not in taken and j not in taken.values():
                taken[i] = j
        for i, pole in enumerate(own):
            if i in taken:
                groups[taken[i]].append(pole)
            else:
                groups.append([pole])
    return [_summary(group) for group in groups]


def _summary(group: Sequence[Pole]) -> Cluster:
    reference = group[0].shape
    turned = np.mean([item.shape * np.exp(-1j * np.angle(np.vdot(reference, item.shape))) for item in group], axis=0)
    # the phase that makes the shape as real as it can be
    turned = turned * np.exp(-0.5j * np.angle(np.sum(turned**2)))
    collinearity = float(np.abs(np.sum(turned**2)) / np.sum(np.abs(turned) ** 2))
    return Cluster(
        float(np.median([item.angular_frequency for item in group])),
        float(np.median([item.damping_ratio for item in group])),
        np.asarray(turned.real / np.linalg.norm(turned.real)),
        collinearity,
        len(group),
    )


def without_copies(
    clusters: Sequence[Cluster],
    weights: FloatArray,
    is_second_peak: Callable[[tuple[float, float], tuple[float, float]], bool],
) -> tuple[list[Cluster], list[bool]]:
    """Return the clusters without those that repeat the shape of a more stable one: high orders split a pole.

    A pole repeats another one where their half-power bands overlap. Farther away, up to a tenth of the frequency, it
    may also be another mode with a similar shape at the sensors. It is one if the spectra have a peak for each of the
    two. The second result marks the poles for which they do not. Both results are sorted by frequency.

    Parameters
    ----------
    clusters
        Stable poles.
    weights
        Shape (s,): weights of the sensors for the comparison of shapes. Modes are orthogonal to the mass, so that these
        are the roots of the floor masses where they are known; otherwise a light mast would dominate all shapes.
    is_second_peak
        Whether the spectra show a pole (the first argument) in addition to another one, each as frequency and damping.
    """
    kept: list[Cluster] = []
    doubtful: list[bool] = []
    for item in sorted(clusters, key=lambda cluster: (-cluster.orders, -cluster.collinearity)):
        own = weights * item.shape
        alike = [known for known in kept if _cosine(weights * known.shape, own) ** 2 >= _COPY_ASSURANCE]
        gaps = [abs(known.angular_frequency - item.angular_frequency) for known in alike]
        widths = [sum(pole.damping_ratio * pole.angular_frequency for pole in (known, item)) for known in alike]
        if all(gap >= width for gap, width in zip(gaps, widths, strict=True)):
            near = [known for known, gap in zip(alike, gaps, strict=True) if gap < _COPY_RANGE * item.angular_frequency]
            kept.append(item)
            doubtful.append(not all(is_second_peak(item.pole, known.pole) for known in near))
    rising = np.argsort([item.angular_frequency for item in kept])
    return [kept[i] for i in rising], [doubtful[i] for i in rising]


def _cosine(first: FloatArray, second: FloatArray) -> float:
    return float(first @ second) / max(float(np.linalg.norm(first) * np.linalg.norm(second)), 1e-300)


def matched(clusters: Sequence[Cluster], pole: Cluster) -> Cluster | None:
    """Return the cluster of another estimate that is the same mode as `pole`; None if there is none."""
    near = [item for item in clusters if abs(item.angular_frequency / pole.angular_frequency - 1.0) < 0.03]
    same = [item for item in near if (item.shape @ pole.shape) ** 2 > 0.5]
    return max(same, key=lambda item: (item.orders, (item.shape @ pole.shape) ** 2), default=None)
