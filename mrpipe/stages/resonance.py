"""`simulate --law LAW --resonance`: the response over frequency and the loop's own resonance; one stage per law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.control.laws import law_names
from mrpipe.pipeline.loop_inputs import LOOP_INPUTS
from mrpipe.pipeline.stage import Stage, StageContext


def resonance_stage(law: str) -> Stage:
    """Return the stage that measures the response over frequency under `law`."""
    return Stage(
        name=f"resonance-{law}",
        summary=f"Find the resonance of the closed loop under law {law}.",
        run=lambda context: _run(context, law),
        inputs=("identify-frame", "calibrate"),
        conditional_inputs=(*LOOP_INPUTS, ("gains.source", "design", "design")),
        after=("identify-damper", "train-inverse"),
        settings=("gains", "simulate", "resonance"),
        family="resonance",
        outputs=(f"resonance-{law}.h5",),
        check=_check,
    )


def _run(context: StageContext, law: str) -> Mapping[str, Any]:
    from mrpipe.errors import StageSkipped
    from mrpipe.reporting import resonance as report
    from mrpipe.simulation.resonance import default_band, measure_resonance
    from mrpipe.simulation.rig import excitation_of, read_rig
    from mrpipe.simulation.storage import write_curves

    rig = read_rig(context.settings.simulate, context.artifact, context.settings.gains.source)
    if reason := rig.reason_to_skip(law):
        raise StageSkipped(reason)
    rig.controller(law)  # a law that is not calibrated is refused before anything is simulated
    settings = context.settings.resonance
    excitation, _ = excitation_of(rig, context.settings.simulate.excitation)
    band = settings.band_rad_s or default_band(context.artifact("calibrate"))
    absolute = context.settings.simulate.accelerations == "absolute"
    curves = measure_resonance(
        rig, law, excitation, band, settings, absolute, context.rng, context.progress, context.jobs
    )
    for warning in curves.warnings:
        context.warn(warning)
    with context.write(f"resonance-{law}.h5") as artifact:
        write_curves(artifact, curves.curves)
        artifact.attributes("/", law=law)
    report.describe(context.report, law, curves)
    return {"law": law, **curves.as_json()}


def _check(settings: Any) -> None:
    """Check that damper and frame are there."""
    from mrpipe.simulation.checks import require_models

    require_models(settings.simulate)


STAGES = tuple(resonance_stage(law) for law in law_names())
