"""Comparison of the declared model of a tracing with the damper model that `identify-damper` chose."""

from __future__ import annotations

from typing import Any

from mrpipe.dampers.model import DamperModel
from mrpipe.fitting.damper import damper_model
from mrpipe.fitting.kernel import FORCE_AT, run_recordings
from mrpipe.fitting.known import Known
from mrpipe.tracing.bench.residuals.error_measures import score
from mrpipe.tracing.bench.verdict.summary import Tracing

DRIVES = (0.0, 0.5, 1.0)
"""Numerical technique: drives, as shares of the largest one, at which the laws of both dampers are listed."""

OTHER_FIT = (
    "close-loop starts from the parameters of identify-damper and fits the form again. It weights each sample "
    "by the expected error at this sample, it chooses the filter of the displacement by the error of base forms, and "
    "it takes the simplest laws of the drive that fit as well as others. identify-damper gives all samples the same "
    "weight and chooses the laws by levels of drive left out."
)
"""Reason why the two models differ although they have the same form."""


def comparison_with_identified(chosen: DamperModel, known: Known, traced: Tracing) -> dict[str, Any]:
    """Return the comparison of the damper of `identify-damper` with the declared model of the tracing, for JSON.

    Parameters
    ----------
    chosen
        The damper model that `identify-damper` chose.
    known
        All base forms that it fitted.
    traced
        The tracing.

    Returns
    -------
    `form`; `nrmse` on the same samples as `before`; `forms`, whose fits started from those of `identify-damper`; `why`
    the two models differ; and, if `identify-damper` fitted the declared form, its `parameters` and `laws` with the
    `value` of `identify-damper` and that of `before`.
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
