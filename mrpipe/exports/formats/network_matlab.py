"""A network as a MATLAB function with its weights in a .mat file."""

from __future__ import annotations

import numpy as np

from mrpipe.exports import matlab_text
from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.networks.network import Network


def _files(subject: Subject) -> Files:
    network: Network = subject.model
    prefix = subject.prefix
    weights, biases = (np.empty((1, len(network.weights)), dtype=object) for _ in range(2))
    for place, (matrix, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        weights[0, place], biases[0, place] = matrix, bias[:, None]
    model = {
        "weights": weights,
        "biases": biases,
        "input_scale": network.input_scale,
        "input_shift": network.input_shift,
        "output_scale": network.output_scale,
        "output_shift": network.output_shift,
        "sampling_rate_hz": float(network.features.sampling_rate_hz),
    }
    labels = "\n".join(
        f"%   {place + 1}: {item.name} [{item.unit}]" for place, item in enumerate(subject.vectors.inputs)
    )
    target = subject.vectors.outputs[0]
    main = f"""\
function estimate = {prefix}(features)
% Network {network.architecture} for {target.name} [{target.unit}]; written by mrpipe, see README.md.
% features has a row for each estimate and the columns
{labels}
    persistent network
    if isempty(network)
        network = load('{prefix}.mat');
    end
    signal = bsxfun(@rdivide, bsxfun(@minus, features.', network.input_shift), network.input_scale);
    last = numel(network.weights);
    for layer = 1:last
        signal = bsxfun(@plus, network.weights{{layer}} * signal, network.biases{{layer}});
        if layer < last
            signal = tanh(signal);
        end
    end
    estimate = signal.' * network.output_scale + network.output_shift;
end
"""
    return {
        f"{prefix}.m": main,
        f"{prefix}.mat": matlab_text.data_file(model, subject.vectors),
        "self_test.m": matlab_text.self_test(prefix, (), (f"output = {prefix}(input);",)),
    }


FORMAT = ExportFormat(
    kind="network",
    name="matlab",
    files=_files,
    usage="## MATLAB\n\n" + matlab_text.MATLAB_USAGE + "\n\n`{prefix}(features)` returns an estimate for each row.",
)
