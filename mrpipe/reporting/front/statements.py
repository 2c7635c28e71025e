"""The first screen in plain sentences: what was measured, how good the models are, what is missing, which law is best.

Everything comes from the summaries of the stages, so that `mrpipe report --summary` prints it without drawing anything.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mrpipe.reporting.facts import RunFacts
from mrpipe.reporting.front import laws as law_facts
from mrpipe.reporting.front import several_dampers
from mrpipe.reporting.headlines import weak_network
from mrpipe.reporting.places import names_of, size_in_words
from mrpipe.reporting.traced_words import (
    exchange_in_words,
    exchanged_form,
    leading_first,
    proper_effects,
    tie_in_words,
    uncertainty,
    verdict_class,
)
from mrpipe.reporting.words import percent, plain, quantity, with_interval
from mrpipe.words import counted, duration, in_percent, listed, noun, number

NARROW = 0.001
"""Half width of an interval, over the value, below which its digits are not written out: it holds the noise alone."""

FITTED_ALIKE = 0.1
"""Two fits of one form whose errors differ by less than this share are reported as one."""


_DRIVES = {None: "constant", "constant": "constant", "steps": "stepped", "half-sine": "half-sine", "random": "random"}
PARTS = {"pre_yield": "before yield", "post_yield": "after yield", "reversal": "around reversals"}
"""Part of the cycle -> the words for it."""


@dataclass(frozen=True)
class Statement:
    """One answer of the first screen.

    Attributes
    ----------
    topic
        The question it answers, in one or two words.
    text
        The answer in one to four sentences.
    """

    topic: str
    text: str


def statements(facts: RunFacts) -> list[Statement]:
    """Return the answers that the stages of a run allow, in the order of a reader's questions."""
    found = [
        Statement("Measured", measured(facts)),
        Statement("Missing", missing(facts)),
        Statement("Trust", trusted(facts)),
        Statement("Models", models(facts)),
        Statement("Weak spots", weak_spots(facts)),
        Statement("Structure", structure(facts)),
        Statement("Control", law_facts.answer(facts) or several_dampers.answer(facts) or _without_laws(facts)),
        Statement("Test next", next_tests(facts)),
        Statement("Distrust", " ".join(doubts(facts)[:4])),
    ]
    return [item for item in found if item.text]


def measured(facts: RunFacts) -> str:
    """Return what was measured: tests, time, motion and drive of the damper; floors and tests of the structure."""
    parts = []
    prepared = facts.summary("prepare")
    if prepared.get("tests"):
        tests = prepared["tests"]
        unseen = sum(test["role"] == "validation" for test in tests)
        seconds = sum(test["duration_s"] for test in tests)
        stroke = max(test.get("displacement_peak_m", test["amplitude_m"]) for test in tests)
        speed = max(test["velocity_peak_m_s"] for test in tests)
        force = max(test["force_peak_n"] for test in tests)
        motion = f"up to {number(1e3 * stroke)} mm, " if stroke > 0.0 else ""
        parts.append(
            f"Damper: {len(tests)} tests of campaign {prepared['campaign']}, {duration(seconds)}, {motion}"
            f"{number(speed)} m/s and {number(force)} N. {unseen} of them are validation tests, which no fit has seen."
        )
    frame = facts.summary("identify-frame")
    if "frequencies_hz" in frame:
        source = f"campaign {frame['campaign']}" if frame.get("campaign") else "given in the configuration"
        parts.append(f"Structure: {size_in_words(names_of(frame))}, {source}.")
    loop = facts.summary("close-loop").get("closed_loop") or {}
    recorded = sum(bool(item.get("recorded")) for item in loop.get("tests", []))
    if recorded:
        parts.append(f"Closed loop: {recorded} recordings.")
    return " ".join(parts)


