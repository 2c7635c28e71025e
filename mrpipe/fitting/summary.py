"""Results of a fit, as tables and plain numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mrpipe.dampers.model import parameter_unit, thesis_parameters
from mrpipe.fitting.comparison import Comparison, JudgedFit
from mrpipe.fitting.drive_laws import law_values
from mrpipe.fitting.form_fit import FormFit
from mrpipe.fitting.start import distinct_levels
from mrpipe.words import counted


def parameter_table(fit: FormFit) -> dict[str, dict[str, Any]]:
    """Return parameter -> value, unit, standard error (None if not fitted), and whether it ended at a bound."""
    rows: dict[str, dict[str, Any]] = {}
    for name, value in fit.model.parameters.items():
        error = fit.standard_error(name)
        rows[name] = {
            "value": float(value),
            "unit": fit.model.unit(name),
            "standard_error": error if np.isfinite(error) else None,
            "at_bound": name in fit.at_bound,
        }
    return rows


def thesis_table(fit: FormFit, A: float) -> dict[str, dict[str, Any]]:
    """Return alpha, gamma, beta and eta as Table 2.2 names them, for a chosen A, errors by linear propagation.

    Empty for forms without a Bouc-Wen hysteresis.
    """
    if fit.form.hysteresis is None or fit.model.laws:
        return {}
    model = fit.model
    values = thesis_parameters(model, A)
    slopes = np.zeros((len(values), len(fit.names)))
    for column, name in enumerate(fit.names):
        value = model.parameters[name]
        step = 1e-6 * (abs(value) or 1.0)
        moved = replace(model, parameters={**model.parameters, name: value + step})
        changed = thesis_parameters(moved, A)
        slopes[:, column] = [(changed[key] - values[key]) / step for key in values]
    errors = np.sqrt(np.maximum(np.diag(slopes @ fit.covariance @ slopes.T), 0.0))
    table: dict[str, dict[str, Any]] = {}
    for (name, value), error in zip(values.items(), errors, strict=True):
        known = name not in ("A", "n")
        unit = parameter_unit(name, model.drive_unit)
        if name in ("gamma", "beta"):
            unit = "1/m" if values["n"] == 1.0 else f"1/m^{values['n']:g}"
        table[name] = {
            "value": float(value),
            "unit": unit,
            "standard_error": float(error) if known else None,
        }
    return table


def number_or_none(value: float) -> float | None:
    """Return the number, or None for NaN (no test of the role), because JSON has no NaN."""
    return float(value) if np.isfinite(value) else None


def comparison_rows(judged: Sequence[JudgedFit]) -> list[dict[str, Any]]:
    """Return one row per form, the form with the smallest validation error first."""
    rows = [
        {
            "form": item.fit.form.name,
            "training_nrmse": item.training.nrmse,
            "validation_nrmse": number_or_none(item.validation.nrmse),
            "validation_fit_percent": number_or_none(item.validation.fit_percent),
            "validation_r2": number_or_none(item.validation.r2),
            "cross_validated_nrmse": item.cross_validated_nrmse,
            "typical_left_out_nrmse": number_or_none(item.typical_left_out_nrmse),
            "parameter_count": len(item.fit.names),
            "spread_over_starts": float(np.ptp(item.fit.start_nrmse)),
            "iterations": item.fit.fit.iterations,
            "at_bound": list(item.fit.at_bound),
            "undetermined": list(item.undetermined),
            "notes": list(item.fit.notes),
        }
        for item in judged
    ]
    return sorted(rows, key=_judged_error)


def _judged_error(row: dict[str, Any]) -> float:
    unseen = row["validation_nrmse"]
    return float(row["training_nrmse"] if unseen is None else unseen)


def correlation_rows(fit: FormFit, limit: float = 0.95) -> list[dict[str, Any]]:
    """Return pairs of parameters that the data hardly separate (absolute correlation above `limit`)."""
    return [
        {"parameters": [first, second], "correlation": correlation}
        for first, second, correlation in fit.correlated(limit)
    ]


def test_rows(judged: JudgedFit) -> list[dict[str, Any]]:
    """Return one row per test: name, role, NRMSE [1] and RMS error [N]."""
    return [
        {
            "name": score.name,
            "role": score.role,
            "nrmse": number_or_none(score.nrmse),
            "rms_error_n": float(np.sqrt(score.squared_error / max(score.samples, 1))),
            "rms_force_n": float(np.sqrt(score.squared_force / max(score.samples, 1))),
        }
        for score in judged.tests
    ]


def findings(fit: FormFit) -> list[str]:
    """Return findings on a fit for the user, one line each."""
    lines = []
    problem = fit.fit.problem
    if not problem.base.lag_known:
        lines.append(
            "the drive is constant in every test, which does not determine its lag: "
            f"eta = {fit.model.parameters['eta']:g} 1/s is assumed"
        )
    lines += [f"{fit.form.name}: {note}" for note in fit.notes]
    # a parameter that a note mentions needs no separate line
    silent = [name for name in fit.at_bound if not any(name in note for note in fit.notes)]
    lines += [f"{fit.form.name}: {name} ended at its bound, because the data do not determine it" for name in silent]
    levels = distinct_levels(problem.recordings)
    if levels < 4:
        count = counted(levels, "level")
        law = problem.base.laws[0].name
        lines.append(f"the training tests have {count} of drive, so the yield force over the drive is taken as {law}")
    drive = np.linspace(0.0, problem.scales.drive, 50)
    strength = fit.model.yield_force(drive)
    if np.any(np.diff(strength) < -0.02 * np.max(np.abs(strength))):
        lines.append(
            "the yield force falls with the drive in a part of the range, so that the inverse is not unique there"
        )
    return lines


def law_summary(comparison: Comparison, chosen: JudgedFit) -> dict[str, Any] | None:
    """Return the laws of the drive, the reason for the choice, and their predictions; None if none were chosen."""
    choice = comparison.laws
    if choice is None:
        return None
    return {
        "yield_force": choice.laws[0].name,
        "c0": choice.laws[1].name,
        "reason": choice.reason,
        "candidates": [
            {"law": name, "error_on_levels_left_out": left_out, "error_on_levels": inside}
            for name, left_out, inside in choice.candidates
        ],
        "predictions": law_values(choice, chosen.fit.fit.laws),
    }


def rank_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """Return one row per ranked form: its error on a share of the samples, and whether it was fitted to all."""
    fitted = {item.fit.form.name for item in comparison.judged}
    rows = [{"form": name, "draft_nrmse": error, "fitted": name in fitted} for name, error in comparison.drafts.items()]
    return sorted(rows, key=lambda row: float(row["draft_nrmse"]))
