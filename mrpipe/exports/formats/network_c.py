"""A network as C99."""

from __future__ import annotations

from mrpipe.exports import c_text
from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.exports.translation.c import literal
from mrpipe.networks.network import Network


def _files(subject: Subject) -> Files:
    prefix = subject.prefix
    return {
        f"{subject.name}.h": _header(subject),
        f"{subject.name}.c": _source(subject),
        "self_test.c": c_text.self_test(
            f"{subject.name}.h", prefix, subject.vectors, (), (f"output[0] = {prefix}_predict(input);",)
        ),
    }


def _header(subject: Subject) -> str:
    prefix, upper = subject.prefix, subject.prefix.upper()
    spec = subject.model.features
    labels = "\n".join(f"   {place:3d}  {item.name} [{item.unit}]" for place, item in enumerate(subject.vectors.inputs))
    target = subject.vectors.outputs[0]
    absolute = " Give absolute values." if spec.absolute else ""
    return f"""\
/* Network {subject.model.architecture} for {target.name} [{target.unit}]. Written by mrpipe; see README.md. */
#ifndef {upper}_H
#define {upper}_H

{c_text.precision_header(prefix)}
#define {upper}_FEATURES {spec.width}
#define {upper}_SAMPLING_RATE_HZ {float(spec.sampling_rate_hz)!r}

/* Return the estimate of {target.name} [{target.unit}] from the features{":" if labels else "."}
{labels}
   (k) is the present sample, (k-1) the one before, at the sampling rate above.{absolute} */
{prefix}_real {prefix}_predict(const {prefix}_real features[{upper}_FEATURES]);

#endif
"""


def _source(subject: Subject) -> str:
    network: Network = subject.model
    prefix, upper = subject.prefix, subject.prefix.upper()
    tables = [c_text.array("input_scale", network.input_scale), c_text.array("input_shift", network.input_shift)]
    layers = []
    last = len(network.weights) - 1
    for place, (matrix, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        tables += [c_text.array(f"weights_{place}", matrix), c_text.array(f"biases_{place}", bias)]
        outer, inner = matrix.shape
        layers.append(
            f"    layer(weights_{place}, biases_{place}, {inner}, {outer}, {int(place < last)}, signal, result);"
        )
    widest = max(network.layers)
    body = (
        "\n".join(tables)
        + f"""
static void layer(const double *weights, const double *biases, int inner, int outer, int hidden, double *signal,
                  double *result)
{{
    for (int neuron = 0; neuron < outer; ++neuron) {{
        double total = biases[neuron];
        for (int index = 0; index < inner; ++index) total += weights[neuron * inner + index] * signal[index];
        result[neuron] = hidden ? tanh(total) : total;
    }}
    for (int neuron = 0; neuron < outer; ++neuron) signal[neuron] = result[neuron];
}}

double {prefix}_predict(const double features[{upper}_FEATURES])
{{
    double signal[{widest}], result[{widest}];
    for (int index = 0; index < {upper}_FEATURES; ++index)
        signal[index] = (features[index] - input_shift[index]) / input_scale[index];
{chr(10).join(layers)}
    return signal[0] * {literal(network.output_scale)} + {literal(network.output_shift)};
}}
"""
    )
    return f"""\
/* Network, written by mrpipe; see {subject.name}.h. */
#include "{subject.name}.h"

#include <math.h>

{c_text.precision_macros(prefix)}
{c_text.in_either_precision(body, prefix)}"""


FORMAT = ExportFormat(
    kind="network",
    name="c",
    files=_files,
    usage="## C\n\n" + c_text.CC_USAGE + "\n\n`{prefix}_predict` returns the estimate for one row of features.",
)
