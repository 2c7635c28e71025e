"""How often planted effects are found, on rigs independent of the program: `make bench-tracing`.

`python -m benchmarks.tracing --first-seed 50000 --cases 48` draws a rig for every seed (base form x effect x noise x
excitation, see :mod:`benchmarks.rigs`), writes its campaign directory, and runs `mrpipe close-loop --campaign` on it as
a user would. The truth is compared with what the program prints. Each case is one line of a results file, so that an
interrupted run continues where it ended. `python -m benchmarks.tracing_table` makes tables of the results.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import count, islice
from pathlib import Path
from typing import Any

from benchmarks.judging import judged, verdict_row
from benchmarks.results import append_row, read_rows
from benchmarks.rigs.bases import BASES
from benchmarks.rigs.cases import KINDS, Case, case_of

RESULTS = Path(__file__).with_name("results") / "tracing.jsonl"


def close_loop(campaign: Path, run: Path, timeout_s: float) -> dict[str, Any]:
    """Run `mrpipe close-loop` on a campaign and return what it prints.

    Raises
    ------
    RuntimeError
        If the program fails; the message holds the end of what it says.
    """
    command = [sys.executable, "-m", "mrpipe", "close-loop", "--campaign", str(campaign), "--run", str(run)]
    done = subprocess.run(
        [*command, "--jobs", "1", "--quiet", "--json"], capture_output=True, text=True, timeout=timeout_s, check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    if done.returncode != 0:
        raise RuntimeError(f"exit status {done.returncode}: {done.stderr.strip()[-600:]}")
    return dict(json.loads(done.stdout))


def run_case(case: Case, *, keep: Path | None = None, timeout_s: float = 900.0) -> dict[str, Any]:
    """Record a case, trace it and return its row; `keep` is a directory for the campaigns whose verdict is wrong."""
    from benchmarks.rigs.campaign import record, write

    row: dict[str, Any] = case.as_row()
    try:
        with tempfile.TemporaryDirectory() as temporary:
            campaign = record(case)
            row["truth"] = campaign.truth
            directory = write(campaign, Path(temporary) / f"rig-{case.seed}")
            began, used = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
            summary = close_loop(directory, Path(temporary) / "run", timeout_s)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            row |= {
                "seconds": round(time.perf_counter() - began, 1),
                "cpu_seconds": round(after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime, 1),
            }
            row |= verdict_row(summary)
            row |= judged(case.kind, row["planted"], row)
            if keep is not None and not row["alone"]:
                write(campaign, keep / f"rig-{case.seed}")
                (keep / f"rig-{case.seed}.truth.json").write_text(json.dumps(row, indent=1), encoding="utf-8")
    except Exception as error:
        return {**row, "right": False, "alone": False, "error": f"{type(error).__name__}: {error}"[-900:]}
    return {**row, "error": ""}


def selected(options: argparse.Namespace) -> Iterator[Case]:
    """Yield the cases that the command line selects, by seed."""
    cases = (case_of(seed) for seed in count(options.first_seed))
    wanted = (
        case
        for case in cases
        if (not options.kinds or case.kind in options.kinds)
        and (not options.bases or case.base in options.bases)
        and (not options.effects or set(case.planted) & set(options.effects))
    )
    return islice(wanted, options.cases)


def report_line(row: dict[str, Any]) -> str:
    """Return one line that says what was planted and what was found."""
    mark = "ok " if row["alone"] else "first" if row["right"] else "BAD"
    if row["error"]:
        return f"ERR {row['seed']} {row['error'][-200:]}"
    planted, found = "+".join(row["planted"]) or "clean", "+".join(row["found"]) or "nothing"
    return (
        f"{mark:5s} {row['seed']} {row['base']}: {planted} -> {found} ({row['verdict_class'] or row['verdict']}), "
        f"{row['before']:.4f} to {row['after']:.4f}, floor {row['floor']:.4f}, "
        f"true model {row['truth']['true_model_nrmse']:.4f}, {row['seconds']:.0f} s"
    )


def main() -> None:
    """Run the cases that the command line selects and print their table."""
    import joblib

    from benchmarks.tracing_table import document

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first-seed", type=int, default=50000)
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--kinds", nargs="+", choices=sorted(set(KINDS)), default=[])
    parser.add_argument("--bases", nargs="+", choices=BASES, default=[])
    parser.add_argument("--effects", nargs="+", default=[])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=Path, default=RESULTS)
    parser.add_argument("--keep", type=Path, default=None, help="directory for the campaigns whose verdict is wrong")
    parser.add_argument("--minutes", type=float, default=1e9, help="begin no case after this time")
    options = parser.parse_args()
    done = {row["seed"] for row in read_rows(options.results)}
    until = time.monotonic() + 60.0 * options.minutes
    todo = (case for case in selected(options) if case.seed not in done and time.monotonic() < until)
    parallel = joblib.Parallel(n_jobs=options.jobs, return_as="generator_unordered", pre_dispatch=options.jobs)
    for row in parallel(joblib.delayed(run_case)(case, keep=options.keep) for case in todo):
        append_row(options.results, row)
        print(report_line(row), file=sys.stderr, flush=True)
    print(document(read_rows(options.results)))


if __name__ == "__main__":
    main()
