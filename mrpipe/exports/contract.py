"""Definition of an export format: the contract that every file of `exports/formats` fulfils.

A file defines `FORMAT = ExportFormat(...)`; no other module has to be changed. It converts a model and its test vectors
into the files of a folder.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray

DOUBLE_LIMIT = 1e-9
"""Largest deviation from the test vectors in double precision, over the largest magnitude of the output."""


@dataclass(frozen=True)
class Channel:
    """One quantity of the test vectors.

    Attributes
    ----------
    name, unit
        As in the header of vectors.csv.
    values
        Values of the channel, shape (n,).
    flag
        Whether the values are numbers of states, such as 0 and 1. Rounding may exchange them where the quantity that
        they depend on is zero to rounding.
    """

    name: str
    unit: str
    values: FloatArray
    flag: bool = False


@dataclass(frozen=True)
class Vectors:
    """Inputs of a model and the outputs that Python computes from them.

    Attributes
    ----------
    inputs, outputs
        Channels of equal length.
    sample_time_s
        Interval of the rows; 0 where the rows do not depend on each other.
    single_limit
        Largest RMS deviation in single precision, over the largest magnitude of the output; of a flag, the largest
        share of rows that differ.
    """

    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    sample_time_s: float = 0.0
    single_limit: float = 1e-3

    @property
    def input_table(self) -> FloatArray:
        """Inputs, shape (n, inputs)."""
        return np.column_stack([item.values for item in self.inputs])

    @property
    def output_table(self) -> FloatArray:
        """Outputs, shape (n, outputs)."""
        return np.column_stack([item.values for item in self.outputs])

    def as_csv(self) -> str:
        """Return the table of inputs and outputs; every number reads back to the same double."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        channels = (*self.inputs, *self.outputs)
        writer.writerow(f"{item.name} [{item.unit}]" for item in channels)
        for row in np.column_stack([item.values for item in channels]):
            writer.writerow(repr(float(value)) for value in row)
        return text.getvalue()


@dataclass(frozen=True)
class Subject:
    """A model that is exported.

    Attributes
    ----------
    kind
        `damper`, `frame` or `network`.
    name
        Name of the files, such as `damper` or `inverse`.
    prefix
        First part of the names in C and MATLAB.
    model
        The model.
    vectors
        Test vectors of the model.
    details
        Origin of the model, for the JSON file; `left_out` are sentences on what the model does not contain.
    about
        Sentences for README.md of the folder: what the model is, and where it comes from.
    """

    kind: str
    name: str
    prefix: str
    model: Any
    vectors: Vectors
    details: Mapping[str, Any] = field(default_factory=dict)
    about: str = ""

    @property
    def left_out(self) -> Sequence[str]:
        """Effects that the model does not contain, one sentence each."""
        return tuple(self.details.get("left_out", ()))


Files = Mapping[str, str | bytes]
"""Name of a file -> content."""


@dataclass(frozen=True)
class ExportFormat:
    """One kind of model in one format.

    Attributes
    ----------
    kind
        Kind of model.
    name
        Name of the format: `c`, `json`, `onnx` or `matlab`.
    files
        Function that returns the files of the folder for a subject.
    usage
        Sentences for README.md of the folder: how the files are used. `{name}` and `{prefix}` are those of
        the subject, `{upper}` is the prefix in capitals.
    needs
        Package of an optional extra of the same name as the format; empty: none.
    """

    kind: str
    name: str
    files: Callable[[Subject], Files]
    usage: str
    needs: str = ""
