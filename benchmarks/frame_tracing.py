"""How often planted effects of a structure are found: `python -m benchmarks.frame_tracing --seeds 2`, then `--table`.

Frames of 3 to 5 floors are drawn and recorded by the virtual laboratory (short sweeps, decays, random motion; or the
closed loop of the thesis' frame for brace and delay) and traced as `mrpipe close-loop` does. The laboratory has forms
of its own; the unknown is a machine on a floor that nobody recorded. Each case is a line of a results file (JSON), so
that an interrupted run is taken up where it ended.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
import traceback
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.results import append_row, read_rows

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402 - threads are set before

if TYPE_CHECKING:
    from mrpipe.campaigns import Campaign
    from mrpipe.laboratory.structure import TrueStructure

RESULTS = Path(__file__).with_name("results") / "frame_tracing.jsonl"
OF_FRAME = ("joint-friction", "cubic-stiffness", "impact", "base-rocking")
OF_LOOP: dict[str, tuple[float, float]] = {"brace-flexibility": (1e-5, 3e-5), "controller-delay": (0.006, 0.015)}
"""Effects that show with a damper only: compliances [m/N] and dead times [s] of either strength."""

SHARES = (0.015, 0.04)
"""Either strength of impact and of the unknown: RMS of the change of all floor accelerations over their RMS. Friction,
stiffness and rocking shift frequencies, which changes accelerations much and may leave no error at all."""

FACTORS = (0.5, 2.0)
"""Either strength of those: factor on the laboratory's usual number."""

SEED_STEP = 100


@dataclass(frozen=True)
class Case:
    """One campaign: what is planted (a name, `none`, `unknown`, `none-loop`), how strong (0 or 1), from which seed."""

    planted: str
    strength: int
    seed: int

    @property
    def key(self) -> str:
        """Return the key of the case in the results."""
        return f"{self.planted}-{self.strength}-{self.seed}"


def cases(seeds: int, first: int) -> Iterator[Case]:
    """Yield every effect at both strengths, clean rigs and unknown loads, seed after seed."""
    for number in range(seeds):
        for place, name in enumerate(("none", *OF_FRAME, "unknown", "none-loop", *OF_LOOP)):
            for strength in (0,) if name == "none-loop" else (0, 1):
                yield Case(name, strength, first + SEED_STEP * number + 10 * place + strength)


def structure_of(case: Case, rng: np.random.Generator) -> TrueStructure:
    """Return a drawn frame with the effect of a case, its strength as a share."""
    from mrpipe.laboratory.structure import TrueStructure, draw_frame_effect, random_frame

    frame = random_frame(rng, int(rng.integers(3, 6)))
    if case.planted not in OF_FRAME:
        return TrueStructure(frame)
    effect = draw_frame_effect(rng, (case.planted,))
    if case.planted == "impact":
        return TrueStructure(frame, (replace(effect, strength_share=SHARES[case.strength]),))
    first = effect.form.numbers[0]
    values = {**effect.values, first.name: FACTORS[case.strength] * first.default}
    return TrueStructure(frame, (replace(effect, values=values),))


def record_frame_case(case: Case, folder: Path) -> dict[str, Any]:
    """Record sweeps, decays and random motion of a drawn frame; return the truth."""
    from mrpipe.laboratory.frame_rig import calibrated_structure, floor_masses, record_frame
    from mrpipe.laboratory.options import FrameRig

    rng = np.random.default_rng([case.seed, 7])
    rig = FrameRig(
        sweep_s=80.0, random_s=60.0, sweep_acceleration_m_s2=0.3, random_acceleration_m_s2=0.4, laser_floors=(1, 2, 3)
    )
    structure = calibrated_structure(structure_of(case, rng), rig)
    record = record_frame(structure, rig, rng)
    if case.planted == "unknown":
        add_machine(record.tests, record.scales, structure, rig.sampling_rate_hz, SHARES[case.strength], rng)
    _write(folder, record, rig.sampling_rate_hz, floor_masses(structure))
    return dict(record.truth)


