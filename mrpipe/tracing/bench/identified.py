"""The declared model of a tracing compared with the damper that `identify-damper` chose: one damper, two fits."""

from __future__ import annotations

from typing import Any

from mrpipe.dampers.model import DamperModel
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.kernel import FORCE_AT, run_recordings
from mrpipe.fitting.known import Known
from mrpipe.tracing.bench.error_measures import score
from mrpipe.tracing.bench.summary import Tracing

DRIVES = (0.0, 0.5, 1.0)
"""Numerical technique: drives, as shares of the largest one, at which the laws of both dampers are listed."""

OTHER_FIT = (
    "close-loop begins at the numbers of identify-damper and fits the form again. It weights each sample by what is "
    "expected of the error there, filters the displacement as the base forms prefer, and takes the simplest laws of "
    "the drive that cost nothing. identify-damper weights all samples alike and chooses the laws by levels of drive "
    "left out."
)
"""Why the two dampers differ where they are of one form."""


def compared_with_identified(chosen: DamperModel, known: Known, traced: Tracing) -> dict[str, Any]:
    """Return how the damper of `identify-damper` and the declared model of the tracing compare, for JSON.

    Parameters
    ----------
    chosen
        The damper that `identify-damper` chose.
    known
        All base forms that it fitted.
    traced
        The tracing.

    Returns
    -------
    `form` and `nrmse` (on the samples of which `before` holds the error), `forms` that began at their fits, `why` the
    two differ; `parameters` and laws of the declared form with the `value` of `identify-damper` and that of `before`,
    where it fitted that form.
    """
    base, judged = traced.selection.base, traced.validation
    name = base.problem.base.name
    error = score(judged, traced.measured, run_recordings(chosen.chain(), judged)[FORCE_AT]).nrmse
    found: dict[str, Any] = {"form": chosen.form, "nrmse": error, "forms": sorted(known), "why": OTHER_FIT}
    if chosen.form != name:
        found["why"] = f"close_loop.model names {name}, identify-damper chose {chosen.form}. {OTHER_FIT}"
    own = known.get(name)
    if own is None:
        return found
    before = damper_model(base, traced.drive_unit)
    searched = [item.name for item in base.problem.base.parameters() if not item.name.endswith("_scale")]
    found["parameters"] = {
        item: {"value": own.parameters[item], "before": before.parameters[item], "unit": own.unit(item)}
        for item in searched
        if item in own.parameters
    }
    drives = [share * own.drive_limit for share in DRIVES]
    found["laws"] = [
        {
            "drive": drive,
            "yield_force_n": float(own.yield_force(drive)),
            "yield_force_before_n": float(before.yield_force(drive)),
            "c0_n_s_m": float(own.viscosity(drive)),
            "c0_before_n_s_m": float(before.viscosity(drive)),
        }
        for drive in drives
    ]
    return found
