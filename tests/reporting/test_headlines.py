"""One line for each result."""

from __future__ import annotations

import pytest

from mrpipe.reporting.headlines import in_brief, weak_network
from tests.reporting.front.run import tracing


@pytest.mark.property
def test_a_network_far_worse_than_the_damper_model_is_named_with_both_errors() -> None:
    found = {
        "train-forward": {"validation_nrmse": 0.43},
        "identify-damper": {"validation_nrmse": 0.127, "form": "dahl"},
    }
    text = weak_network(found)
    assert "43 % of the RMS force" in text and "3.4 times" in text and "dahl (13 %)" in text
    assert weak_network({**found, "train-forward": {"validation_nrmse": 0.15}}) == ""
    assert weak_network({"train-forward": {"validation_nrmse": 0.43}}) == ""
    assert weak_network({}) == ""


@pytest.mark.property
def test_the_command_that_applies_corrections_is_complete() -> None:
    lines = in_brief("close-loop", tracing(corrections={"found": True, "file": "corrections.yaml"}))
    (line,) = [line for line in lines if "corrections" in line]
    assert "mrpipe prepare --settings RUN/corrections.yaml, and the same --config or --campaign" in line
    assert not any("corrections" in line for line in in_brief("close-loop", tracing()))