def add_machine(
    tests: list[Any], scales: dict[str, float], structure: TrueStructure, rate_hz: float, share: float, rng: Any
) -> None:
    """Add to all tests what the linear frame does under a machine on a floor that runs up and down irregularly."""
    from scipy import signal

    frame = structure.frame
    n, floor = frame.floors, int(rng.integers(frame.floors))
    inverse = np.linalg.inv(frame.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ frame.stiffness, -inverse @ frame.damping]])
    B = np.concatenate([np.zeros(n), inverse[:, floor]])[:, None]
    C, D = np.vstack([A[n:], np.eye(n, 2 * n)]), np.concatenate([B[n:], np.zeros((n, 1))])
    step = signal.cont2discrete((A, B, C, D), 1.0 / rate_hz)[:4]
    columns = {name: f"ch{index + 1}" for index, name in enumerate(scales)}
    accelerations = [columns[f"floor_acceleration_{k + 1}"] for k in range(n)]
    unit = scales["floor_acceleration_1"]
    for test in tests:
        time_s = np.arange(len(test.columns[accelerations[0]])) / rate_hz
        turns = np.cumsum(4.0 + 2.0 * np.sin(0.9 * time_s) + 1.5 * np.sin(0.37 * time_s + 1.0)) / rate_hz
        load = np.sin(2.0 * np.pi * turns) * (np.sin(0.5 * time_s) > 0.0)
        answer = np.asarray(signal.dlsim((*step, 1.0 / rate_hz), load)[1])
        own = np.column_stack([test.columns[name] for name in accelerations]) * unit
        factor = share * float(np.std(own)) / float(np.std(answer[:, :n]))
        for k in range(n):
            test.columns[accelerations[k]] = test.columns[accelerations[k]] + factor * answer[:, k] / unit
            laser = f"floor_displacement_{k + 1}"
            if laser in columns:
                test.columns[columns[laser]] = test.columns[columns[laser]] + factor * answer[:, n + k] / scales[laser]


def record_loop_case(case: Case, folder: Path) -> dict[str, Any]:
    """Record vd, vdns and fdns on the thesis' frame with set C, with a brace that gives or a late controller."""
    from mrpipe.artifacts import load_parameter_set
    from mrpipe.control import ControllerOptions, Gains, build_controller
    from mrpipe.control.inverse import inverse_table
    from mrpipe.dampers.model import damper_from_parameter_set
    from mrpipe.laboratory.closed_loop import record_closed_loop
    from mrpipe.laboratory.damper import damper_from_set, draw_damper
    from mrpipe.laboratory.effects import Planted
    from mrpipe.laboratory.frame_rig import floor_masses
    from mrpipe.laboratory.options import LoopRig
    from mrpipe.laboratory.structure import TrueStructure, find_frame_form
    from mrpipe.structures import frame_from_parameter_set

    rng = np.random.default_rng([case.seed, 7])
    effects = ()
    if case.planted in OF_LOOP:
        form = find_frame_form(case.planted)
        value = OF_LOOP[case.planted][case.strength] * float(np.exp(0.2 * rng.standard_normal()))
        effects = (Planted(form, {form.numbers[0].name: value}),)
    structure = TrueStructure(frame_from_parameter_set("thesis"), effects)
    model = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    inverse = inverse_table(model, drive_limit=4.0)
    gains = {"vd": Gains(650.0), "vdns": Gains(250.0, -4000.0), "fdns": Gains(alpha_n_m=3000.0)}
    options = ControllerOptions(drive_limit=4.0, residual_force_n=18.0, friction_rounding_m_s=0.0125)
    controllers = {law: build_controller(law, own, options, inverse=inverse) for law, own in gains.items()}
    rig = LoopRig(shaking_s=15.0, decay_s=5.0)
    damper = draw_damper(rng, damper_from_set("set-c"), 0.1)
    record = record_closed_loop(damper, structure, controllers, rig, rng)
    _write(folder, record, rig.sampling_rate_hz, floor_masses(structure))
    return {**record.truth, "effects": [item.described() for item in effects]}


def _write(folder: Path, record: Any, rate_hz: float, masses: list[float]) -> None:
    from mrpipe.campaigns import write_campaign
    from mrpipe.laboratory.sealing import campaign_directory, write_scales

    with campaign_directory(folder) as place:
        write_campaign(
            place, campaign="frame-benchmark", rig="shear-frame", sampling_rate_hz=rate_hz, channels=record.channels,
            tests=record.tests, extra={"declared_effects": [], "frame": {"floor_masses_kg": masses}},
        )  # fmt: skip
        write_scales(place, record.scales)


