"""Compare a verdict of `close-loop` with the truth of a rig."""

from __future__ import annotations

from typing import Any

Row = dict[str, Any]

SAME_MEANING: dict[str, dict[str, tuple[str, ...]]] = {
    "accumulator": {"stiffness": ("stiffness",)},
    "inertia": {"mass": ("mass",)},
    "backlash": {"gap": ("gap",)},
    "delay": {"delay": ("delay", "time_constant")},
    "channel-skew": {"skew": ("skew",)},
    "end-stop": {"free_travel": ("free_travel",)},
}
"""Effect -> number of the planted law -> parameters of the program that mean the same in whatever form was found."""


def verdict_row(summary: Row) -> Row:
    """Return what a close-loop summary says, in the keys of a results file; optional keys may be missing."""
    effects = [
        {
            "name": item["name"],
            "form": item.get("form", ""),
            "confidence": item.get("confidence"),
            "tied_with": item.get("tied_with", []),
            "parameters": {name: number["value"] for name, number in item.get("parameters", {}).items()},
        }
        for item in summary["effects"]
    ]
    base_form = summary.get("base_form", {})
    unexplained = summary.get("unexplained", {})
    return {
        "found": [item["name"] for item in effects],
        "effects": effects,
        "verdict": summary.get("verdict", ""),
        "verdict_class": summary.get("verdict_class"),
        "base_taken": base_form.get("taken"),
        "base_best": base_form.get("best"),
        "base_nrmse": base_form.get("nrmse", {}),
        "before": summary["before"]["nrmse"],
        "after": summary["after"]["nrmse"],
        "floor": summary["noise_floor_nrmse"],
        "ceiling": summary.get("ceiling", {}).get("nrmse"),
        "structured": bool(unexplained.get("structured")),
        "left": unexplained.get("share_of_residual"),
        "further": [item["name"] for item in summary.get("further_terms", [])],
        "candidates": [item["name"] for item in summary.get("candidates", [])[:5]],
        "untestable": sorted(summary.get("untestable", {})),
    }


def judged(kind: str, planted: list[str], row: Row) -> Row:
    """Return whether a verdict is right, and in what respect.

    `right` is the acceptance figure of the kind: nothing named on a clean rig, the right name first for a single
    effect, both names for a pair, and for a shape outside the library nothing named and the residual declared
    structured or unknown.
    """
    found = row["found"]
    spurious = [name for name in found if name not in planted]
    if kind == "clean":
        right = not found
    elif kind == "single":
        right = found[:1] == planted
    elif kind == "pair":
        right = set(planted) <= set(found)
    else:
        right = not found and (row["structured"] or row["verdict_class"] in ("unknown", "partly explained"))
    return {"right": right, "alone": right and not spurious, "spurious": spurious}


def parameter_errors(row: Row) -> list[tuple[str, str, float]]:
    """Return effect, parameter and relative error wherever a number found means the same as one planted."""
    errors = []
    for name, numbers in zip(row["planted"], row["truth"]["numbers"], strict=True):
        for item in row["effects"]:
            for planted_key, keys in SAME_MEANING.get(name, {}).items():
                key = next((key for key in keys if key in item["parameters"]), None)
                if item["name"] == name and planted_key in numbers and key is not None:
                    errors.append((name, planted_key, item["parameters"][key] / numbers[planted_key] - 1.0))
    return errors
