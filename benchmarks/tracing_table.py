"""Tables of docs/tracing-benchmark.md from the results of `benchmarks.tracing`.

`python -m benchmarks.tracing_table RESULTS.jsonl > docs/tracing-benchmark.md`
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import TypeVar

from benchmarks.judging import Row, parameter_errors
from benchmarks.rigs.bases import SOURCES
from benchmarks.rigs.effects import LAWS

HEAD = """# How often planted effects are found

This page measures how often `mrpipe close-loop` names the effect that a damper really has. The campaigns are simulated,
so that the correct answer is known. An effect is *planted* if it is part of the simulated damper and the program is not
given it.

- The simulated rigs (`benchmarks/rigs`) share neither code nor formulas with the program.
- The dampers have 16 base forms from the literature, integrated at 20 kHz, and forces from 100 N to 1 MN.
- The equations of the planted effects differ from those of the library wherever the physics allows it.
- The noise is white, coloured, quantised, or contains 50 Hz (`harmonics`). The sampling rate is 500, 1000 or 2000 Hz.
- The validation tests have the same kinds of motion as the training tests (`alike`) or other kinds (`unlike`).
- A third of the cases are *clean* rigs, that is, rigs without an effect.

Each seed of the random generator gives one case, which is one campaign directory. `mrpipe close-loop` runs on it as a
user would run it:

    python -m benchmarks.tracing --first-seed {first} --cases {count}
    python -m benchmarks.tracing_table benchmarks/results/tracing.jsonl

Number of cases in this table: {count}, seeds {first} to {last}. Results of earlier versions of the program are on
[a separate page](tracing-benchmark-earlier.md), and so are results on [rigs of other
generators](tracing-benchmark-other-rigs.md).

**How to read the tables.** The columns of rates count correct verdicts:

| column | a verdict is correct if |
| --- | --- |
| clean: none | no effect is named on a clean rig |
| single: first | one effect is planted, and it is the first name |
| single: alone | one effect is planted, and it is the only name |
| pair: both | two effects are planted, and both are named |
| outside: unknown | the planted effect is not in the library, none is named, and the residual is reported as unknown |
| floor right (clean) | the noise floor is within 25 % of the error of the true model on a clean rig |

In the table of all cases, *share of force* is the RMS of the force that the effect changes, over the RMS of the force
without it. *True model* is the NRMSE of the simulated damper itself on the noisy records. *Class* is `verdict_class`,
and *base taken* is the base form of the final model. *Before*, *after* and *noise floor* are NRMSE
([glossary](glossary.md)). A name that is wrong or incomplete is in bold.
"""

_Item = TypeVar("_Item")


def percent(rows: Iterable[_Item], test: Callable[[_Item], bool]) -> str:
    """Return `hits of all (percent)`."""
    found = [bool(test(row)) for row in rows]
    return f"{sum(found)} of {len(found)} ({100 * sum(found) / len(found):.0f} %)" if found else "-"


def interval(hits: int, count: int) -> str:
    """Return Wilson's interval of 95 % for a rate, in percent."""
    z2 = 1.96**2
    middle = (hits + 0.5 * z2) / (count + z2)
    half = 1.96 / (count + z2) * math.sqrt(hits * (count - hits) / count + 0.25 * z2)
    return f"{100 * max(middle - half, 0.0):.0f} to {100 * min(middle + half, 1.0):.0f} %"


def rate(found: Sequence[bool]) -> tuple[str, str]:
    """Return `hits of all (percent)` and its interval."""
    if not found:
        return "-", "-"
    return percent(found, bool), interval(sum(found), len(found))


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    cells = ([str(cell).replace("|", "\\|") for cell in row] for row in rows)
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in cells])


def of_kind(rows: Sequence[Row], kind: str) -> list[Row]:
    """Return the rows of one kind."""
    return [row for row in rows if row["kind"] == kind]


def confidences(rows: Sequence[Row]) -> list[tuple[float, bool]]:
    """Return (confidence, whether the effect is really there) of every effect that was named with a confidence."""
    return [
        (float(item["confidence"]), item["name"] in row["planted"])
        for row in rows
        for item in row["effects"]
        if item["confidence"] is not None
    ]


def at_floor(row: Row) -> bool:
    """Return whether the error after is at most 1.25 noise floors."""
    return bool(row["after"] <= 1.25 * row["floor"])


