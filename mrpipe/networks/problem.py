"""The least-squares problem of a network: residuals, analytic Jacobian and its exact compression.

A problem of n rows and P parameters does not need the n x P Jacobian. The Gram matrix of [J e] is accumulated over
chunks of rows, and a square root of it is computed. The last column of this root is a residual, and the other columns
are a Jacobian, both with P + 1 rows. They have the norm, the gradient J'e and the matrix J'J of the full problem, so
that a Gauss-Newton or Levenberg-Marquardt method takes the same steps. The Gram matrix squares the condition number,
which is acceptable in double precision for the networks of this program.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from mrpipe.artifacts import FloatArray

CHUNK_ROWS = 2048
"""Number of rows of the Jacobian in memory at a time. In double precision and with a hundred parameters, they fit into
the second-level cache.
"""


def layer_slices(layers: tuple[int, ...], biases: bool) -> list[tuple[slice, slice]]:
    """Return the slices of weights and biases of each layer in the parameter vector (empty slices without biases)."""
    slices = []
    start = 0
    for inner, outer in pairwise(layers):
        middle = start + inner * outer
        end = middle + (outer if biases else 0)
        slices.append((slice(start, middle), slice(middle, end)))
        start = end
    return slices


def unpack(parameters: FloatArray, layers: tuple[int, ...], biases: bool) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return weights (out, in) and biases (out,) of each layer; zeros without biases."""
    weights = []
    offsets = []
    for (at, beside), (inner, outer) in zip(layer_slices(layers, biases), pairwise(layers), strict=True):
        weights.append(parameters[at].reshape(outer, inner))
        offsets.append(parameters[beside] if biases else np.zeros(outer, dtype=parameters.dtype))
    return weights, offsets


def pack(weights: list[FloatArray], biases: list[FloatArray], has_biases: bool) -> FloatArray:
    """Return the parameter vector: for each layer the weights row by row, then the biases if there are any."""
    parts = [
        part
        for matrix, bias in zip(weights, biases, strict=True)
        for part in ((matrix.ravel(), bias) if has_biases else (matrix.ravel(),))
    ]
    return np.concatenate(parts)


