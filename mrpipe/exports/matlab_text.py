"""Parts that the MATLAB files of all exports share: data file and self test."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mrpipe.exports.contract import DOUBLE_LIMIT, Vectors

MATLAB_USAGE = """\
Copy `{prefix}.m` and `{prefix}.mat` to a folder of the MATLAB path; GNU Octave runs them as well. `self_test` compares
them with the test vectors and raises an error where they differ."""


def data_file(model: Mapping[str, Any], vectors: Vectors) -> bytes:
    """Return a MATLAB file (version 5) with the numbers of a model, and the test vectors in `vectors`."""
    from scipy.io import savemat

    content = io.BytesIO()
    table = {
        "inputs": vectors.input_table,
        "outputs": vectors.output_table,
        "input_names": np.array([f"{item.name} [{item.unit}]" for item in vectors.inputs], dtype=object),
        "output_names": np.array([f"{item.name} [{item.unit}]" for item in vectors.outputs], dtype=object),
        "sample_time_s": vectors.sample_time_s,
    }
    savemat(content, {**model, "vectors": table}, oned_as="column")
    return content.getvalue()


def self_test(prefix: str, setup: Iterable[str], call: Iterable[str]) -> str:
    """Return a MATLAB function that compares an export with its test vectors.

    Parameters
    ----------
    prefix
        Name of the data file.
    setup
        Statements before the first row.
    call
        Statements that compute `output` from `input`, both rows.
    """
    before, body = (
        "\n".join(f"{indent}{line}" for line in lines) for indent, lines in (("    ", setup), ("        ", call))
    )
    return f"""\
function worst = self_test()
% Compare the export with its test vectors; an error means that they differ.
    data = load('{prefix}.mat');
    vectors = data.vectors;
    computed = zeros(size(vectors.outputs));
{before}
    for row = 1:size(vectors.inputs, 1)
        input = vectors.inputs(row, :);
{body}
        computed(row, :) = output;
    end
    largest = max(abs(vectors.outputs), [], 1);
    largest(largest == 0) = 1;
    worst = max(max(abs(computed - vectors.outputs), [], 1) ./ largest);
    fprintf('largest deviation %.3e of the largest magnitude, limit {DOUBLE_LIMIT:.0e}\\n', worst);
    if ~(worst <= {DOUBLE_LIMIT!r})
        error('the export differs from its test vectors');
    end
end
"""
