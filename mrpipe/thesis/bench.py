"""What the ledger computes with: the structure, damper, controllers and networks of a run, or parameter sets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, load_parameter_set
from mrpipe.control.assembly import ControllerFactory, calibrated_from
from mrpipe.control.calibration import CalibrationOptions, balanced_weights, calibrate
from mrpipe.control.limits import limiting_modes
from mrpipe.control.settings import ControllerSettings
from mrpipe.dampers.model import DamperModel, damper_from_parameter_set
from mrpipe.effects.damper import read_damper
from mrpipe.simulation import Excitation, LoopOptions, Response, harmonic
from mrpipe.simulation.adjustment import adjusted_amplitude
from mrpipe.simulation.indices import indices
from mrpipe.simulation.rig import Rig, read_rig
from mrpipe.simulation.sensors import SensorNoise
from mrpipe.simulation.settings import SimulateSettings
from mrpipe.structures import Frame, floor_position
from mrpipe.thesis.entries import printed_columns, printed_gains

OMEGA = 8.0
"""Frequency at which the simulated column of Table 5.1 was made [rad/s]: a5/x5 of vd is its square (errata row 23)."""
SWITCH_N = 18.0
LAWS = ("vd", "vdps", "vdns", "fdns")
CYCLES = 40
DECAY_S = 6.0


def reference_rms_top_m() -> float:
    """Return the rms top displacement of vd that sets the amplitude of Table 5.1 [m]."""
    return printed_columns("Table 5.1", "T5.1s")["vd"]["rms_x5_m"]


@dataclass(frozen=True)
class Bench:
    """Structure, damper, controllers and networks with which the ledger computes.

    Attributes
    ----------
    source
        Words that say where it comes from.
    rig
        Frame, damper, controllers and options of the loop.
    traced
        The same loop with the damper that the tracing found, under the same controllers; None where nothing was
        traced.
    artifacts
        Stage -> its artifact; empty without a run.
    seed
        Seed of the sensor noise.
    """

    source: str
    rig: Rig
    traced: Rig | None = None
    artifacts: Mapping[str, Artifact] = field(default_factory=dict)
    seed: int = 0

    def artifact(self, stage: str) -> Artifact | None:
        """Return the artifact of a stage of the run, or None."""
        return self.artifacts.get(stage)

    @property
    def laws(self) -> tuple[str, ...]:
        """The laws of Table 5.1 and `nnc` where its network was trained."""
        return (*LAWS, "nnc") if self.rig.controllers.calibrated.reference is not None else LAWS


def perfect(rig: Rig) -> Rig:
    """Return the loop with a damper that gives every dissipative force, and perfect sensors."""
    return replace(rig, options=replace(rig.options, tracking="ideal", noise=SensorNoise(), record_rate_hz=2000.0))


def with_damper(rig: Rig, damper: DamperModel) -> Rig:
    """Return the loop with another damper under controllers that know that damper exactly."""
    return replace(rig, damper=damper, controllers=replace(rig.controllers, damper=damper, inverse=None))


def bench_of_run(settings: SimulateSettings, artifacts: Mapping[str, Artifact], seed: int) -> Bench:
    """Return the bench of a run.

    Parameters
    ----------
    settings
        Settings of the simulation. The damper is always the identified one, and it gives the force.
    artifacts
        Stage -> artifact: identify-frame, identify-damper, calibrate, train-inverse and what else there is.
    seed
        Seed of the run.
    """
    chosen = settings.changed(damper="identified", tracking="damper")
    artifact: Callable[[str], Artifact] = lambda stage: artifacts[stage]  # noqa: E731
    rig = read_rig(chosen, artifact)
    traced = None
    if "close-loop" in artifacts:
        # the controllers know the identified damper, not what the tracing has found since
        traced = replace(rig, damper=read_damper(artifacts["close-loop"]))
    return Bench("this run", rig, traced, artifacts, seed)


def bench_of_sets(frame: Frame) -> Bench:
    """Return the bench without a run: a frame, damper set C with its exact inverse, and the gains of the thesis."""
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    position = floor_position(frame.floors)
    calibration = calibrate(
        frame,
        position,
        CalibrationOptions(
            source="published",
            published=printed_gains(),
            positive_stiffness_n_m=printed_gains()["vdps"]["k_n_m"],
            negative_stiffness_n_m=printed_gains()["vdns"]["k_n_m"],
        ),
    )
    weights = balanced_weights(frame, position, limiting_modes(frame, position))
    settings = ControllerSettings(inverse="model", residual_force_n=SWITCH_N)
    calibrated = calibrated_from(calibration, weights, damper, amplitude_m=9.3e-3)
    rig = Rig(frame, damper, ControllerFactory(frame, damper, calibrated, settings), LoopOptions())
    return Bench("frame and damper set C with its exact inverse, without a run", rig)


@dataclass(frozen=True)
class LoopRun:
    """One law under harmonic motion of the base that stops: response, excitation and indices."""

    response: Response
    excitation: Excitation
    indices: Mapping[str, Any]


def excite(
    amplitude_m_s2: float, omega: float = OMEGA, *, cycles: int = CYCLES, decay_s: float = DECAY_S
) -> Excitation:
    """Return the harmonic motion of the base that all runs of the ledger share."""
    return harmonic(amplitude_m_s2, omega, cycles=cycles, settling_cycles=cycles // 2, decay_s=decay_s)


def amplitude_of(rig: Rig, rms_top_m: float, omega: float = OMEGA) -> float:
    """Return the base amplitude at which vd gives an rms top displacement [m/s^2]."""
    viscous = rig.controller("vd")
    options = replace(rig.options, noise=SensorNoise(), fault=None)
    amplitude, _, _ = adjusted_amplitude(
        rig.frame,
        rig.damper.chain(),
        viscous,
        lambda level: excite(level, omega, decay_s=0.0),
        options,
        position=rig.position,
        rms_top_m=rms_top_m,
    )
    return amplitude


def run_law(rig: Rig, law: str, excitation: Excitation, seed: int = 0, **gains: float) -> LoopRun:
    """Run a law with its calibrated gains; `gains` changes some of them."""
    chosen = rig.controllers.calibrated.gains_of(law).changed(**gains)
    response = rig.run(rig.controller(law, chosen), excitation, rng=np.random.default_rng(seed))
    judged = indices(response, excitation, residual_force_n=rig.residual_force_n, drive_limit=rig.damper.drive_limit)
    return LoopRun(response, excitation, judged)
