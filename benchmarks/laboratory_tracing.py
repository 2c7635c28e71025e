"""How often effects planted in the virtual laboratory are found.

`python -m benchmarks.laboratory_tracing --preset core` runs the cases and prints how many verdicts are right.
The virtual laboratory is part of the program, and its damper is a Bouc-Wen damper. `benchmarks.tracing` is the harder
benchmark, with rigs that are independent of the program. Each case is a line of a results file (JSON), so that an
interrupted run continues where it ended.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import tempfile
import time
import traceback
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.results import append_row, read_rows

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

RESULTS = Path(__file__).with_name("results") / "laboratory_tracing.jsonl"
NOISES = ("white", "coloured", "harmonics")
EXCITATIONS = ("mixed", "sine", "triangle", "random", "earthquake")


@dataclass(frozen=True)
class Case:
    """One campaign: what is planted (names joined by +, `none`, `unfamiliar`, `any`), how strong, recorded how."""

    planted: str
    seed: int
    share: float = 0.05
    noise: str = "white"
    rate_hz: float = 1000.0
    excitation: str = "mixed"

    @property
    def key(self) -> str:
        """Return the key of the case in the results."""
        return f"{self.planted}-{self.seed}-{self.share:g}-{self.noise}-{self.rate_hz:g}-{self.excitation}"


def tests_for(excitation: str, duration_s: float) -> list[Any]:
    """Return the tests: the compact plan, or training of one kind of motion judged on the plan's mixed validation."""
    from mrpipe.laboratory.plans import compact

    tests = compact(duration_s)
    if excitation == "mixed":
        return tests
    kept = []
    for test in tests:
        if test.role == "validation":
            kept.append(test)
        elif test.motion != "dwell":
            # the command of another motion: its strokes, frequencies and drives stay
            frequency = test.frequency_hz if excitation in ("sine", "triangle") else max(test.frequency_hz, 2.0)
            kept.append(replace(test, motion=excitation, frequency_hz=frequency))
    return kept


def record(case: Case, folder: Path, duration_s: float) -> Path:
    """Record the campaign of a case."""
    from mrpipe.laboratory.blind import record_blind
    from mrpipe.laboratory.effects import EFFECT_NAMES
    from mrpipe.laboratory.options import BenchRig, BenchSensors, Servo

    names = [part for part in case.planted.split("+") if part != "none"]
    many = len(names)
    chosen: tuple[str, ...] = EFFECT_NAMES if "any" in names else tuple(names)
    servo = Servo(amplitude_error=0.02, harmonic_share=0.03) if case.noise == "harmonics" else Servo()
    rig = BenchRig(
        servo=servo,
        sensors=BenchSensors(colour="coloured" if case.noise == "coloured" else "white"),
        sampling_rate_hz=case.rate_hz,
    )
    return record_blind(
        folder / case.key, case.seed, names=chosen, share=case.share, count=many,
        tests=tests_for(case.excitation, duration_s), rig=rig,
    )  # fmt: skip


def run_case(case: Case, *, duration_s: float = 4.0, keep: Path | None = None) -> dict[str, Any]:
    """Record and trace one case, open its truth, and return its row."""
    import warnings

    warnings.simplefilter("ignore")
    try:
        with tempfile.TemporaryDirectory() as temporary:
            campaign = record(case, keep or Path(temporary), duration_s)
            return {"key": case.key, **asdict(case), **trace(campaign, case.seed), "error": ""}
    except Exception:
        return {"key": case.key, **asdict(case), "right": False, "error": traceback.format_exc(limit=-2)}


def trace(campaign: Path, seed: int) -> dict[str, Any]:
    """Trace a recorded campaign and judge the verdict by its sealed truth."""
    import numpy as np

    from mrpipe.campaigns import load_campaign
    from mrpipe.effects.library import damper_effects
    from mrpipe.laboratory.sealing import sealed_path
    from mrpipe.signals.options import PreparationOptions
    from mrpipe.signals.preparation import prepare_campaign
    from mrpipe.tracing.bench.trace import trace_campaign
    from mrpipe.tracing.options import TracingOptions

    tests = [item.test for item in prepare_campaign(load_campaign(campaign), PreparationOptions()).tests]
    damper_effects()
    began, used = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF).ru_utime
    summary = trace_campaign(tests, damper_effects(), [], TracingOptions(), rng=np.random.default_rng(seed)).summary
    seconds, cpu = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_utime - used
    truth = json.loads(sealed_path(campaign).read_text(encoding="utf-8"))
    return {**judged(summary, truth), "seconds": round(seconds, 2), "cpu_seconds": round(cpu, 2)}


