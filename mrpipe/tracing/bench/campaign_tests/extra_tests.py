"""Proposals of further bench tests that would separate rival effects, with amplitudes that suit the campaign."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.effects.contract import TESTS_FOR, Effect, TestKind
from mrpipe.fitting.recordings import Recordings

_BY_STATE: Mapping[str, TestKind] = {
    "displacement": "positions",
    "past of displacement": "reversal",
    "hysteresis": "reversal",
    "velocity": "speeds",
    "direction": "constants",
    "acceleration": "frequencies",
    "past of velocity": "reversal",
    "drive": "constants",
    "past of drive": "steps",
    "rate of drive": "steps",
    "time in test": "long",
    "work": "long",
}
"""State that an unknown residual depends on -> kind of test."""

WHETHER = "whether there is "
"""Beginning of a question about one effect; a sentence on several of them has it once."""

_DRIVEN: frozenset[TestKind] = frozenset({"steps", "rest"})
"""Kinds of test whose drive changes within the test."""

_IN_DOUBT: tuple[TestKind, ...] = ("speeds", "steps", "amplitudes")


@dataclass(frozen=True)
class ExtraTests:
    """Proposed tests.

    Attributes
    ----------
    tests
        Tests in the form of the setting `laboratory.bench.tests`.
    reasons
        One entry per open question: the question (`accumulator or inertia`), the kind of test, and the names of the
        tests.
    """

    tests: tuple[dict[str, Any], ...] = ()
    reasons: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True)
class Range:
    """Range of the motions of the campaign.

    Attributes
    ----------
    stroke_m, speed_m_s, drive
        Largest displacement [m], speed [m/s], and drive [A or V], which is zero where no test has one.
    frequency_hz
        Usual frequency of the motion [Hz].
    duration_s
        Usual duration of a test [s].
    """

    stroke_m: float
    speed_m_s: float
    drive: float
    frequency_hz: float
    duration_s: float


def range_of(recordings: Recordings) -> Range:
    """Return the range of the motions of a campaign."""
    scales = recordings.scales()
    periods = recordings.period_s[recordings.period_s > 0.0]
    frequency = 1.0 / float(np.median(periods)) if len(periods) else scales.speed / (2.0 * np.pi * scales.stroke)
    lengths = np.diff(recordings.starts) * recordings.dt
    # where the damper was never driven, its largest drive is not known, and it may have none
    drive = scales.drive if np.any(recordings.drive) else 0.0
    return Range(scales.stroke, scales.speed, drive, frequency, float(np.clip(np.median(lengths), 4.0, 20.0)))


def kinds_between(one: str, other: str, library: Mapping[str, Effect]) -> tuple[TestKind, ...]:
    """Return the kinds of test that separate two effects, as one of them states; general kinds if neither does."""
    for name, rival in ((one, other), (other, one)):
        separation = library[name].separated_by.get(rival) if name in library else None
        if separation is not None and separation.kinds:
            return separation.kinds
    return _IN_DOUBT


def wanted_tests(summary: Mapping[str, Any], library: Mapping[str, Effect], recordings: Recordings) -> ExtraTests:
    """Return the tests that would answer the open questions of a verdict.

    Parameters
    ----------
    summary
        The document that `close-loop --json` prints: rivals of each effect, the states that an unknown residual depends
        on, and the effects that the campaign cannot show.
    library
        Name -> effect, with the tests that separate it from others and the tests that it needs.
    recordings
        Training tests.
    """
    span = range_of(recordings)
    wanted: list[tuple[str, TestKind]] = []
    for effect in summary["effects"]:
        for rival in effect["tied_with"]:
            kinds = kinds_between(effect["name"], rival, library)
            wanted += [(f"{effect['name']} or {rival}", kind) for kind in kinds]
    if summary["unexplained"]["structured"]:
        states = [item["state"] for item in summary["unexplained"]["depends_on"][:3]]
        kinds = tuple(dict.fromkeys(_BY_STATE[state] for state in states if state in _BY_STATE)) or _IN_DOUBT
        wanted += [("what is unexplained", kind) for kind in kinds]
    for name in summary.get("untestable", {}):
        asked = library[name].needs if name in library else ()
        wanted += [(f"{WHETHER}{name}", TESTS_FOR[need]) for need in asked]
    tests: dict[str, list[dict[str, Any]]] = {}
    reasons: dict[str, dict[str, Any]] = {}
    for decides, kind in wanted:
        if span.drive == 0.0 and kind in _DRIVEN:
            continue
        tests.setdefault(kind, list({item["name"]: item for item in _MAKERS[kind](span)}.values()))
        entry = reasons.setdefault(decides, {"decides": decides, "kinds": [], "tests": []})
        if kind not in entry["kinds"]:
            entry["kinds"].append(kind)
            entry["tests"] += [item["name"] for item in tests[kind]]
    return ExtraTests(tuple(item for made in tests.values() for item in made), tuple(reasons.values()))


def _short(drive: float) -> str:
    """Return a drive with three digits and without an exponent, for the name of a test."""
    return f"{float(f'{drive:.3g}'):g}"


def with_drive_unit(tests: Sequence[Mapping[str, Any]], drive_unit: str) -> list[dict[str, Any]]:
    """Return tests whose largest drive is named by its unit: `current_a`, or `drive_v` for a campaign in volts.

    The setting `laboratory.bench.tests`, whose form the tests have, knows `current_a` only.
    """
    name = "current_a" if drive_unit == "A" else f"drive_{drive_unit.lower()}"
    return [{name if key == "current_a" else key: value for key, value in test.items()} for test in tests]


def _test(name: str, motion: str, amplitude: float, frequency: float, duration: float, **more: Any) -> dict[str, Any]:
    made = {
        "name": f"extra-{name}",
        "role": "training",
        "motion": motion,
        "amplitude_m": float(f"{amplitude:.3g}"),
        "frequency_hz": float(f"{frequency:.3g}"),
        "duration_s": float(f"{max(duration, 2.5 / frequency):.3g}"),
        # the rig is the same
        "later": True,
    }
    return made | {key: float(f"{value:.3g}") if isinstance(value, float) else value for key, value in more.items()}


def _speeds(span: Range) -> list[dict[str, Any]]:
    amplitude = 0.8 * span.stroke_m
    # also beyond the largest speed so far: two curves that look alike within the range differ beyond it
    speeds = span.speed_m_s * np.geomspace(0.03, 1.5, 5)
    return [
        _test(
            f"speed-{number}-{_short(drive)}", "triangle", amplitude, speed / (4.0 * amplitude), span.duration_s,
            current_a=drive,
        )
        for number, speed in enumerate(speeds, start=1)
        for drive in (0.0, 0.5 * span.drive)
    ]  # fmt: skip


def _steps(span: Range) -> list[dict[str, Any]]:
    return [
        _test(
            f"steps-{factor:g}", "triangle", 0.8 * span.stroke_m, factor * span.frequency_hz, 2.0 * span.duration_s,
            current="steps", current_a=span.drive, pause_s=0.5 / span.frequency_hz,
        )
        for factor in (0.5, 1.0)
    ]  # fmt: skip


def _positions(span: Range) -> list[dict[str, Any]]:
    return [
        _test(
            f"dwell-{_short(drive)}", "dwell", span.stroke_m, span.frequency_hz, 2.0 * span.duration_s, current_a=drive
        )
        for drive in (0.0, 0.5 * span.drive)
    ]


def _middle(span: Range) -> list[dict[str, Any]]:
    return [
        _test(
            f"middle-{1e3 * middle:.3g}mm", "sine", 0.4 * span.stroke_m, span.frequency_hz, span.duration_s,
            current_a=0.5 * span.drive, middle_m=float(middle),
        )
        for middle in (-0.5 * span.stroke_m, 0.5 * span.stroke_m)
    ]  # fmt: skip


def _frequencies(span: Range) -> list[dict[str, Any]]:
    amplitude = 0.5 * span.stroke_m
    highest = span.speed_m_s / (2.0 * np.pi * amplitude)
    return [
        _test(f"frequency-{number}-{_short(drive)}", "sine", amplitude, frequency, span.duration_s, current_a=drive)
        for number, frequency in enumerate(highest * np.geomspace(0.15, 1.5, 4), start=1)
        for drive in (0.0, 0.5 * span.drive)
    ]


def _amplitudes(span: Range) -> list[dict[str, Any]]:
    return [
        _test(
            f"amplitude-{share:g}-{_short(drive)}", "sine", share * span.stroke_m, span.frequency_hz, span.duration_s,
            current_a=drive,
        )
        for share in (0.2, 0.5)
        for drive in (0.0, 0.5 * span.drive)
    ]  # fmt: skip


def _long(span: Range) -> list[dict[str, Any]]:
    amplitude = min(0.8 * span.stroke_m, span.speed_m_s / (2.0 * np.pi * span.frequency_hz))
    long = min(max(5.0 * span.duration_s, 30.0), 60.0)
    common: dict[str, Any] = {"current_a": 0.7 * span.drive}
    return [
        _test("long", "sine", amplitude, span.frequency_hz, long, **common),
        _test("cooling", "hold", amplitude, span.frequency_hz, long, pause_s=0.3 * long, **common),
        _test("long-again", "sine", amplitude, span.frequency_hz, long, **common)
        | {"role": "repeat", "repeat_of": "extra-long"},
    ]


def _reversal(span: Range) -> list[dict[str, Any]]:
    return [
        _test(f"reversal-{_short(drive)}", "triangle", 0.2 * span.stroke_m, 0.5 * span.frequency_hz, span.duration_s,
              current_a=drive)
        for drive in (0.2 * span.drive, span.drive)
    ]  # fmt: skip


def _constants(span: Range) -> list[dict[str, Any]]:
    amplitude = 0.7 * span.stroke_m
    return [
        _test(f"constant-{_short(drive)}-{factor:g}", "sine", amplitude, factor * span.frequency_hz, span.duration_s,
              current_a=drive)
        for drive in (0.0, 0.3 * span.drive, 0.6 * span.drive, span.drive)
        for factor in (0.5, 1.0)
    ]  # fmt: skip


def _rest(span: Range) -> list[dict[str, Any]]:
    return [
        _test("rest-in-steps", "hold", 0.3 * span.stroke_m, span.frequency_hz, 3.0 * span.duration_s,
              pause_s=2.0 * span.duration_s, current="steps", current_a=span.drive)
    ]  # fmt: skip


_MAKERS: Mapping[TestKind, Callable[[Range], list[dict[str, Any]]]] = {
    "speeds": _speeds,
    "steps": _steps,
    "positions": _positions,
    "middle": _middle,
    "frequencies": _frequencies,
    "amplitudes": _amplitudes,
    "long": _long,
    "reversal": _reversal,
    "constants": _constants,
    "rest": _rest,
}
