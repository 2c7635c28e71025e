"""Words on what a tracing found: an exchanged base form, and the numbers of effects, well-determined ones first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from mrpipe.words import listed, separating_tests

WELL_DETERMINED = 1.0
"""Width of an interval, over the magnitude of the value, up to which a parameter is called well determined."""

UNDETERMINED = 100.0
"""An interval whose ends differ by more than this factor does not determine the parameter."""


def determined(low: float, high: float) -> bool:
    """Return whether an interval determines a parameter: finite, and not of one sign over several decades."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return False
    small, large = sorted((abs(low), abs(high)))
    return low * high <= 0.0 or large <= UNDETERMINED * small


def is_well_determined(entry: Mapping[str, Any]) -> bool:
    """Return whether the interval of a parameter is narrow; a parameter without an interval is taken as it is."""
    low, high = uncertainty(entry)
    return bool(math.isfinite(high - low) and abs(high - low) <= WELL_DETERMINED * abs(entry["value"]))


def uncertainty(entry: Mapping[str, Any]) -> tuple[float, float]:
    """Return the interval of a parameter that the data leave open; both ends are its value if the tracing gives none.

    The range of a parameter over the storeys of a structure is none: it begins at 0 where a storey lacks the effect.
    """
    if entry.get("interval_kind") == "range" or not entry.get("interval"):
        return entry["value"], entry["value"]
    low, high = entry["interval"][:2]
    return low, high


def leading_first(effect: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the parameters of an effect that have a value: well-determined ones first, else in the effect's order."""
    known = [(name, entry) for name, entry in effect["parameters"].items() if entry.get("value") is not None]
    return sorted(known, key=lambda item: not is_well_determined(item[1]))


def numbers_of(effect: Mapping[str, Any], digits: int) -> str:
    """Return the parameters of an effect with units; those with a wide interval come last and are marked."""
    return ", ".join(
        f"{name.replace('_', ' ')} {entry['value']:.{digits}g} {entry['unit']}".removesuffix(" 1")
        + ("" if is_well_determined(entry) else " (not well determined)")
        for name, entry in leading_first(effect)
    )


def exchanged_form(summary: Mapping[str, Any]) -> str:
    """Return the base form of the final model where it is not the declared one; else nothing."""
    found = summary.get("base_form") or {}
    taken = str(found.get("taken") or "")
    return "" if taken == found.get("declared") else taken


def shown_candidates(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the candidates, best first, with the share that each effect recovers by itself.

    Where the final model has another base form, `share` of a candidate counts what this form recovers too, so that all
    of them come near to 1. The share of its best form, which is that of the effect on the final base form, is shown
    instead.
    """
    rows = [dict(item) for item in summary.get("candidates") or []]
    if not exchanged_form(summary):
        return rows
    for row in rows:
        row["share"] = max((row.get("forms") or {}).values(), default=row.get("share"))
    return sorted(rows, key=lambda row: -float(row["share"] or 0.0))


def proper_effects(summary: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the named effects, without the flexible model, which has no physical meaning."""
    return [effect for effect in summary.get("effects", []) if effect["name"] != "unattributed"]


def verdict_class(summary: Mapping[str, Any]) -> str:
    """Return the class of a verdict; runs of older versions do not name it."""
    if summary.get("verdict_class"):
        return str(summary["verdict_class"])
    if not summary["residual"]["structured"]:
        return "noise"
    if not proper_effects(summary):
        return "unknown"
    return "partly explained" if summary["unexplained"]["structured"] else "explained"


def later_effects(summary: Mapping[str, Any]) -> list[str]:
    """Return the named effects that are not among the candidates.

    Candidates are fitted one at a time. Once the best one is part of the model, the search goes on, and may find an
    effect that the screening of the first round had left out.
    """
    alone = {item["name"] for item in summary.get("candidates") or []}
    return [effect["name"] for effect in proper_effects(summary) if effect["name"] not in alone]


def not_alone_in_words(loop: Mapping[str, Any]) -> str:
    """Return a sentence on the named effects that the figure of the candidates does not show; empty without any."""
    later = later_effects(loop)
    if not later:
        return ""
    was = "was" if len(later) == 1 else "were"
    return f" {listed(later)} {was} found in addition to others and {was} not fitted alone."


def shares_in_words(summary: Mapping[str, Any]) -> str:
    """Return what the shares of the candidates are shares of."""
    taken = exchanged_form(summary)
    return f"of what the base form {taken} leaves above the noise" if taken else "of the recoverable residual"


def exchange_in_words(summary: Mapping[str, Any]) -> str:
    """Return a sentence on another base form than the declared one, if the final model has one."""
    taken = exchanged_form(summary)
    if not taken:
        return ""
    found = summary["base_form"]
    rivals = [name for name in found.get("tied_with") or [] if name != taken]
    as_good = f" These tests do not separate it from {listed(rivals)}." if rivals else ""
    return (
        f"The final model has the base form **{taken}** in place of {found.get('declared')}, because it lowers the "
        f"error.{as_good}"
    )


def unproven_in_words(terms: Sequence[Mapping[str, Any]]) -> str:
    """Return a sentence on the terms that are part of the model without being proven; empty without any."""
    if not terms:
        return ""
    names = listed([f"{item['name']} ({item['form']}, probability {item['confidence']:.2f})" for item in terms])
    rest = (
        "lowers the error and is part of the model, but is not proven"
        if len(terms) == 1
        else ("lower the error and are part of the model, but are not proven")
    )
    rivals = sorted({name for item in terms for name in item["tied_with"]})
    return f"In addition, {names} {rest}{f' against {listed(rivals)}' if rivals else ''}."


def tie_in_words(summary: Mapping[str, Any]) -> str:
    """Return a sentence on effects of a structure that the tests do not separate, so that none is named; or nothing."""
    tied = summary.get("tied")
    if not tied:
        return ""
    remains = "what then remains" if summary["effects"] else "it"
    proposed = separating_tests(tied["separating_tests"])
    sentence = f" {proposed[0].upper()}{proposed[1:]}." if proposed else ""
    return f"{listed(tied['effects'])} explain {remains} equally well.{sentence}"


def declared_in_words(names: Sequence[str]) -> str:
    """Return a sentence on the effects that the campaign declares; empty without any."""
    if not names:
        return ""
    said = "this effect is" if len(names) == 1 else "these effects are"
    return f"The campaign declares {listed(names)}; {said} part of the model from the start."


def notes_on_model(loop: Mapping[str, Any], *, named: bool) -> list[str]:
    """Return sentences on the parts of the final model that no named effect explains.

    Parameters
    ----------
    loop
        Summary of `close-loop`.
    named
        Whether effects of the damper are named.
    """
    unproven = unproven_in_words(loop.get("further_terms") or [])
    if unproven and named:
        unproven += (
            " All parameters are fitted again then, so that those of the effects may differ a little from above."
        )
    notes = (exchange_in_words(loop), declared_in_words(loop.get("declared_effects") or []), unproven)
    return [text for text in notes if text]
