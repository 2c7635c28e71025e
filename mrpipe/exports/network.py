"""A network as a subject of exports: its test vectors and its plain description."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrpipe.exports.contract import Channel, Subject, Vectors
from mrpipe.networks.network import CHANNEL_UNITS, Network, spec_to_json

ROWS = 200


def network_subject(network: Network, name: str, prefix: str = "mrpipe", **details: Any) -> Subject:
    """Return a network with test vectors over the range of its training.

    Parameters
    ----------
    network
        The network.
    name
        `forward` or `inverse`.
    prefix
        First part of the names in C and MATLAB.
    details
        Further entries of the JSON file; `drive_unit` is the unit of the channel `drive`.
    """
    vectors = network_vectors(network, str(details.get("drive_unit", "drive")))
    return Subject("network", name, f"{prefix}_{name}", network, vectors, details)


def network_vectors(network: Network, drive_unit: str) -> Vectors:
    """Return feature rows over the range of the training data, and the estimates of the network.

    Each feature runs over its range with another frequency, so that the rows hold all combinations of small and
    large values. The first row is zero.
    """
    spec = network.features
    low, high = network.feature_minimum, network.feature_maximum
    if not len(low):
        low, high = network.input_shift - network.input_scale, network.input_shift + network.input_scale
    # multiples of the golden ratio have no common period
    phases = np.outer(np.arange(ROWS), np.modf((np.arange(spec.width) + 1) * 0.6180339887498949)[0])
    rows = low + (high - low) * (0.5 - 0.5 * np.cos(2.0 * np.pi * phases))
    rows[0] = 0.0
    units = {**CHANNEL_UNITS, "drive": drive_unit}
    inputs = tuple(
        Channel(label, units.get(label.split("(")[0], "1"), rows[:, place]) for place, label in enumerate(spec.labels)
    )
    return Vectors(inputs, (Channel(spec.target, units.get(spec.target, "1"), network.predict(rows)),))


def described(network: Network) -> dict[str, Any]:
    """Return the network as plain values; `formula` states how they are evaluated."""
    return {
        "architecture": network.architecture,
        "formula": "a = (features - input_shift)/input_scale; a = tanh(weights a + biases) for each hidden layer; "
        "y = (weights a + biases) output_scale + output_shift",
        "features": {**spec_to_json(network.features), "labels": list(network.features.labels)},
        "weights": [matrix.tolist() for matrix in network.weights],
        "biases": [bias.tolist() for bias in network.biases],
        "input_scale": network.input_scale.tolist(),
        "input_shift": network.input_shift.tolist(),
        "output_scale": float(network.output_scale),
        "output_shift": float(network.output_shift),
        "feature_minimum": network.feature_minimum.tolist(),
        "feature_maximum": network.feature_maximum.tolist(),
    }
