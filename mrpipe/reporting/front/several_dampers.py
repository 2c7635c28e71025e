"""Several dampers in one structure: what they do together, and what each of them needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.reporting.facts import RunFacts
from mrpipe.reporting.words import percent
from mrpipe.words import listed, number


def answer(facts: RunFacts) -> str:
    """Return dampers with their laws, and the damping ratios that they give together; empty with one damper."""
    calibrated = facts.summary("calibrate")
    dampers = calibrated.get("dampers") or []
    if not dampers:
        return ""
    names = listed([f"{item['name']} (law {item['law']})" for item in dampers])
    text = f"{len(dampers)} dampers: {names}."
    together = calibrated.get("together") or {}
    if together.get("damping_ratios"):
        ratios = listed([
            f"{percent(ratio)} in mode {mode}"
            for mode, ratio in zip(together["modes"], together["damping_ratios"], strict=True)
        ])  # fmt: skip
        text += f" Calibrated together they give damping ratios of {ratios}, if every force follows its command."
        if not together.get("stable", True):
            text += " This loop is not stable."
    return text


def rows(facts: RunFacts) -> list[dict[str, Any]]:
    """Return a row for each damper that was simulated: gains, stroke, force, and error of the force."""
    simulated = facts.summary("simulate-dampers").get("dampers") or []
    gains = {item["name"]: item["gains"] for item in facts.summary("calibrate").get("dampers") or []}
    return [_row(item, gains.get(item["name"], {})) for item in simulated]


def _row(item: Mapping[str, Any], gains: Mapping[str, float]) -> dict[str, Any]:
    return {
        "damper": item["name"],
        "law": item["law"],
        "c [kN s/m]": number(1e-3 * gains["c_n_s_m"]) if "c_n_s_m" in gains else "-",
        "k [kN/m]": number(1e-3 * gains["k_n_m"]) if "k_n_m" in gains else "-",
        "rms stroke [mm]": number(1e3 * item["rms_damper_displacement_m"]),
        "largest stroke [mm]": number(1e3 * item["peak_damper_displacement_m"]),
        "rms force [kN]": number(1e-3 * item["rms_force_n"]),
        "largest force [kN]": number(1e-3 * item["peak_force_n"]),
        "error of force [%]": number(100.0 * item["force_tracking_nrmse"], 2),
    }