@dataclass(frozen=True)
class Problem:
    """Least-squares problem of a network and rows of normalised data.

    Attributes
    ----------
    inputs
        Normalised features, feature-major: shape (R, n), contiguous.
    target
        Normalised target, shape (n,).
    layers
        Neurons of each layer, input and output included: (8, 6, 6, 1).
    biases
        Whether biases are parameters.
    weight_decay
        Penalty lambda |parameters|^2, added to the mean squared error (0 in the thesis). It keeps a network smooth
        between the few levels of the drive that a campaign may have.
    single
        Compute the Gram matrix in single precision, which takes half the time. Residuals and mean squares stay in
        double precision, so a step is accepted or refused as before. The rounding of the Gram matrix acts like a
        damping of 1e-7 of its largest eigenvalue.
    threads
        Threads that compute the Gram matrix. The result does not depend on their number, because the chunks of rows
        are the same and are added in order.
    """

    inputs: FloatArray
    target: FloatArray
    layers: tuple[int, ...]
    biases: bool
    weight_decay: float = 0.0
    single: bool = False
    threads: int = 1

    @cached_property
    def _rows_of_gram(self) -> tuple[FloatArray, FloatArray]:
        """Inputs and target in the precision of the Gram matrix."""
        if not self.single:
            return self.inputs, self.target
        return self.inputs.astype(np.float32), self.target.astype(np.float32)

    @cached_property
    def size(self) -> int:
        """Number of parameters."""
        return int(layer_slices(self.layers, self.biases)[-1][1].stop)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.target)

    def output(self, parameters: FloatArray, inputs: FloatArray | None = None) -> FloatArray:
        """Return the network's output, shape (n,), normalised."""
        signal = self.inputs if inputs is None else inputs
        weights, biases = unpack(parameters, self.layers, self.biases)
        for matrix, bias in zip(weights[:-1], biases[:-1], strict=True):
            signal = matrix @ signal
            if self.biases:
                signal += bias[:, None]
            np.tanh(signal, out=signal)
        return np.asarray((weights[-1] @ signal)[0] + biases[-1][0])

    def residual(self, parameters: FloatArray) -> FloatArray:
        """Return output minus target, shape (n,)."""
        return self.output(parameters) - self.target

    def mean_square(self, parameters: FloatArray) -> float:
        """Return the mean squared residual plus the penalty."""
        total = 0.0
        for start in range(0, self.rows, 4 * CHUNK_ROWS):
            part = slice(start, start + 4 * CHUNK_ROWS)
            error = self.output(parameters, self.inputs[:, part]) - self.target[part]
            total += float(error @ error)
        return total / self.rows + self.weight_decay * float(parameters @ parameters)

    def jacobian(self, parameters: FloatArray) -> FloatArray:
        """Return the Jacobian of the residual, shape (n, P)."""
        stacked = np.empty((self.size + 1, self.rows))
        self._fill(parameters, self.inputs, self.target, stacked)
        return np.ascontiguousarray(stacked[:-1].T)

    def gram(self, parameters: FloatArray) -> FloatArray:
        """Return [J e]'[J e] / n, shape (P + 1, P + 1), from chunks of rows; the penalty counts as further rows."""
        total = np.zeros((self.size + 1, self.size + 1))
        inputs, target = self._rows_of_gram
        rounded = parameters.astype(inputs.dtype)
        rows = CHUNK_ROWS * total.itemsize // inputs.itemsize

        def product(start: int) -> FloatArray:
            part = slice(start, min(start + rows, self.rows))
            stacked = np.empty((self.size + 1, part.stop - part.start), dtype=inputs.dtype)
            self._fill(rounded, inputs[:, part], target[part], stacked)
            # numpy uses the symmetric product (half the operations) if both factors are the same array
            return stacked @ stacked.T

        starts = range(0, self.rows, rows)
        if self.threads == 1 or len(starts) == 1:
            for start in starts:
                total += product(start)
        else:
            with ThreadPoolExecutor(self.threads) as pool:
                for each in pool.map(product, starts):
                    total += each
        total /= self.rows
        if self.weight_decay > 0.0:
            extended = np.column_stack([np.eye(self.size), parameters])
            total += self.weight_decay * (extended.T @ extended)
        return total

    def compressed(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residual (P + 1,) and Jacobian (P + 1, P) with the norm, gradient and J'J of the problem over n."""
        gram = self.gram(parameters)
        try:
            root = np.linalg.cholesky(gram).T
        except np.linalg.LinAlgError:
            # a neuron without effect makes J'J singular; then the symmetric square root is used
            values, vectors = np.linalg.eigh(gram)
            root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
        return np.array(root[:, -1]), np.array(root[:, :-1], order="C")

    def _fill(self, parameters: FloatArray, inputs: FloatArray, target: FloatArray, stacked: FloatArray) -> None:
        """Write the transposed Jacobian, and below it the residual, into `stacked`, shape (P + 1, columns).

        All arrays have the same precision.
        """
        weights, biases = unpack(parameters, self.layers, self.biases)
        signals = [inputs]
        for matrix, bias in zip(weights[:-1], biases[:-1], strict=True):
            signal = matrix @ signals[-1]
            if self.biases:
                signal += bias[:, None]
            signals.append(np.tanh(signal, out=signal))
        np.subtract((weights[-1] @ signals[-1])[0] + biases[-1][0], target, out=stacked[-1])
        slices = layer_slices(self.layers, self.biases)
        slope = np.ones((1, inputs.shape[1]), dtype=inputs.dtype)
        for layer in range(len(weights) - 1, -1, -1):
            at, beside = slices[layer]
            inner = signals[layer]
            block = stacked[at].reshape(len(slope), len(inner), -1)
            np.multiply(slope[:, None, :], inner[None, :, :], out=block)
            if self.biases:
                stacked[beside] = slope
            if layer:
                slope = weights[layer].T @ slope
                slope *= 1.0 - inner * inner
