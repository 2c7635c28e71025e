"""`calibrate`: limiting frequencies and the gains of every control law."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.config.sections.calibrate import CalibrateSettings
    from mrpipe.control.calibration import Calibration, CalibrationOptions
    from mrpipe.control.lqg import Weights
    from mrpipe.control.neural import ReferenceNetwork, ReferenceOptions
    from mrpipe.structures import Frame


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.control.assembly import expected_amplitude
    from mrpipe.control.calibration import balanced_weights, calibrate
    from mrpipe.control.limits import limiting_modes, placement_warning
    from mrpipe.control.neural import reference_options
    from mrpipe.control.operation import forces_at
    from mrpipe.control.storage import calibration_to_json, write_calibration
    from mrpipe.control.validity import force_demands, validity_warnings
    from mrpipe.effects.damper import damper_named
    from mrpipe.modal.storage import doubts_of
    from mrpipe.reporting import calibrate as report
    from mrpipe.structures import floor_position, read_frame, storey_position

    settings = context.settings.calibrate
    identified = context.artifact("identify-frame")
    frame = read_frame(identified)
    for doubt in doubts_of(identified):
        context.warn(f"the structure of identify-frame may be wrong: {doubt}")
    damper = damper_named(
        settings.damper, {"identified": partial(context.artifact, "identify-damper")}, "calibrate.damper"
    )
    _check_floor(settings.damper_floor, frame)
    place = storey_position if settings.damper_across_storey else floor_position
    position = place(frame.floors, settings.damper_floor)
    modes = limiting_modes(frame, position, settings.target_mode)
    amplitude = settings.expected_amplitude_m
    if amplitude is None:
        amplitude = expected_amplitude(damper, _tested(context), modes)
    residual, largest = forces_at(damper, amplitude, modes)
    weights = balanced_weights(frame, position, modes, residual, **settings.regulator.known())
    calibration = calibrate(frame, position, _options(settings, weights))
    if hardly := placement_warning(frame, modes):
        context.warn(hardly)
    for law, reason in calibration.skipped.items():
        context.warn(f"law {law} was skipped: {reason}")
    context.progress(0.3, "laws")
    demands = force_demands(calibration, amplitude_m=amplitude, residual_force_n=residual, largest_force_n=largest)
    for line in validity_warnings(calibration, demands):
        context.warn(line)
    rounding = settings.friction_rounding_share * (amplitude * modes.omega_0)
    reference = None
    if _networks(calibration):
        alpha = calibration.laws["nnc"].gains.alpha_n_m
        trained = reference_options(settings.neural, alpha, frame, modes, amplitude, rounding)
        reference = _reference(context, trained)
    with context.write("control.h5") as artifact:
        write_calibration(artifact, calibration, position, weights, reference, rounding, amplitude, residual)
    summary = calibration_to_json(calibration)
    if reference is not None:
        summary["laws"]["nnc"] |= reference.assessment(alpha, amplitude, modes.omega_0)
    summary |= {
        "expected_amplitude_m": amplitude,
        "residual_force_n": residual,
        "largest_force_n": largest,
        "force_demands": {law: demand.as_json() for law, demand in demands.items()},
    }
    report.describe(context.report, frame, calibration, summary, amplitude, settings.map_points)
    return summary


def _tested(context: StageContext) -> dict[str, float]:
    """Return the ranges of the bench tests; empty if the damper was not identified on a bench."""
    from mrpipe.dampers.model import read_tested

    return read_tested(context.artifact("identify-damper")) if "identify-damper" in context.inputs else {}


def _reference(context: StageContext, options: ReferenceOptions) -> ReferenceNetwork:
    """Train the network of the law nnc."""
    from mrpipe.control.neural import train_reference

    return train_reference(options, context.rng, lambda f, text="": context.progress(0.3 + 0.6 * f, f"nnc {text}"))


def _check_floor(floor: int, frame: Frame) -> None:
    from mrpipe.errors import UserError

    if floor > frame.floors:
        raise UserError(
            "calibrate.damper_floor", str(floor), f"the frame has {frame.floors} floors", f"1 to {frame.floors}"
        )


def _options(settings: CalibrateSettings, weights: Weights) -> CalibrationOptions:
    from mrpipe.control.calibration import CalibrationOptions
    from mrpipe.control.laws import law_names

    overrides = {law: settings.given(law) for law in law_names()}
    # nnc imitates fdns and therefore has the gains of fdns
    overrides["nnc"] = overrides["nnc"] or overrides["fdns"]
    return CalibrationOptions(
        mode=settings.target_mode,
        source=settings.gains,
        published=settings.published,
        positive_stiffness_n_m=settings.positive_stiffness_n_m,
        negative_stiffness_n_m=settings.negative_stiffness_n_m,
        overrides=overrides,
        weights=weights,
    )


def _networks(calibration: Calibration) -> bool:
    from mrpipe.control.laws import law_named

    return any("network" in law_named(law).needs for law in calibration.laws)


def _check(settings: Any) -> None:
    """Check that the damper is there."""
    from mrpipe.effects.damper import require_damper

    require_damper(settings.calibrate.damper, "calibrate.damper", ("identified",))


STAGE = Stage(
    name="calibrate",
    summary="Compute the limiting frequencies and the gains of every control law.",
    run=_run,
    inputs=("identify-frame",),
    # a damper from a file with a given amplitude needs no bench
    conditional_inputs=(
        ("calibrate.damper", "identified", "identify-damper"),
        ("calibrate.expected_amplitude_m", None, "identify-damper"),
    ),
    settings=("calibrate",),
    outputs=("control.h5",),
    check=_check,
)
