"""`simulate --law LAW`: the closed loop under one control law; a stage a law."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.stages.simulate_ranges import check_ranges, ranges_as_json, report_ranges

if TYPE_CHECKING:
    from mrpipe.artifacts import FloatArray
    from mrpipe.control.controller import Controller, Gains
    from mrpipe.control.inverse import InverseTable
    from mrpipe.dampers.model import DamperModel
    from mrpipe.networks.network import Network
    from mrpipe.simulation.excitation import Excitation
    from mrpipe.simulation.loop import LoopOptions, Response
    from mrpipe.structures import Frame

RATES_HZ = (200.0, 500.0)
"""The two rates of the controller that the thesis prints: with the damper, and for a perfect one."""

RECORD_RATE_HZ = 1000.0
"""Of the histories, where settings do not say; all plant steps with a perfect damper, whose force jumps."""

PERFECT_ROUNDING = 1.5
"""Rounding of friction for a perfect damper over that with a damper, whose yielding rounds it besides."""

LAWS = ("vd", "vdps", "vdns", "fdns", "nnc", "lqg", "passive-off", "passive-on")


@dataclass(frozen=True)
class Rig:
    """What the settings and the artifacts come to."""

    frame: Frame
    damper: DamperModel
    position: FloatArray
    options: LoopOptions


def simulate_stage(law: str) -> Stage:
    """Return the stage that runs the loop under `law`."""
    return Stage(
        name=f"simulate-{law}",
        summary=f"Run the closed loop under law {law}.",
        run=lambda context: _run(context, law),
        inputs=("identify-frame", "identify-damper", "calibrate", "train-inverse"),
        settings=("simulate",),
        family="simulate",
        outputs=(f"response-{law}.h5",),
    )


def _run(context: StageContext, law: str) -> Mapping[str, Any]:
    from mrpipe.simulation.indices import indices
    from mrpipe.simulation.loop import simulate_law
    from mrpipe.simulation.storage import write_response

    settings = context.settings.simulate
    rig = _rig(context)
    control = controller(context, law, rig.frame, rig.damper, perfect=rig.options.tracking == "ideal")
    excitation, viscous = excitation_of(context, rig)
    context.progress(0.4, f"loop under {law}")
    response = simulate_law(
        rig.frame,
        rig.damper.chain(),
        control,
        excitation,
        rig.options,
        position=rig.position,
        rng=context.rng,
        initial_state=_release(settings.excitation, rig),
    )
    residual = float(rig.damper.quasi_static_force(0.05, 0.0))
    limit = settings.controller.drive_limit or rig.damper.drive_limit
    absolute = settings.accelerations == "absolute"
    values = indices(response, excitation, residual_force_n=residual, drive_limit=limit, absolute=absolute)
    if values["energy_balance_error"] > 5e-3:
        context.warn(f"energy balance is off by {values['energy_balance_error']:.2%}: raise simulate.plant_rate_hz")
    against = None
    if viscous is not None:
        against = indices(viscous, excitation, residual_force_n=residual, drive_limit=limit, absolute=absolute)
        values["rms_x_top_over_vd"] = values["rms_x_top_m"] / against["rms_x_top_m"]
    ranges = check_ranges(context, rig, control, response)
    with context.write(f"response-{law}.h5") as artifact:
        write_response(artifact, response, rig.damper.drive_unit)
        # wall-clock time is printed, not stored: the same inputs give the same artifact
        artifact.put_json("indices", {key: value for key, value in values.items() if key != "real_time_factor"})
        artifact.put_json("training_range", ranges_as_json(ranges))
        artifact.put_json("excitation", excitation.details)
        artifact.attributes("/", law=law)
    _report(context, law, rig, response, excitation, values, against)
    report_ranges(context, ranges)
    details = {"excitation": excitation.details, "drive_unit": rig.damper.drive_unit}
    return {"law": law, **values, **details, "training_range": ranges_as_json(ranges)}


def _rig(context: StageContext) -> Rig:
    from mrpipe.artifacts import load_parameter_set
    from mrpipe.dampers.model import damper_from_parameter_set, read_damper
    from mrpipe.errors import UserError
    from mrpipe.structures import frame_from_parameter_set, read_frame

    settings = context.settings.simulate
    if settings.frame == "identified":
        frame = read_frame(context.artifact("identify-frame"))
    else:
        frame = frame_from_parameter_set(settings.frame)
    if settings.damper == "identified":
        damper = read_damper(context.artifact("identify-damper"))
    else:
        damper = damper_from_parameter_set(load_parameter_set("dampers", settings.damper))
    position = context.artifact("calibrate").array("position")
    if len(position) != frame.floors:
        raise UserError(
            "simulate.frame", settings.frame, f"has {frame.floors} floors", f"calibrated for {len(position)}"
        )
    return Rig(frame, damper, position, loop_options(context))


def loop_options(context: StageContext) -> LoopOptions:
    """Return how the loop is run, from the settings."""
    from mrpipe.simulation.loop import LoopOptions, SensorNoise

    settings = context.settings.simulate
    sensors = settings.sensors
    perfect = settings.tracking != "damper"
    noise = SensorNoise(sensors.displacement_noise_m, sensors.acceleration_noise_m_s2, sensors.acceleration_bias_m_s2)
    return LoopOptions(
        plant_rate_hz=settings.plant_rate_hz,
        tracking=settings.tracking,
        delay_s=settings.controller.delay_s,
        driver_time_constant_s=settings.driver_time_constant_s,
        noise=SensorNoise() if perfect else noise,
        record_rate_hz=settings.record_rate_hz or (settings.plant_rate_hz if perfect else RECORD_RATE_HZ),
    )


def controller(
    context: StageContext,
    law: str,
    frame: Frame,
    damper: DamperModel,
    gains: Gains | None = None,
    *,
    perfect: bool = False,
    inverse: Network | InverseTable | None = None,
    residual_force_n: float | None = None,
    reference_factor: float = 1.0,
) -> Controller:
    """Return the controller of a law as the settings of simulate.controller say.

    Parameters
    ----------
    context
        Of the stage.
    law, frame, damper
        What it controls.
    gains, inverse, residual_force_n
        In place of the calibrated gains, of the inverse, and of the force below which the drive is 0 [N].
    reference_factor
        On the force of nnc.
    perfect
        For a perfect damper and perfect sensors: it reads the velocity, and at 500 Hz where the rate is not given.
    """
    import math
    from dataclasses import replace

    from mrpipe.control.controller import PASSIVE, ControllerOptions, Gains, build_controller
    from mrpipe.control.inverse import inverse_table
    from mrpipe.control.lqg import lqg_observer
    from mrpipe.control.storage import read_gains, read_reference, read_weights
    from mrpipe.networks.network import read_network

    settings = context.settings.simulate.controller
    calibrated = context.artifact("calibrate")
    rounding = settings.friction_rounding_m_s
    if rounding is None:
        rounding = calibrated.scalar("friction_rounding")
    if perfect:
        given = context.settings.simulate.ideal_rounding_m_s
        rounding = PERFECT_ROUNDING * rounding if given is None else given
    rate = settings.rate_hz or RATES_HZ[perfect]
    options = ControllerOptions(
        rate_hz=rate,
        velocity="measured" if perfect else settings.velocity,
        displacement_noise_m=settings.kalman_displacement_noise_m,
        acceleration_noise_m_s2=settings.kalman_acceleration_noise_m_s2,
        bias_drift_m_s2=settings.kalman_bias_drift_m_s2,
        inverse_request=settings.inverse_request,
        residual_force_n=settings.residual_force_n if residual_force_n is None else residual_force_n,
        low_pass_hz=settings.low_pass_hz,
        drive_limit=settings.drive_limit or damper.drive_limit,
        dead_band_m_s=settings.dead_band_m_s,
        extremum_step_m=settings.extremum_step_m,
        friction_rounding_m_s=rounding,
        extremum_share=settings.extremum_share,
        extremum_memory_s=settings.extremum_memory_periods * 2.0 * math.pi / calibrated.scalar("omega_0"),
    )
    if inverse is None and settings.inverse == "network":
        inverse = read_network(context.artifact("train-inverse"), "network")
    elif inverse is None:
        inverse = inverse_table(damper, drive_limit=settings.drive_limit)
    if gains is None:
        gains = Gains() if law in PASSIVE else read_gains(calibrated, law)
    observer = None
    if law == "lqg":
        observer = lqg_observer(frame, calibrated.array("position"), read_weights(calibrated), 1.0 / rate)
    reference = None
    if law == "nnc":
        # its force is proportional to alpha, whatever the network looks like inside
        known = read_reference(calibrated)
        reference = replace(
            known,
            output_scale=reference_factor * known.output_scale,
            output_shift=reference_factor * known.output_shift,
        )
    return build_controller(law, gains, options, inverse=inverse, reference=reference, observer=observer)


def excitation_of(context: StageContext, rig: Rig) -> tuple[Excitation, Response | None]:
    """Return the excitation and, where its amplitude was adjusted, the response of vd to it."""
    from mrpipe.simulation import excitation as kinds

    settings = context.settings.simulate.excitation
    factor = settings.factor
    if settings.kind == "recorded":
        return _recorded(settings), None
    if settings.kind == "free-decay":
        return kinds.at_rest(settings.decay_s), None
    omega = settings.frequency_rad_s or context.artifact("calibrate").scalar("omega_0")

    def harmonic(amplitude: float) -> Excitation:
        return kinds.harmonic(
            amplitude,
            omega,
            cycles=settings.cycles,
            settling_cycles=min(settings.settling_cycles, settings.cycles - 1),
            ramp_cycles=settings.ramp_cycles,
            decay_s=settings.decay_s,
        )

    amplitude, viscous = settings.base_amplitude_m_s2, None
    if amplitude is None:
        amplitude, viscous = _adjusted(context, rig, harmonic)
        viscous = viscous if factor == 1.0 and settings.kind == "harmonic" else None
    if settings.kind == "sweep":
        sweep = kinds.sweep(factor * amplitude, settings.sweep_first_hz, settings.sweep_last_hz, settings.sweep_s)
        return sweep, None
    return harmonic(factor * amplitude), viscous


def _adjusted(
    context: StageContext, rig: Rig, harmonic: Callable[[float], Excitation]
) -> tuple[float, Response | None]:
    from dataclasses import replace

    from mrpipe.control.controller import Gains
    from mrpipe.simulation.adjustment import adjusted_amplitude
    from mrpipe.simulation.loop import SensorNoise

    settings = context.settings.simulate.excitation
    tracking = rig.options.tracking
    if settings.adjust_with == "ideal" and tracking == "damper":
        tracking = "ideal"
    options = replace(rig.options, noise=SensorNoise(), tracking=tracking)
    gains = Gains(c_n_s_m=settings.reference_c_n_s_m)
    viscous = controller(context, "vd", rig.frame, rig.damper, gains, perfect=tracking == "ideal")
    amplitude, response = adjusted_amplitude(
        rig.frame,
        rig.damper.chain(),
        viscous,
        harmonic,
        options,
        position=rig.position,
        rms_top_m=settings.reference_rms_top_m,
    )
    return amplitude, response if options.tracking == rig.options.tracking else None


def _recorded(settings: Any) -> Excitation:
    from pathlib import Path

    from mrpipe.simulation.excitation import recorded
    from mrpipe.simulation.ground_record import read_ground_record

    time_s, acceleration = read_ground_record(Path(settings.file), settings.file_unit)
    return recorded(time_s, acceleration, scale=settings.factor)


def _release(settings: Any, rig: Rig) -> FloatArray | None:
    """Return the initial state of a free decay: the first mode with the given top displacement, at rest."""
    if settings.kind != "free-decay":
        return None
    import numpy as np

    from mrpipe.structures import natural_modes

    shape = natural_modes(rig.frame).mode_shapes[:, 0]
    return np.concatenate([settings.release_top_m * shape / shape[-1], np.zeros(rig.frame.floors)])


def _report(
    context: StageContext,
    law: str,
    rig: Rig,
    response: Response,
    excitation: Excitation,
    values: Mapping[str, Any],
    viscous: Mapping[str, Any] | None,
) -> None:
    import numpy as np

    from mrpipe.reporting import simulation as figures
    from mrpipe.simulation.indices import FLOWING, decay_damping

    context.report.text(_words(law, excitation, values))
    context.report.table("indices", _table(law, values, viscous), "Indices beside vd and what is printed (SI).")
    last = excitation.steady_s[1]
    cycle = 2.0 * np.pi / excitation.frequency_rad_s if np.isfinite(excitation.frequency_rad_s) else last / 4.0
    shown = (response.time_s >= last - 4.0 * cycle) & (response.time_s < last)
    loops = figures.loops(
        response.damper_displacement[shown],
        response.damper_velocity[shown],
        response.force[shown],
        response.desired_force[shown],
        law,
    )
    context.report.figure("loops", loops, "Damper force in the last four cycles.")
    context.report.figure(
        "histories",
        figures.histories(
            response.time_s,
            response.displacement[:, -1],
            response.damper_displacement,
            response.force,
            response.desired_force,
            response.drive,
            rig.damper.drive_unit,
        ),
        "Histories.",
    )
    context.report.figure(
        "energy",
        figures.energies(response.time_s, response.work_in, response.work_damper, response.work_frame),
        f"Energies; the balance closes to {values['energy_balance_error']:.1e}.",
    )
    if np.isfinite(excitation.decay_from_s):
        decay = decay_damping(response, excitation.decay_from_s, FLOWING * rig.damper.drive_limit)
        after = response.time_s >= excitation.decay_from_s
        context.report.figure(
            "decay",
            figures.decay(
                response.time_s[after],
                response.displacement[after, -1],
                decay.peak_time_s,
                decay.peak_m,
                decay.point_to_point,
            ),
            "Free decay after the base stops (thesis Figure 5.7).",
        )


def _words(law: str, excitation: Excitation, values: Mapping[str, Any]) -> str:
    damping = values["damping_ratio"]
    decay = ""
    if damping is not None:
        low, high = values["damping_ratio_interval"]
        decay = f" Free decay: damping ratio {damping:.3f} while current flows; readings from {low:.3f} to {high:.3f}."
    return (
        f"Law {law}, {excitation.details['kind']} excitation: rms top displacement "
        f"{1e3 * values['rms_x_top_m']:.1f} mm, first floor {1e3 * values['rms_x1_m']:.1f} mm; "
        f"{values['switched_off_share']:.0%} of the time switched off, "
        f"{values['clipped_share']:.0%} clipped.{decay} Energy balance closed to {values['energy_balance_error']:.1e}; "
        f"{values['real_time_factor']:.0f} times real time."
    )


def _table(law: str, values: Mapping[str, Any], viscous: Mapping[str, Any] | None) -> Any:
    import pandas as pd

    from mrpipe.thesis.printed import PRINTED

    numbers = {key: value for key, value in values.items() if isinstance(value, float)}
    frame = pd.DataFrame({"index": list(numbers), law: list(numbers.values())})
    if viscous is not None:
        frame["vd"] = [viscous.get(key) for key in numbers]
        frame["over vd"] = [value / viscous[key] if viscous.get(key) else None for key, value in numbers.items()]
    for source, printed in PRINTED.get(law, {}).items():
        frame[source] = [printed.get(key) for key in numbers]
    return frame


STAGES = tuple(simulate_stage(law) for law in LAWS)
