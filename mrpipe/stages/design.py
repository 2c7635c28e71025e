"""`design`: the law and gains with the smallest largest response of the real loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.loop_inputs import LOOP_INPUTS
from mrpipe.pipeline.stage import Stage, StageContext

KEPT = "design-kept"
"""Folder with the results of completed laws, until the design is complete."""

if TYPE_CHECKING:
    from mrpipe.law_design.uncertainty import DamperUncertainty, FrameUncertainty
    from mrpipe.simulation.rig import Rig


def _run(context: StageContext) -> Mapping[str, Any]:
    import time

    from mrpipe.control.calibration import CalibrationOptions, plant_of
    from mrpipe.law_design.confirmation import doubts
    from mrpipe.law_design.kept import Kept
    from mrpipe.law_design.results import design_as_json, write_design
    from mrpipe.law_design.run import load_of, run_design
    from mrpipe.reporting import design as report
    from mrpipe.simulation.inputs import ground_amplitude
    from mrpipe.simulation.resonance import default_band
    from mrpipe.simulation.rig import excitation_of, read_rig

    began = time.perf_counter()
    settings, simulate = context.settings.design, context.settings.simulate
    rig = read_rig(simulate, context.artifact)
    # the design without the tracing, to show the benefit of the tracing
    identified = (
        read_rig(simulate.changed(damper="identified"), context.artifact) if simulate.damper == "traced" else None
    )
    excitation, _ = excitation_of(rig, simulate.excitation)
    amplitude = ground_amplitude(excitation.details, "a design")
    band = settings.band_rad_s or context.settings.resonance.band_rad_s or default_band(context.artifact("calibrate"))
    load = load_of(settings, amplitude, band, rig.frame)
    plant = plant_of(rig.frame, rig.position, CalibrationOptions(mode=context.settings.calibrate.target_mode))
    result = run_design(
        rig,
        plant,
        settings,
        load,
        _uncertainty(context, rig),
        absolute=simulate.accelerations == "absolute",
        rng=context.rng,
        jobs=context.jobs,
        progress=context.progress,
        kept=(kept := Kept(context.run_directory / KEPT, _problem(context))),
        identified=identified,
    )
    for law, why in result.left_out.items():
        context.warn(f"law {law} is not in the race, because {why}")
    for line in doubts(result.confirmation, plant):
        context.warn(line)
    summary = {**design_as_json(result, settings), "drive_unit": rig.damper.drive_unit}
    with context.write("design.h5") as artifact:
        write_design(artifact, result, summary)
    report.describe(context.report, result, summary)
    kept.clear()
    return {**summary, "seconds": time.perf_counter() - began}


def _problem(context: StageContext) -> str:
    """Return everything that the result for a law depends on, as text: inputs, settings, seed and version."""
    from mrpipe import __version__

    provenance = context.provenance
    return f"{sorted(provenance.content.items())}|{provenance.config}|{provenance.seed}|{__version__}"


def _uncertainty(context: StageContext, rig: Rig) -> tuple[FrameUncertainty, DamperUncertainty]:
    from mrpipe.law_design.identified import damper_uncertainty, frame_uncertainty, traced_damper_uncertainty
    from mrpipe.law_design.uncertainty import DamperUncertainty, FrameUncertainty

    simulate = context.settings.simulate
    frame = FrameUncertainty.none(rig.frame.floors)
    if simulate.frame == "identified":
        frame = frame_uncertainty(context.artifact("identify-frame"), rig.frame)
    damper = DamperUncertainty.without_covariance()
    if simulate.damper == "identified":
        damper = damper_uncertainty(context.artifact("identify-damper"))
    elif simulate.damper == "traced":
        damper = traced_damper_uncertainty(context.artifact("identify-damper"), context.artifact("close-loop"))
    return frame, damper


def _check(settings: Any) -> None:
    """Check that laws, gains and quantities of the design are known, its band, and that damper and frame are there."""
    from mrpipe.law_design.problem import require_known
    from mrpipe.simulation.checks import require_models

    require_known(settings.design)
    require_models(settings.simulate)


STAGE = Stage(
    name="design",
    summary="Find the control law and gains whose largest response over frequency and amplitude is smallest.",
    run=_run,
    inputs=("identify-frame", "calibrate"),
    conditional_inputs=LOOP_INPUTS,
    after=("identify-damper", "train-inverse", "simulate", "resonance"),
    settings=("design", "simulate", "resonance", "calibrate.target_mode"),
    outputs=("design.h5",),
    check=_check,
)
