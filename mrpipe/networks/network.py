"""A feed-forward network as plain arrays: tanh hidden layers, linear output (thesis 2.7).

Layout, for an evaluation of the arrays in another kernel
-------------------------------------------------------------------
A feature row holds, channel after channel in the order of `FeatureSpec.channels`, the present value, then the
past values of k-1, k-2 .. k-p, as in (2.8) and (2.9):

    [c1(k), c1(k-1), .. c1(k-p), c2(k), c2(k-1), .. c2(k-p), ...]

of samples `1 / sampling_rate_hz` apart, as absolute values if `FeatureSpec.absolute` is true. Then

    a = (features - input_shift) / input_scale
    a = tanh(weights[j] @ a + biases[j])               for each hidden layer j
    y = (weights[-1] @ a + biases[-1])[0] * output_scale + output_shift

`weights[j]` has shape (neurons of layer j, neurons of layer j-1). In a network without biases, `biases[j]` are zeros.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray

CHANNEL_UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}
"""SI unit of each channel that can be input or target. The channel `drive` has the unit of the campaign (A or V)."""


@dataclass(frozen=True)
class FeatureSpec:
    """Definition of the features of a network.

    Attributes
    ----------
    channels
        Input channels in order, such as ("velocity", "drive") of (2.8) or ("velocity", "force") of (2.9).
    past_values
        Number of past values of each channel, in addition to the present one.
    absolute
        Whether the features are absolute values, as in (2.9).
    sampling_rate_hz
        Sampling rate of the past values [Hz].
    target
        Channel that the network estimates: `force` (forward) or `drive` (inverse).
    past_target
        Whether the past values k-1 .. k-p of the target are inputs, after all channels (a model with output feedback).
    """

    channels: tuple[str, ...]
    past_values: int
    absolute: bool
    sampling_rate_hz: float
    target: str
    past_target: bool = False

    @property
    def width(self) -> int:
        """Number of features."""
        return len(self.channels) * (self.past_values + 1) + (self.past_values if self.past_target else 0)

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the name of each feature: velocity(k), velocity(k-1), ..."""
        names = [
            f"{name}(k-{lag})" if lag else f"{name}(k)" for name in self.channels for lag in range(self.past_values + 1)
        ]
        if self.past_target:
            names += [f"{self.target}(k-{lag})" for lag in range(1, self.past_values + 1)]
        return tuple(names)


def spec_to_json(spec: FeatureSpec) -> dict[str, Any]:
    """Return a specification as plain values."""
    return {**asdict(spec), "channels": list(spec.channels)}


def spec_from_json(content: Mapping[str, Any]) -> FeatureSpec:
    """Return the specification from the result of :func:`spec_to_json`."""
    return FeatureSpec(**{**content, "channels": tuple(content["channels"])})


def lagged(channels: Sequence[FloatArray], past_values: int, *, absolute: bool = False) -> FloatArray:
    """Return the feature rows of one uninterrupted record in the order of (2.8) and (2.9).

    Parameters
    ----------
    channels
        Arrays of shape (n,), uniformly sampled, in the order of the specification.
    past_values
        Number p of past values.
    absolute
        Whether to return absolute values.

    Returns
    -------
    Shape (n - p, channels x (p + 1)); row j belongs to sample j + p. Empty if the record is too short.
    """
    length = min(len(channel) for channel in channels)
    rows = max(length - past_values, 0)
    columns = [
        np.asarray(channel, dtype=np.float64)[past_values - lag : past_values - lag + rows]
        for channel in channels
        for lag in range(past_values + 1)
    ]
    features = np.stack(columns, axis=1)
    return np.abs(features) if absolute else features


