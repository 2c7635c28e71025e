"""What the report says of a tracing in plain words."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import pytest

from mrpipe.reporting.bench_tracing import errors_per_test, in_plain_words

pytestmark = pytest.mark.property


def _effect(name: str, tied_with: list[str]) -> dict[str, Any]:
    return {
        "name": name,
        "form": "plain",
        "parameters": {"gain": {"value": 0.5, "unit": "1", "interval": [0.4, 0.6]}},
        "confidence": 0.9,
        "tied_with": tied_with,
        "physics": "It remembers.",
        "remedy": "Demagnetise.",
    }


@pytest.fixture
def summary() -> dict[str, Any]:
    return {
        "model": "bouc-wen",
        "noise_floor_nrmse": 0.004,
        "before": {"nrmse": 0.08},
        "after": {"nrmse": 0.01},
        "residual": {"structured": True},
        "effects": [_effect("remanence", [])],
        "further_terms": [],
        "ceiling": {"nrmse": 0.009, "recovered": 0.97},
        "unexplained": {"structured": False, "depends_on": []},
    }


def test_a_term_that_counts_in_the_error_but_is_not_proven_is_told(summary: dict[str, Any]) -> None:
    assert "not proven" not in in_plain_words(summary)
    summary["further_terms"] = [_effect("migration", ["stribeck"])]
    text = in_plain_words(summary)
    assert (
        "In addition, migration (plain, probability 0.90) lowers the error and is part of the model, but is not "
        "proven against stribeck." in text
    )
    assert "lacks **remanence**." in text


def test_noise_alone_and_the_unknown_are_said_to_be_so(summary: dict[str, Any]) -> None:
    unknown = {**summary, "effects": [], "unexplained": {"structured": True, "depends_on": [{"state": "displacement"}]}}
    assert "no known effect explains it. It varies with displacement." in in_plain_words(unknown)
    noise = {**unknown, "residual": {"structured": False}}
    assert in_plain_words(noise).endswith("nothing is missing.")


def test_differences_of_the_validation_tests_are_said_first(summary: dict[str, Any]) -> None:
    comparable = {"share_of_samples": 0.75, "nrmse_before": 0.02, "nrmse_after": 0.01, "nrmse_corrected": 0.012}
    difference = {"sentence": "v8: the measured force is 0.001 times the simulated one"}
    differs = {
        **summary,
        "verdict_class": "validation differs",
        "validation": {"differences": [difference], "comparable": comparable},
    }
    text = in_plain_words(differs)
    assert "v8: the measured force is 0.001 times the simulated one." in text
    assert "75.0 % of the samples) the error is 2.0 % before and 1.0 % after" in text
    assert "the error is 1.2 %." in text
    assert "Remanence" in text


def test_a_base_model_that_fails_is_said_to_fail(summary: dict[str, Any]) -> None:
    sentence = "the model does not predict the validation tests (NRMSE 0.7): nothing is traced"
    failed = {**summary, "effects": [], "candidates": [], "verdict_class": "unknown", "verdict": sentence}
    assert in_plain_words(failed).endswith("(NRMSE 0.7): nothing is traced.")


def test_an_exchanged_base_form_is_part_of_the_paragraph(summary: dict[str, Any]) -> None:
    summary["base_form"] = {"declared": "bouc-wen", "taken": "rounded-yield", "tied_with": []}
    assert "base form **rounded-yield** in place of bouc-wen" in in_plain_words(summary)


@pytest.mark.property
@pytest.mark.parametrize("count", [1, 2, 6, 24])
def test_the_legend_hides_no_test_and_the_first_one_is_whole(count: int) -> None:
    rows = [{"name": f"t{index}", "nrmse_before": 0.1 - 0.001 * index, "nrmse_after": 0.01} for index in range(count)]
    figure = errors_per_test(rows, 0.004)
    figure.canvas.draw()
    axis = figure.axes[0]
    low, high = axis.get_ylim()
    assert low <= -0.5 and high >= count - 0.5
    legend = axis.get_legend()
    assert legend is not None
    box = legend.get_window_extent().transformed(axis.transData.inverted())
    assert box.y1 < 0.0  # the last test stands at 0
    plt.close(figure)
