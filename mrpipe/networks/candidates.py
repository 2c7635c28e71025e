"""Architectures of a sweep: input states x past values x layers x neurons (Figure 2.13 of the thesis)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise, product
from typing import Any

from mrpipe.networks.network import FeatureSpec

SHORT = {"displacement": "x", "velocity": "v", "acceleration": "a", "drive": "i", "force": "f"}


@dataclass(frozen=True)
class Candidate:
    """Architecture of a network.

    Attributes
    ----------
    states
        Motion channels among the inputs; the drive is an input of every candidate.
    past_values
        Number of past values of each input.
    hidden
        Neurons of each hidden layer.
    biases
        Whether biases are trained.
    """

    states: tuple[str, ...]
    past_values: int
    hidden: tuple[int, ...]
    biases: bool

    @property
    def channels(self) -> tuple[str, ...]:
        """Return all inputs."""
        return (*self.states, "drive")

    def spec(self, sampling_rate_hz: float) -> FeatureSpec:
        """Return the features of the forward network."""
        return FeatureSpec(self.channels, self.past_values, False, sampling_rate_hz, "force")

    @property
    def layers(self) -> tuple[int, ...]:
        """Neurons of every layer, input and output included."""
        return (len(self.channels) * (self.past_values + 1), *self.hidden, 1)

    @property
    def parameters(self) -> int:
        """Number of trained numbers."""
        weights = sum(inner * outer for inner, outer in pairwise(self.layers))
        return weights + (sum(self.layers[1:]) if self.biases else 0)

    @property
    def label(self) -> str:
        """Short name such as `v,i | 3 past | 8-6-6-1`, with `+b` if biases are trained."""
        inputs = ",".join(SHORT[name] for name in self.channels)
        shape = "-".join(str(count) for count in self.layers)
        return f"{inputs} | {self.past_values} past | {shape}{'+b' if self.biases else ''}"


@dataclass(frozen=True)
class Grid:
    """Axes of a sweep and its reference architecture.

    Attributes
    ----------
    states, past_values, layers, neurons
        Values that are tried on each axis; all hidden layers of a network have the same number of neurons.
    biases
        Whether networks have biases; both values are compared if both are listed.
    centre
        Reference architecture, as in the thesis: velocity, three past values, two layers of six neurons.
    """

    states: tuple[tuple[str, ...], ...]
    past_values: tuple[int, ...]
    layers: tuple[int, ...]
    neurons: tuple[int, ...]
    biases: tuple[bool, ...]
    centre: Candidate

    def candidates(self, design: str) -> list[Candidate]:
        """Return the candidates: `star` varies one axis at a time (layers with neurons), `full` combines all values."""
        shapes = [(neurons,) * layers for layers, neurons in product(self.layers, self.neurons)]
        if design == "full":
            every: Iterable[Candidate] = (
                Candidate(*point) for point in product(self.states, self.past_values, shapes, self.biases)
            )
            return _once([self.centre, *every])
        at = self.centre
        return _once(
            [
                at,
                *(Candidate(states, at.past_values, at.hidden, at.biases) for states in self.states),
                *(Candidate(at.states, past, at.hidden, at.biases) for past in self.past_values),
                *(Candidate(at.states, at.past_values, shape, at.biases) for shape in shapes),
                *(Candidate(at.states, at.past_values, at.hidden, biases) for biases in self.biases),
            ]
        )

    def crossings(self, scores: Mapping[Candidate, float]) -> list[Candidate]:
        """Return candidates that a star does not contain: combinations of the best values of two and more axes.

        A star shows which single changes reduce the error. The best network usually combines several of them. A further
        input can help only a network that is large enough to use it, so all inputs are tried with the best layers too.

        Parameters
        ----------
        scores
            Error of each candidate of the star.
        """
        at = self.centre
        best: dict[str, Any] = {}
        for axis in ("states", "past_values", "hidden", "biases"):
            along = [item for item in scores if replace(item, **{axis: getattr(at, axis)}) == at]
            best[axis] = getattr(min(along, key=lambda item: scores[item], default=at), axis)
        moved = [axis for axis, value in best.items() if value != getattr(at, axis)]
        groups = [group for count in range(2, len(moved) + 1) for group in combinations(moved, count)]
        combined = [replace(at, **{axis: best[axis] for axis in group}) for group in groups]
        widened = [replace(at, states=states, hidden=best["hidden"]) for states in self.states]
        return [item for item in _once([*combined, *widened]) if item not in scores]

    @property
    def most_crossings(self) -> int:
        """Largest possible number of crossings."""
        at = self.centre
        shapes = [(neurons,) * layers for layers, neurons in product(self.layers, self.neurons)]
        axes = (
            (at.states, self.states),
            (at.past_values, self.past_values),
            (at.hidden, shapes),
            (at.biases, self.biases),
        )
        moving = sum(any(value != own for value in values) for own, values in axes)
        return int(2**moving) - 1 - moving + len(self.states)


def _once(candidates: Sequence[Candidate]) -> list[Candidate]:
    return list(dict.fromkeys(candidates))
