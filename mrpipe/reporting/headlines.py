"""One line for each stage's result: what a reader wants to know first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mrpipe.reporting.traced_words import exchanged_form, numbers_of
from mrpipe.reporting.words import percent
from mrpipe.words import counted, duration, in_percent, listed


def headline(stage: str, summary: Mapping[str, Any]) -> str:
    """Return a line that says what a stage found, from its summary."""
    if stage.startswith("simulate-"):
        return _simulation(summary)
    if stage.startswith("train-"):
        return _training(summary)
    if stage.startswith("record-") and summary:
        return f"{counted(int(summary.get('tests') or 0), 'test')}, {duration(float(summary.get('duration_s') or 0.0))}"
    lines = {
        "prepare": _prepared,
        "assemble": _assembled,
        "sweep": _sweep,
        "identify-damper": _damper,
        "identify-frame": _frame,
        "calibrate": _calibration,
        "design": _design,
        "close-loop": _close_loop,
    }
    return lines[stage](summary) if stage in lines and summary else _plain(summary)


def _number(value: Any, factor: float = 1.0, digits: int = 3) -> str:
    return "-" if value is None else f"{value * factor:.{digits}g}"


def _fit(percent: float | None) -> str:
    return "not defined" if percent is None else in_percent(percent / 100.0, digits=3)


def _prepared(summary: Mapping[str, Any]) -> str:
    return (
        f"campaign {summary.get('campaign', '')}: {counted(int(summary.get('test_count') or 0), 'test')} at "
        f"{_number(summary.get('sampling_rate_hz'), digits=4)} Hz, drive in {summary.get('drive_unit', '')}"
    )


def _assembled(summary: Mapping[str, Any]) -> str:
    return (
        f"{summary.get('training_samples')} samples of {summary.get('training_tests')} training tests, "
        f"{summary.get('validation_samples')} of {summary.get('validation_tests')} validation tests"
    )


def _sweep(summary: Mapping[str, Any]) -> str:
    return f"of {summary.get('candidates')} networks, {summary.get('choice')} is chosen"


def _training(summary: Mapping[str, Any]) -> str:
    return (
        f"{summary.get('architecture', '')}: validation NRMSE {_number(summary.get('validation_nrmse'))}, "
        f"fit {_fit(summary.get('validation_fit_percent'))}"
    )


def _simulation(summary: Mapping[str, Any]) -> str:
    response = (
        f"rms x_top {_number(summary.get('rms_x_top_m'), 1e3)} mm, x1 {_number(summary.get('rms_x1_m'), 1e3)} mm, "
        f"a1 {_number(summary.get('rms_a1_m_s2'))} m/s² relative to the ground"
    )
    dampers = summary.get("dampers")
    if dampers:
        forces = ", ".join(f"{item['name']} {_number(item['rms_force_n'], 1e-3)} kN" for item in dampers)
        return f"{response}, rms force of {forces}"
    return f"{response}, damping ratio {_number(summary.get('damping_ratio'))}"


def _damper(summary: Mapping[str, Any]) -> str:
    form = summary.get("form") or summary.get("model", "")
    return (
        f"{form}: validation NRMSE {_number(summary.get('validation_nrmse'))}, "
        f"fit {_fit(summary.get('validation_fit_percent'))}"
    )


def _frame(summary: Mapping[str, Any]) -> str:
    frequencies = summary.get("frequencies_hz") or []
    return f"{counted(len(frequencies), 'mode')}: " + ", ".join(_number(value) for value in frequencies) + " Hz"


def _calibration(summary: Mapping[str, Any]) -> str:
    dampers = summary.get("dampers")
    if dampers:
        laws = ", ".join(f"{item['name']} with {item['law']}" for item in dampers)
        first = ((summary.get("together") or {}).get("damping_ratios") or [None])[0]
        return f"{laws}: damping ratio {_number(first)} in the first mode"
    return (
        f"omega_0 {_number(summary.get('omega_0'), digits=4)} rad/s, "
        f"omega_inf {_number(summary.get('omega_inf'), digits=4)} rad/s, {len(summary.get('laws') or {})} laws"
    )


def _design(summary: Mapping[str, Any]) -> str:
    best = summary.get("best")
    if isinstance(best, Mapping):
        calibrated = summary.get("calibrated") or {}
        return (
            f"gains of {listed(list(summary.get('dampers') or {}))} together: largest rms x_top over frequency "
            f"{_number(best.get('peak_rms_x_top_m'), 1e3)} mm, with the calibrated gains "
            f"{_number(calibrated.get('peak_rms_x_top_m'), 1e3)} mm"
        )
    peaks = {law: item.get("peak_rms_x_top_m") for law, item in (summary.get("laws") or {}).items()}
    others = ", ".join(f"{law} {_number(peak, 1e3)} mm" for law, peak in peaks.items() if law != best)
    return f"best law {best}: largest rms x_top over frequency {_number(peaks.get(best), 1e3)} mm" + (
        f" (others: {others})" if others else ""
    )


def _close_loop(summary: Mapping[str, Any]) -> str:
    before = (summary.get("before") or {}).get("nrmse")
    after = (summary.get("after") or {}).get("nrmse")
    found = ", ".join(effect["name"] for effect in summary.get("effects") or [])
    unexplained = (summary.get("unexplained") or {}).get("structured")
    differs = "the validation tests differ from the training tests"
    form = exchanged_form(summary)
    exchanged = f" with the base form {form} in place of {summary.get('model', '')}" if form else ""
    left = f"what the base form {form} leaves" if form else "the residual"
    tied = summary.get("tied")
    verdict = (
        (f"{found}{exchanged}" if found else "")
        or (differs if summary.get("verdict_class") == "validation differs" else "")
        or (f"{listed(tied['effects'])} explain {left} equally well" if tied else "")
        or (f"no known effect explains {left}" if unexplained else "")
        or (f"no effect is missing{exchanged}" if form else "nothing is missing")
    )
    floor = _number(summary.get("noise_floor_nrmse"))
    return f"{verdict}: NRMSE {_number(before)} before, {_number(after)} after (noise floor {floor})"


FAR_WORSE = 1.5
"""Ratio of the errors of forward network and damper model from which the network is called worse."""


def weak_network(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a sentence where the forward network is far worse than the damper model of the same run, else nothing.

    Parameters
    ----------
    summaries
        Stage -> its summary.
    """
    network, damper = summaries.get("train-forward") or {}, summaries.get("identify-damper") or {}
    error, reference = network.get("validation_nrmse"), damper.get("validation_nrmse")
    if not error or not reference or error < FAR_WORSE * reference:
        return ""
    return (
        f"The forward network misses the validation tests by {percent(error)} of the RMS force, "
        f"{error / reference:.2g} times the error of the damper model {damper.get('form', '')} "
        f"({percent(reference)}). {_why_weak(network)}Use the damper model for predictions."
    )