@dataclass(frozen=True)
class Network:
    """A trained network; the docstring of the module defines the layout.

    Attributes
    ----------
    weights, biases
        Weights and biases of each layer, shapes (out, in) and (out,); the last layer has one neuron.
    input_scale, input_shift
        Shape (features,), in the units of the features.
    output_scale, output_shift
        Scale and shift of the output, in the unit of the target.
    features
        Definition of the features.
    feature_minimum, feature_maximum
        Range of each feature in the training set, shape (features,); empty if unknown.
    has_biases
        Whether the biases were trained (the thesis has none).
    members
        Number of networks that this one combines, see :func:`averaged`.
    """

    weights: tuple[FloatArray, ...]
    biases: tuple[FloatArray, ...]
    input_scale: FloatArray
    input_shift: FloatArray
    output_scale: float
    output_shift: float
    features: FeatureSpec
    feature_minimum: FloatArray = field(default_factory=lambda: np.zeros(0))
    feature_maximum: FloatArray = field(default_factory=lambda: np.zeros(0))
    has_biases: bool = True
    members: int = 1

    @property
    def layers(self) -> tuple[int, ...]:
        """Neurons of every layer, input and output included."""
        return (self.weights[0].shape[1], *(len(matrix) for matrix in self.weights))

    @property
    def hidden_of_members(self) -> tuple[int, ...]:
        """Neurons of the hidden layers of each member."""
        return tuple(count // self.members for count in self.layers[1:-1])

    @property
    def architecture(self) -> str:
        """Architecture in the notation of the thesis, such as `8-6-6-1`."""
        return "-".join(str(count) for count in self.layers)

    @property
    def parameters(self) -> int:
        """Number of trained numbers."""
        # zeros between the blocks of averaged networks were not trained
        count = sum(int(np.count_nonzero(matrix)) for matrix in self.weights)
        return count + sum(bias.size for bias in self.biases) if self.has_biases else count

    def predict(self, features: FloatArray) -> FloatArray:
        """Return the estimate of the target, shape (n,), of feature rows (n, R)."""
        signal = ((np.asarray(features, dtype=np.float64) - self.input_shift) / self.input_scale).T
        for matrix, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            signal = np.tanh(matrix @ signal + bias[:, None])
        output = (self.weights[-1] @ signal + self.biases[-1][:, None])[0]
        return np.asarray(output * self.output_scale + self.output_shift)

    def outside_training_range(self, features: FloatArray, margin: float = 0.02) -> float:
        """Return the share of feature rows (n, R) with any feature beyond its range in training.

        Parameters
        ----------
        features
            Feature rows as for :meth:`predict`.
        margin
            Share of the range beyond its ends that still counts as within, because noise at the ends is not an
            extrapolation.
        """
        if not len(self.feature_minimum) or not len(features):
            return 0.0
        slack = margin * (self.feature_maximum - self.feature_minimum)
        outside = (features < self.feature_minimum - slack) | (features > self.feature_maximum + slack)
        return float(np.mean(np.any(outside, axis=1)))

    def steady(self) -> Network:
        """Return this network for constant inputs: a network without past values, equal to a relative error of 1e-12.

        Every past value equals the present one, so that the weights of a channel add up. An inverse network in this
        form gives the drive at which the damper would hold this force at this speed, independent of the previous
        forces.
        """
        spec = self.features
        if spec.past_target:
            raise ValueError("a network with its own past output has no steady form")
        if spec.past_values == 0:
            return self
        by_channel = (len(spec.channels), spec.past_values + 1)
        first = self.weights[0] / self.input_scale
        known = len(self.feature_minimum) > 0
        return replace(
            self,
            weights=(first.reshape(len(first), *by_channel).sum(axis=2), *self.weights[1:]),
            biases=(self.biases[0] - first @ self.input_shift, *self.biases[1:]),
            input_scale=np.ones(len(spec.channels)),
            input_shift=np.zeros(len(spec.channels)),
            features=replace(spec, past_values=0),
            feature_minimum=self.feature_minimum.reshape(by_channel).max(axis=1) if known else self.feature_minimum,
            feature_maximum=self.feature_maximum.reshape(by_channel).min(axis=1) if known else self.feature_maximum,
        )


def averaged(networks: Sequence[Network]) -> Network:
    """Return one network whose output is the mean of several networks, with block-diagonal weights.

    Random errors of the single trainings cancel in part; common errors remain.

    Parameters
    ----------
    networks
        Networks of the same features, scaling and number of layers.
    """
    # the configuration needs this module without scipy
    from scipy.linalg import block_diag

    first = networks[0]
    if len(networks) == 1:
        return first
    layers = range(len(first.weights) - 1)
    outputs = [network.weights[-1] for network in networks]
    last = np.hstack(outputs) / len(networks) if layers else np.mean(outputs, axis=0)
    # the first layers share their inputs, the next ones use the outputs of the same network only
    inner = [
        np.asarray((block_diag if layer else _stacked)(*(network.weights[layer] for network in networks)))
        for layer in layers
    ]
    biases = [np.concatenate([network.biases[layer] for network in networks]) for layer in layers]
    return replace(
        first,
        weights=(*inner, last),
        biases=(*biases, np.mean([network.biases[-1] for network in networks], axis=0)),
        members=len(networks),
    )


def _stacked(*matrices: FloatArray) -> FloatArray:
    return np.vstack(matrices)


def write_network(artifact: ArtifactWriter, group: str, network: Network) -> None:
    """Store a network as arrays under `group`; :func:`read_network` returns it without rounding."""
    for index, (matrix, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        artifact.put(f"{group}/weights_{index}", matrix, unit="1", dims=("neuron", "input"))
        artifact.put(f"{group}/biases_{index}", bias, unit="1", dims=("neuron",))
    for name in ("input_scale", "input_shift", "feature_minimum", "feature_maximum"):
        artifact.put(f"{group}/{name}", getattr(network, name), unit="SI of each feature", dims=("feature",))
    for name in ("output_scale", "output_shift"):
        artifact.put(f"{group}/{name}", getattr(network, name), unit="SI of the target")
    artifact.put_json(f"{group}/features", spec_to_json(network.features))
    artifact.attributes(
        group,
        architecture=network.architecture,
        layers=len(network.weights),
        has_biases=network.has_biases,
        members=network.members,
    )


def read_network(artifact: Artifact, group: str) -> Network:
    """Read the network that :func:`write_network` wrote."""
    notes = artifact.attributes(group)
    layers = range(int(notes["layers"]))
    return Network(
        weights=tuple(artifact.array(f"{group}/weights_{index}") for index in layers),
        biases=tuple(artifact.array(f"{group}/biases_{index}") for index in layers),
        input_scale=artifact.array(f"{group}/input_scale"),
        input_shift=artifact.array(f"{group}/input_shift"),
        output_scale=artifact.scalar(f"{group}/output_scale"),
        output_shift=artifact.scalar(f"{group}/output_shift"),
        features=spec_from_json(artifact.json(f"{group}/features")),
        feature_minimum=artifact.array(f"{group}/feature_minimum"),
        feature_maximum=artifact.array(f"{group}/feature_maximum"),
        has_biases=bool(notes["has_biases"]),
        members=int(notes.get("members", 1)),
    )
