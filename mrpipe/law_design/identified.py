"""Uncertainty of structure and damper, from the artifacts of their identification."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray
from mrpipe.errors import UserError
from mrpipe.law_design.uncertainty import DamperUncertainty, FrameUncertainty
from mrpipe.structures import Frame, natural_modes

WIDTH_OF_95_PERCENT = 2.0 * 1.96
"""Width of a 95 % interval of a normal distribution in standard deviations."""


def frame_uncertainty(artifact: Artifact, frame: Frame) -> FrameUncertainty:
    """Return the standard deviations of the modes from their 95 % intervals in frame.h5.

    They are zero without intervals, and for modes of the frame that were not identified.

    Raises
    ------
    UserError
        If stored intervals have another shape than (modes, 2), or belong to modes that the frame does not have.
    """
    n = frame.floors
    members = set(artifact.members("modes")) if "modes" in artifact.members() else set()
    numbers = artifact.array("modes/number").astype(np.int64) if "number" in members else np.arange(1, n + 1)

    def deviations(name: str) -> FloatArray:
        found = np.zeros(n)
        key = f"modes/{name}_interval"
        if f"{name}_interval" not in members:
            return found
        bounds = artifact.array(key)
        if bounds.shape != (len(numbers), 2):
            problem = f"has shape {bounds.shape}, and the structure has {len(numbers)} identified modes"
            raise UserError(artifact.path, key, problem, f"shape ({len(numbers)}, 2): run identify-frame again")
        if len(numbers) and not (numbers.min() >= 1 and numbers.max() <= n):
            problem = f"holds modes {numbers.min()} to {numbers.max()}, and the frame has {n}"
            raise UserError(artifact.path, "modes/number", problem, "run identify-frame again")
        found[numbers - 1] = np.nan_to_num(np.abs(bounds[:, 1] - bounds[:, 0])) / WIDTH_OF_95_PERCENT
        return found

    omega = natural_modes(frame).angular_frequencies
    return FrameUncertainty(deviations("angular_frequency") / omega, deviations("damping_ratio"))


def damper_uncertainty(artifact: Artifact) -> DamperUncertainty:
    """Return the covariance of the parameters in damper.h5, and the model error on tests not used in the fit."""
    members = set(artifact.members())
    error = 0.0
    if "comparison" in members:
        rows = [row for row in artifact.json("comparison") if row.get("form") == _form(artifact)]
        error = float((rows[0].get("validation_nrmse") if rows else None) or 0.0)
    return DamperUncertainty(*_covariance(artifact), error)


def traced_damper_uncertainty(identified: Artifact, traced: Artifact) -> DamperUncertainty:
    """Return the uncertainty of a traced damper.

    The covariance of the base form is that of its identification; there is none where the tracing has taken another
    base form. The effects have the 95 % intervals of their parameters, and the model error is that after the tracing.

    Parameters
    ----------
    identified, traced
        Artifacts of `identify-damper` and of `close-loop`.
    """
    summary: Mapping[str, Any] = traced.json("summary")
    effects = {}
    for effect in summary["effects"]:
        for name, found in effect["parameters"].items():
            low, high = found.get("interval") or (None, None)
            if low is not None and high is not None and np.isfinite(high - low):
                effects[f"{effect['name']}.{name}"] = float(high - low) / WIDTH_OF_95_PERCENT
    same = _form(identified) == _form(traced)
    base = _covariance(identified) if same else ((), np.zeros((0, 0)))
    return DamperUncertainty(*base, float(summary["after"]["nrmse"] or 0.0), effects)


def _form(artifact: Artifact) -> str:
    return str(artifact.attributes("damper").get("form", ""))


def _covariance(artifact: Artifact) -> tuple[tuple[str, ...], FloatArray]:
    """Return the names of the parameters and their covariance; nothing where the artifact has none."""
    if not {"covariance", "parameter_names"} <= set(artifact.members()):
        return (), np.zeros((0, 0))
    names = tuple(str(name) for name in artifact.json("parameter_names"))
    return names, np.nan_to_num(artifact.array("covariance"))
