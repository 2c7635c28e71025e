"""The closed-loop part of `close-loop`: every law before, after, and with a controller made for the damper as it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import StageContext

if TYPE_CHECKING:
    from mrpipe.control.controller import Controller
    from mrpipe.control.gains import Gains
    from mrpipe.control.inverse import InverseTable
    from mrpipe.networks.network import Network
    from mrpipe.signals.prepared import PreparedTest
    from mrpipe.simulation.rig import Rig
    from mrpipe.tracing.bench.summary import Tracing
    from mrpipe.tracing.loop.augmented import ForceInUse
    from mrpipe.tracing.loop.comparison import LoopRun

PARTS = ("inverse", "switch", "gain")
"""What is renewed in a controller, one after another."""

_LACKING = {
    "identify-frame": "identified frame",
    "calibrate": "calibrated law",
    "train-inverse": "inverse network",
}


def closed_loop(context: StageContext, traced: Tracing, tests: list[PreparedTest]) -> dict[str, Any]:
    """Return the part `closed_loop` of the JSON: each law measured, before, after and recalibrated."""
    from mrpipe.control.assembly import ControllerFactory, inverse_network
    from mrpipe.control.storage import read_calibrated
    from mrpipe.reporting.closed_loop_words import in_words
    from mrpipe.simulation.rig import Rig, loop_options
    from mrpipe.structures import read_frame
    from mrpipe.tracing.loop.augmented import damper_of, plant_chain
    from mrpipe.tracing.loop.comparison import Arrangement, Bench, best_ways, compare_laws

    needed = ["identify-frame", "calibrate"]
    if context.settings.simulate.controller.inverse == "network":
        needed.append("train-inverse")
    lacking = [_LACKING[name] for name in needed if name not in context.inputs]
    if lacking:
        return {"status": f"skipped: there is no {' and no '.join(lacking)}"}
    context.progress(0.92, "closed loop")
    frame = read_frame(context.artifact("identify-frame"))
    damper = damper_of(traced.selection.base, traced.drive_unit)
    settings = context.settings.simulate
    controllers = ControllerFactory(
        frame,
        damper,
        read_calibrated(context.artifact("calibrate")),
        settings.controller,
        inverse_network(settings.controller, lambda: context.artifact("train-inverse")),
    )
    position = controllers.calibrated.position
    rig = Rig(frame, damper, controllers, replace(loop_options(settings), tracking="damper"))
    bench = Bench(frame, position, rig.options, context.seed, traced.selection.base.problem.scales.stroke)
    runs, status = _runs(context, rig)
    base, chosen = plant_chain(traced.selection.base), plant_chain(traced.selection.chosen)
    ways = {
        "before": Arrangement(base, lambda run: _as_it_ran(rig, run)),
        "after": Arrangement(chosen, lambda run: _as_it_ran(rig, run)),
    }
    found: dict[str, Any] = {"status": status, "plant": _plant_words(traced)}
    if found["plant"]["effects"]:
        renewed = _renewed(context, traced, rig, tests)
        offered = {
            ", ".join(parts) or "nothing": Arrangement(chosen, partial(_renewed_controller, rig, renewed, parts))
            for parts in ((), ("inverse",), ("inverse", "switch"), ("inverse", "switch", "gain"))
        }
        taken = best_ways(runs, offered, bench)
        found["controller"] = {**renewed.summary, "renewed": taken}
        ways["recalibrated"] = Arrangement(chosen, lambda run: offered[taken[run.law]].controller(run))
    found |= compare_laws(runs, ways, bench)
    return {**found, "statement": in_words(found)}


def _runs(context: StageContext, rig: Rig) -> tuple[list[LoopRun], str]:
    """Return the recordings and every other law under their motion; without recordings all laws as simulate has it."""
    from mrpipe.campaigns import load_campaign
    from mrpipe.simulation.rig import excitation_of
    from mrpipe.tracing.loop.comparison import measured_runs, simulated_runs, with_unrecorded

    laws = rig.controllers.available()
    recorded = []
    if "campaign:closed-loop" in context.inputs:
        recorded = measured_runs(load_campaign(context.inputs["campaign:closed-loop"]))
        if not recorded:
            context.warn("no closed-loop recording names its law and has ground motion and floor displacements")
    if recorded:
        runs = with_unrecorded(recorded, laws)
        others = [law for law in laws if law not in {run.law for run in recorded}]
        more = f"; {', '.join(others)} predicted alone" if others else ""
        return runs, f"{len(recorded)} recordings replayed with their measured ground motion{more}"
    excitation, _ = excitation_of(rig, context.settings.simulate.excitation)
    kind = excitation.details.get("kind", "given")
    return simulated_runs(excitation, laws), f"predicted alone under {kind} excitation: no closed-loop recordings"


def _plant_words(traced: Tracing) -> dict[str, Any]:
    """Return which effects are in the plant and which are not, and why."""
    terms = traced.selection.chosen.problem.terms
    left_out = {term.effect.name: "a fault of sensors: corrected in prepare" for term in terms if term.effect.sensor}
    for item in traced.summary["effects"]:
        if item["name"] == "unattributed":
            left_out["unattributed"] = "a flexible model of the record stands for no physics: it cannot run in a loop"
        elif item.get("corrected_in") == "prepare":
            left_out.setdefault(item["name"], "a fault of sensors: corrected in prepare")
    declared = set(traced.summary["declared_effects"])
    names = [term.effect.name for term in terms if not term.effect.sensor and term.effect.name not in declared]
    return {"effects": names, "left_out": left_out}


def _given_gains(run: LoopRun) -> Gains | None:
    from mrpipe.control.gains import Gains

    return Gains(**run.gains) if run.gains else None


def _as_it_ran(rig: Rig, run: LoopRun) -> Controller:
    return rig.controllers.build(run.law, _given_gains(run))


@dataclass(frozen=True)
class Renewed:
    """What is new in a controller that knows the effect."""

    inverse: Network | InverseTable | None
    threshold_n: float
    factors: dict[str, float]
    summary: dict[str, Any]


def _renewed(context: StageContext, traced: Tracing, rig: Rig, tests: list[PreparedTest]) -> Renewed:
    """Return inverse, switch and gains for the damper with its effects."""
    from mrpipe.tracing.loop.augmented import CHANGED, changed_share, force_in_use, plant_chain
    from mrpipe.tracing.loop.recalibration import switch_threshold

    settings = context.settings.simulate.controller
    calibrated = context.artifact("calibrate")
    omega, amplitude = calibrated.scalar("omega_0"), context.settings.calibrate.expected_amplitude_m
    limit = min(settings.drive_limit or rig.damper.drive_limit, rig.damper.drive_limit)
    base, chosen = plant_chain(traced.selection.base), plant_chain(traced.selection.chosen)
    training = [test for test in tests if test.role != "validation"]
    share = changed_share(base, chosen, training)
    before, after = (
        force_in_use(
            chain,
            limit,
            stroke_m=traced.selection.base.problem.scales.stroke,
            omega=omega,
            working_drive=_working_drive(rig, calibrated.scalar("laws/vd/c_n_s_m") * amplitude * omega, limit),
        )
        for chain in (base, chosen)
    )
    speed = amplitude * omega
    threshold = switch_threshold(settings.residual_force_n, before, after, speed)
    summary: dict[str, Any] = {
        "force_change_share": share,
        "residual_force_before_n": before.residual_n(speed),
        "residual_force_after_n": after.residual_n(speed),
        "switch_force_before_n": settings.residual_force_n,
        "switch_force_after_n": threshold,
    }
    inverse: Network | InverseTable | None = None
    if share < CHANGED:
        summary["inverse"] = f"kept: the effect changes the force by {100.0 * share:.1f} %"
    elif settings.inverse == "model":
        inverse = after.table()
        summary["inverse"] = "rebuilt from the damper with its effects"
    else:
        inverse = _retrained(context, traced, tests, limit, summary)
    factors = _factors(rig, before, after, omega, amplitude)
    summary["gain_factors"] = factors
    return Renewed(inverse, threshold, factors, summary)


def _working_drive(rig: Rig, force_n: float, limit: float) -> float:
    """Return the drive at which the damper without effects gives the peak force of viscous damping."""
    import numpy as np

    drive = np.linspace(0.0, limit, 101)
    forces = np.asarray(rig.damper.quasi_static_force(0.05, drive))
    return float(drive[min(int(np.searchsorted(np.maximum.accumulate(forces), force_n)), 100)])


def _retrained(
    context: StageContext, traced: Tracing, tests: list[PreparedTest], limit: float, summary: dict[str, Any]
) -> Network:
    from mrpipe.networks.network import read_network
    from mrpipe.tracing.loop.augmented import plant_chain, retrain_inverse

    again = retrain_inverse(
        read_network(context.artifact("train-inverse"), "network"),
        plant_chain(traced.selection.chosen),
        [test for test in tests if test.role != "validation"],
        [test for test in tests if test.role == "validation"],
        limit,
        context.rng,
        jobs=context.jobs,
        progress=lambda fraction, text="": context.progress(0.92 + 0.06 * fraction, f"inverse {text}"),
    )
    summary["inverse"] = "retrained on the damper with its effects" if again.replaced else "kept: the better of both"
    summary["inverse_nrmse"] = {"before": again.before_nrmse, "after": again.after_nrmse}
    return again.network


def _factors(rig: Rig, before: ForceInUse, after: ForceInUse, omega: float, amplitude: float) -> dict[str, float]:
    """Return by what the gain of each law moves, from the calibrated gains."""
    from mrpipe.control.laws import law_named
    from mrpipe.tracing.loop.recalibration import gain_factor

    found = {}
    for name, gains in rig.controllers.calibrated.gains.items():
        law = law_named(name)
        if law.tuned_gain and law.harmonic_force is not None:
            found[name] = gain_factor(law, gains, before, after, omega, amplitude)
    return found


def _renewed_controller(rig: Rig, renewed: Renewed, parts: tuple[str, ...], run: LoopRun) -> Controller:
    """Return the controller of a run with some of its parts (`inverse`, `switch`, `gain`) renewed."""
    from mrpipe.control.laws import law_named

    factor = renewed.factors.get(run.law, 1.0) if "gain" in parts else 1.0
    gains = _given_gains(run) or rig.controllers.calibrated.gains_of(run.law)
    return rig.controllers.build(
        run.law,
        law_named(run.law).scaled(gains, factor),
        inverse=renewed.inverse if "inverse" in parts else None,
        residual_force_n=renewed.threshold_n if "switch" in parts else None,
    )