def floor_is_right(row: Row) -> bool:
    """Return whether the program's noise floor lies within 25 % of the true model's error."""
    return bool(0.75 <= row["floor"] / row["truth"]["true_model_nrmse"] <= 1.25)


def rates(rows: Sequence[Row]) -> str:
    """Return the table of acceptance figures."""
    clean, single, pair, outside = (of_kind(rows, kind) for kind in ("clean", "single", "pair", "outside"))
    first = [row for row in single if row["right"]]
    errors = [abs(error) for row in single for _, _, error in parameter_errors(row)]
    figures: list[tuple[str, list[bool], str]] = [
        ("clean rig: no effect named", [r["right"] for r in clean], "98 %"),
        ("one effect: named first", [r["right"] for r in single], "95 %"),
        ("one effect: named alone", [r["alone"] for r in single], "90 %"),
        ("pair: both named", [r["right"] for r in pair], "70 %"),
        ("pair: no name that is not there", [not r["spurious"] for r in pair], ""),
        ("shape outside the library: unknown", [r["right"] for r in outside], "80 %"),
        (
            "effects named with confidence 0.9 or more that are wrong",
            [not there for confidence, there in confidences(rows) if confidence >= 0.9],
            "at most 5 %",
        ),
        ("clean rig: error after at most 1.25 noise floors", [at_floor(r) for r in clean], "90 %"),
        ("effect named first: error after at most 1.25 noise floors", [at_floor(r) for r in first], "90 %"),
        (
            "clean rig: error after at most 1.25 times the true model's error",
            [r["after"] <= 1.25 * r["truth"]["true_model_nrmse"] for r in clean],
            "",
        ),
        (
            "effect named first: error after at most 1.25 times the true model's error",
            [r["after"] <= 1.25 * r["truth"]["true_model_nrmse"] for r in first],
            "",
        ),
        ("clean rig: noise floor within 25 % of the true model's error", [floor_is_right(r) for r in clean], "100 %"),
        ("one effect: parameters that can be compared within 15 %", [e <= 0.15 for e in errors], "90 %"),
    ]
    lines = [(what, *rate(found), aim) for what, found, aim in figures]
    if rows:
        lines.append(("time of a case, median", f"{median(r['seconds'] for r in rows):.0f} s", "", ""))
        lines.append(("time of a case, largest", f"{max(r['seconds'] for r in rows):.0f} s", "", ""))
    return table(("what", "rate", "95 % interval", "aim"), lines)


def reliability(rows: Sequence[Row]) -> str:
    """Return the reliability diagram as a table, and the Brier score."""
    pairs = confidences(rows)
    if not pairs:
        return "No effect was named."
    bins = ((0.0, 0.5), (0.5, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 1.01))
    lines = []
    for low, high in bins:
        inside = [(confidence, there) for confidence, there in pairs if low <= confidence < high]
        if inside:
            mean = sum(confidence for confidence, _ in inside) / len(inside)
            really = sum(there for _, there in inside) / len(inside)
            lines.append((f"{low:g} to {min(high, 1.0):g}", len(inside), f"{mean:.2f}", f"{really:.2f}"))
    brier = sum((confidence - there) ** 2 for confidence, there in pairs) / len(pairs)
    diagram = table(("confidence", "effects named", "mean confidence", "share really there"), lines)
    return f"{diagram}\n\nBrier score: {brier:.3f} ({len(pairs)} effects named)."


def by_group(rows: Sequence[Row], group: Callable[[Row], str], header: str) -> str:
    """Return the table of rates by a property of the case."""
    lines = []
    for name in sorted({group(row) for row in rows}):
        some = [row for row in rows if group(row) == name]
        clean, single = of_kind(some, "clean"), of_kind(some, "single")
        lines.append(
            (name, percent(clean, lambda r: r["right"]), percent(single, lambda r: r["right"]),
             percent(single, lambda r: r["alone"]), percent(of_kind(some, "pair"), lambda r: r["right"]),
             percent(of_kind(some, "outside"), lambda r: r["right"]), percent(clean, floor_is_right))
        )  # fmt: skip
    columns = (header, "clean: none", "single: first", "single: alone", "pair: both", "outside: unknown",
               "floor right (clean)")  # fmt: skip
    return table(columns, lines)