def run_case(case: Case) -> dict[str, Any]:
    """Record and trace one case, open its truth, and return its row."""
    from mrpipe.campaigns import load_campaign

    try:
        with tempfile.TemporaryDirectory() as temporary:
            folder = Path(temporary) / case.key
            loop = case.planted in OF_LOOP or case.planted == "none-loop"
            truth = record_loop_case(case, folder) if loop else record_frame_case(case, folder)
            return {"key": case.key, **asdict(case), **traced(case, load_campaign(folder), truth), "error": ""}
    except Exception:
        return {"key": case.key, **asdict(case), "right": False, "error": traceback.format_exc(limit=-2)}


def traced(case: Case, campaign: Campaign, truth: dict[str, Any]) -> dict[str, Any]:
    """Trace a campaign and judge the verdict."""
    from mrpipe.effects.library import damper_effects
    from mrpipe.effects.structural.library import all_structural_effects
    from mrpipe.tracing.options import TracingOptions
    from mrpipe.tracing.structure.verdict import trace_structure

    options = TracingOptions(refits=4, observation_filter=False)
    began = time.process_time()
    summary = trace_structure(
        [campaign], all_structural_effects(), damper_effects(), options, rng=np.random.default_rng(case.seed)
    ).summary
    found = [item["name"] for item in summary["effects"]]
    missing = bool(summary["unexplained"]["structured"])
    planted = truth["effects"]
    if case.planted == "unknown":
        right = not found and missing
    elif not planted:
        right = not found and not missing
    else:
        right = found[:1] == [case.planted]
    return {
        "right": right,
        "verdict": "+".join(found) or ("unknown" if missing else "none"),
        "truth": planted,
        "effects": [{"name": item["name"], "form": item["form"], "parameters": item["parameters"]}
                    for item in summary["effects"]],
        "before": summary["before"]["nrmse"],
        "after": summary["after"]["nrmse"],
        "floor": summary["noise_floor_nrmse"],
        "cpu_seconds": round(time.process_time() - began, 1),
    }  # fmt: skip


def table(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a table for the documentation."""
    lines = [
        "| planted | form | strength | verdict | planted value | found | before | after | noise floor |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    order = ("none", "none-loop", *OF_FRAME, *OF_LOOP, "unknown")
    for row in sorted(rows, key=lambda item: (order.index(item["planted"]), item["strength"], item["seed"])):
        if row["error"]:
            lines.append(f"| {row['planted']} | | {row['strength']} | error | | | | | |")
            continue
        verdict = row["verdict"] if row["right"] else f"**{row['verdict']}**"
        form = ", ".join(item.get("form", "") for item in row["truth"])
        values = [f"{row[key]:.4f}" for key in ("before", "after", "floor")]
        strong = ("weak", "strong")[row["strength"]] if not row["planted"].startswith("none") else ""
        cells = [row["planted"], form, strong, verdict, *_values(row), *values]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


ALIKE = {"compliance": "compliance", "time": "time", "clearance": "gap"}
"""Parameters that laboratory and library share -> the library's name."""


def _values(row: dict[str, Any]) -> tuple[str, str]:
    """Return the planted and the found value of the parameter that both sides have, empty where there is none."""
    for item in row["truth"]:
        for name, own in ALIKE.items():
            if name in item.get("parameters", {}):
                same = [e for e in row["effects"] if e["name"] == row["planted"] and own in e["parameters"]]
                found = f"{same[0]['parameters'][own]['value']:.3g}" if same else ""
                return f"{name} {item['parameters'][name]['value']:.3g}", found
    return "", ""


def main() -> None:
    """Run the cases that the results file lacks, or print its table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=1000)
    parser.add_argument("--names", nargs="+", default=[])
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--table", action="store_true", help="print the table of the results and run nothing")
    options = parser.parse_args()
    if not options.table:
        done = {row["key"] for row in read_rows(options.results)}
        for case in cases(options.seeds, options.first_seed):
            if case.key in done or (options.names and case.planted not in options.names):
                continue
            row = run_case(case)
            append_row(options.results, row)
            print("ok " if row["right"] else "BAD", row["key"], row.get("verdict", row["error"][-300:]), flush=True)
        return
    print(table(read_rows(options.results)))


if __name__ == "__main__":
    main()
