"""`simulate --law LAW`: the closed loop under one control law; one stage per law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.control.laws import law_names
from mrpipe.pipeline.loop_inputs import LOOP_INPUTS
from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.words import in_percent


def simulate_stage(law: str) -> Stage:
    """Return the stage that runs the loop under `law`."""
    return Stage(
        name=f"simulate-{law}",
        summary=f"Run the closed loop under law {law}.",
        run=lambda context: _run(context, law),
        inputs=("identify-frame", "calibrate"),
        conditional_inputs=(*LOOP_INPUTS, ("gains.source", "design", "design")),
        after=("identify-damper", "train-inverse"),
        settings=("gains", "simulate"),
        family="simulate",
        outputs=(f"response-{law}.h5",),
        check=_check,
    )


def _run(context: StageContext, law: str) -> Mapping[str, Any]:
    from mrpipe.dampers.model import read_tested
    from mrpipe.errors import StageSkipped
    from mrpipe.reporting import simulate as report
    from mrpipe.simulation.indices import indices, places_table
    from mrpipe.simulation.rig import DAMPERS, drive_warning, excitation_of, read_rig, release_state
    from mrpipe.simulation.storage import write_response
    from mrpipe.simulation.training_range import check_ranges, ranges_as_json

    settings = context.settings.simulate
    rig = read_rig(settings, context.artifact, context.settings.gains.source)
    if reason := rig.reason_to_skip(law):
        raise StageSkipped(reason)
    if beyond := drive_warning(rig.damper, settings.controller.drive_limit):
        context.warn(beyond)
    controller = rig.controller(law)
    excitation, viscous = excitation_of(rig, settings.excitation, context.warn)
    context.progress(0.4, f"loop under {law}")
    response = rig.run(controller, excitation, rng=context.rng, initial_state=release_state(rig, settings.excitation))
    judged = {
        "residual_force_n": rig.residual_force_n,
        "drive_limit": settings.controller.drive_limit or rig.damper.drive_limit,
    }
    values = indices(response, excitation, **judged)
    if values["energy_balance_error"] > 5e-3:
        context.warn(
            f"energy balance is off by {in_percent(values['energy_balance_error'], 2)}: raise simulate.plant_rate_hz"
        )
    against = None
    if viscous is not None:
        against = indices(viscous, excitation, **judged)
        at_rest = against["rms_x_top_m"] == 0.0  # the motion is below the smallest number
        values["rms_x_top_over_vd"] = None if at_rest else values["rms_x_top_m"] / against["rms_x_top_m"]
    tested = read_tested(context.artifact("identify-damper")) if settings.damper in DAMPERS else {}
    ranges = check_ranges(rig, controller, response, tested)
    for check in ranges:
        if check.warning:
            context.warn(check.warning)
    with context.write(f"response-{law}.h5") as artifact:
        write_response(artifact, response, rig.damper.drive_unit)
        # wall-clock time is printed, not stored: the same inputs give the same artifact
        artifact.put_json("indices", {key: value for key, value in values.items() if key != "real_time_factor"})
        artifact.put_json("training_range", ranges_as_json(ranges))
        artifact.put_json("excitation", excitation.details)
        artifact.attributes("/", law=law)
    report.describe(context.report, law, rig, response, excitation, values, against)
    report.describe_ranges(context.report, ranges)
    if excitation.places:
        values["degrees_of_freedom"] = places_table(response, rig.frame.names, excitation)
    details = {"excitation": excitation.details, "drive_unit": rig.damper.drive_unit}
    return {"law": law, **values, **details, "training_range": ranges_as_json(ranges)}


def _check(settings: Any) -> None:
    """Check that damper and frame are there."""
    from mrpipe.simulation.checks import require_models

    require_models(settings.simulate)


STAGES = tuple(simulate_stage(law) for law in law_names())
