"""`calibrate` for a structure with several dampers: each has its own place, brace, law and gains.

This stage replaces the stage for one damper if the configuration has `structure.dampers`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.loop_inputs import variant_for_dampers
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings
    from mrpipe.config.sections.calibrate import CalibrateSettings
    from mrpipe.control.placed import PlacedCalibration
    from mrpipe.dampers.model import DamperModel
    from mrpipe.structures import Frame
    from mrpipe.structures.options import DamperSettings


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.control.calibration import CalibrationOptions
    from mrpipe.control.operation import operation_of
    from mrpipe.control.placed import calibrate_placed
    from mrpipe.control.placed_storage import accelerometers_of, placed_dampers, write_placed
    from mrpipe.dampers.model import read_tested
    from mrpipe.modal.storage import doubts_of
    from mrpipe.reporting import several_dampers as report
    from mrpipe.simulation.several_dampers_rig import damper_model
    from mrpipe.structures import read_frame

    settings, entries = context.settings.calibrate, context.settings.structure.dampers
    identified = context.artifact("identify-frame")
    frame = read_frame(identified)
    for doubt in doubts_of(identified):
        context.warn(f"the structure of identify-frame may be wrong: {doubt}")
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
    operations = []
    for entry, item in zip(entries, found, strict=True):
        model = damper_model(entry, settings.damper, context.artifact)
        operation = operation_of(
            frame,
            item,
            model,
            _amplitude(settings, entry, model, item, tested),
            wanted_mode=entry.target_mode or settings.target_mode,
            rounding_share=settings.friction_rounding_share,
            regulator=settings.regulator,
        )
        operations.append(operation)
        for line in operation.warnings:
            context.warn(line)
    summary = {"dampers": [item.summary for item in operations], **_together(frame, found)}
    with context.write("control.h5") as artifact:
        write_placed(artifact, found, [item.weights for item in operations], summary)
    report.describe_calibration(context.report, summary)
    return summary


def _amplitude(
    settings: CalibrateSettings,
    entry: DamperSettings,
    model: DamperModel,
    item: PlacedCalibration,
    tested: Mapping[str, float],
) -> float:
    """Return the expected amplitude of a damper [m]: that of the settings, or one that follows from its tests."""
    from mrpipe.control.assembly import expected_amplitude

    given = entry.expected_amplitude_m or settings.expected_amplitude_m
    if given is not None:
        return given
    known = tested if (entry.damper or settings.damper) == "identified" else {}
    return expected_amplitude(model, known, item.modes)


def _together(frame: Frame, found: Sequence[PlacedCalibration]) -> dict[str, Any]:
    """Return the damping of the target modes and of the first three modes, with gains for all dampers and for each."""
    from mrpipe.control.placed import modes_together
    from mrpipe.control.placed_storage import together_as_json

    modes = sorted({item.damper.mode for item in found} | set(range(1, min(frame.floors, 3) + 1)))
    return {
        "together": together_as_json(frame, modes_together(frame, found, modes), modes),
        "alone": together_as_json(frame, modes_together(frame, found, modes, alone=True), modes),
    }


def _check(settings: Any) -> None:
    """Check that the laws, gains, models and places of the dampers are known, before anything is built."""
    from mrpipe.control.laws import law_named
    from mrpipe.control.placed_storage import require_law
    from mrpipe.effects.damper import require_damper
    from mrpipe.structures.given_storage import read_matrix
    from mrpipe.structures.named import require_places

    require_damper(settings.calibrate.damper, "calibrate.damper", ("identified",))
    for place, entry in enumerate(settings.structure.dampers):
        where = f"structure.dampers[{place}]"
        if entry.damper:
            require_damper(entry.damper, f"{where}.damper", ("identified",))
        require_law(entry, where)
        law_named(entry.law).require_gains(entry.gains or {}, f"{where}.gains")
    require_places(settings.structure, read_matrix)


VARIANTS = (
    Stage(
        name="calibrate",
        summary="Compute the gains of several dampers, each alone and all together.",
        run=_run,
        inputs=("identify-frame",),
        settings=("calibrate", "structure"),
        outputs=("control.h5",),
        check=_check,
    ),
)


def variant(configuration: RunSettings, _: str = "") -> Stage | None:
    """Return the stage if the configuration has several dampers, else None."""
    return variant_for_dampers(VARIANTS[0], configuration)
