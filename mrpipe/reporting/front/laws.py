"""Comparison of the control laws with each other and with the structure without a damper."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, BoolArray, FloatArray
from mrpipe.control.laws import law_named, law_names
from mrpipe.reporting.facts import RunFacts
from mrpipe.reporting.words import percent, quantity
from mrpipe.structures import Frame, read_frame
from mrpipe.structures.response import linear_response
from mrpipe.words import in_percent, listed, number

UNCONTROLLED = "no damper"


@dataclass(frozen=True)
class LawRun:
    """One law in the comparison.

    Attributes
    ----------
    law
        Name of the law, or :data:`UNCONTROLLED`.
    rms_top_m, rms_first_m
        RMS displacement of the top and of the first floor relative to the ground [m].
    rms_a_top_m_s2, rms_a_first_m_s2
        RMS absolute acceleration of these floors [m/s2].
    peak_force_n
        Largest damper force [N]; NaN without a damper.
    damping_ratio
        Damping ratio from the free decay after the excitation [1]; NaN where there is none.
    outside_share
        Share of the time in which the damper model is extrapolated [1].
    """

    law: str
    rms_top_m: float
    rms_first_m: float
    rms_a_top_m_s2: float
    rms_a_first_m_s2: float
    peak_force_n: float
    damping_ratio: float
    outside_share: float


@dataclass(frozen=True)
class History:
    """Histories of a run in the last cycles of its excitation: times [s], top displacement [m], damper, drive."""

    time_s: FloatArray
    top_m: FloatArray
    stroke_m: FloatArray
    velocity_m_s: FloatArray
    force_n: FloatArray
    desired_n: FloatArray
    drive: FloatArray


def comparison(facts: RunFacts) -> list[LawRun]:
    """Return every simulated law, best RMS top displacement first, and the structure without a damper at the end."""
    runs = []
    bare = None
    for law, summary in facts.laws.items():
        artifact = facts.artifact(f"response-{law}.h5")
        if artifact is None:
            continue
        time = artifact.array("time")
        ground = artifact.array("ground_acceleration")
        window = _window(time, ground, summary)
        accelerations = artifact.array("absolute_acceleration")[window]
        frame = _frame(facts, summary, accelerations.shape[1])
        first, top = (frame.moved_by_ground[0], frame.top) if frame else (0, accelerations.shape[1] - 1)
        runs.append(
            LawRun(
                law,
                float(summary["rms_x_top_m"]),
                float(summary["rms_x1_m"]),
                _rms(accelerations[:, top]),
                _rms(accelerations[:, first]),
                float(np.max(np.abs(artifact.array("force")[window]))),
                _or_nan(summary.get("damping_ratio")),
                _outside(summary),
            )
        )
        bare = bare or _bare(facts, summary, time, ground, window)
    runs.sort(key=lambda run: run.rms_top_m)
    return [*runs, bare] if bare else runs


def _frame(facts: RunFacts, summary: Mapping[str, Any], count: int | None = None) -> Frame | None:
    """Return the structure, turned as in the simulation; None where it is not there or has not `count` columns."""
    artifact = facts.artifact("frame.h5")
    if artifact is None:
        return None
    frame = read_frame(artifact)
    if count not in (None, frame.floors):
        return None
    return frame.turned((summary.get("excitation") or {}).get("direction_deg", 0.0))


def _window(time: FloatArray, ground: FloatArray, summary: Mapping[str, Any]) -> BoolArray:
    """Return where the response is steady: as the simulation says, else the second half of the excitation."""
    steady = (summary.get("excitation") or {}).get("steady_s")
    if steady:
        return np.asarray((time >= steady[0]) & (time < steady[1]))
    moving = np.flatnonzero(np.abs(ground) > 1e-9 * float(np.max(np.abs(ground), initial=0.0)))
    last = float(time[moving[-1]]) if moving.size else float(time[-1])
    return np.asarray((time >= 0.5 * last) & (time <= last))


def _bare(
    facts: RunFacts, summary: Mapping[str, Any], time: FloatArray, ground: FloatArray, window: BoolArray
) -> LawRun | None:
    """Return the linear structure without a damper under the same ground motion.

    None under forces or motion in two directions, because the artifact holds the histories of one direction only.
    """
    frame = _frame(facts, summary)
    if frame is None or "degrees_of_freedom" in summary or not np.any(ground) or len(time) < 2:
        return None
    step = float(np.median(np.diff(time)))
    even = time[0] + step * np.arange(round((time[-1] - time[0]) / step) + 1)
    response = linear_response(frame, np.interp(even, time, ground), step)
    first, top = frame.moved_by_ground[0], frame.top
    inside = np.interp(even, time, window.astype(np.float64)) > 0.5
    nan = float("nan")
    return LawRun(
        UNCONTROLLED,
        _rms(response.displacement[inside, top]),
        _rms(response.displacement[inside, first]),
        _rms(response.absolute_acceleration[inside, top]),
        _rms(response.absolute_acceleration[inside, first]),
        nan,
        _or_nan(_of_first_mode(facts.summary("identify-frame"))),
        0.0,
    )


def _of_first_mode(frame: Mapping[str, Any]) -> float | None:
    """Return the damping ratio of the mode of the lowest frequency, which governs the free decay; None if unknown."""
    frequencies, ratios = frame.get("frequencies_hz") or [], frame.get("damping_ratios") or []
    return float(ratios[int(np.argmin(frequencies))]) if len(frequencies) == len(ratios) > 0 else None


def last_cycles(facts: RunFacts, artifact: Artifact, summary: Mapping[str, Any], cycles: float = 3.0) -> History:
    """Return the last cycles of the steady response (a tenth of it where the excitation has no single frequency)."""
    time, ground = artifact.array("time"), artifact.array("ground_acceleration")
    window = _window(time, ground, summary)
    omega = (summary.get("excitation") or {}).get("frequency_rad_s")
    last = float(time[window][-1])
    span = cycles * 2.0 * np.pi / omega if omega else 0.1 * (last - float(time[window][0]))
    kept = np.flatnonzero(window & (time > last - span))
    kept = kept[:: max(1, len(kept) // 800)]
    displacement = artifact.array("displacement")
    frame = _frame(facts, summary, displacement.shape[1])
    return History(
        time[kept] - time[kept[0]],
        displacement[kept, frame.top if frame else -1],
        artifact.array("damper_displacement")[kept],
        artifact.array("damper_velocity")[kept],
        artifact.array("force")[kept],
        artifact.array("desired_force")[kept],
        artifact.array("drive")[kept],
    )


def meanings(laws: Iterable[str]) -> dict[str, str]:
    """Return law -> what it does, in a few words."""
    return {law: law_named(law).summary for law in laws if law in law_names()}


def answer(facts: RunFacts) -> str:
    """Return which law is best for this structure, and by how much."""
    design = facts.summary("design")
    if design.get("best"):
        return _designed(design) if "laws" in design else _designed_together(design)
    runs = comparison(facts)
    laws = [run for run in runs if run.law != UNCONTROLLED]
    if not laws:
        return ""
    bare = next((run for run in runs if run.law == UNCONTROLLED), None)
    damping = {run.law: run.damping_ratio for run in laws}
    off = damping.get("passive-off", 0.0)
    # a law that damps free vibration less than the unpowered damper does not damp: it detunes the structure
    damps = [run for run in laws if not damping[run.law] < 0.5 * off]
    best = (damps or laws)[0]
    omega = (next(iter(facts.laws.values())).get("excitation") or {}).get("frequency_rad_s")
    force = "force_amplitude_n" in (next(iter(facts.laws.values())).get("excitation") or {})
    kind = "a harmonic force" if force else "harmonic base motion"
    motion = f"under {kind} at {number(omega)} rad/s" if omega else "under this excitation"
    over_band = _over_band(facts)
    if over_band and omega:
        motion = f"at the single frequency {number(omega)} rad/s"
    text = (
        f"Of the laws that add damping, **{best.law}** is best {motion}"
        if len(damps) < len(laws)
        else (f"**{best.law}** is the best law {motion}")
    )
    text += f": RMS top displacement {_millimetres(best.rms_top_m)}"
    text = f"{over_band} {text}".strip()
    compared = []
    if bare is not None:
        compared.append(f"{_millimetres(bare.rms_top_m)} without a damper ({_change(best.rms_top_m, bare.rms_top_m)})")
    for rival in laws:
        if rival.law == "passive-off" and rival is not best:
            compared.append(
                f"{_millimetres(rival.rms_top_m)} with the damper switched off "
                f"({_change(best.rms_top_m, rival.rms_top_m)})"
            )
    text += f", compared with {listed(compared)}." if compared else "."
    if np.isfinite(best.damping_ratio):
        text += f" Its damping ratio in free decay is {percent(best.damping_ratio)}."
    detuned = [run for run in laws if run not in damps and run.rms_top_m < best.rms_top_m]
    for run in detuned:
        text += (
            f" {run.law} moves less ({_millimetres(run.rms_top_m)}) but damps free vibration by "
            f"{percent(run.damping_ratio)} only: it shifts the resonance away from this one frequency."
        )
    return text


def _over_band(facts: RunFacts) -> str:
    """Return which law has the smallest peak over the frequency band of `close-loop`; empty where it was not computed.

    A ranking at one frequency misleads, because a law can shift the resonance away from that frequency.
    """
    band = (facts.summary("close-loop").get("closed_loop") or {}).get("over_band") or {}
    peaks = {
        row["law"]: row["after"]["peak_rms_x_top_m"]
        for row in band.get("laws", [])
        if "peak_rms_x_top_m" in row.get("after", {})
    }
    if len(peaks) < 2:
        return ""
    best, *others = sorted(peaks, key=lambda law: peaks[law])
    low, high = band["band_rad_s"]
    rest = ", ".join(f"{law} {number(1e3 * peaks[law])}" for law in others)
    text = (
        f"Use **{best}**: over harmonic base motion from {number(low)} to {number(high)} rad/s it has the smallest "
        f"peak of the RMS top displacement, {_millimetres(peaks[best])} ({rest} mm)."
    )
    absent = [law for law in facts.laws if law not in peaks]
    if absent:
        text += f" {listed(absent)} {'is' if len(absent) == 1 else 'are'} not part of this comparison"
        text += f" (`mrpipe simulate --law {absent[0]} --resonance` computes its curve)."
    return text


def _designed(design: Mapping[str, Any]) -> str:
    best = design["best"]
    entry = design["laws"][best]
    text = f"**{best}** is the best law for this damper and structure ({design.get('objective', 'worst case')})"
    if entry.get("peak_rms_x_top_m") is not None:
        text += f": the peak of its RMS top displacement over frequency is {_millimetres(entry['peak_rms_x_top_m'])}"
    others = [
        f"{law} {_millimetres(item['peak_rms_x_top_m'])}"
        for law, item in design["laws"].items()
        if law != best and item.get("peak_rms_x_top_m") is not None
    ]
    text += f" (others: {', '.join(others)})." if others else "."
    if entry.get("probability_best") is not None:
        text += f" The probability that it is the best is {percent(entry['probability_best'])}."
    return text


def _designed_together(design: Mapping[str, Any]) -> str:
    """Return what the design of several dampers found; their gains are searched together, and no law is chosen."""
    best, calibrated = (design[key]["peak_rms_x_top_m"] for key in ("best", "calibrated"))
    named = listed([f"{name} ({item['law']})" for name, item in design["dampers"].items()])
    return (
        f"The gains of {named} were searched together: the peak of the RMS top displacement over frequency is "
        f"{_millimetres(best)}, and {_millimetres(calibrated)} at the calibrated gains."
    )


def _force_demands(facts: RunFacts) -> dict[str, Mapping[str, Any]]:
    """Return law or damper -> forces needed and available; where some were simulated, of these alone."""
    calibrated = facts.summary("calibrate")
    dampers = {item["name"]: item.get("force_demand") for item in calibrated.get("dampers") or []}
    demands = {**calibrated.get("force_demands", {}), **{name: row for name, row in dampers.items() if row}}
    run = {*facts.laws, *(item["name"] for item in facts.summary("simulate-dampers").get("dampers") or [])}
    return {name: row for name, row in demands.items() if not run or name in run}


def doubts(facts: RunFacts) -> list[str]:
    """Return what to distrust of the closed loop: extrapolation, and laws that the force of the damper limits."""
    shares = {law: _outside(summary) for law, summary in facts.laws.items()}
    far = sorted(((share, law) for law, share in shares.items() if share > 0.01), reverse=True)
    found = []
    if far:
        named = listed([f"{law} ({percent(share)} of the time)" for share, law in far])
        found.append(f"The damper model is extrapolated beyond its bench tests under {named}.")
    loop = facts.summary("close-loop").get("closed_loop") or {}
    grows = [
        row["law"]
        for row in loop.get("laws", [])
        if any("diverged" in row.get(when, {}) for when in ("before", "after"))
    ]
    if grows:
        found.append(f"The predicted response grows without bound under {listed(grows)}.")
    demands = _force_demands(facts)
    weak = {name: quantity(row["largest_force_n"], "N") for name, row in demands.items() if row["exceeds_damper"]}
    if weak:
        need = "needs" if len(weak) == 1 else "need"
        found.append(
            f"{listed(list(weak))} {need} more force than the damper gives at the stroke of the calibration "
            f"({listed(list(dict.fromkeys(weak.values())))}): in part of each cycle the force is smaller than the "
            "desired one."
        )
    limited = [name for name, row in demands.items() if row["limited_by_residual_force"]]
    if limited:
        found.append(
            f"The unpowered damper limits {listed(limited)}: in part of each cycle they request less force than it "
            "gives without drive."
        )
    return found


def beyond_tests(facts: RunFacts) -> str:
    """Return the largest stroke and speed that the loop asks of the damper beyond its bench tests; empty for none."""
    asked: dict[str, float] = {}
    for law, summary in facts.laws.items():
        if law.startswith("passive"):
            continue
        inputs = ((summary.get("training_range") or {}).get("damper_model") or {}).get("inputs") or {}
        for name, key in (("displacement", "largest_m"), ("velocity", "largest_m_s")):
            entry = inputs.get(name) or {}
            if entry.get("outside_share", 0.0) > 0.001 and entry[key] > entry[f"known_{key}"]:
                asked[name] = max(asked.get(name, 0.0), entry[key])
    parts = []
    if "displacement" in asked:
        parts.append(f"{number(1e3 * asked['displacement'])} mm")
    if "velocity" in asked:
        parts.append(f"{number(asked['velocity'])} m/s")
    return listed(parts)


def _outside(summary: Mapping[str, Any]) -> float:
    return float(((summary.get("training_range") or {}).get("damper_model") or {}).get("outside_share") or 0.0)


def _millimetres(value: float) -> str:
    return f"{number(1e3 * value)} mm"


def _change(value: float, reference: float) -> str:
    return in_percent(value / reference - 1.0, signed=True)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def _or_nan(value: Any) -> float:
    return float("nan") if value is None else float(value)
