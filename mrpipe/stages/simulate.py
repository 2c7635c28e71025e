"""`simulate --law LAW`: the closed loop under one control law; one stage per law."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from mrpipe.control.laws import law_names
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.simulation.rig import Rig

DAMPERS = {"identified": "identify-damper", "traced": "close-loop"}
"""Dampers of this run by name, and the stage whose artifact holds each."""


def simulate_stage(law: str) -> Stage:
    """Return the stage that runs the loop under `law`."""
    return Stage(
        name=f"simulate-{law}",
        summary=f"Run the closed loop under law {law}.",
        run=lambda context: _run(context, law),
        inputs=("identify-frame", "identify-damper", "calibrate", "train-inverse"),
        conditional_inputs=(("simulate.damper", "traced", "close-loop"),),
        settings=("simulate",),
        family="simulate",
        outputs=(f"response-{law}.h5",),
    )


def _run(context: StageContext, law: str) -> Mapping[str, Any]:
    from mrpipe.dampers.model import read_tested
    from mrpipe.reporting import simulate as report
    from mrpipe.simulation.indices import indices
    from mrpipe.simulation.rig import excitation_of, release_state
    from mrpipe.simulation.storage import write_response
    from mrpipe.simulation.training_range import check_ranges, ranges_as_json
    from mrpipe.thesis.printed import PRINTED

    settings = context.settings.simulate
    rig = _rig(context)
    controller = rig.controller(law)
    excitation, viscous = excitation_of(rig, settings.excitation)
    context.progress(0.4, f"loop under {law}")
    response = rig.run(controller, excitation, rng=context.rng, initial_state=release_state(rig, settings.excitation))
    judged = {
        "residual_force_n": float(rig.damper.quasi_static_force(0.05, 0.0)),
        "drive_limit": settings.controller.drive_limit or rig.damper.drive_limit,
        "absolute": settings.accelerations == "absolute",
    }
    values = indices(response, excitation, **judged)
    if values["energy_balance_error"] > 5e-3:
        context.warn(f"energy balance is off by {values['energy_balance_error']:.2%}: raise simulate.plant_rate_hz")
    against = None
    if viscous is not None:
        against = indices(viscous, excitation, **judged)
        values["rms_x_top_over_vd"] = values["rms_x_top_m"] / against["rms_x_top_m"]
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
    report.describe(context.report, law, rig, response, excitation, values, against, PRINTED.get(law, {}))
    report.describe_ranges(context.report, ranges)
    details = {"excitation": excitation.details, "drive_unit": rig.damper.drive_unit}
    return {"law": law, **values, **details, "training_range": ranges_as_json(ranges)}


def _rig(context: StageContext) -> Rig:
    from mrpipe.control.assembly import ControllerFactory, inverse_network
    from mrpipe.control.storage import read_calibrated
    from mrpipe.effects.damper import damper_named
    from mrpipe.simulation.rig import Rig, loop_options
    from mrpipe.structures import frame_from_parameter_set, read_frame

    settings = context.settings.simulate
    if settings.frame == "identified":
        frame = read_frame(context.artifact("identify-frame"))
    else:
        frame = frame_from_parameter_set(settings.frame)
    dampers = {name: partial(context.artifact, stage) for name, stage in DAMPERS.items()}
    damper = damper_named(settings.damper, dampers)
    controllers = ControllerFactory(
        frame,
        # the controller knows the damper that it was designed for, not what the tracing has found since
        damper_named("identified", dampers) if settings.damper == "traced" else damper,
        read_calibrated(context.artifact("calibrate")),
        settings.controller,
        inverse_network(settings.controller, lambda: context.artifact("train-inverse")),
        settings.ideal_rounding_m_s,
    )
    return Rig(frame, damper, controllers, loop_options(settings))


STAGES = tuple(simulate_stage(law) for law in law_names())
