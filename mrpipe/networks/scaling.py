"""Normalisation of features and the basis in which a network is trained.

Lagged samples of smooth motion are nearly collinear (eigenvalues over eight decades at 200 Hz), which slows the
convergence of every method. Training therefore uses a whitened basis. Afterwards the transformation is multiplied into
the first layer, so that the inputs of the stored network are normalised features.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.networks.network import FeatureSpec

Normalisation = Literal["maximum", "range", "standard"]

NORMALISATION: Normalisation = "maximum"
"""Default scaling, which maps zero to zero."""

_SMALLEST_EIGENVALUE = 1e-9


@dataclass(frozen=True)
class Scaling:
    """Normalisation of features and target.

    Attributes
    ----------
    input_scale, input_shift
        Shape (R,): normalised = (features - shift) / scale. All past values of a channel have the same scale and shift.
    output_scale, output_shift
        The same for the target.
    basis
        Shape (R, R): trained input = basis @ normalised.
    minimum, maximum
        Range of each feature in the training rows, shape (R,).
    """

    input_scale: FloatArray
    input_shift: FloatArray
    output_scale: float
    output_shift: float
    basis: FloatArray
    minimum: FloatArray
    maximum: FloatArray

    def inputs(self, features: FloatArray) -> FloatArray:
        """Return trained inputs, feature-major (R, n), of feature rows (n, R)."""
        normalised = (features - self.input_shift) / self.input_scale
        return np.ascontiguousarray(self.basis @ normalised.T)

    def target(self, target: FloatArray) -> FloatArray:
        """Return the normalised target."""
        return np.asarray((target - self.output_shift) / self.output_scale)


def scaling_of(
    features: FloatArray,
    target: FloatArray,
    spec: FeatureSpec,
    normalisation: Normalisation = NORMALISATION,
    *,
    whitened: bool = True,
) -> Scaling:
    """Return the normalisation of training rows.

    Parameters
    ----------
    features, target
        Shapes (n, R) and (n,), SI.
    spec
        Definition of the features; all values of one channel have the same scale.
    normalisation
        `maximum` divides by the largest magnitude and keeps zero at zero (right for a network without biases, whose
        output at zero input is zero); `range` maps to -1 .. 1 as MATLAB's mapminmax; `standard` to zero mean and unit
        variance.
    whitened
        Whether to train in the basis in which the features are uncorrelated and have unit variance.
    """
    shift = np.zeros(spec.width)
    scale = np.ones(spec.width)
    for block in channel_blocks(spec):
        shift[block], scale[block] = _shift_and_scale(features[:, block], normalisation)
    output_shift, output_scale = _shift_and_scale(target, normalisation)
    basis = np.eye(spec.width)
    if whitened:
        normalised = (features - shift) / scale
        values, vectors = np.linalg.eigh(normalised.T @ normalised / len(normalised))
        # features that are all zero have no positive eigenvalue as a reference
        floor = _SMALLEST_EIGENVALUE * (values.max() or 1.0)
        # the sign of an eigenvector is arbitrary; it is fixed here so that the same data give the same network
        vectors = vectors * np.sign(vectors[np.argmax(np.abs(vectors), axis=0), np.arange(spec.width)])
        basis = (vectors / np.sqrt(np.maximum(values, 0.0) + floor)).T
    return Scaling(
        scale_safe(scale), shift, output_scale, output_shift, basis, features.min(axis=0), features.max(axis=0)
    )


def channel_blocks(spec: FeatureSpec) -> list[slice]:
    """Return the columns of each channel, followed by those of the past target if the features contain it."""
    window = spec.past_values + 1
    blocks = [slice(index * window, (index + 1) * window) for index in range(len(spec.channels))]
    if spec.past_target and spec.past_values:
        blocks.append(slice(blocks[-1].stop if blocks else 0, spec.width))
    return blocks


def scale_safe(scale: FloatArray) -> FloatArray:
    """Return the scale with zeros replaced by ones (constant channels)."""
    return np.where(scale > 0.0, scale, 1.0)


def _shift_and_scale(values: FloatArray, normalisation: Normalisation) -> tuple[float, float]:
    if normalisation == "maximum":
        shift, scale = 0.0, float(np.max(np.abs(values)))
    elif normalisation == "range":
        low, high = float(np.min(values)), float(np.max(values))
        shift, scale = 0.5 * (low + high), 0.5 * (high - low)
    else:
        shift, scale = float(np.mean(values)), float(np.std(values))
    return shift, scale if scale > 0.0 else 1.0
