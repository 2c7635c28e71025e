"""`calibrate`: limiting frequencies and the gains of every control law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.artifacts import FloatArray
    from mrpipe.control.calibration import Calibration, CalibrationOptions
    from mrpipe.control.lqg import Weights
    from mrpipe.control.neural import ReferenceNetwork
    from mrpipe.structures import Frame


FREQUENCIES = (0.625, 1.6)
"""Lowest and highest frequency that nnc learns, over that of the free mode, which lies in their middle: a network that
cannot tell a slow large motion from a quick small one answers for the middle."""

INPUT_NOISE = (0.002, 0.04)
"""Noise on displacement and velocity in the training of nnc, over the expected amplitude of each."""


def _run(context: StageContext) -> Mapping[str, Any]:
    import numpy as np

    from mrpipe.control.calibration import calibrate, validity_warnings
    from mrpipe.control.storage import calibration_to_json, write_calibration
    from mrpipe.dampers.model import read_damper
    from mrpipe.structures import floor_position, read_frame, storey_position

    settings = context.settings.calibrate
    frame = read_frame(context.artifact("identify-frame"))
    damper = read_damper(context.artifact("identify-damper"))
    _check_floor(settings.damper_floor, frame)
    place = storey_position if settings.damper_across_storey else floor_position
    position = place(frame.floors, settings.damper_floor)
    options = _options(settings)
    calibration = calibrate(frame, position, options)
    context.progress(0.3, "laws")
    amplitude = settings.expected_amplitude_m
    speed = amplitude * calibration.modes.omega_0
    forces = damper.quasi_static_force(speed, np.array([0.0, damper.drive_limit]))
    for line in validity_warnings(
        calibration, amplitude_m=amplitude, residual_force_n=float(forces[0]), largest_force_n=float(forces[1])
    ):
        context.warn(line)
    rounding = settings.friction_rounding_share * speed
    reference = _train_reference(context, calibration, frame, rounding)
    with context.write("control.h5") as artifact:
        write_calibration(artifact, calibration, position, options.weights, reference, rounding)
    summary = calibration_to_json(calibration)
    summary["laws"]["nnc"] |= _neural_summary(calibration, reference, amplitude)
    summary |= {"residual_force_n": float(forces[0]), "largest_force_n": float(forces[1])}
    _report(context, frame, position, calibration, summary)
    return summary


def _check_floor(floor: int, frame: Frame) -> None:
    from mrpipe.errors import UserError

    if floor > frame.floors:
        raise UserError(
            "calibrate.damper_floor", str(floor), f"the frame has {frame.floors} floors", f"1 to {frame.floors}"
        )


def _options(settings: Any) -> CalibrationOptions:
    from mrpipe.control.calibration import THESIS_GAINS, CalibrationOptions
    from mrpipe.control.controller import Gains

    overrides = {}
    for law in ("vd", "vdps", "vdns", "fdns"):
        given = {key: value for key, value in getattr(settings, law).model_dump().items() if value is not None}
        if given:
            known = THESIS_GAINS[law]
            base = {key: getattr(known, key) for key in ("c_n_s_m", "k_n_m", "alpha_n_m")}
            overrides[law] = Gains(**{**base, **given})
    if "fdns" in overrides:
        overrides["nnc"] = overrides["fdns"]
    return CalibrationOptions(
        mode=settings.target_mode,
        source=settings.gains,
        positive_stiffness_n_m=settings.positive_stiffness_n_m,
        negative_stiffness_n_m=settings.negative_stiffness_n_m,
        overrides=overrides,
        weights=_weights(settings.regulator),
    )


def _weights(regulator: Any) -> Weights:
    from mrpipe.control.lqg import Weights

    return Weights(
        energy=regulator.energy_weight,
        top_displacement=regulator.top_displacement_weight,
        force=regulator.force_weight,
        ground_noise_m_s2=regulator.ground_noise_m_s2,
        force_noise_n=regulator.force_noise_n,
    )


def _train_reference(
    context: StageContext, calibration: Calibration, frame: Frame, rounding_m_s: float
) -> ReferenceNetwork:
    import numpy as np

    from mrpipe.control.neural import ReferenceOptions, train_reference
    from mrpipe.structures import natural_modes

    settings = context.settings.calibrate
    neural = settings.neural
    amplitude, omega = settings.expected_amplitude_m, calibration.modes.omega_0
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
        # what lies above a quarter of the rate is no motion to the network
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


def _report(
    context: StageContext, frame: Frame, position: FloatArray, calibration: Calibration, summary: Mapping[str, Any]
) -> None:
    import pandas as pd

    modes = calibration.modes
    context.report.text(
        f"Mode {modes.mode}: {modes.omega_0:.3f} rad/s free, {modes.omega_inf:.3f} rad/s with the damper locked, modal "
        f"flexibility {modes.nu:.4g} m/N, static stiffness at the damper {calibration.static_stiffness_n_m:.0f} N/m."
    )
    rows = [
        {"law": law, **{key: value for key, value in entry.items() if isinstance(value, float | int)}}
        for law, entry in summary["laws"].items()
    ]
    context.report.table("laws", pd.DataFrame(rows), "Gains and damping of every law; friction by its equivalent.")
    sources = [
        {"law": law, "source": source, **gains}
        for law, entry in summary["laws"].items()
        for source, gains in entry["candidates"].items()
    ]
    context.report.table(
        "candidates",
        pd.DataFrame(sources),
        "Gains as the thesis ran them, by closed form, and of best exact damping.",
    )
    for warning in context.warnings:
        context.report.text(f"Warning: {warning}.")
    _maps(context, frame, position, calibration)


def _maps(context: StageContext, frame: Frame, position: FloatArray, calibration: Calibration) -> None:
    import numpy as np

    from mrpipe.control import exact, limits
    from mrpipe.control.linearisation import clipped_force, friction_stiffness
    from mrpipe.reporting import control as figures

    points = context.settings.calibrate.map_points
    modes, bare = calibration.modes, exact.undamped(frame)
    optimum = limits.optimal_viscosity(modes)
    c = np.linspace(optimum / points, 2.0 * optimum, points)
    k = np.linspace(-1.1 * calibration.static_stiffness_n_m, calibration.static_stiffness_n_m, points)
    laws = calibration.laws
    over_c = np.array([exact.exact_damping(bare, position, modes, float(value), 0.0).damping_ratio for value in c])
    estimate = np.array([limits.damping_estimate(modes, 0.0, value * modes.omega_0) for value in c])
    marks = {"vd as run": (laws["vd"].gains.c_n_s_m, laws["vd"].damping_ratio_exact)}
    context.report.figure(
        "viscosity", figures.damping_over_gain(c, over_c, estimate, marks, "c [N s/m]"), "Viscous damping."
    )
    alpha = np.linspace(1.5 / modes.nu / points, 1.5 / modes.nu, points)
    H = [friction_stiffness(float(value)) for value in alpha]
    context.report.figure(
        "friction",
        figures.damping_over_gain(
            alpha,
            exact.friction_map(bare, position, modes, alpha),
            np.array([limits.damping_estimate(modes, item.real, item.imag) for item in H]),
            {"fdns as run": (laws["fdns"].gains.alpha_n_m, laws["fdns"].damping_ratio_exact)},
            "alpha [N/m]",
        ),
        "Friction with negative stiffness, by its equivalent.",
    )
    context.progress(0.95, "maps")
    context.report.figure(
        "map",
        figures.damping_over_gains(
            c,
            k,
            exact.damping_map(bare, position, modes, c, k),
            {law: (laws[law].gains.c_n_s_m, laws[law].gains.k_n_m) for law in ("vd", "vdps", "vdns")},
            calibration.static_stiffness_n_m,
        ),
        "Exact damping over viscosity and stiffness of an unclipped device; white: the structure folds.",
    )
    amplitude = context.settings.calibrate.expected_amplitude_m
    phase = np.linspace(0.0, 2.0 * np.pi, 721)
    x, v = amplitude * np.sin(phase), amplitude * modes.omega_0 * np.cos(phase)
    loops = {
        law: (x, clipped_force(laws[law].gains.c_n_s_m, laws[law].gains.k_n_m, x, v)) for law in ("vd", "vdps", "vdns")
    }
    loops["fdns"] = (x, laws["fdns"].gains.alpha_n_m * (np.sign(v) * amplitude - x))
    context.report.figure("loops", figures.law_loops(loops), "Desired force (thesis Figure 5.5).")


STAGE = Stage(
    name="calibrate",
    summary="Compute the limiting frequencies and the gains of every control law.",
    run=_run,
    inputs=("identify-frame", "identify-damper"),
    settings=("calibrate",),
    outputs=("control.h5",),
)
