"""The closed loop under every law: with the damper before, with its effects, and with a renewed controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from mrpipe.artifacts import Progress, no_progress
from mrpipe.control.controller import Controller
from mrpipe.control.gains import Gains
from mrpipe.control.inverse import InverseTable
from mrpipe.control.laws import law_named
from mrpipe.networks.network import Network
from mrpipe.signals.prepared import PreparedTest
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.rig import Rig, excitation_of
from mrpipe.simulation.settings import SimulateSettings
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.tracing.loop.augmented import (
    ForceInUse,
    changed_share,
    force_in_use,
    plant_chain,
    retrain_inverse,
)
from mrpipe.tracing.loop.band import Band, amplitude_of, best_way, curves_of, rank_over_band
from mrpipe.tracing.loop.comparison import (
    Arrangement,
    Bench,
    LoopRun,
    compare_laws,
    simulated_runs,
    with_unrecorded,
)
from mrpipe.tracing.loop.recalibration import gain_factor, switch_threshold
from mrpipe.tracing.rules import LoopRules
from mrpipe.words import in_percent


@dataclass(frozen=True)
class LoopStudy:
    """Inputs of the comparison in the closed loop.

    Attributes
    ----------
    rig
        Structure, controllers, and the damper without effects.
    traced
        The tracing: the damper without and with its effects.
    tests
        Prepared bench tests; an inverse network is retrained on their motions.
    settings
        Settings of the simulation.
    recorded
        Recordings of the closed loop; empty for none.
    laws
        Laws that are compared in addition to the recorded ones.
    band_rad_s
        Lowest and highest frequency over which the laws are ranked [rad/s].
    rng, seed, jobs, progress
        Randomness of a retrained inverse, seed of the sensor noise, processes, and progress.
    rules
        Decision thresholds.
    """

    rig: Rig
    traced: Tracing
    tests: Sequence[PreparedTest]
    settings: SimulateSettings
    recorded: Sequence[LoopRun]
    laws: Sequence[str]
    band_rad_s: tuple[float, float]
    rng: np.random.Generator
    seed: int
    jobs: int = 1
    progress: Progress = no_progress
    rules: LoopRules = field(default_factory=LoopRules)


NOTHING = "nothing"
"""Renewed parts of a law that is better with the unchanged controller: none."""

PARTS = (("inverse",), ("inverse", "switch"), ("inverse", "switch", "gain"))
"""Sets of parts of the controller that are renewed together, the smallest change first."""


def closed_loop(study: LoopStudy) -> dict[str, Any]:
    """Return for every law the response as measured, without and with the effects, and with a renewed controller."""
    rig, traced = study.rig, study.traced
    position = rig.controllers.calibrated.position
    stroke = traced.selection.base.problem.scales.stroke
    bench = Bench(rig.frame, position, rig.options, study.seed, stroke, study.rules)
    runs, status = _runs(study)
    base, chosen = plant_chain(traced.selection.base), plant_chain(traced.selection.chosen)
    before = Arrangement(base, lambda run: _as_it_ran(rig, run))
    after = Arrangement(chosen, lambda run: _as_it_ran(rig, run))
    unchanged = traced.selection.chosen is traced.selection.base
    ways = {"before": before, "after": before if unchanged else after}
    found: dict[str, Any] = {"status": status, "plant": _plant_words(traced)}
    band = Band(study.band_rad_s, amplitude_of(runs[0], study.rules.steady))
    laws = tuple(dict.fromkeys(run.law for run in runs))
    offered: dict[str, Arrangement] = {}
    if found["plant"]["effects"]:
        renewed = _renewed(study)
        offered = {
            ", ".join(parts): Arrangement(chosen, partial(_renewed_controller, rig, renewed, parts)) for parts in PARTS
        }
    # a law that commands the drive directly uses neither inverse nor switch
    ways_of = {law: ways | (offered if law_named(law).output == "force" else {}) for law in laws}
    curves = curves_of(
        runs, ways_of, bench, band, study.jobs, lambda done, text="": study.progress(0.5 + 0.4 * done, text)
    )
    if offered:
        taken = {law: _best_parts(own, tuple(offered), study.rules.alike) for law, own in curves.items()}
        found["controller"] = {**renewed.summary, "renewed": taken}
        for law, parts in taken.items():
            curves[law]["recalibrated"] = curves[law]["after" if parts == NOTHING else parts]
        kept = {**offered, NOTHING: ways["after"]}
        ways["recalibrated"] = Arrangement(chosen, lambda run: kept[taken[run.law]].controller(run))
    found |= compare_laws(runs, ways, bench, study.jobs)
    return found | rank_over_band(curves, band, tuple(ways), study.rules.alike)


def _best_parts(curves: Mapping[str, ResponseCurve | None], offered: Sequence[str], alike: float) -> str:
    """Return the renewed parts with which the largest response of a law over the band is smallest."""
    found = {parts: curves[parts] for parts in offered if parts in curves}
    return best_way({NOTHING: curves["after"], **found}, alike)


def laws_to_compare(asked: Sequence[str], stages: Sequence[str], available: Sequence[str]) -> list[str]:
    """Return the laws that are compared in addition to the recorded ones.

    Parameters
    ----------
    asked
        Setting `close_loop.laws`; empty: the laws that the run simulates, or all laws if it simulates none.
    stages
        Stages of the run.
    available
        Laws whose requirements are met.
    """
    simulated = [stage.removeprefix("simulate-") for stage in stages if stage.startswith("simulate-")]
    wanted = asked or simulated or available
    return [law for law in available if law in wanted]


def _runs(study: LoopStudy) -> tuple[list[LoopRun], str]:
    """Return the runs of all laws: under the recorded motions, or without any under the excitation of `simulate`."""
    laws, recorded = study.laws, study.recorded
    if recorded:
        runs = with_unrecorded(list(recorded), laws)
        others = [law for law in laws if law not in {run.law for run in recorded}]
        more = f"; {', '.join(others)} predicted alone" if others else ""
        return runs, f"{len(recorded)} recordings replayed with their measured ground motion{more}"
    excitation, _ = excitation_of(study.rig, study.settings.excitation)
    kind = excitation.details.get("kind", "given")
    return simulated_runs(excitation, laws), f"predicted alone under {kind} excitation: no closed-loop recordings"


def _plant_words(traced: Tracing) -> dict[str, Any]:
    """Return in words which effects are in the plant, and why others are not."""
    terms = traced.selection.chosen.problem.terms
    left_out = {term.effect.name: "a fault of sensors: corrected in prepare" for term in terms if term.effect.sensor}
    for item in traced.summary["effects"]:
        if item["name"] == "unattributed":
            left_out["unattributed"] = "a flexible model of the record has no physical meaning: it cannot run in a loop"
        elif item.get("corrected_in") == "prepare":
            left_out.setdefault(item["name"], "a fault of sensors: corrected in prepare")
    declared = set(traced.summary["declared_effects"])
    names = [term.effect.name for term in terms if not term.effect.sensor and term.effect.name not in declared]
    return {"effects": names, "left_out": left_out}


def _given_gains(run: LoopRun) -> Gains | None:
    return Gains(**run.gains) if run.gains else None


def _as_it_ran(rig: Rig, run: LoopRun) -> Controller:
    return rig.controllers.build(run.law, _given_gains(run))


@dataclass(frozen=True)
class Renewed:
    """The renewed parts of a controller for the damper with its effects.

    Attributes
    ----------
    inverse
        Network or table that gives the drive for a desired force; None if the controller has none.
    threshold_n
        Desired force below which the drive is 0 [N].
    factors
        Law -> factor on its calibrated gains [1].
    summary
        Keys of docs/close-loop-json.md on the renewed parts.
    """

    inverse: Network | InverseTable | None
    threshold_n: float
    factors: dict[str, float]
    summary: dict[str, Any]


def _renewed(study: LoopStudy) -> Renewed:
    """Return inverse, switch and gains for the damper with its effects."""

    rig, traced, settings = study.rig, study.traced, study.settings.controller
    calibrated = rig.controllers.calibrated
    omega, amplitude = calibrated.omega_0, calibrated.amplitude_m
    limit = min(settings.drive_limit or rig.damper.drive_limit, rig.damper.drive_limit)
    base, chosen = plant_chain(traced.selection.base), plant_chain(traced.selection.chosen)
    training = [test for test in study.tests if test.role != "validation"]
    share = changed_share(base, chosen, training)
    viscous_force = calibrated.gains_of("vd").c_n_s_m * amplitude * omega
    speed, scales = amplitude * omega, traced.selection.base.problem.scales
    before, after = (
        force_in_use(
            chain,
            limit,
            stroke_m=scales.stroke,
            speed_m_s=max(scales.speed, speed),
            omega=omega,
            working_drive=_working_drive(rig, viscous_force, limit, speed),
        )
        for chain in (base, chosen)
    )
    threshold = switch_threshold(rig.controllers.switch_force_n, before, after, speed)
    summary: dict[str, Any] = {
        "force_change_share": share,
        "residual_force_before_n": before.residual_n(speed),
        "residual_force_after_n": after.residual_n(speed),
        "switch_force_before_n": rig.controllers.switch_force_n,
        "switch_force_after_n": threshold,
    }
    inverse: Network | InverseTable | None = None
    if share < study.rules.force_changed:
        summary["inverse"] = f"kept: the effect changes the force by {in_percent(share, 1)}"
    elif settings.inverse == "model":
        inverse = after.table()
        summary["inverse"] = "rebuilt from the damper with its effects"
    else:
        inverse = _retrained(study, limit, summary)
    factors = _factors(rig, before, after, omega, amplitude, study.rules.most_gain)
    summary["gain_factors"] = factors
    return Renewed(inverse, threshold, factors, summary)


def _working_drive(rig: Rig, force_n: float, limit: float, speed_m_s: float) -> float:
    """Return the drive [A or V] at which the damper without effects gives the peak force of viscous damping."""
    drive = np.linspace(0.0, limit, 101)
    forces = np.asarray(rig.damper.quasi_static_force(speed_m_s, drive))
    return float(drive[min(int(np.searchsorted(np.maximum.accumulate(forces), force_n)), 100)])


def _retrained(study: LoopStudy, limit: float, summary: dict[str, Any]) -> Network | InverseTable:
    network = study.rig.controllers.inverse
    if not isinstance(network, Network):
        raise TypeError("the inverse of the controller is not a network")

    again = retrain_inverse(
        network,
        plant_chain(study.traced.selection.chosen),
        [test for test in study.tests if test.role != "validation"],
        [test for test in study.tests if test.role == "validation"],
        limit,
        study.rng,
        jobs=study.jobs,
        progress=lambda fraction, text="": study.progress(0.5 * fraction, f"inverse {text}"),
    )
    summary["inverse"] = "retrained on the damper with its effects" if again.replaced else "kept: the better of both"
    summary["inverse_nrmse"] = {"before": again.before_nrmse, "after": again.after_nrmse}
    return again.network


def _factors(
    rig: Rig, before: ForceInUse, after: ForceInUse, omega: float, amplitude: float, most: float
) -> dict[str, float]:
    """Return the factor on the calibrated gain of each law."""

    found = {}
    for name, gains in rig.controllers.calibrated.gains.items():
        law = law_named(name)
        if law.tuned_gain and law.harmonic_force is not None:
            found[name] = gain_factor(law, gains, before, after, omega, amplitude, most)
    return found


def _renewed_controller(rig: Rig, renewed: Renewed, parts: tuple[str, ...], run: LoopRun) -> Controller:
    """Return the controller of a run with some of its parts (`inverse`, `switch`, `gain`) renewed."""

    factor = renewed.factors.get(run.law, 1.0) if "gain" in parts else 1.0
    gains = _given_gains(run) or rig.controllers.calibrated.gains_of(run.law)
    return rig.controllers.build(
        run.law,
        law_named(run.law).scaled(gains, factor),
        inverse=renewed.inverse if "inverse" in parts else None,
        residual_force_n=renewed.threshold_n if "switch" in parts else None,
    )
