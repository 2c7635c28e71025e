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
    from mrpipe.control.neural import ReferenceNetwork
    from mrpipe.structures import Frame


FREQUENCIES = (0.625, 1.6)
"""Ratios of the lowest and the highest training frequency of nnc to the frequency of the free mode. This frequency is
in the middle of the range, because a network that cannot distinguish a slow large motion from a fast small one gives
the force for the middle.
"""

INPUT_NOISE = (0.002, 0.04)
"""Ratio of the noise on displacement and velocity in the training of nnc to the expected amplitude of each."""


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.control.assembly import expected_amplitude
    from mrpipe.control.calibration import balanced_weights, calibrate, validity_warnings
    from mrpipe.control.limits import limiting_modes, placement_warning
    from mrpipe.control.operation import forces_at
    from mrpipe.control.storage import calibration_to_json, write_calibration
    from mrpipe.dampers.model import read_tested
    from mrpipe.effects.damper import damper_named
    from mrpipe.modal.storage import doubts_of
    from mrpipe.reporting import calibrate as report
    from mrpipe.structures import floor_position, read_frame, storey_position

    settings = context.settings.calibrate
    identified = context.artifact("identify-frame")
    frame = read_frame(identified)
    for doubt in doubts_of(identified):
        context.warn(f"the structure of identify-frame may be wrong: {doubt}")
    damper = damper_named(settings.damper, {"identified": partial(context.artifact, "identify-damper")})
    _check_floor(settings.damper_floor, frame)
    place = storey_position if settings.damper_across_storey else floor_position
    position = place(frame.floors, settings.damper_floor)
    modes = limiting_modes(frame, position, settings.target_mode)
    amplitude = settings.expected_amplitude_m
    if amplitude is None:
        tested = read_tested(context.artifact("identify-damper")) if "identify-damper" in context.inputs else {}
        amplitude = expected_amplitude(damper, tested, modes)
    residual, largest = forces_at(damper, amplitude, modes)
    weights = balanced_weights(modes, residual, **settings.regulator.known())
    calibration = calibrate(frame, position, _options(settings, weights))
    if hardly := placement_warning(frame, modes):
        context.warn(hardly)
    for law, reason in calibration.skipped.items():
        context.warn(f"law {law} was skipped: {reason}")
    context.progress(0.3, "laws")
    for line in validity_warnings(
        calibration, amplitude_m=amplitude, residual_force_n=residual, largest_force_n=largest
    ):
        context.warn(line)
    rounding = settings.friction_rounding_share * (amplitude * modes.omega_0)
    reference = _train_reference(context, calibration, frame, amplitude, rounding) if _networks(calibration) else None
    with context.write("control.h5") as artifact:
        write_calibration(artifact, calibration, position, weights, reference, rounding, amplitude, residual)
    summary = calibration_to_json(calibration)
    if reference is not None:
        summary["laws"]["nnc"] |= _neural_summary(calibration, reference, amplitude)
    summary |= {
        "expected_amplitude_m": amplitude,
        "residual_force_n": residual,
        "largest_force_n": largest,
    }
    report.describe(context.report, frame, calibration, summary, amplitude, settings.map_points)
    return summary


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


def _train_reference(
    context: StageContext, calibration: Calibration, frame: Frame, amplitude: float, rounding_m_s: float
) -> ReferenceNetwork:
    import numpy as np

    from mrpipe.control.neural import ReferenceOptions, train_reference
    from mrpipe.structures import natural_modes

    settings = context.settings.calibrate
    neural = settings.neural
    omega = calibration.modes.omega_0
    free = omega / (2.0 * np.pi)
    others = np.delete(natural_modes(frame).angular_frequencies, settings.target_mode - 1)
    options = ReferenceOptions(
        alpha_n_m=calibration.laws["nnc"].gains.alpha_n_m,
        amplitudes_m=tuple(amplitude * np.geomspace(0.2, 2.0, neural.amplitudes)),
        frequencies_hz=tuple(free * np.geomspace(*FREQUENCIES, neural.frequencies)),
        rate_hz=neural.rate_hz,
        past_values=neural.past_values,
        hidden=neural.hidden,
        starts=neural.starts,
        iterations=neural.iterations,
        rounding_m_s=rounding_m_s,
        # what lies above a quarter of the rate is not motion to the network
        disturbances_rad_s=tuple(others[others < 0.5 * np.pi * neural.rate_hz]),
        disturbance_share=neural.disturbance_share,
        displacement_noise_m=INPUT_NOISE[0] * amplitude,
        velocity_noise_m_s=INPUT_NOISE[1] * amplitude * omega,
    )
    return train_reference(options, context.rng, lambda f, text="": context.progress(0.3 + 0.6 * f, f"nnc {text}"))


def _neural_summary(calibration: Calibration, reference: ReferenceNetwork, amplitude: float) -> dict[str, Any]:
    from mrpipe.control.linearisation import equivalent_stiffness, friction_stiffness
    from mrpipe.control.neural import network_force

    H = equivalent_stiffness(lambda x, v: network_force(reference.network, x, v), amplitude, calibration.modes.omega_0)
    wanted = friction_stiffness(calibration.laws["nnc"].gains.alpha_n_m)
    return {
        "architecture": reference.network.architecture,
        "training_nrmse": reference.training_nrmse,
        "verification_nrmse": reference.verification_nrmse,
        "equivalent_stiffness_n_m": H.real,
        "equivalent_loss_n_m": H.imag,
        "equivalent_error": abs(H - wanted) / abs(wanted),
    }


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
)
