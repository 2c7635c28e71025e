"""What `simulate` says of a network or damper model that was asked for more than training and tests have shown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import StageContext

if TYPE_CHECKING:
    from mrpipe.control.controller import Controller
    from mrpipe.simulation.loop import Response
    from mrpipe.simulation.training_range import RangeCheck
    from mrpipe.stages.simulate import Rig


def check_ranges(context: StageContext, rig: Rig, control: Controller, response: Response) -> list[RangeCheck]:
    """Return how networks and damper model were asked in a run, and warn where one was asked beyond what it knows."""
    import numpy as np

    from mrpipe.dampers.model import read_tested
    from mrpipe.simulation.training_range import check_damper, check_networks

    with_damper = rig.options.tracking == "damper"
    relative = np.einsum("tf,f->t", response.acceleration, rig.position)
    acceleration = np.interp(response.command_time_s, response.time_s, relative)
    checks = check_networks(control, response, acceleration, drive_counts=with_damper)
    if with_damper and context.settings.simulate.damper == "identified":
        tested = read_tested(context.artifact("identify-damper"))
        if tested:
            checks.append(check_damper(response, tested))
    for check in checks:
        if check.warning:
            context.warn(check.warning)
    return checks


def ranges_as_json(checks: Sequence[RangeCheck]) -> dict[str, Any]:
    """Return the checks by what they are of, as plain values."""
    return {check.what.replace(" ", "_"): check.as_json() for check in checks}


def report_ranges(context: StageContext, checks: Sequence[RangeCheck]) -> None:
    """Write the ranges into the report."""
    import pandas as pd

    rows = [
        {"of": check.what, "input": name, "share of time outside": item.outside_share}
        | {"largest asked": item.asked[1], "largest known": item.known[1]}
        | {"smallest asked": item.asked[0], "smallest known": item.known[0]}
        for check in checks
        for name, item in check.inputs.items()
    ]
    if not rows:
        return
    within = [check.what for check in checks if not check.warning]
    if within:
        context.report.text(f"Asked within the range it knows: {', '.join(within)}.")
    context.report.table(
        "training-range",
        pd.DataFrame(rows),
        "What networks and damper model were asked, beside the range of their training rows and bench tests (SI).",
    )
