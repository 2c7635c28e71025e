"""A network as ONNX in double precision, from a table of features to a column of estimates."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrpipe.exports.contract import ExportFormat, Files, Subject
from mrpipe.networks.network import Network

OPSET = 17
"""Version of the operators: old enough for runtimes of the last years."""


def _files(subject: Subject) -> Files:
    return {f"{subject.name}.onnx": _model(subject).SerializeToString()}


def _model(subject: Subject) -> Any:
    from onnx import TensorProto, checker, helper, numpy_helper

    network: Network = subject.model
    constants: list[Any] = []
    nodes: list[Any] = []

    def constant(name: str, values: Any) -> str:
        constants.append(numpy_helper.from_array(np.asarray(values, dtype=np.float64), name))
        return name

    def node(operator: str, inputs: list[str], result: str) -> str:
        nodes.append(helper.make_node(operator, inputs, [result]))
        return result

    signal = node("Sub", ["features", constant("input_shift", network.input_shift)], "shifted")
    signal = node("Div", [signal, constant("input_scale", network.input_scale)], "normalised")
    last = len(network.weights) - 1
    for place, (matrix, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        signal = node("MatMul", [signal, constant(f"weights_{place}", matrix.T)], f"product_{place}")
        signal = node("Add", [signal, constant(f"biases_{place}", bias)], f"sum_{place}")
        if place < last:
            signal = node("Tanh", [signal], f"layer_{place}")
    signal = node("Mul", [signal, constant("output_scale", [network.output_scale])], "scaled")
    target = network.features.target
    node("Add", [signal, constant("output_shift", [network.output_shift])], target)
    graph = helper.make_graph(
        nodes,
        subject.name,
        [helper.make_tensor_value_info("features", TensorProto.DOUBLE, ["rows", network.features.width])],
        [helper.make_tensor_value_info(target, TensorProto.DOUBLE, ["rows", 1])],
        constants,
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="mrpipe", ir_version=8
    )
    helper.set_model_props(
        model,
        {
            "features": ", ".join(f"{item.name} [{item.unit}]" for item in subject.vectors.inputs),
            "target": ", ".join(f"{item.name} [{item.unit}]" for item in subject.vectors.outputs),
            "sampling_rate_hz": repr(float(network.features.sampling_rate_hz)),
        },
    )
    checker.check_model(model)
    return model


FORMAT = ExportFormat(
    kind="network",
    name="onnx",
    files=_files,
    usage="## ONNX\n\n`{name}.onnx` takes `features` of shape (rows, features) in double precision and returns one "
    "column. Its metadata list the features with their units.",
    needs="onnx",
)