def missing(facts: RunFacts) -> str:
    """Return what the model lacks, with value, interval and confidence, and the error before and after."""
    summary = facts.summary("close-loop")
    if "before" not in summary:
        return ""
    before, after = summary["before"]["nrmse"], summary["after"]["nrmse"]
    floor = summary["noise_floor_nrmse"]
    errors = f"Error on unseen tests: {percent(before)} before, {percent(after)} after (noise alone: {percent(floor)})."
    kind = verdict_class(summary)
    subject = f"The {summary.get('model') or 'linear'} model"
    effects, form = proper_effects(summary), exchange_in_words(summary)
    exchange = f" {form}" if form else ""
    if kind == "validation differs":
        differences = "; ".join(item["sentence"] for item in summary["validation"]["differences"][:3])
        return (
            f"The validation tests differ from the training tests: {differences}. The error of {percent(after)} on "
            "them therefore does not judge the model."
        )
    if kind == "noise":
        return (
            f"{subject} lacks nothing that these tests could show: its error on unseen tests, {percent(before)}, is "
            f"that of the noise ({percent(floor)})."
        )
    if kind == "base form":
        return f"{subject} is not the right base form: {summary['verdict']}. {errors}"
    if not effects:
        states = [item["state"] for item in summary["unexplained"]["depends_on"][:3]]
        varies = f" It varies with {listed(states)}." if states else ""
        drift = _drift_of(summary)
        tied = tie_in_words(summary)
        lacks = f"{subject} lacks something" + (f". {tied}" if tied else " that no effect of the library explains.")
        if form:
            share = percent(summary["unexplained"]["share_of_residual"])
            lacks = f"{form} What it leaves, {share} of the squared residual, no effect of the library explains."
        return f"{lacks}{varies}{drift} {errors}"
    named = listed([f"**{effect['name']}**{_value_of(effect)}" for effect in effects])
    sure = listed([_confidence(effect["confidence"]) for effect in effects])
    meanings = "".join(f" {effect['physics'].rstrip('.')}." for effect in effects if effect.get("physics"))
    text = f"{subject} lacks {named}. Confidence: {sure}.{meanings}{exchange} {errors}"
    ceiling = (summary.get("ceiling") or {}).get("nrmse")
    if ceiling is not None:
        text += f" The best any model reached is {percent(ceiling)}."
    if kind == "partly explained" or summary["unexplained"]["structured"]:
        share = summary["unexplained"]["share_of_residual"]
        text += f" A part stays unexplained ({percent(share)} of the squared residual)."
    return text


def _value_of(effect: Mapping[str, Any]) -> str:
    """Return the leading parameter of an effect with its interval; a well-determined one leads."""
    place = f" at {effect['place']}" if effect.get("place") else ""
    for name, entry in leading_first(effect):
        low, high = uncertainty(entry)
        level = f"{in_percent(entry.get('interval_level', 0.95))} interval"
        if 0.0 < abs(high - low) < 2.0 * NARROW * abs(entry["value"]):
            value = quantity(entry["value"], entry["unit"], 4)
            return f"{place} ({plain(name)} {value}, {level} within {percent(NARROW)})"
        if low == high:  # the tracing gives none
            return f"{place} ({plain(name)} {quantity(entry['value'], entry['unit'])})"
        value, _, interval = with_interval(entry["value"], low, high, entry["unit"]).partition(" (")
        return f"{place} ({plain(name)} {value}, {level} {interval.rstrip(')')})"
    return place


def _confidence(value: float) -> str:
    word = "high" if value >= 0.9 else "medium" if value >= 0.6 else "low"
    return f"{word} ({value:.2f})"


def trusted(facts: RunFacts) -> str:
    """Return what supports the named effects: unseen tests that improve, and how far behind the best rival is."""
    loop = facts.summary("close-loop")
    effects = proper_effects(loop)
    tests = [row for row in loop.get("tests", []) if row.get("nrmse_before") is not None]
    if not effects or not tests:
        return ""
    better = sum(row["nrmse_after"] < row["nrmse_before"] for row in tests)
    if len(tests) == 1:
        text = "Unseen test: 1; " + ("its error falls." if better else "its error does not fall.")
    else:
        text = f"The error falls in {better} of {len(tests)} unseen tests."
    names = {effect["name"] for effect in effects}
    rivals = [
        (float(item["nrmse"]), str(item["name"]))
        for item in loop.get("candidates", [])
        if item["name"] not in names and item.get("nrmse") is not None
    ]
    if rivals:
        error, rival = min(rivals)
        text += f" The best other explanation, {rival}, leaves {percent(error)}."
    recovered = (loop.get("ceiling") or {}).get("recovered")
    if recovered is not None:
        text += f" {percent(recovered)} of what a flexible model of the residual can explain is explained."
    return text


def _drift_of(summary: Mapping[str, Any]) -> str:
    """Return how the stiffness of a structure changes over its tests; empty where it does not."""
    between = (summary.get("frame") or {}).get("between_tests") or {}
    if between.get("kind") not in ("drift", "step"):
        return ""
    of = f" of storey {between['storey']}" if between.get("storey") else ""
    return f" The stiffness{of} changes by {percent(between['stiffness_change'])} over the tests."


