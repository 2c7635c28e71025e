"""`calibrate` for a structure with several dampers: each has its own place, brace, law and gains.

This stage replaces the stage for one damper if the configuration has `structure.dampers`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.loop_inputs import variant_for_dampers
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.control.assembly import expected_amplitude
    from mrpipe.control.calibration import CalibrationOptions, balanced_weights
    from mrpipe.control.limits import placement_warning
    from mrpipe.control.placed import calibrate_placed, modes_together, placed_warnings
    from mrpipe.control.placed_storage import (
        accelerometers_of,
        damper_as_json,
        placed_dampers,
        together_as_json,
        write_placed,
    )
    from mrpipe.dampers.model import read_tested
    from mrpipe.reporting import several_dampers as report
    from mrpipe.simulation.several_rig import damper_model
    from mrpipe.structures import read_frame

    settings, entries = context.settings.calibrate, context.settings.structure.dampers
    frame = read_frame(context.artifact("identify-frame"))
    dampers = [
        replace(item, gains={**settings.given(item.law), **(item.gains or {})})
        for item in placed_dampers(frame, entries, settings.target_mode)
    ]
    accelerometers_of(frame, context.settings.structure.accelerometers)  # so that a wrong name is reported here
    options = CalibrationOptions(
        source=settings.gains,
        published=settings.published,
        positive_stiffness_n_m=settings.positive_stiffness_n_m,
        negative_stiffness_n_m=settings.negative_stiffness_n_m,
    )
    found = calibrate_placed(frame, dampers, options, together=settings.together)
    context.progress(0.8, "forces")
    tested = read_tested(context.artifact("identify-damper")) if "identify-damper" in context.inputs else {}
    rows, weights = [], []
    for entry, item in zip(entries, found, strict=True):
        model = damper_model(entry, settings.damper, context.artifact)
        amplitude = entry.expected_amplitude_m or settings.expected_amplitude_m
        if amplitude is None:
            known = tested if (entry.damper or settings.damper) == "identified" else {}
            amplitude = expected_amplitude(model, known, item.modes)
        speed = amplitude * item.modes.omega_0
        residual, largest = (float(model.quasi_static_force(speed, drive)) for drive in (0.0, model.drive_limit))
        rows.append(damper_as_json(item, amplitude, residual, settings.friction_rounding_share * speed))
        weights.append(balanced_weights(item.modes, residual, **settings.regulator.known()))
        if entry.target_mode is None and item.damper.mode != settings.target_mode:
            context.warn(
                f"{item.damper.name}: mode {settings.target_mode} does not move this damper, so that it is calibrated "
                f"for mode {item.damper.mode}"
            )
        if hardly := placement_warning(frame, item.modes):
            context.warn(f"{item.damper.name}: {hardly}")
        for line in placed_warnings(item, amplitude_m=amplitude, residual_force_n=residual, largest_force_n=largest):
            context.warn(line)
    modes = sorted({item.damper.mode for item in found} | set(range(1, min(frame.floors, 3) + 1)))
    summary = {
        "dampers": rows,
        "together": together_as_json(frame, modes_together(frame, found, modes), modes),
        "alone": together_as_json(frame, modes_together(frame, found, modes, alone=True), modes),
    }
    with context.write("control.h5") as artifact:
        write_placed(artifact, found, weights, summary)
    report.describe_calibration(context.report, summary)
    return summary


VARIANTS = (
    Stage(
        name="calibrate",
        summary="Compute the gains of several dampers, each alone and all together.",
        run=_run,
        inputs=("identify-frame",),
        settings=("calibrate", "structure"),
        outputs=("control.h5",),
    ),
)


def variant(configuration: RunSettings, _: str = "") -> Stage | None:
    """Return the stage if the configuration has several dampers, else None."""
    return variant_for_dampers(VARIANTS[0], configuration)
