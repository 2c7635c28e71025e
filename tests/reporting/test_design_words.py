"""A limit that no design keeps is said in the same words for one damper and for several."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import mrpipe
from mrpipe.reporting.design_words import exceeded_limits, in_plain_words

pytestmark = pytest.mark.property


def test_each_exceeded_limit_has_its_clause() -> None:
    assert exceeded_limits({}) == []
    assert exceeded_limits({"max_stroke_m": 0.25, "max_force_n": 0.004}) == [
        "no design keeps all limits: the best one exceeds that of max_stroke_m by 25.0 %",
        "no design keeps all limits: the best one exceeds that of max_force_n by 0.4 %",
    ]


def test_the_result_for_one_damper_has_it_as_a_sentence() -> None:
    best = {
        "gains": {}, "peak_rms_x_top_m": 0.01, "resonance_rad_s": 8.0, "objective": 1.0, "improvement": 0.0,
        "exceeds_limits": {"max_stroke_m": 0.25}, "peak_rms_a_top_m_s2": 1.0, "law": "vd",
    }  # fmt: skip
    confirmation = {"design": best, "calibrated": best, "improvement_x_top": 0.0, "improvement_a_top": 0.0}
    words = in_plain_words({"best": "vd", "objective": "x", "laws": {"vd": best}, "confirmation": confirmation})
    assert " No design keeps all limits: the best one exceeds that of max_stroke_m by 25.0 %. " in words


def test_the_sentence_has_one_source() -> None:
    files = [
        path.name
        for path in Path(mrpipe.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and "no design keeps" in str(node.value).lower()
    ]
    assert files == ["design_words.py"]
