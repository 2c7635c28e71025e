"""Whether a design for the traced damper is better on the true rig than a design for the damper as first identified.

    python -m benchmarks.traced_design --results traced-design.jsonl [--draws 10] [--first-seed 1]
    python -m benchmarks.traced_design --results traced-design.jsonl --table

Each draw is a damper near set C with a hidden remanence of random form and strength. Its bench campaign is traced. The
gains of `vdns` and `fdns` are then searched twice on the thesis' frame, as `mrpipe design` does: with the damper as
identified before the tracing, and with the traced one. (`vd` takes no part, because its peak is half as large again.)
Both designs run on the true rig, which is the virtual laboratory and not the model of the design. The controller is the
same in both: its inverse is that of the identified damper. One line of JSON per draw, so that an interrupted run goes
on where it ended; `--table` prints Markdown.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.results import append_row, read_rows
from mrpipe.artifacts import FloatArray
from mrpipe.campaigns import load_campaign
from mrpipe.control.assembly import ControllerFactory, calibrated_from
from mrpipe.control.calibration import CalibrationOptions, calibrate, plant_of
from mrpipe.control.controller import Controller
from mrpipe.control.laws import law_named
from mrpipe.control.lqg import Weights
from mrpipe.control.settings import ControllerSettings
from mrpipe.dampers.model import DamperModel
from mrpipe.effects.library import damper_effects
from mrpipe.errors import DivergedError
from mrpipe.fitting.damper import damper_model
from mrpipe.laboratory.bench import record_bench
from mrpipe.laboratory.blind import write_bench
from mrpipe.laboratory.closed_loop import run_loop
from mrpipe.laboratory.damper import TrueDamper, damper_from_set, draw_damper
from mrpipe.laboratory.effects import draw_hidden_effect
from mrpipe.laboratory.options import BenchRig, LoopRig
from mrpipe.laboratory.plans import compact
from mrpipe.laboratory.structure import TrueStructure
from mrpipe.law_design.objective import Load, Objective
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.problem import LoopOf, laws_in_the_race
from mrpipe.law_design.run import SEARCH_RATE, accurate_curves
from mrpipe.law_design.search import SearchOptions
from mrpipe.law_design.study import Loops, design_law
from mrpipe.signals.options import PreparationOptions
from mrpipe.signals.preparation import prepare_campaign
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import LoopOptions, Response
from mrpipe.simulation.resonance import BAND
from mrpipe.simulation.response_curve import response_curve
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.sensors import SensorNoise
from mrpipe.simulation.steady_state import CurveOptions
from mrpipe.structures import Frame, frame_from_parameter_set
from mrpipe.thesis.gains import THESIS_GAINS
from mrpipe.tracing.bench.trace import trace_campaign
from mrpipe.tracing.bench.verdict.summary import Tracing
from mrpipe.tracing.loop.augmented import traced_damper
from mrpipe.tracing.options import TracingOptions

LAWS = ("vdns", "fdns")
AMPLITUDE_M_S2 = 0.79
EXPECTED_AMPLITUDE_M = 0.0093
SHARE = (0.03, 0.10)
"""RMS of the remanence over RMS of the force, drawn between these."""

DURATION_S = 4.0
"""Length of each bench test."""

JUDGED = CurveOptions(points=11, tolerance=1e-2, most_cycles=60, refined=("rms_x_top_m",), absolute=True)
"""Response curves on the true rig."""

RESOLUTION = 5e-3
"""Peaks of two designs that differ by less than this share count as equal: the curves do not resolve less."""


def true_damper(seed: int, rng: np.random.Generator) -> TrueDamper:
    """Return a damper near set C with a remanence that no campaign file declares."""
    base = draw_damper(rng, damper_from_set("set-c"), 0.1)
    return base.with_effects([draw_hidden_effect(np.random.default_rng([seed, 5]), ("remanence",), SHARE)])


def traced(seed: int, damper: TrueDamper, rng: np.random.Generator) -> tuple[TrueDamper, Tracing]:
    """Record the bench campaign and trace it; return the damper with the strength that its share demands."""
    rig = BenchRig()
    with tempfile.TemporaryDirectory() as folder:
        record = record_bench(damper, compact(DURATION_S), rig, rng)
        campaign = load_campaign(write_bench(Path(folder) / "bench", record, rig))
        tests = [item.test for item in prepare_campaign(campaign, PreparationOptions()).tests]
    options = TracingOptions(drive_unit="A")
    return record.damper, trace_campaign(tests, damper_effects(), [], options, rng=np.random.default_rng(seed))


def factory_of(frame: Frame, damper: DamperModel) -> ControllerFactory:
    """Return the controllers with the thesis' gains and the exact inverse of the identified damper."""
    published = {law: dict(gains) for law, gains in THESIS_GAINS.items()}
    options = CalibrationOptions(
        source="published", published=published, positive_stiffness_n_m=2500.0, negative_stiffness_n_m=-4500.0
    )
    calibration = calibrate(frame, np.eye(frame.floors)[0], options, tuple(map(law_named, LAWS)))
    known = calibrated_from(calibration, Weights(), damper, amplitude_m=EXPECTED_AMPLITUDE_M)
    return ControllerFactory(frame, damper, known, ControllerSettings(inverse="model"))