def weak_spots(facts: RunFacts) -> str:
    """Return where the final model is bad: the worst unseen tests, and what the remaining error varies with."""
    loop = facts.summary("close-loop")
    tests = [row for row in loop.get("tests", []) if row.get("nrmse_after") is not None]
    if not tests or verdict_class(loop) == "validation differs":
        return ""
    worst = sorted(tests, key=lambda row: -float(row["nrmse_after"]))[:2]
    made = _conditions(facts)
    named = listed([f"{row['name']} ({percent(row['nrmse_after'])}{made.get(str(row['name']), '')})" for row in worst])
    text = f"The error of the final model is largest in {noun(len(worst), 'test')} {named}."
    states = [str(item["state"]) for item in loop["unexplained"].get("depends_on", [])[:3]]
    if states and loop["unexplained"]["structured"]:
        text += f" It varies with {listed(states)}."
    where = (loop.get("residual") or {}).get("where") or {}
    if where and verdict_class(loop) != "noise":
        part, share = max(where.items(), key=lambda item: float(item[1]))
        lay = "Before the correction" if proper_effects(loop) else "With the declared model"
        text += f" {lay}, {percent(share)} of the squared residual lay {PARTS.get(part) or f'in {plain(part)}'}."
    recordings = [row for row in (loop.get("closed_loop") or {}).get("tests", []) if _history_error(row) is not None]
    if recordings:
        row = max(recordings, key=lambda item: _history_error(item) or 0.0)
        text += (
            f" In the closed loop, the history of the top floor is missed most in recording {row['test']}: by "
            f"{percent(_history_error(row))} of its RMS value."
        )
    return text


def _history_error(row: Mapping[str, Any]) -> float | None:
    """Return the error of the predicted history of the top floor in a recording of the closed loop."""
    return (row.get("after") or {}).get("nrmse_x_top") if row.get("recorded") else None


def _conditions(facts: RunFacts) -> dict[str, str]:
    """Return test -> what was done in it: `; 5.0 mm, 1.0 Hz, mean drive 0.50 A`; only for tests of one frequency."""
    prepared = facts.summary("prepare")
    made = {}
    for test in prepared.get("tests", []):
        if test.get("frequency_hz") and test.get("excitation", "periodic") == "periodic" and "drive_mean" in test:
            motion = f"{number(1e3 * test['amplitude_m'], 2)} mm, {number(test['frequency_hz'], 2)} Hz"
            drive = round(float(test["drive_mean"]), 2) + 0.0  # no minus sign before a zero
            made[str(test["name"])] = f"; {motion}, mean drive {drive:.2f} {prepared.get('drive_unit', '')}".rstrip()
    return made


def _without_laws(facts: RunFacts) -> str:
    """Return why no law is recommended, where a damper was measured or modelled."""
    if not any(facts.summary(name) for name in ("prepare", "identify-damper", "close-loop")):
        return ""
    if facts.laws or facts.summary("calibrate"):
        return "No law was simulated: `mrpipe simulate --law all` compares them."
    if "frequencies_hz" in facts.summary("identify-frame"):
        return "The laws are not calibrated: `mrpipe calibrate` does it, and `mrpipe simulate --law all` compares them."
    return (
        "There is no structure in this run, so no law can be recommended. Add a frame campaign, or describe the "
        "structure in the section `structure`."
    )


def models(facts: RunFacts) -> str:
    """Return the error of every model on unseen tests, with noise floor and linear baseline."""
    rows = [f"{name} {percent(value)}" for name, value, _ in model_errors(facts)]
    inverse = facts.summary("train-inverse")
    text = f"RMS error over RMS force on unseen tests: {', '.join(rows)}." if rows else ""
    text += _fitted_again(facts)
    if "error_over_range" in inverse:
        text += f" The inverse network misses the drive by {percent(inverse['error_over_range'])} of its range"
        linear = inverse.get("linear_baseline_error_over_range")
        text += f" (linear model {percent(linear)})." if linear is not None else "."
    weak = weak_network({name: facts.summary(name) for name in ("identify-damper", "train-forward")})
    return f"{text} {weak}".strip()


def _fitted_again(facts: RunFacts) -> str:
    """Return why the error of the damper model differs from that of the declared model of close-loop."""
    damper, loop = facts.summary("identify-damper"), facts.summary("close-loop")
    if "validation_nrmse" not in damper or "before" not in loop or damper.get("form") != loop.get("model"):
        return ""
    identified, before = damper["validation_nrmse"], loop["before"]["nrmse"]
    if abs(before - identified) <= FITTED_ALIKE * identified:
        return ""
    return (
        f" close-loop fits {damper['form']} again, with weights from the noise and an offset for each test: "
        f"{percent(before)}{' before the effect is added' if proper_effects(loop) else ''}."
    )