def judged(summary: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Return what was planted, what was found, and whether that is right."""
    planted = [item["name"] for item in truth["effects"]]
    found = [item["name"] for item in summary["effects"]]
    structured = bool(summary["residual"]["structured"])
    if not planted:
        right = not found
    elif "unfamiliar" in planted:
        right = not found and bool(summary["unexplained"]["structured"])
    elif len(planted) == 1:
        right = found[:1] == planted
    else:
        right = set(planted) <= set(found)
    return {
        "truth": planted,
        "truth_forms": [item.get("form", "") for item in truth["effects"]],
        "truth_parameters": [
            {name: number["value"] for name, number in item["parameters"].items()} for item in truth["effects"]
        ],
        "found": found,
        "verdict": "+".join(found) or ("unknown" if structured else "none"),
        "right": right,
        "further": [item["name"] for item in summary["further_terms"]],
        "spurious": [name for name in found if name not in planted],
        "effects": [
            {
                "name": item["name"],
                "form": item["form"],
                "confidence": item["confidence"],
                "tied_with": item["tied_with"],
                "parameters": {name: number["value"] for name, number in item["parameters"].items()},
                "gain": item.get("cross_validated_gain"),
            }
            for item in summary["effects"]
        ],
        "candidates": [[item["name"], item["form"], round(item["share"], 4)] for item in summary["candidates"][:5]],
        "before": summary["before"]["nrmse"],
        "after": summary["after"]["nrmse"],
        "floor": summary["noise_floor_nrmse"],
        "chi_square": summary["residual"]["chi_square"],
        "chi_square_of_noise": summary["residual"]["chi_square_of_noise"],
        "p_value": summary["residual"]["p_value"],
        "ceiling": summary["ceiling"],
        "left": summary["unexplained"]["share_of_residual"],
    }


PAIRS = (
    "accumulator+remanence", "stribeck+backlash", "offset+migration", "heating+asymmetry", "inertia+delay",
    "quadratic-drag+saturation", "pinching+channel-skew", "end-stop+remanence", "rate-dependent-yield+backlash",
    "migration+accumulator", "heating+remanence", "asymmetry+delay",
)  # fmt: skip


def core(first: int) -> Iterator[Case]:
    """Yield the cases of the committed table: all names at three strengths, clean rigs, unknown shapes, pairs."""
    from mrpipe.effects.library import damper_effects

    for place, name in enumerate(damper_effects()):
        for step, share in enumerate((0.05, 0.05, 0.1, 0.2)):
            yield Case(name, first + 4 * place + step, share)
    for number in range(16):
        yield Case("none", first + 100 + number)
    for number in range(12):
        yield Case("unfamiliar", first + 120 + number, (0.05, 0.1)[number % 2])
    for number, pair in enumerate(PAIRS):
        yield Case(pair, first + 140 + number, 0.08)


def conditions(first: int) -> Iterator[Case]:
    """Yield cases of any effect under other noise, rates and excitations, and clean rigs under the same."""
    settings = [{"noise": noise} for noise in NOISES[1:]] + [{"rate_hz": rate} for rate in (500.0, 2000.0)]
    settings += [{"excitation": kind} for kind in EXCITATIONS[1:]] + [{"share": 0.02}]
    for place, changed in enumerate(settings):
        for number in range(6):
            yield Case("any", first + 200 + 10 * place + number, **changed)  # type: ignore[arg-type]
        if "share" not in changed:
            for number in range(2):
                yield Case("none", first + 300 + 10 * place + number, **changed)  # type: ignore[arg-type]


PRESETS = {"core": core, "conditions": conditions}


def listed(options: argparse.Namespace) -> Iterator[Case]:
    """Yield the cases that the command line selects."""
    from mrpipe.effects.library import damper_effects

    if options.preset:
        for name in options.preset:
            yield from PRESETS[name](options.first_seed)
        return
    names = options.names or ["none", "unfamiliar", *damper_effects()]
    for number in range(options.seeds):
        for place, name in enumerate(names):
            for share in options.shares:
                for noise in options.noise:
                    for rate in options.rate_hz:
                        for excitation in options.excitation:
                            seed = options.first_seed + number * len(names) + place
                            yield Case(name, seed, share, noise, rate, excitation)


def run(cases: Iterable[Case], path: Path, *, jobs: int, keep: Path | None, duration_s: float) -> None:
    """Run what the results file lacks, two cases at a time with one thread each."""
    import joblib

    done = {row["key"] for row in read_rows(path)}
    todo = [case for case in cases if case.key not in done]
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered")
    work = (joblib.delayed(run_case)(case, duration_s=duration_s, keep=keep) for case in todo)
    for row in parallel(work):
        append_row(path, row)
        mark = "ok " if row["right"] else "BAD"
        print(mark, row["key"], row.get("verdict", row["error"][-200:]), row.get("truth_forms", ""), flush=True)


def main() -> None:
    """Run the cases that the command line selects and print how many were right."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", nargs="+", choices=sorted(PRESETS), default=[])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--shares", type=float, nargs="+", default=[0.05])
    parser.add_argument("--noise", nargs="+", choices=NOISES, default=["white"])
    parser.add_argument("--rate-hz", type=float, nargs="+", default=[1000.0])
    parser.add_argument("--excitation", nargs="+", choices=EXCITATIONS, default=["mixed"])
    parser.add_argument("--names", nargs="+", default=[], help="names joined by +, none, unfamiliar, any")
    parser.add_argument("--duration-s", type=float, default=4.0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--keep", type=Path, default=None, help="keep the campaigns in this directory")
    parser.add_argument("--last", type=int, default=0, help="only so many of the cases")
    options = parser.parse_args()
    # in no order of theirs, so that a run that is cut short is a fair sample
    cases = sorted(listed(options), key=lambda case: zlib.crc32(case.key.encode()))
    run(
        cases[: options.last or None], options.results, jobs=options.jobs, keep=options.keep,
        duration_s=options.duration_s,
    )  # fmt: skip
    rows = read_rows(options.results)
    print(json.dumps({"campaigns": len(rows), "right": sum(row["right"] for row in rows) / max(len(rows), 1)}))


if __name__ == "__main__":
    main()
