"""How often planted effects are found: `make bench-tracing`, or `python -m benchmarks.tracing --seeds 3 --shares 0.05`.

Every campaign is drawn by the virtual laboratory; its truth is read only after the verdict. Writes
benchmarks/results/tracing.csv (a row a campaign) and tracing.md (confusion matrix and rates).
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pandas as pd

RESULTS = Path(__file__).with_name("results")


def one(name: str, seed: int, share: float, colour: str, rate_hz: float) -> dict[str, Any]:
    from mrpipe.campaigns import load_campaign, write_campaign
    from mrpipe.discrepancy.summary import TracingOptions
    from mrpipe.discrepancy.tracing import trace_campaign
    from mrpipe.effects.library import damper_effects
    from mrpipe.laboratory.bench import CHANNELS, BenchRig, BenchSensors, record_bench
    from mrpipe.laboratory.damper import damper_from_set, draw_damper
    from mrpipe.laboratory.effects import draw_hidden_effect
    from mrpipe.laboratory.motion import Servo
    from mrpipe.laboratory.plans import tests_of
    from mrpipe.signals.preparation import PreparationOptions, prepare_campaign

    warnings.simplefilter("ignore")
    rng = np.random.default_rng([seed, 77])
    damper = draw_damper(rng, damper_from_set("set-c"), 0.15)
    names = [part for part in name.split("+") if part != "none"]
    damper = damper.with_effects([draw_hidden_effect(rng, names=(part,), share=share) for part in names])
    rig = BenchRig(servo=Servo(), sensors=BenchSensors(colour=colour), sampling_rate_hz=rate_hz)
    record = record_bench(damper, tests_of("compact", cycles=6, duration_s=5.0), rig, rng)
    with tempfile.TemporaryDirectory() as folder:
        write_campaign(
            Path(folder), campaign="bench", rig="damper-bench", sampling_rate_hz=rate_hz, channels=CHANNELS,
            tests=record.tests, data_format="h5", extra={"declared_effects": []},
        )  # fmt: skip
        tests = [item.test for item in prepare_campaign(load_campaign(Path(folder)), PreparationOptions()).tests]
    began = time.perf_counter()
    summary = trace_campaign(tests, damper_effects(), [], TracingOptions(), rng=np.random.default_rng(seed)).summary
    found = [item["name"] for item in summary["effects"]]
    return {
        "planted": name,
        "form": "+".join(str(item.get("form")) for item in record.truth["effects"]),
        "seed": seed,
        "share": share,
        "noise": colour,
        "rate_hz": rate_hz,
        "found": "+".join(found) or ("unknown" if summary["residual"]["structured"] else "none"),
        "right": verdict_is_right(names, found, summary),
        "before": summary["before"]["nrmse"],
        "after": summary["after"]["nrmse"],
        "noise_floor": summary["noise_floor_nrmse"],
        "seconds": time.perf_counter() - began,
    }


def verdict_is_right(names: list[str], found: list[str], summary: dict[str, Any]) -> bool:
    if not names:
        return not found
    if names == ["unfamiliar"]:
        return not found and bool(summary["unexplained"]["structured"])
    return set(names) <= set(found) if len(names) > 1 else found[:1] == names


def table(rows: pd.DataFrame, command: str) -> str:
    rates = rows.groupby(["share", "noise", "planted"]).agg(
        campaigns=("right", "size"), right=("right", "mean"), before=("before", "mean"), after=("after", "mean"),
        noise_floor=("noise_floor", "mean"), seconds=("seconds", "mean"),
    )  # fmt: skip
    confusion = pd.crosstab(rows["planted"], rows["found"])
    return (
        f"# Tracing planted effects\n\nCommand: `{command}`\n\n## Rates\n\n```\n{rates.round(4).to_string()}\n```\n\n"
        f"## Confusion (planted in rows, verdict in columns)\n\n```\n{confusion.to_string()}\n```\n"
    )


def main() -> None:
    from mrpipe.effects.library import damper_effects

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--shares", type=float, nargs="+", default=[0.05])
    parser.add_argument("--noise", nargs="+", default=["white"])
    parser.add_argument("--rate-hz", type=float, nargs="+", default=[1000.0])
    parser.add_argument("--names", nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    names = options.names or ["none", "unfamiliar", *damper_effects()]
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    work = [
        (name, seed, share, noise, rate)
        for share in options.shares
        for noise in options.noise
        for rate in options.rate_hz
        for name in names
        for seed in seeds
    ]
    results = joblib.Parallel(n_jobs=options.jobs, verbose=5)(joblib.delayed(one)(*item) for item in work)
    rows = pd.DataFrame(results)
    RESULTS.mkdir(exist_ok=True)
    rows.to_csv(RESULTS / "tracing.csv", index=False, float_format="%.5g")
    command = f"python -m benchmarks.tracing --seeds {options.seeds} --shares {' '.join(map(str, options.shares))}"
    (RESULTS / "tracing.md").write_text(table(rows, command), encoding="utf-8")
    print(json.dumps({"campaigns": len(rows), "right": float(rows["right"].mean())}))


if __name__ == "__main__":
    main()