def _why_weak(network: Mapping[str, Any]) -> str:
    """Return sentences on what limits a weak network: tests with a changing drive, and the part of the past it sees."""
    found = []
    steady, varying = network.get("constant_drive_nrmse"), network.get("varying_drive_nrmse")
    tests, changing = network.get("training_tests", 0), network.get("training_tests_with_varying_drive", 0)
    if steady and varying and varying > FAR_WORSE * steady:
        found.append(
            f"The error is {percent(varying)} in tests whose drive changes and "
            f"{percent(steady)} in the others. The drive changes in only {changing} of {tests} training tests, so "
            "record more such tests."
        )
    rate = float(network.get("sampling_rate_hz") or 0.0)
    window = network.get("past_values", 0) / rate if rate > 0.0 else 0.0
    needed = float(network.get("yield_time_s") or 0.0)
    if needed > FAR_WORSE * window > 0.0:
        found.append(
            f"The network sees {1e3 * window:.3g} ms of the past, but from a reversal of the motion until it yields "
            f"the damper takes about {1e3 * needed:.0f} ms; a longer window (sweep.past_values) needs more tests with "
            "irregular motion."
        )
    return "".join(f"{text} " for text in found)


def in_brief(stage: str, summary: Mapping[str, Any]) -> list[str]:
    """Return the few lines that a person wants to read of a stage; empty where its numbers speak for themselves."""
    if stage == "design" and "pareto" in summary:
        from mrpipe.reporting.design_words import in_lines

        return in_lines(summary)
    if stage != "close-loop" or "before" not in summary:
        return []
    from mrpipe.reporting.closed_loop_words import in_words

    before, after, floor = (
        _number(value, digits=3)
        for value in (summary["before"]["nrmse"], summary["after"]["nrmse"], summary["noise_floor_nrmse"])
    )
    lines = [f"campaign {summary['campaign']}, model {summary['model']}: {summary['verdict']}"]
    for effect in summary["effects"]:
        numbers = numbers_of(effect, digits=3)
        rivals = f", not separated from {listed(effect['tied_with'])}" if effect["tied_with"] else ""
        confidence = f", confidence {effect['confidence']:.2f}" if effect["name"] != "unattributed" else ""
        shown = f": {numbers}" if numbers else ""
        place = f" at {effect['place']}" if effect.get("place") else ""
        lines.append(f"effect {effect['name']}{place} ({effect['form']}{shown}{confidence}{rivals})")
    recovered = f", {in_percent(summary['ceiling']['recovered'])} of what is recoverable" if summary["effects"] else ""
    lines.append(f"error on validation tests: NRMSE {before} before, {after} after (noise floor {floor}{recovered})")
    unexplained = summary["unexplained"]
    if unexplained["structured"]:
        states = ", ".join(item["state"] for item in unexplained["depends_on"][:3])
        lines.append(
            f"still unexplained: {percent(unexplained['share_of_residual'])} of the squared residual"
            f"{', varying with ' + states if states else ''}"
        )
    if summary.get("corrections", {}).get("found"):
        file = summary["corrections"]["file"]
        lines.append(
            f"fault of sensors: corrections in {file} of the run directory; apply them with "
            f"mrpipe prepare --settings RUN/{file}, and the same --config or --campaign"
        )
    if "closed_loop" in summary:
        lines += _sentences(in_words(summary["closed_loop"]))
    wanted = summary.get("next_tests", {})
    if wanted.get("tests"):
        lines.append(
            f"{len(wanted['tests'])} tests in {wanted['file']} would decide {open_questions(wanted['decides'])}"
        )
    elif wanted.get("made_already"):
        questions = open_questions(wanted["decides"])
        lines.append(f"open though the tests for it have been made: {questions}; longer ones or repeats may do")
    return lines


def open_questions(decides: Sequence[Mapping[str, Any]]) -> str:
    """Return what tests would decide, the rivals of one effect together, and likewise the effects in doubt."""
    from mrpipe.tracing.bench.campaign_tests.extra_tests import WHETHER

    rivals: dict[str, list[str]] = {}
    absent, others = [], []
    for item in decides:
        effect, joined, rival = item["decides"].partition(" or ")
        if joined:
            rivals.setdefault(effect, []).append(rival)
        elif effect.startswith(WHETHER):
            absent.append(effect.removeprefix(WHETHER))
        else:
            others.append(effect)
    if absent:
        others.append(WHETHER + " or ".join(absent))
    return "; ".join([*(f"{effect} or {', '.join(names)}" for effect, names in rivals.items()), *others])


def _sentences(text: str) -> list[str]:
    """Return a paragraph sentence by sentence."""
    return [f"{part.rstrip('.')}." for part in text.split(". ") if part]


def _plain(summary: Mapping[str, Any]) -> str:
    """Return the first few plain numbers and words."""
    shown = []
    for key, value in summary.items():
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            continue
        shown.append(f"{key} {_number(value, digits=4) if isinstance(value, float) else value}")
    return ", ".join(shown[:4])