def by_effect(rows: Sequence[Row]) -> str:
    """Return the table of single effects and outside shapes by name."""
    some = [row for row in rows if row["kind"] in ("single", "outside")]
    lines = []
    for name in sorted({row["planted"][0] for row in some}):
        cases = [row for row in some if row["planted"][0] == name]
        others = Counter("+".join(row["found"]) or "none" for row in cases if not row["alone"])
        instead = ", ".join(f"{verdict} ({times})" for verdict, times in others.most_common(5))
        lines.append((name, percent(cases, lambda r: r["right"]), percent(cases, lambda r: r["alone"]), instead))
    return table(("planted", "right", "right and nothing else", "named otherwise"), lines)


def parameters(rows: Sequence[Row]) -> str:
    """Return the table of parameter errors."""
    found: dict[tuple[str, str], list[float]] = {}
    for row in of_kind(rows, "single"):
        for name, key, error in parameter_errors(row):
            found.setdefault((name, key), []).append(100.0 * error)
    if not found:
        return "None to compare."
    return table(
        ("effect", "parameter", "errors [%]"),
        [(*key, ", ".join(f"{error:+.0f}" for error in sorted(errors))) for key, errors in sorted(found.items())],
    )


def planted_laws() -> str:
    """Return the tables of base forms and of the laws that are planted."""
    forms = table(("base form", "source"), SOURCES.items())
    return forms + "\n\n" + table(("planted", "law"), LAWS.items())


def every_case(rows: Sequence[Row]) -> str:
    """Return one line for each case."""
    order = {"clean": 0, "single": 1, "pair": 2, "outside": 3}
    lines = []
    for row in sorted(rows, key=lambda r: (order[r["kind"]], r["planted"], r["base"], r["seed"])):
        named = ", ".join(f"{i['name']} {i['confidence'] or 0:.2f}" for i in row["effects"]) or "none"
        shares = ", ".join(f"{share:.2f}" for share in row["truth"]["shares"])
        lines.append(
            (row["seed"], "+".join(row["planted"]) or "none", shares, row["base"],
             f"{row['noise']}, {row['rate_hz']:g} Hz, {row['training']}, {row['validation']}",
             named if row["alone"] else f"**{named}**", row["verdict_class"] or "", row["base_taken"] or "",
             *(f"{row[key]:.4f}" for key in ("before", "after", "floor")), f"{row['truth']['true_model_nrmse']:.4f}")
        )  # fmt: skip
    header = ("seed", "planted", "share of force", "base form", "conditions", "named, confidence", "class",
              "base taken", "before", "after", "noise floor", "true model")  # fmt: skip
    return table(header, lines)


def document(all_rows: Sequence[Row]) -> str:
    """Return the whole document."""
    rows = [row for row in all_rows if not row["error"]]
    failed = [row for row in all_rows if row["error"]]
    if not rows:
        return f"No case was run ({len(failed)} failed)."
    seeds = [row["seed"] for row in all_rows]
    sections = [
        ("Rates", rates(rows)),
        ("Reliability of the confidence", reliability(rows)),
        ("By base form", by_group(rows, lambda r: r["base"], "base form")),
        ("By effect", by_effect(rows)),
        ("By noise", by_group(rows, lambda r: r["noise"], "noise")),
        ("By sampling rate", by_group(rows, lambda r: f"{r['rate_hz']:g} Hz", "rate")),
        ("By excitation", by_group(rows, lambda r: f"{r['training']} / {r['validation']}", "training / validation")),
        ("By strength", by_group(rows, lambda r: f"{r['share']:g} of force RMS", "strength wanted")),
        ("Parameters", parameters(rows)),
        ("What the rigs are made of", planted_laws()),
        ("Every case", every_case(rows)),
    ]
    if failed:
        lines = [(row["seed"], "+".join(row["planted"]) or "none", row["base"], row["error"].split("\n")[-1][-200:])
                 for row in failed]  # fmt: skip
        sections.insert(1, ("Cases in which the program failed", table(("seed", "planted", "base", "error"), lines)))
    head = HEAD.format(first=min(seeds), last=max(seeds), count=len(all_rows))
    return "\n\n".join([head.strip(), *(f"## {title}\n\n{text}" for title, text in sections)]) + "\n"


def main() -> None:
    """Print the document."""
    from benchmarks.results import read_rows

    print(document([row for path in sys.argv[1:] for row in read_rows(Path(path))]), end="")


if __name__ == "__main__":
    main()
