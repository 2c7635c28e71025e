"""What the formats of an export share: JSON, MATLAB data and C text hold the numbers exactly."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest
from scipy.io import loadmat

from mrpipe.exports import c_text
from mrpipe.exports.contract import Channel, Subject, Vectors
from mrpipe.exports.json_text import as_json
from mrpipe.exports.matlab_text import data_file, self_test

pytestmark = pytest.mark.property

VALUES = np.array([1.0 / 3.0, -2.0e-7, 4.0e12])
VECTORS = Vectors((Channel("x", "m", VALUES),), (Channel("force", "N", 2.0 * VALUES),), 0.001)


def test_matlab_holds_the_numbers_and_the_vectors() -> None:
    found = loadmat(io.BytesIO(data_file({"mass": np.eye(2)}, VECTORS)), simplify_cells=True)
    assert np.array_equal(found["mass"], np.eye(2))
    assert np.array_equal(found["vectors"]["inputs"], VALUES)
    assert found["vectors"]["sample_time_s"] == 0.001
    text = self_test("rig_damper", ["state = 0;"], ["output = 2 * input;"])
    assert text.startswith("function worst = self_test()") and "load('rig_damper.mat')" in text
    assert text.count("\n    state = 0;") == 1 and "1e-09" in text


def test_json_holds_every_digit() -> None:
    subject = Subject(kind="damper", name="damper", prefix="rig", model=None, vectors=VECTORS, details={"unit": "A"})
    content = json.loads(as_json(subject, {"stiffness": 1.0 / 3.0}))
    assert content["model"]["stiffness"] == 1.0 / 3.0 and content["unit"] == "A"
    assert content["vectors"]["outputs"][0]["values"] == (2.0 * VALUES).tolist()


def test_c_code_for_either_precision() -> None:
    """Constants, functions and types change; comments, strings, words and preprocessor lines do not."""
    text = '#include "a.h" /* 0.5 */\ndouble f(double x) { return 0.5 * tanh(x) + table2[1]; } /* double 1.0 */\n'
    found = c_text.in_either_precision(text, "rig")
    assert "rig_real f(rig_real x) { return R(0.5) * M(tanh)(x) + table2[1]; }" in found
    assert '#include "a.h" /* 0.5 */' in found and "/* double 1.0 */" in found
    assert "#ifdef RIG_SINGLE" in c_text.precision_header("rig")