def designed(rig: Rig, load: Load, seed: int) -> dict[str, Any]:
    """Return the law and gains with the smallest largest response in this loop."""
    settings = DesignSettings(laws=LAWS, fixed_gains={"vdns": {"k_n_m": -4500.0}})
    plant = plant_of(rig.frame, rig.position, CalibrationOptions())
    entries, _, _ = laws_in_the_race(settings, plant, rig.controllers.calibrated.gains)
    accurate = LoopOf(rig, seed)
    loops = Loops(accurate, accurate.at_rate(SEARCH_RATE))
    search, curves = SearchOptions(settings.grid, settings.evaluations), accurate_curves(settings, absolute=True)
    found = [design_law(loops, entry, load, Objective({"rms_x_top_m": 1.0}), search, curves).best for entry in entries]
    best = min(found, key=lambda item: item.value)
    return {"law": best.law, "gains": dict(best.gains), "peak_rms_x_top_m": best.peaks["rms_x_top_m"]}


def on_true_rig(damper: TrueDamper, frame: Frame, controller: Controller, band: tuple[float, float]) -> float:
    """Return the largest RMS top displacement over frequency on the true rig [m]."""
    structure, rig = TrueStructure(frame), LoopRig(acceleration_noise_m_s2=0.1)

    def run(excitation: Excitation) -> Response:
        clock: FloatArray = np.arange(round(excitation.duration_s / rig.step_s), dtype=np.float64) * rig.step_s
        histories = run_loop(damper, structure, controller, excitation.at(clock), rig, np.random.default_rng(11))
        if float(np.abs(histories.displacement).max()) > 1.0:
            raise DivergedError("the true rig moves by more than a metre")
        moved = histories.displacement[:, 0]
        none = np.zeros_like(moved)
        table = np.zeros_like(histories.displacement)
        return Response(
            histories.time_s, histories.displacement, table, table, histories.acceleration, moved, none,
            histories.force, histories.drive, histories.desired, histories.ground, none, none, none, none, none,
            np.zeros((0, 0)), np.zeros(0), 0.0,
        )  # fmt: skip

    return response_curve(run, AMPLITUDE_M_S2, band, JUDGED).peak("rms_x_top_m")


def draw_once(seed: int) -> dict[str, Any]:
    """Return the row of one draw."""
    began = time.process_time()
    rng = np.random.default_rng([seed, 31])
    damper, tracing = traced(seed, true_damper(seed, rng), rng)
    traced_at = time.process_time()
    planted = damper.effects[0]
    frame = frame_from_parameter_set("thesis")
    plain = damper_model(tracing.selection.base, tracing.drive_unit)
    better = traced_damper(tracing.selection.chosen, tracing.drive_unit)
    controllers = factory_of(frame, plain)
    modes = plant_of(frame, np.eye(frame.floors)[0], CalibrationOptions()).modes
    band = (BAND[0] * modes.omega_0, BAND[1] * modes.omega_inf)
    load = Load(band, (AMPLITUDE_M_S2,))
    rig = Rig(frame, plain, controllers, LoopOptions(noise=SensorNoise(20e-6, 0.1)))
    row: dict[str, Any] = {
        "seed": seed,
        "form": planted.form.form,
        "share": planted.strength_share,
        "named": [item["name"] for item in tracing.summary["effects"]],
        "before": tracing.summary["before"]["nrmse"],
        "after": tracing.summary["after"]["nrmse"],
    }
    for name, loop in (("untraced", rig), ("traced", replace(rig, damper=better))):
        found = designed(loop, load, seed)
        gains = controllers.calibrated.gains_of(found["law"]).changed(**found["gains"])
        found["true_peak_rms_x_top_m"] = on_true_rig(damper, frame, controllers.build(found["law"], gains), band)
        row[name] = found
    row["better_by"] = 1.0 - row["traced"]["true_peak_rms_x_top_m"] / row["untraced"]["true_peak_rms_x_top_m"]
    row |= {"tracing_cpu_s": traced_at - began, "cpu_s": time.process_time() - began}
    return row


def as_markdown(rows: list[dict[str, Any]]) -> str:
    """Return the table and how often the design for the traced damper is at least as good."""
    lines = [
        "| draw | remanence, share of the force | named | design before tracing | design after tracing "
        "| true peak, before [mm] | true peak, after [mm] | better by |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        cells = [str(row["seed"]), f"{row['form']}, {row['share']:.1%}", " + ".join(row["named"]) or "nothing"]
        cells += [_words(row[name]) for name in ("untraced", "traced")]
        cells += [f"{1e3 * row[name]['true_peak_rms_x_top_m']:.1f}" for name in ("untraced", "traced")]
        lines.append("| " + " | ".join([*cells, f"{row['better_by']:+.1%}"]) + " |")
    good = sum(row["better_by"] >= -RESOLUTION for row in rows)
    strictly = sum(row["better_by"] > RESOLUTION for row in rows)
    gains = [row["better_by"] for row in rows] or [0.0]
    lines += [
        "",
        f"The design for the traced damper is at least as good in {good} of {len(rows)} draws (differences below "
        f"{RESOLUTION:.1%} count as equal), and better in {strictly}. On average its largest response is "
        f"{np.mean(gains):.1%} smaller.",
    ]
    return "\n".join(lines)


def _words(design: dict[str, Any]) -> str:
    parts = [f"{value:.4g}" for value in design["gains"].values() if value]
    return f"{design['law']} {', '.join(parts)}"


def main() -> None:
    """Run the draws that are missing, or print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--results", type=Path, required=True)
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--table", action="store_true")
    given = parser.parse_args()
    rows = read_rows(given.results)
    if given.table:
        print(as_markdown(rows))
        return
    done = {row["seed"] for row in rows}
    for seed in range(given.first_seed, given.first_seed + given.draws):
        if seed in done:
            continue
        row = draw_once(seed)
        append_row(given.results, row)
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
