"""The closed loop before and after an effect is added, in sentences made from the summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mrpipe.words import in_percent, listed

WHEN = ("before", "after", "recalibrated")
"""How a law was simulated."""

EQUAL = "; laws whose responses hardly differ count as equal"
"""Text if two such laws have changed places."""

WORTH_SAYING = 0.01
"""Relative change of a law's response below which it is not mentioned."""


def in_words(found: Mapping[str, Any]) -> str:
    """Return the result of the closed loop in plain words."""
    return " ".join(in_points(found))


def in_points(found: Mapping[str, Any]) -> list[str]:
    """Return the result of the closed loop, a few sentences for each question."""
    if "laws" not in found:
        return [f"Closed loop {found['status']}."]
    effects = found["plant"]["effects"]
    parts = [f"Closed loop, {found['status']}."]
    if "rms_x_top_error" in found:
        parts.append(errors_in_words(found))
    parts.append(ranking_in_words(found))
    left_out = found["plant"]["left_out"].items()
    parts += [f"The effect {name} is not put into the damper of the closed loop ({why})." for name, why in left_out]
    if effects and "controller" in found:
        parts.append(controller_in_words(found))
    return parts + _doubts([*found["laws"], *found["over_band"]["laws"]])


def errors_in_words(found: Mapping[str, Any]) -> str:
    """Return the errors of the predictions against the measurements, before and after."""

    def pair(name: str) -> str:
        error = found.get(name) or {}
        return f"{in_percent(error.get('before'), 1)} before and {in_percent(error.get('after'), 1)} after"

    text = (
        f"The model misses the measured RMS displacement of the top floor by {pair('rms_x_top_error')} (RMS over the "
        "recordings)"
    )
    within = found.get("rms_x_top_error_within_tested_stroke") or {}
    if within.get("before") is not None and within != found["rms_x_top_error"]:
        text += f", {pair('rms_x_top_error_within_tested_stroke')} where the damper stays within its tested stroke"
    if (found.get("rms_a1_error") or {}).get("before") is not None:
        text += f"; that of the first floor's acceleration by {pair('rms_a1_error')}"
    return f"{text}."


def _doubts(laws: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return limitations: responses that grow without bound, and motion beyond the tested stroke."""
    grows = list(
        dict.fromkeys(f"{row['law']} ({when})" for row in laws for when in WHEN if "diverged" in row.get(when, {}))
    )
    far = [
        f"{row['law']} ({row['after']['peak_over_tested_stroke']:.1f} times)" for row in laws if row.get("extrapolated")
    ]
    said = []
    if grows:
        said.append(f"The predicted response grows without bound under {', '.join(grows)}.")
    if far:
        said.append(f"Beyond the stroke of the bench tests, and so extrapolated: {', '.join(far)}.")
    return said


def ranking_in_words(found: Mapping[str, Any]) -> str:
    """Return whether the effect changes the order of the laws over the frequency band."""
    order = found["ranking"]
    names = ", ".join(order["after"])
    low, high = found["over_band"]["band_rad_s"]
    over = (
        f"by the largest RMS top displacement from {low:.3g} to {high:.3g} rad/s at a base acceleration of "
        f"{found['over_band']['base_amplitude_m_s2']:.3g} m/s²"
    )
    if not found["plant"]["effects"]:
        return f"The damper stays as it is, and so does the ranking of the laws {over}: {names} (the best first)."
    if found["ranking_changes"]:
        swaps = ", ".join(f"{a} is now ahead of {b}" for a, b in found["reversed_pairs"])
        said = f"The effect changes the ranking of the laws {over} ({swaps}): {names} (the best first)."
    else:
        equal = "" if order.get("before", order["after"]) == order["after"] else EQUAL
        said = f"The effect does not change the ranking of the laws {over}: {names} (the best first{equal})."
    if "recorded_ranking" in found:
        agrees = found["ranking_agrees_with_measured"]
        words = {(True, True): "both before and after", (True, False): "before only", (False, True): "only after"}
        said += (
            f" Under the recorded motions the measured order is {', '.join(found['recorded_ranking']['measured'])}; "
            f"the model agrees with it {words.get((agrees['before'], agrees['after']), 'neither before nor after')}."
        )
        if agrees["before"] != agrees["after"] and not found["ranking_changes"]:
            said += " So under these motions, unlike over the whole band, the effect changes the predicted order."
    return said


def controller_in_words(found: Mapping[str, Any]) -> str:
    """Return the changes of the controller that were tried, the laws that adopt them, and their benefit."""
    new = found["controller"]
    gains = ", ".join(
        f"{law} x {value:.2f}" for law, value in new["gain_factors"].items() if abs(value - 1.0) > WORTH_SAYING
    )
    tried = (
        f"To adapt the controller to the effect, three changes were tried, each in addition to the one before: "
        f"{_inverse_in_words(new['inverse'])}; a switch at {new['switch_force_after_n']:.1f} N instead of "
        f"{new['switch_force_before_n']:.1f} N (the residual force is {new['residual_force_after_n']:.1f} N, without "
        f"the effect {new['residual_force_before_n']:.1f} N); "
        f"{'gains ' + gains if gains else 'gains, which stay within 1 %'}."
    )
    parts: dict[str, list[str]] = {}
    for law, renewed in new["renewed"].items():
        parts.setdefault(renewed, []).append(law)
    kept = parts.pop("nothing", [])
    if not parts:
        return (
            f"{tried} None of them lowers the simulated response of a law, so every law keeps its controller: the "
            "effect matters for prediction, not for control."
        )
    taken = "; ".join(f"{renewed} for {', '.join(laws)}" for renewed, laws in parts.items())
    text = f"{tried} A law takes a change only if its simulated response falls: {taken}."
    if kept:
        text += f" {listed(kept)} {'keep their controllers' if len(kept) > 1 else 'keeps its controller'}."
    return f"{text} {gain_in_words(found['over_band']['laws'])}"


def _inverse_in_words(inverse: str) -> str:
    """Return the outcome for the inverse of the controller."""
    words, _, why = inverse.partition(": ")
    if words != "kept":
        return f"an inverse {inverse}"
    if why == "the better of both":
        return "a retrained inverse, which is no better than the present one and is not used"
    return f"no new inverse, because {why} only"


def gain_in_words(laws: Sequence[Mapping[str, Any]]) -> str:
    """Return the changes by the renewed controller with the effect in the damper, from the peaks over the band."""
    key = "peak_rms_x_top_m"
    changes = {
        row["law"]: row["recalibrated"][key] / row["after"][key] - 1.0
        for row in laws
        if key in row.get("recalibrated", {}) and key in row.get("after", {})
    }
    changed = {law: change for law, change in changes.items() if abs(change) > WORTH_SAYING}
    if not changed:
        return (
            "Retuning for the effect changes the largest RMS top displacement of no law by more than 1 %: the effect "
            "matters for prediction, not for control."
        )
    named = ", ".join(f"{law} {in_percent(change, signed=True)}" for law, change in changed.items())
    return (
        f"On the damper with the effect it changes the largest RMS top displacement: {named}; the other laws stay "
        "within 1 %."
    )
