"""Tables of docs/tracing-benchmark-laboratory.md from the results of `benchmarks.laboratory_tracing`.

`python -m benchmarks.laboratory_tracing_table RESULTS.jsonl > docs/tracing-benchmark-laboratory.md`
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

from benchmarks.results import read_rows

Row = dict[str, Any]
_Item = TypeVar("_Item")

HEAD = """# Effects planted in the virtual laboratory

This page measures how often effects are found that are planted in the virtual laboratory. The virtual laboratory is
part of the program, and its damper is a Bouc-Wen damper, so that these cases are easier than those of the [tracing
benchmark](tracing-benchmark.md). Each case is a campaign of 44 tests of 4 s (the plan `compact`) with effects that
`campaign.yaml` does not declare. The planted effects are read only after the verdict. Each seed is used once.

    python -m benchmarks.laboratory_tracing --preset core conditions --first-seed {first} --results RESULTS.jsonl
    python -m benchmarks.laboratory_tracing_table RESULTS.jsonl

The cases are run in random order; this table holds {count} of those that the presets list.
"""


def kind_of(row: Row) -> str:
    """Return `clean`, `outside`, `pair` or `single`."""
    if row["planted"] == "none":
        return "clean"
    if row["planted"] == "unfamiliar":
        return "outside"
    return "pair" if "+" in row["planted"] else "single"


def percent(rows: Iterable[_Item], test: Callable[[_Item], bool]) -> str:
    """Return `hits of all (percent)`."""
    found = [test(row) for row in rows]
    return f"{sum(found)} of {len(found)} ({100 * sum(found) / len(found):.0f} %)" if found else "none run"


def rates(rows: list[Row]) -> list[str]:
    """Return the lines of the table of rates."""
    groups = {name: [row for row in rows if kind_of(row) == name] for name in ("single", "clean", "outside", "pair")}
    single = groups["single"]
    named = [row for row in single if row["right"]]
    lines = [
        "| what | rate | aim |",
        "| --- | --- | --- |",
        f"| one effect, 5 to 20 % of force RMS: named first | {percent(single, lambda r: r['right'])} | 95 % |",
        f"| ... and nothing else named | {percent(single, lambda r: r['right'] and not r['spurious'])} | |",
        f"| ... and tied with no other | "
        f"{percent(single, lambda r: r['right'] and not r['effects'][0]['tied_with'])} | |",
        f"| clean rig: nothing named | {percent(groups['clean'], lambda r: r['right'])} | 98 % |",
        f"| shape of no family: unknown | {percent(groups['outside'], lambda r: r['right'])} | 80 % |",
        f"| pair of effects, 8 % each: both named | {percent(groups['pair'], lambda r: r['right'])} | 70 % |",
        f"| pair: at least one, and none that is not there | "
        f"{percent(groups['pair'], lambda r: bool(r['found']) and not r['spurious'])} | |",
        f"| held-out error after at most 1.25 noise floors (one effect) | "
        f"{percent(named, lambda r: r['after'] <= 1.25 * r['floor'])} | all |",
        f"| ... at most 2 noise floors | {percent(named, lambda r: r['after'] <= 2.0 * r['floor'])} | |",
    ]
    if rows:
        lines.append(f"| processor time of a tracing, median | {median(r['cpu_seconds'] for r in rows):.0f} s | |")
        lines.append(f"| ... largest | {max(r['cpu_seconds'] for r in rows):.0f} s | |")
    return lines


def by_effect(rows: list[Row]) -> list[str]:
    """Return the lines of the table by effect."""
    lines = [
        "| planted | share of force RMS | planted form | verdict | form named | before | after | noise floor |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in sorted(rows, key=lambda r: (kind_of(r) != "single", kind_of(r), r["truth"], r["share"], r["seed"])):
        verdict = row["verdict"] if row["right"] else f"**{row['verdict']}**"
        forms = ", ".join(item["form"] for item in row["effects"])
        share = "" if row["planted"] == "none" else f"{row['share']:g}"
        lines.append(
            f"| {'+'.join(row['truth']) or 'none'} | {share} | {', '.join(row['truth_forms'])} | {verdict} | {forms} "
            f"| {row['before']:.4f} | {row['after']:.4f} | {row['floor']:.4f} |"
        )
    return lines


def conditions_of(rows: list[Row]) -> list[str]:
    """Return the lines of the table by noise, rate, excitation and strength."""
    plain = {"noise": "white", "rate_hz": 1000.0, "excitation": "mixed"}
    groups: dict[str, list[Row]] = {}
    for row in rows:
        other = [f"{key}: {row[key]}" for key, usual in plain.items() if row[key] != usual]
        name = ", ".join(other) or f"as usual, {row['share']:g} of force RMS"
        groups.setdefault(name, []).append(row)
    lines = ["| condition | one effect named first | clean rig: nothing named |", "| --- | --- | --- |"]
    for name, group in sorted(groups.items()):
        single = [row for row in group if kind_of(row) == "single"]
        clean = [row for row in group if kind_of(row) == "clean"]
        if single:
            lines.append(
                f"| {name} | {percent(single, lambda r: r['right'])} | {percent(clean, lambda r: r['right'])} |"
            )
    return lines


SAME_MEANING = {
    ("accumulator", "gas-spring", "gas"): ("stiffness", "stiffness"),
    ("backlash", "free", "free"): ("gap", "gap"),
    ("backlash", "held", "held"): ("gap", "gap"),
    ("channel-skew", "constant", "late-force"): ("time", "skew"),
    ("delay", "dead-time", "dead-time"): ("time", "delay"),
    ("end-stop", "hertz", "contact"): ("clearance", "free_travel"),
    ("inertia", "lagged", "mass"): ("mass", "mass"),
    ("migration", "slip", "rational"): ("slip", "slip_length"),
    ("pinching", "quartic", "flat"): ("width", "width"),
    ("stribeck", "rational", "rational"): ("speed", "velocity_scale"),
}
"""(effect, planted form, form found) -> a number of the planted form, and the parameter that means the same."""


def parameter_errors(rows: list[Row]) -> list[str]:
    """Return the lines of the table of parameters where the form found says the same as the one planted."""
    errors: dict[tuple[str, ...], list[float]] = {}
    for row in rows:
        for found in row["effects"]:
            for name, form, values in zip(
                row["truth"], row["truth_forms"], row.get("truth_parameters", ()), strict=False
            ):
                same = SAME_MEANING.get((found["name"], form, found["form"]))
                if same and name == found["name"]:
                    off = found["parameters"][same[1]] / values[same[0]] - 1.0
                    errors.setdefault((found["name"], found["form"], same[1]), []).append(100.0 * off)
    every = [abs(off) for offs in errors.values() for off in offs]
    lines = [f"Within 15 %: {percent(every, lambda off: off <= 15.0)}.", ""] if every else ["None to compare."]
    if every:
        lines += ["| effect | form found | parameter | errors [%] |", "| --- | --- | --- | --- |"]
    return lines + [
        f"| {effect} | {form} | {name} | {', '.join(f'{off:+.0f}' for off in sorted(offs))} |"
        for (effect, form, name), offs in sorted(errors.items())
    ]


def confusions(rows: list[Row]) -> list[str]:
    """Return the lines that say what was taken for what."""
    wrong = Counter(
        ("+".join(row["truth"]) or "none", row["verdict"]) for row in rows if not row["right"] or row["spurious"]
    )
    if not wrong:
        return ["None."]
    return ["| planted | verdict | times |", "| --- | --- | --- |"] + [
        f"| {planted} | {verdict} | {count} |" for (planted, verdict), count in sorted(wrong.items())
    ]


def main() -> None:
    """Print the document."""
    rows = [row for path in sys.argv[1:] for row in read_rows(Path(path)) if not row["error"]]
    first = min(row["seed"] for row in rows) // 1000 * 1000
    parts = [HEAD.format(first=first, count=len(rows)), "## Rates", "\n".join(rates(rows))]
    parts += ["## What was taken for what", "\n".join(confusions(rows))]
    parts += ["## Parameters", "\n".join(parameter_errors(rows))]
    parts += ["## By condition", "\n".join(conditions_of(rows)), "## Every case", "\n".join(by_effect(rows))]
    print("\n\n".join(part.strip() for part in parts))


if __name__ == "__main__":
    main()