def model_errors(facts: RunFacts) -> list[tuple[str, float, str]]:
    """Return (name, NRMSE on the validation tests, kind) of the force models, best first; kind as in the figure."""
    found: list[tuple[str, float | None, str]] = []
    loop, damper, network = (facts.summary(name) for name in ("close-loop", "identify-damper", "train-forward"))
    if loop.get("noise_floor_nrmse"):
        found.append(("noise alone", loop["noise_floor_nrmse"], "noise"))
    form, effects = exchanged_form(loop), proper_effects(loop)
    kind = "structure model" if str(loop.get("model", "")).endswith("-frame") else "damper model"
    if effects or (form and "after" in loop):
        parts = [kind, form, "with the effect" if effects else ""]
        found.append((" ".join(filter(None, parts)), loop["after"]["nrmse"], "after"))
    if "validation_nrmse" in damper:
        found.append((f"damper model {damper['form']}", damper["validation_nrmse"], "before"))
    elif "before" in loop and loop.get("model"):
        found.append((f"{kind} {loop['model']}", loop["before"]["nrmse"], "before"))
    if "validation_nrmse" in network:
        found.append((f"forward network {network['architecture']}", network["validation_nrmse"], "network"))
        found.append(("linear model", network.get("linear_baseline_nrmse"), "linear"))
    return sorted(
        ((name, float(value), kind) for name, value, kind in found if value is not None), key=lambda item: item[1]
    )


def structure(facts: RunFacts) -> str:
    """Return the modes of the structure."""
    frame = facts.summary("identify-frame")
    if "frequencies_hz" not in frame:
        return ""
    frequencies = listed([number(value) for value in frame["frequencies_hz"]])
    least, largest = (number(100.0 * extreme(frame["damping_ratios"]), 2) for extreme in (min, max))
    if least == largest:
        return f"Modes at {frequencies} Hz with a damping ratio of {least} %."
    return f"Modes at {frequencies} Hz with damping ratios of {least} to {largest} %."


def next_tests(facts: RunFacts) -> str:
    """Return which tests would decide what is open, and which would replace an extrapolation."""
    parts = []
    wanted = facts.summary("close-loop").get("next_tests") or {}
    if wanted.get("tests"):
        questions = "; ".join(item["decides"] for item in wanted["decides"][:3])
        number_of = counted(len(wanted["tests"]), "test")
        parts.append(f"{number_of} would decide {questions}: {_described(wanted['tests'])} ({wanted['file']}).")
    elif wanted.get("made_already"):
        questions = "; ".join(item["decides"] for item in wanted["decides"][:3])
        parts.append(f"Still open although tests for it were made: {questions}. Longer tests or repeats may decide.")
    beyond = law_facts.beyond_tests(facts)
    if beyond:
        parts.append(f"Bench tests up to {beyond}: the closed loop moves the damper that far, and no bench test does.")
    if not parts and proper_effects(facts.summary("close-loop")):
        parts.append("No further test is needed to decide which effect is missing.")
    return " ".join(parts)


def _described(tests: Sequence[Mapping[str, Any]]) -> str:
    """Return tests to be made in words: kind of motion and drive, and the span of amplitude and frequency."""
    named = (
        f"{test.get('motion', 'any')} motion with {_DRIVES.get(test.get('current'), 'chosen')} drive" for test in tests
    )
    kinds = list(dict.fromkeys(named))
    spans = [
        _span([factor * test[key] for test in tests if test.get(key)], unit)
        for key, factor, unit in (("amplitude_m", 1e3, "mm"), ("frequency_hz", 1.0, "Hz"))
    ]
    more = "" if len(kinds) < 4 else " and others"
    return ", ".join([f"{'; '.join(kinds[:3])}{more}", *(span for span in spans if span)])


def _span(values: Sequence[float], unit: str) -> str:
    if not values:
        return ""
    low, high = min(values), max(values)
    shown = number(low, 2) if high <= 1.01 * low else f"{number(low, 2)} to {number(high, 2)}"
    return f"{shown} {unit}"


def doubts(facts: RunFacts) -> list[str]:
    """Return what to distrust, the weightiest first, one sentence each."""
    found = [f"{stage.name} failed: {stage.failed.rstrip('.')}." for stage in facts.stages if stage.failed]
    loop = facts.summary("close-loop")
    for effect in proper_effects(loop):
        if effect.get("tied_with"):
            found.append(f"These tests do not separate {effect['name']} from {listed(list(effect['tied_with']))}.")
    if "before" in loop and loop["before"]["nrmse"] > 0.3 and verdict_class(loop) != "validation differs":
        found.append(
            f"The base model misses the force on unseen tests by {percent(loop['before']['nrmse'])}: what is traced in "
            "its residual depends on that model."
        )
    found += law_facts.doubts(facts)
    outside = facts.summary("train-forward").get("outside_training_range_share", 0.0)
    if outside > 0.01:
        found.append(f"{percent(outside)} of the validation samples lie outside the range of the training tests.")
    found += _sentences(facts.warnings("identify-damper", "prepare", "identify-frame"))
    untestable = loop.get("untestable") or {}
    if untestable:
        found.append(f"These tests cannot show {listed([plain(name) for name in untestable])}.")
    return found


def _sentences(lines: Sequence[str]) -> list[str]:
    return [f"{line[:1].upper()}{line[1:].rstrip('.')}." for line in lines]
